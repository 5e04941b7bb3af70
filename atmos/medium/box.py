import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import AbstractPath, Point
from ..quantity import as_float, Number, Position
from ._base import AbstractLocal, check_above_zero
from ._bounds import through_box


class Box(AbstractLocal):
    """1 in the box from the corner `lower` to the corner `upper`, in m, 0 outside."""

    lower: Position = eqx.field(converter=as_float)
    upper: Position = eqx.field(converter=as_float)

    def __check_init__(self):
        for size in self.upper - self.lower:
            check_above_zero("upper - lower", size)

    def density(self, point: Point) -> Number:
        place = point.position
        inside = jnp.all((place >= self.lower) & (place <= self.upper))
        return jnp.where(inside, jnp.ones_like(point.altitude), 0.0)

    def breaks(self, path: AbstractPath) -> Float[Array, "2"]:
        return through_box(path, self.lower, self.upper)

    def most(self, lower: Position, upper: Position) -> Number:
        meets = jnp.all((lower <= self.upper) & (upper >= self.lower))
        return jnp.where(meets, jnp.ones_like(lower[0]), 0.0)

    @property
    def box(self) -> tuple[Position, Position]:
        return self.lower, self.upper
