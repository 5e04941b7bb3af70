"""Every error begins with the key that it is about."""

import contextlib
import dataclasses
import re
from collections.abc import Iterator, Sequence
from typing import NoReturn


def refuse(key: str, rule: str, value: object = None) -> NoReturn:
    """Raises the `ValueError` that names all three."""
    got = "" if value is None else f"; got {short(value)}"
    raise ValueError(f"`{key}` {rule}{got}.")


def short(value: object) -> str:
    """A value in no more than 80 characters."""
    text = repr(value)
    return text if len(text) < 80 else f"{text[:77]}..."


@contextlib.contextmanager
def under(key: str) -> Iterator[None]:
    """Errors about what lies under a key become errors about the longer key."""
    try:
        yield
    except ValueError as error:
        text = str(error)
        inner = text[1:] if text.startswith("`") else f"`: {text}"
        dot = "." if text.startswith("`") else ""
        raise ValueError(f"`{key}{dot}{inner}") from error


@contextlib.contextmanager
def renamed(makes: type, keys: Sequence[str]) -> Iterator[None]:
    """Errors about the fields of an object become errors about the keys of a table."""
    names = [x.name for x in dataclasses.fields(makes)]
    with spelt(dict(zip(names, keys, strict=False))):
        yield


@contextlib.contextmanager
def spelt(names: dict[str, str]) -> Iterator[None]:
    """Errors about some names become errors about others."""
    try:
        yield
    except ValueError as error:
        swap = lambda found: f"`{names.get(found[1], found[1])}`"
        raise ValueError(re.sub(r"`([\w.]+)`", swap, str(error))) from error
