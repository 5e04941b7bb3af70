import contextlib
import os
import zipfile
from collections.abc import Iterator

import numpy as np
from jaxtyping import ArrayLike
from numpy.lib.npyio import NpzFile

from ..medium import AbstractProfile, coloured, Medium
from ..phase import AbstractPhaseFunction
from ..spectrum import AbstractSpectrum
from ._stream import Stream
from ._vdb import entries, read
from ._volume import Volume


def load(path: str | os.PathLike[str], name: str) -> AbstractProfile:
    """The grid of numbers that has this name in a file.

    An OpenVDB file, or a NumPy archive that holds an array of that name with an axis
    each for x, y and z, and the corners `lower` and `upper` of its box, in m. Lengths
    in OpenVDB files are taken to be in m. Outside the box of its active cells, and of
    a cell's width about them in which it falls to that, it must be 0. Raises
    `ValueError` naming the file and the grid for what cannot be read, is below 0 or not
    finite; `OSError` for a file that cannot be opened.
    """
    with _about(path, name):
        (volume,) = _volumes(os.fspath(path), [name])
        if volume.values.ndim != 3:
            raise ValueError("must hold numbers; it holds vectors")
        return volume.placed(volume.grid())


def load_coloured(
    path: str | os.PathLike[str],
    name: str,
    colour: str,
    extinction: ArrayLike | AbstractSpectrum,
    phase: AbstractPhaseFunction,
) -> tuple[Medium, ...]:
    """The media of `atmos.medium.coloured`, of a grid of densities and one of colours.

    Both of one file, with the same cells. Raises the errors of `load` and `coloured`.
    """
    with _about(path, name):
        density, share = _volumes(os.fspath(path), [name, colour])
        media = coloured(density.grid(), share.values, extinction, phase)
    place = lambda x: density.placed(x.profile)
    return tuple(Medium(place(x), x.scattering, x.absorption, x.phase) for x in media)


@contextlib.contextmanager
def _about(path: str | os.PathLike[str], name: str) -> Iterator[None]:
    try:
        yield
    except ValueError as error:
        text = str(error).removesuffix(".")
        raise ValueError(f"{os.fspath(path)}: `{name}` {text}.") from error


def _volumes(path: str, names: list[str]) -> list[Volume]:
    if path.endswith(".vdb"):
        with open(path, "rb") as file:
            return _of_vdb(Stream(file.read()), names)
    if path.endswith(".npz"):
        return _of_npz(path, names)
    raise ValueError("must be in a .vdb or .npz file")


def _of_vdb(stream: Stream, names: list[str]) -> list[Volume]:
    known = {x.name: x for x in reversed(entries(stream))}
    for name in names:
        _find(name, list(known)[::-1])
    found = [read(stream, known[name]) for name in names]
    tree, matrix, offset = found[0]
    bounds = tree.bounds() or (np.zeros(3, int), np.zeros(3, int))
    # A cell more all around, through which it falls to what is outside.
    low, high = bounds[0] - 1, bounds[1] + 1
    volumes = []
    for tree, *place in found:
        if np.any(tree.background != 0.0):
            raise ValueError(f"must be 0 outside its cells; got {tree.background}")
        if not all(map(np.array_equal, place, (matrix, offset))):
            raise ValueError("must have the same place as its colours")
        first = (int(low[0]), int(low[1]), int(low[2]))
        volumes.append(Volume(tree.dense(low, high), first, matrix, offset))
    return volumes


def _find(name: str, known: list[str]) -> None:
    if name not in known:
        raise ValueError(f"must be one of {', '.join(known) or 'none'}; got {name!r}")


def _of_npz(path: str, names: list[str]) -> list[Volume]:
    try:
        with np.load(path, allow_pickle=False) as archive:
            grids = [x for x in archive if x not in _CORNERS]
            for name in names:
                _find(name, grids)
            for corner in _CORNERS:
                if corner not in archive:
                    raise ValueError(f"must stand beside `{corner}`, which is missing")
            arrays = [_numbers(archive, x) for x in names]
            lower, upper = (_numbers(archive, x).astype(float) for x in _CORNERS)
    except zipfile.BadZipFile as error:
        raise ValueError("is cut short or damaged") from error
    if lower.shape != (3,) or upper.shape != (3,):
        raise ValueError("must have `lower` and `upper` of 3 numbers each")
    if not (np.all(np.isfinite(upper - lower)) and np.all(upper > lower)):
        corners = f"{lower.tolist()} and {upper.tolist()}"
        raise ValueError(f"must have `lower` below `upper`; got {corners}")
    volumes = []
    for values in arrays:
        if values.ndim not in (3, 4):
            raise ValueError(f"must have 3 or 4 axes; got shape {values.shape}")
        size = (upper - lower) / np.maximum(values.shape[:3], 1)
        place = np.diag(size), lower + 0.5 * size
        volumes.append(Volume(values.astype(np.float32), (0, 0, 0), *place))
    return volumes


_CORNERS = "lower", "upper"


def _numbers(archive: NpzFile, name: str) -> np.ndarray:
    try:
        found = archive[name]
    except ValueError as error:  # of objects, which are not read
        raise ValueError(f"must have numbers in `{name}`; got objects") from error
    if found.dtype.kind not in "buif":
        raise ValueError(f"must have real numbers in `{name}`; got {found.dtype}")
    return found
