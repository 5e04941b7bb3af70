import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import AbstractPath, Point
from ..quantity import as_float, Number, Position
from ._base import AbstractLocal, check_above_zero, check_not_negative
from ._bounds import through_box
from ._trilinear import trilinear, window_most


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
        cells = jnp.array(self.values.shape, self.lower.dtype)
        each = cells / (self.upper - self.lower)
        inside, places = jnp.array(True), []
        # One number at a time: XLA on CPUs is slow with vectors of three.
        for n, x, low, by in zip(
            self.values.shape, point.position, self.lower, each, strict=True
        ):
            place = (x - low) * by
            inside = inside & (place >= 0.0) & (place <= n)
            places.append(place - 0.5)
        return jnp.where(inside, trilinear(self.values, *places), 0.0)

    def breaks(self, path: AbstractPath) -> Float[Array, "2"]:
        return through_box(path, self.lower, self.upper)

    def most(self, lower: Position, upper: Position) -> Number:
        # A little wider than it is: what rounding moves into the box is in it.
        size = (self.upper - self.lower) / jnp.array(self.values.shape, lower.dtype)
        low, high = (lower - self.lower) / size - 0.51, (upper - self.lower) / size
        meets = jnp.all((lower <= self.upper) & (upper >= self.lower))
        most = window_most(self.values, low, high - 0.49)
        return jnp.where(meets, most, 0.0)

    @property
    def box(self) -> tuple[Position, Position]:
        return self.lower, self.upper
