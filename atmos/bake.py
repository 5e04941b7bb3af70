"""What a solver worked out for a sky, in a file, so that the next one starts at once.

The file is a NumPy archive (.npz) without pickled objects, which any NumPy reads. It
holds the arrays of `SolvedSky.prepared`, each named by the way to it, such as
`prepared.field.moments`; and `header`, the bytes of a JSON text in UTF-8:

    format   "atmos bake"
    version  that of this layout, 2
    atmos    the version of atmos that made it
    made     what it was made of, by the way to it: `solver.streams`, `wavelength`,
             `scene.media[0].profile.scale_height`. Arrays with type, shape and numbers;
             those of more than 64 numbers with their SHA-256 instead.

The last 64 bytes, which are the archive's comment, are the SHA-256 in hexadecimal of
all bytes before them.

A bake serves nothing but what it was made of, to the last bit: the same solver with all
its settings, the same wavelengths in the same precision, and the same scene but for
what the solver's `baked` leaves out.
"""

import dataclasses
import hashlib
import importlib.metadata
import io
import json
import os
import zipfile
from collections.abc import Iterator
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.tree_util import keystr, tree_leaves_with_path
from jaxtyping import ArrayLike

from .image import whole_file
from .scene import Scene
from .solver import AbstractSolver, admit, SolvedSky


VERSION = 2
_SHORT = 64
_DIGITS = 64  # of a SHA-256 in hexadecimal


def save(sky: SolvedSky, path: str | os.PathLike[str]) -> None:
    """Keeps what was worked out for a sky in a file.

    It is written whole, or whatever was there stays. Raises `ValueError` for a solver
    that works nothing out before the first look, `OSError` where the file cannot be
    written.
    """
    arrays: dict[str, Any] = {name: np.asarray(x) for name, x in _named(sky.prepared)}
    if not arrays:
        raise ValueError(
            f"`sky` must hold what takes time to work out; {type(sky.solver).__name__} "
            "works nothing out before the first look."
        )
    header = _header() | {"made": _made(sky.scene, sky.solver, sky.wavelength)}
    text = json.dumps(header, indent=1).encode()
    arrays["header"] = np.frombuffer(text, np.uint8)
    with whole_file(path) as part:
        with open(part, "wb") as file:
            np.savez(file, **arrays)
        with zipfile.ZipFile(part, "a") as archive:
            archive.comment = b" " * _DIGITS
        with open(part, "rb+") as file:
            size = file.seek(-_DIGITS, os.SEEK_END)
            file.seek(0)
            found = hashlib.sha256(file.read(size)).hexdigest()
            file.seek(size)
            file.write(found.encode())


def load(
    path: str | os.PathLike[str],
    scene: Scene,
    solver: AbstractSolver,
    wavelength: ArrayLike,
) -> SolvedSky:
    """The sky that `solve` would find, from a file that `save` made for the same.

    Raises `ValueError` naming the file where it is something else, cut short or
    damaged, or serves another sky, and then says what differs; `OSError` where it
    cannot be read; and the errors of `solve`.
    """
    scene, nm = admit(scene, solver, wavelength)
    name = os.fspath(path)
    header, arrays = _read(name)
    here = _header()
    for key in ("format", "version", "atmos"):
        _compare(name, key, header.get(key), here[key])
    there, here = header["made"], _made(scene, solver, nm)
    for key in [*here, *there]:
        _compare(name, key, there.get(key), here.get(key))

    # What `prepare` would make of it, without the work.
    empty = eqx.filter_eval_shape(solver.prepare, solver.baked(scene), nm)
    wanted = dict(_named(empty))
    kind = lambda x: None if x is None else f"{x.dtype}{list(x.shape)}"
    for key in [*wanted, *arrays]:
        _compare(name, key, kind(arrays.get(key)), kind(wanted.get(key)))
    leaves = [jnp.asarray(arrays[key]) for key in wanted]
    prepared = jax.tree.unflatten(jax.tree.structure(empty), leaves)
    return SolvedSky(scene=scene, solver=solver, wavelength=nm, prepared=prepared)


def _read(name: str) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    with open(name, "rb") as file:
        raw = file.read()
    if not raw.startswith(b"PK"):
        raise ValueError(f"{name}: is no bake; `bake.save` makes one.")
    found = hashlib.sha256(raw[:-_DIGITS]).hexdigest()
    if raw[-_DIGITS:] != found.encode():
        raise ValueError(
            f"{name}: is no bake, or cut short or damaged: its checksum is wrong."
        )
    with np.load(io.BytesIO(raw), allow_pickle=False) as archive:
        arrays = dict(archive)
    return json.loads(arrays.pop("header").tobytes()), arrays


def _header() -> dict[str, Any]:
    version = importlib.metadata.version("atmos")
    return {"format": "atmos bake", "version": VERSION, "atmos": version}


def _compare(name: str, key: str, there: Any, here: Any) -> None:
    if there != here:
        raise ValueError(
            f"{name}: serves another sky: `{key}` is {_brief(there)} there and "
            f"{_brief(here)} here; remove the file to have it made anew."
        )


def _brief(value: Any) -> str:
    text = "nothing" if value is None else str(value)
    return text if len(text) < 80 else f"{text[:77]}..."


def _named(prepared: Any) -> list[tuple[str, Any]]:
    found = tree_leaves_with_path(prepared)
    return [(f"prepared{keystr(path)}", x) for path, x in found]


def _made(scene: Scene, solver: AbstractSolver, wavelength: Any) -> dict[str, str]:
    """What a bake hangs on, in words."""
    parts = {"wavelength": wavelength, "solver": solver, "scene": solver.baked(scene)}
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
        numbers = array.tolist()
        if array.size > _SHORT:
            numbers = hashlib.sha256(array.tobytes()).hexdigest()
        yield key, f"{array.dtype}{list(array.shape)} {numbers}"
    elif value is None or isinstance(value, bool | int | float | str):
        yield key, repr(value)
    else:
        raise ValueError(
            f"`{key}` must be made of numbers and texts to be kept; got {value!r}."
        )
