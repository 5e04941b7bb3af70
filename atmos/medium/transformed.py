import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from ..geometry import AbstractPath, FlatPath, Point
from ..quantity import as_float, dot, Number, Position
from ._base import AbstractLocal, AbstractProfile


class Transformed(AbstractLocal):
    """A local profile turned, stretched, sheared and moved.

    What was at a place `x` is at `matrix @ x + offset`, in m; how dense it is does not
    change. Raises `ValueError` for a profile that depends on altitude, and for a matrix
    that flattens space.
    """

    of: AbstractProfile
    matrix: Float[Array, "3 3"] = eqx.field(converter=as_float)
    offset: Position = eqx.field(converter=as_float)

    def __check_init__(self):
        if not isinstance(self.of, AbstractLocal):
            raise ValueError(
                "`of` must be a profile that depends on the place alone; got "
                f"{type(self.of).__name__}."
            )
        if not isinstance(self.matrix, Tracer):
            size = np.linalg.det(np.asarray(self.matrix, float))
            if not (np.isfinite(size) and size != 0.0):
                raise ValueError(
                    "`matrix` must be finite and have an inverse; got "
                    f"{np.asarray(self.matrix).tolist()}."
                )
        if not isinstance(self.offset, Tracer):
            if not np.all(np.isfinite(self.offset)):
                raise ValueError(f"`offset` must be finite; got {self.offset}.")

    def density(self, point: Point) -> Number:
        return self.of.density(self._back(point))

    def breaks(self, path: AbstractPath) -> Float[Array, "n"]:
        start = self._back(path.start)
        return self.of.breaks(FlatPath(start, self._inverse(path.direction)))

    @property
    def box(self) -> tuple[Position, Position] | None:
        inner = self.of.box
        if inner is None:
            return None
        lower, upper = inner
        middle = self.offset + _times(self.matrix, 0.5 * (lower + upper))
        half = _times(jnp.abs(self.matrix), 0.5 * (upper - lower))
        return middle - half, middle + half

    def most(self, lower: Position, upper: Position) -> Number:
        middle = self._inverse(0.5 * (lower + upper) - self.offset)
        corners = [jnp.stack([upper[0], upper[1], z]) for z in (lower[2], upper[2])]
        corners += [jnp.stack([upper[0], lower[1], z]) for z in (lower[2], upper[2])]
        # The other corners of the box lie opposite of these.
        apart = [jnp.abs(self._inverse(x - self.offset) - middle) for x in corners]
        half = jnp.max(jnp.stack(apart), 0)
        return self.of.most(middle - half, middle + half)

    def _back(self, point: Point) -> Point:
        position = self._inverse(point.position - self.offset)
        return Point(position, point.altitude, point.up)

    def _inverse(self, x: Float[Array, "3"]) -> Float[Array, "3"]:
        a, b, c = self.matrix.T
        across = jnp.stack([jnp.cross(b, c), jnp.cross(c, a), jnp.cross(a, b)])
        return _times(across, x) / dot(a, across[0])


def _times(matrix: Float[Array, "3 3"], x: Float[Array, "3"]) -> Float[Array, "3"]:
    return dot(matrix, x)
