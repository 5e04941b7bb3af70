"""The tree of an OpenVDB grid: values in leaves of 8 cells, nodes of 16 and of 32."""

import dataclasses

import numpy as np
from jaxtyping import Bool, Int

from ._stream import MASK, Stream


_SIDES = [32, 16, 8]  # nodes of the root, their nodes, and leaves, in children
_SPANS = [128, 8, 1]  # how many cells a child of each is wide
_MOST = 2**28  # cells that a grid may span


@dataclasses.dataclass(frozen=True)
class Cube:
    """A cube of children, `span` cells wide each; those that `stands` have a value."""

    origin: Int[np.ndarray, "3"]
    span: int
    values: np.ndarray
    stands: Bool[np.ndarray, "side side side"]
    active: Bool[np.ndarray, "side side side"]


@dataclasses.dataclass(frozen=True)
class Tree:
    """What a grid is outside its cubes, and the cubes, coarse ones first."""

    background: np.ndarray
    cubes: list[Cube]

    def count(self) -> int:
        """How many cells are active."""
        return sum(int(x.active.sum()) * x.span**3 for x in self.cubes)

    def bounds(self) -> tuple[np.ndarray, np.ndarray] | None:
        """The first cell that is active and the last, in each direction."""
        low, high = [], []
        for x in self.cubes:
            if x.active.any():
                found = np.argwhere(x.active)
                low.append(x.origin + found.min(0) * x.span)
                high.append(x.origin + (found.max(0) + 1) * x.span - 1)
        return (np.min(low, 0), np.max(high, 0)) if low else None

    def dense(self, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """The values of all cells from the first to the last.

        Raises `ValueError` if there are too many.
        """
        size = [int(x) for x in high - low + 1]
        if np.prod(size, dtype=object) > _MOST:
            raise ValueError(f"must span at most {_MOST} cells; got {size}")
        shape = (*size, *self.background.shape)
        found = np.broadcast_to(self.background, shape).astype(np.float32)
        for x in self.cubes:
            for place in np.argwhere(x.stands) if x.span > 1 else [None]:
                begin = x.origin if place is None else x.origin + place * x.span
                length = x.span if place is not None else len(x.values)
                a = np.clip(begin - low, 0, size)
                b = np.clip(begin + length - low, 0, size)
                if np.all(b > a):
                    part = tuple(map(slice, a, b))
                    if place is None:
                        inner = map(slice, a + low - begin, b + low - begin)
                        found[part] = x.values[tuple(inner)]
                    else:
                        found[part] = x.values[tuple(place)]
        return found


class TreeReader:
    """Reads a tree of values of some kind, with what is said of a whole grid."""

    def __init__(self, stream: Stream, kind: np.dtype, half: bool, compression: int):
        self.stream, self.kind, self.compression = stream, kind, compression
        base, shape = kind.subdtype or (kind, ())
        stored = np.dtype((np.float16, shape)) if half else kind
        self.stored, self.half, self.shape = stored, half, shape
        self.cubes: list[Cube] = []
        self.leaves: list[np.ndarray] = []

    def topology(self) -> None:
        """Everything but the values of leaves."""
        if self.stream.number("i") != 1:
            raise ValueError("must have one buffer a leaf")
        self.background = self._one()
        tiles, children = self.stream.number("I"), self.stream.number("I")
        for _ in range(tiles):
            origin = self.stream.array(np.dtype("<i4"), 3)
            value, active = self._one(), self.stream.number("?")
            one = np.ones((1, 1, 1), bool)
            values = value.reshape(1, 1, 1, *self.shape)
            self.cubes.append(Cube(origin, 4096, values, one, one & active))
        for _ in range(children):
            self._node(self.stream.array(np.dtype("<i4"), 3), 0)

    def buffers(self) -> Tree:
        """The values of the leaves."""
        one = np.ones((8, 8, 8), bool)
        for origin in self.leaves:
            active = self.stream.mask(512)
            values = self._values(512, active).reshape(8, 8, 8, *self.shape)
            self.cubes.append(Cube(origin, 1, values, one, active.reshape(8, 8, 8)))
        self.cubes.sort(key=lambda x: -x.span)
        return Tree(self.background, self.cubes)

    def _one(self) -> np.ndarray:
        return np.asarray(self.stream.array(self.kind, 1)[0])

    def _node(self, origin: np.ndarray, level: int) -> None:
        side, span = _SIDES[level], _SPANS[level]
        if level == 2:
            self.stream.mask(512)
            self.leaves.append(origin)
            return
        children = self.stream.mask(side**3)
        active = self.stream.mask(side**3)
        values = self._values(side**3, active)
        cube = (side, side, side)
        stands = ~children & (
            active | np.any((values != self.background).reshape(side**3, -1), 1)
        )
        if stands.any():
            values = values.reshape(*cube, *self.shape)
            parts = stands.reshape(cube), (active & stands).reshape(cube)
            self.cubes.append(Cube(origin, span, values, *parts))
        for place in np.argwhere(children.reshape(cube)):
            self._node(origin + place.astype(np.int32) * span, level + 1)

    def _values(self, count: int, active: np.ndarray) -> np.ndarray:
        """Values of which the inactive ones may be left out."""
        code = self.stream.number("b")
        if not 0 <= code <= 6:
            raise ValueError("is cut short or damaged")
        # Which values the inactive ones have: one, or two that a mask tells apart.
        others = [self.background, self.background]
        if code == 1:
            others = [-self.background, self.background]
        if code in (2, 4, 5):
            others[0] = self._one()
        if code == 5:
            others[1] = self._one()
        which = self.stream.mask(count) if code in (3, 4, 5) else np.zeros(count, bool)
        masked = self.compression & MASK and code != 6
        stored = int(active.sum()) if masked else count
        if self.half and stored == 0:
            found = np.zeros((0, *self.shape), np.float32)
        else:
            base = self.stored.subdtype or (self.stored, ())
            many = stored * int(np.prod(base[1], dtype=int))
            found = self.stream.packed(base[0], many, self.compression)
            found = found.reshape(stored, *self.shape)
        if not masked:
            return found
        shape = (count, *(1 for _ in self.shape))
        values = np.where(which.reshape(shape), others[1], others[0])
        values[active] = found
        return values
