"""What takes time to work out, in a file, for nothing but what it was made of.

The file is a NumPy archive (.npz) without pickled objects, which any NumPy reads. It
holds arrays, and `header`, the bytes of a JSON text in UTF-8:

    format   "atmos bake", or what else it is
    version  that of the layout of its kind, such as 2
    atmos    the version of atmos that made it
    made     what it was made of, by the way to it: `solver.streams`, `wavelength`,
             `scene.media[0].profile.scale_height`. Arrays with type, shape and numbers;
             those of more than 64 numbers with their SHA-256 instead.

The last 64 bytes, which are the archive's comment, are the SHA-256 in hexadecimal of
all bytes before them.
"""

import dataclasses
import hashlib
import importlib.metadata
import io
import json
import os
import zipfile
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from .image import whole_file


_SHORT = 64
_DIGITS = 64  # of a SHA-256 in hexadecimal


class Kind(NamedTuple):
    """What a file is called, the version of its layout, and what it serves."""

    name: str
    version: int
    serves: str

    @property
    def header(self) -> dict[str, Any]:
        """What the file says of itself."""
        version = importlib.metadata.version("atmos")
        return {
            "format": f"atmos {self.name}",
            "version": self.version,
            "atmos": version,
        }


def write(
    path: str | os.PathLike[str],
    kind: Kind,
    made: Mapping[str, str],
    arrays: Mapping[str, np.ndarray],
) -> None:
    """Keeps arrays, and in `words` what they are made of, in a file.

    It is written whole, or whatever was there stays. Raises `OSError` where it cannot.
    """
    text = json.dumps(kind.header | {"made": dict(made)}, indent=1).encode()
    kept: dict[str, Any] = {**arrays, "header": np.frombuffer(text, np.uint8)}
    with whole_file(path) as part:
        with open(part, "wb") as file:
            np.savez(file, **kept)
        with zipfile.ZipFile(part, "a") as archive:
            archive.comment = b" " * _DIGITS
        with open(part, "rb+") as file:
            size = file.seek(-_DIGITS, os.SEEK_END)
            file.seek(0)
            found = hashlib.sha256(file.read(size)).hexdigest()
            file.seek(size)
            file.write(found.encode())


def read(
    path: str | os.PathLike[str], kind: Kind, made: Mapping[str, str]
) -> dict[str, np.ndarray]:
    """The arrays of a file that was made of the same.

    Raises `ValueError` naming the file where it is something else, cut short or
    damaged, or serves another thing, and then says what differs; `OSError` where it
    cannot be read.
    """
    name = os.fspath(path)
    with open(name, "rb") as file:
        raw = file.read()
    if not raw.startswith(b"PK"):
        raise ValueError(f"{name}: is no {kind.name} of atmos.")
    found = hashlib.sha256(raw[:-_DIGITS]).hexdigest()
    if raw[-_DIGITS:] != found.encode():
        raise ValueError(
            f"{name}: is no {kind.name}, or cut short or damaged: its checksum is "
            "wrong."
        )
    with np.load(io.BytesIO(raw), allow_pickle=False) as archive:
        arrays = dict(archive)
    header = json.loads(arrays.pop("header").tobytes())
    for key, value in kind.header.items():
        compare(path, kind, key, header.get(key), value)
    for key in [*made, *header["made"]]:
        compare(path, kind, key, header["made"].get(key), made.get(key))
    return arrays


def compare(
    path: str | os.PathLike[str], kind: Kind, key: str, there: Any, here: Any
) -> None:
    """Raises the `ValueError` of `read` unless both are alike."""
    if there != here:
        raise ValueError(
            f"{os.fspath(path)}: serves another {kind.serves}: `{key}` is "
            f"{_brief(there)} there and {_brief(here)} here; remove the file to have "
            "it made anew."
        )


def _brief(value: Any) -> str:
    text = "nothing" if value is None else str(value)
    return text if len(text) < 80 else f"{text[:77]}..."


def words(**parts: Any) -> dict[str, str]:
    """What things are made of, by the way to it.

    Raises `ValueError` for what is not made of numbers and texts.
    """
    return dict(x for key, part in parts.items() for x in _words(key, part))


def _words(key: str, value: Any) -> Iterator[tuple[str, str]]:
    if isinstance(value, eqx.Module):
        yield key, f"{type(value).__module__}.{type(value).__qualname__}"
        for field in dataclasses.fields(value):
            yield from _words(f"{key}.{field.name}", getattr(value, field.name))
    elif isinstance(value, tuple | list):
        yield key, f"{len(value)} items"
        for i, x in enumerate(value):
            yield from _words(f"{key}[{i}]", x)
    elif isinstance(value, jax.Array | np.ndarray):
        if jnp.issubdtype(value.dtype, jax.dtypes.prng_key):
            value = jax.random.key_data(value)
        array = np.asarray(value)
        if array.size <= _SHORT:
            numbers = array.tolist()
        else:
            numbers = hashlib.sha256(array.tobytes()).hexdigest()
        yield key, f"{array.dtype}{list(array.shape)} {numbers}"
    elif value is None or isinstance(value, bool | int | float | str):
        yield key, repr(value)
    else:
        raise ValueError(
            f"`{key}` must be made of numbers and texts to be kept; got {value!r}."
        )
