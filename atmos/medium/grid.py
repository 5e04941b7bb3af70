import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import AbstractPath, Point
from ..quantity import as_float, Number, Position
from ._base import AbstractLocal, check_above_zero, check_not_negative
from ._bounds import through_box


class Grid(AbstractLocal):
    """Values at the centres of equal cells in the box from `lower` to `upper`, in m.

    Between the centres it is trilinear, in the outermost half cells constant, and
    outside the box 0. Raises `ValueError` for a grid without cells, and for values that
    are below 0 or not finite, saying where.
    """

    values: Float[Array, "nx ny nz"] = eqx.field(converter=as_float)
    lower: Position = eqx.field(converter=as_float)
    upper: Position = eqx.field(converter=as_float)

    def __check_init__(self):
        if self.values.size == 0:
            raise ValueError(
                f"`values` must have one cell or more; got shape {self.values.shape}."
            )
        check_not_negative("values", self.values)
        for size in self.upper - self.lower:
            check_above_zero("upper - lower", size)

    def density(self, point: Point) -> Number:
        share = (point.position - self.lower) / (self.upper - self.lower)
        inside = jnp.all((share >= 0.0) & (share <= 1.0))
        cell = share * jnp.asarray(self.values.shape, share.dtype) - 0.5
        return jnp.where(inside, _trilinear(self.values, cell), 0.0)

    def breaks(self, path: AbstractPath) -> Float[Array, "2"]:
        return through_box(path, self.lower, self.upper)

    @property
    def box(self) -> tuple[Position, Position]:
        return self.lower, self.upper


def _trilinear(values: Float[Array, "nx ny nz"], cell: Float[Array, "3"]) -> Number:
    """The value at a place counted in cells; beyond the edge that of the edge."""
    size = values.shape
    last = jnp.array([max(n - 2, 0) for n in size], jnp.int32)
    first = jnp.clip(jnp.int32(jnp.floor(cell)), 0, last)
    part = jnp.clip(cell - first.astype(cell.dtype), 0.0, 1.0)
    strides = size[1] * size[2], size[2], 1
    steps = [stride if n > 1 else 0 for stride, n in zip(strides, size, strict=True)]
    start = first[0] * strides[0] + first[1] * strides[1] + first[2]
    corners = [(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    offsets = jnp.array(
        [sum(a * b for a, b in zip(x, steps, strict=True)) for x in corners], jnp.int32
    )
    found = values.reshape(-1).at[start + offsets].get(mode="promise_in_bounds")
    found = found.reshape(2, 2, 2)
    found = found[0] + part[0] * (found[1] - found[0])
    found = found[0] + part[1] * (found[1] - found[0])
    return found[0] + part[2] * (found[1] - found[0])
