"""OpenVDB files, as its version 3 and later writes them: versions 222 to 224."""

import dataclasses

import numpy as np

from ._stream import Stream
from ._tree import Tree, TreeReader


_MAGIC = 0x56444220
_VERSIONS = range(222, 225)
_KINDS = {
    "float": np.dtype("<f4"),
    "double": np.dtype("<f8"),
    "vec3s": np.dtype(("<f4", (3,))),
    "vec3d": np.dtype(("<f8", (3,))),
}
_HALF = "_HalfFloat"


@dataclasses.dataclass(frozen=True)
class Entry:
    """A grid in a file: what it is called, what it holds and where."""

    name: str
    kind: str
    parent: str
    start: int
    blocks: int


def entries(stream: Stream) -> list[Entry]:
    """The grids of a file. Raises `ValueError` for what is no such file."""
    if len(stream.raw) < 12 or stream.number("q") != _MAGIC:
        raise ValueError("is no OpenVDB file")
    version = stream.number("I")
    if version not in _VERSIONS:
        known = f"{_VERSIONS[0]} to {_VERSIONS[-1]}"
        raise ValueError(f"must be of OpenVDB's file version {known}; got {version}")
    stream.take(8)  # the version of the library
    if not stream.number("?"):
        raise ValueError("must say where its grids are; it was written as a stream")
    stream.take(36)
    _metadata(stream)
    found = []
    for _ in range(stream.number("I")):
        # Grids of the same name are told apart by what follows this character.
        name = stream.text().split("\x1e")[0]
        kind, parent = stream.text(), stream.text()
        start, blocks, end = (stream.number("q") for _ in range(3))
        found.append(Entry(name, kind, parent, start, blocks))
        stream.at = end
    return found


def read(stream: Stream, entry: Entry) -> tuple[Tree, np.ndarray, np.ndarray]:
    """The tree of a grid, and the matrix and the offset from cells to the world."""
    half = entry.kind.endswith(_HALF)
    parts = entry.kind.removesuffix(_HALF).split("_")
    if parts[:1] != ["Tree"] or parts[2:] != ["5", "4", "3"] or parts[1] not in _KINDS:
        known = ", ".join(_KINDS)
        raise ValueError(
            f"must hold {known} in nodes of 5, 4 and 3 bits; got {entry.kind}"
        )
    if entry.parent:
        raise ValueError(f"must have values of its own; it has those of {entry.parent}")
    stream.at = entry.start
    compression = stream.number("I")
    said = _metadata(stream)
    if said.get("class") == b"level set":
        raise ValueError("must be a density; it is a level set")
    matrix, offset = _transform(stream)
    reader = TreeReader(stream, _KINDS[parts[1]], half, compression)
    reader.topology()
    stream.at = entry.blocks
    tree = reader.buffers()
    count = said.get("file_voxel_count")
    if count is not None and int.from_bytes(count, "little") != tree.count():
        due = int.from_bytes(count, "little")
        raise ValueError(f"must have {due} active cells; got {tree.count()}")
    return tree, matrix, offset


def _metadata(stream: Stream) -> dict[str, bytes]:
    found = {}
    for _ in range(stream.number("I")):
        name, _ = stream.text(), stream.text()
        found[name] = stream.take(stream.number("I"))
    return found


def _transform(stream: Stream) -> tuple[np.ndarray, np.ndarray]:
    kind = stream.text()
    numbers = lambda count: stream.array(np.dtype("<f8"), count)
    if kind in ("AffineMap", "UnitaryMap"):
        # Rows are multiplied from the left there.
        whole = numbers(16).reshape(4, 4)
        return whole[:3, :3].T.copy(), whole[3, :3].copy()
    offset = numbers(3) if "Translat" in kind else np.zeros(3)
    if kind in ("ScaleMap", "UniformScaleMap"):
        return np.diag(numbers(15)[:3]), offset
    if kind in ("ScaleTranslateMap", "UniformScaleTranslateMap"):
        return np.diag(numbers(15)[:3]), offset
    if kind == "TranslationMap":
        return np.eye(3), offset
    raise ValueError(f"must be placed by an affine map; got {kind}")
