"""What an option may be; the only file that knows the library that reads them."""

import datetime
import importlib.metadata
import math
from typing import Any, NoReturn

from cyclopts import App, CycloptsError as CycloptsError, Group, Parameter


_MOST_NUMBERS = 10**6
# As far away as the moon is three times; squares still fit into single precision.
HIGHEST = 1e9
SIGNED = {"allow_leading_hyphen": True}
STOP = Group("Until", sort_key=0)
MARCH = Group("With --solver march", sort_key=1)
WORLD = Group("World", sort_key=2)
SUN = Group("Sun", sort_key=3)
MODEL = Group("Fitted sky", sort_key=4)
CAMERA = Group("Camera", sort_key=5)
OUTPUT = Group("Output", sort_key=6)
app = App(
    name="atmos",
    help="A physically based sky: pictures, radiances, optical depths.",
    version=lambda: importlib.metadata.version("atmos"),
    help_format="markdown",
    result_action="return_value",
    suppress_keyboard_interrupt=False,
)


def refuse(option: str, rule: str, value: object = None) -> NoReturn:
    """Raises `ValueError` that names an option, the rule and the value."""
    got = "" if value is None else f"; got {value}"
    raise ValueError(f"`{option}` {rule}{got}.")


def number(text: str, low: float | int, high: float | int) -> float:
    """A number from `low` to `high`, read from text; raises `ValueError` otherwise."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not low <= value <= high:
        rule = f"must be a number from {low:g} to {high:g}"
        raise ValueError(f"{rule}; got {text!r}.")
    return value


def _numbers(text: str, low: float | int, high: float | int) -> tuple[float, ...]:
    found: list[float] = []
    for part in text.split(","):
        ends = part.split(":")
        if len(ends) == 1:
            found.append(number(part, low, high))
            continue
        first, last, step = (
            number(ends[0], low, high),
            number(ends[1], low, high),
            number(ends[2], 0.0, HIGHEST) if len(ends) == 3 else 0.0,
        )
        if not (step > 0.0 and last >= first):
            rule = "must be numbers and ranges FIRST:LAST:STEP, such as 0,30,40:80:10"
            raise ValueError(f"{rule}; got {part!r}.")
        count = (last - first) / step + 1e-9
        if count > _MOST_NUMBERS:
            raise ValueError(f"must be at most {_MOST_NUMBERS} numbers; got {part!r}.")
        found += [round(first + i * step, 9) for i in range(math.floor(count) + 1)]
    return tuple(found)


def option(description: str, **more: Any) -> Parameter:
    """An option and what help says of it."""
    return Parameter(help=description, negative=(), **more)


def real(
    description: str, low: float | int, high: float | int, unit: str, **more: Any
) -> Parameter:
    """An option that is a number from `low` to `high`."""

    def convert(type_, tokens):
        return number(tokens[0].value, low, high)

    more |= {"converter": convert, "n_tokens": 1, "metavar": unit or "NUMBER"}
    return option(description, **SIGNED, **more)


def whole(description: str, low: int, high: int, **more: Any) -> Parameter:
    """An option that is a whole number from `low` to `high`."""

    def convert(type_, tokens):
        text = tokens[0].value
        value = number(text, low, high)
        if value != math.floor(value):
            rule = f"must be a whole number from {low} to {high}"
            raise ValueError(f"{rule}; got {text!r}.")
        return int(value)

    return option(description, converter=convert, n_tokens=1, **more)


def numbers_option(
    description: str,
    low: float | int,
    high: float | int,
    unset: str = "the scene's",
    **more: Any,
) -> Parameter:
    """An option that is a list of numbers and ranges, all from `low` to `high`."""

    def convert(type_, tokens):
        return _numbers(tokens[0].value, low, high)

    def show(values):
        if values is None:
            return unset
        if len(values) < 9:
            return ",".join(f"{x:g}" for x in values)
        return f"{values[0]:g}:{values[-1]:g}:{values[1] - values[0]:g}"

    return option(
        description,
        converter=convert,
        n_tokens=1,
        show_default=show,
        metavar="LIST",
        **SIGNED,
        **more,
    )


def moment(type_, tokens) -> datetime.datetime:
    """A date and time, read from ISO 8601."""
    text = tokens[0].value
    try:
        return datetime.datetime.fromisoformat(text)
    except ValueError:
        rule = "must be a date and time, such as 2026-06-21T12:00+02:00"
        raise ValueError(f"{rule}; got {text!r}.") from None


def exposure_value(type_, tokens) -> float | None:
    """An exposure value, or None for an automatic one."""
    text = tokens[0].value
    return None if text == "auto" else number(text, -50.0, 50.0)


def switch(description: str) -> Parameter:
    """An option that is on unless `--no-` stands before its name."""
    return Parameter(help=description)


def flat(group: Group) -> Parameter:
    """A group of options that stand by themselves."""
    return Parameter(name="*", group=group)
