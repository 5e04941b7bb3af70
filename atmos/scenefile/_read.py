import contextlib
import os
import re
import tomllib
from collections.abc import Callable, Iterator
from typing import Any, TypeVar

import msgspec

from ..camera import AbstractCamera
from ..scene import Scene
from ._base import build
from ._errors import refuse, short
from ._profiles import FOLDER
from ._scene import File


# More than this, in size, single precision cannot hold.
_LARGEST = 3.4e38


def load(path: str | os.PathLike[str]) -> Scene:
    """Reads a scene file; files that it names are looked for beside it.

    Raises `ValueError` naming the file, the key, the rule and the value where it is not
    TOML, or not a scene; `OSError` where it cannot be read.
    """
    return _loaded(path, parse)


def load_camera(path: str | os.PathLike[str]) -> AbstractCamera | None:
    """The camera of a scene file, if it has one. Errors are those of `load`."""
    return _loaded(path, parse_camera)


def parse(text: str) -> Scene:
    """The scene that the text of a scene file describes.

    Raises `ValueError` naming the key, the rule and the value.
    """
    return _tables(text).build()


def parse_camera(text: str) -> AbstractCamera | None:
    """The camera in the text of a scene file, if there is one; errors of `parse`."""
    found = _tables(text).camera
    return None if found is None else build("camera", found)


Read = TypeVar("Read")


def _loaded(path: str | os.PathLike[str], parsed: Callable[[str], Read]) -> Read:
    with open(path, "rb") as file:
        raw = file.read()
    token = FOLDER.set(os.path.dirname(os.fspath(path)) or ".")
    try:
        with _of_file(os.fspath(path)):
            return parsed(raw.decode())
    finally:
        FOLDER.reset(token)


def _tables(text: str) -> File:
    try:
        raw = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"must be TOML: {error}") from error
    except RecursionError as error:
        raise ValueError("must be TOML without deep nesting") from error
    _check_finite(raw, "")
    try:
        return msgspec.convert(raw, File)
    except msgspec.ValidationError as error:
        raise ValueError(_explained(str(error), raw)) from error


@contextlib.contextmanager
def _of_file(name: str) -> Iterator[None]:
    try:
        yield
    except UnicodeDecodeError as error:
        raise ValueError(f"{name}: must be text in UTF-8; {error}.") from error
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from error


def _check_finite(value: Any, key: str) -> None:
    if isinstance(value, dict):
        for name, x in value.items():
            _check_finite(x, f"{key}.{name}" if key else name)
    elif isinstance(value, list):
        for i, x in enumerate(value):
            _check_finite(x, f"{key}[{i}]")
    elif isinstance(value, int | float) and not abs(value) <= _LARGEST:
        refuse(key, "must be a finite number", value)


def _explained(message: str, raw: dict[str, Any]) -> str:
    """What msgspec found wrong, as key, rule and value."""
    rule, _, path = message.partition(" - at `$")
    key = path.rstrip("`").removeprefix(".")
    node, value = _find(msgspec.inspect.type_info(File), raw, key)
    own = re.search(r"`(.*)`", rule)
    full = ".".join(x for x in [key, own[1] if own else ""] if x)
    if "unknown field" in rule:
        known = ", ".join(x.encode_name for x in node.fields)
        return f"`{full}` is not known; known there: {known}."
    if "missing required field" in rule:
        return f"`{full}` is missing."
    choices = list(getattr(node, "values", ()))
    if key.endswith("kind"):
        choices = [x.tag for x in _structs(node)]
    if choices:
        return f"`{key}` must be one of {', '.join(map(str, choices))}; got {value!r}."
    rule = rule.removeprefix("Expected ").split(", got")[0].replace("`", "")
    for theirs, ours in _WORDS.items():
        rule = re.sub(theirs, ours, rule)
    return f"`{key}` must be {rule}; got {short(value)}."


_WORDS = {
    r" \| null": "",
    r" \| ": " or ",
    r"\bfloat\b": "a number",
    r"\bint\b": "a whole number",
    r"\bstr\b": "a text",
    r"\bobject\b": "a table",
    r"\barray\b": "a list",
    r" > ": " above ",
    r" < ": " below ",
    r" >= (\S+)": r" of \1 or more",
    r" <= (\S+)": r" of \1 or less",
    r"(\d)\.0\b": r"\1",
}


def _find(node: Any, value: Any, key: str) -> tuple[Any, Any]:
    """What a key may be, and what it is."""
    for step in re.findall(r"[^.\[\]]+", key):
        if isinstance(value, dict):
            if step == "kind":
                return node, value[step]
            fields = {x.encode_name: x.type for x in node.fields}
            node, value = fields[step], value[step]
        else:
            node, value = getattr(node, "item_type", node), value[int(step)]
        if isinstance(value, dict):
            fits = [x for x in _structs(node) if x.tag in (None, value.get("kind"))]
            node = fits[0] if fits else node
        elif isinstance(value, list):
            lists = [x for x in getattr(node, "types", ()) if hasattr(x, "item_type")]
            node = lists[0] if lists else node
    return node, value


def _structs(node: Any) -> list[Any]:
    return [x for x in getattr(node, "types", [node]) if hasattr(x, "fields")]
