import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import AbstractPath, Point
from ..quantity import as_float, dot, Length, Number, Position
from ._base import AbstractLocal, check_above_zero
from ._bounds import sphere_meets, through_sphere


class Ball(AbstractLocal):
    """1 inside a sphere of `radius` m around `centre`, 0 outside."""

    centre: Position = eqx.field(converter=as_float)
    radius: Length = eqx.field(converter=as_float)

    def __check_init__(self):
        check_above_zero("radius", self.radius)

    def density(self, point: Point) -> Number:
        apart = point.position - self.centre
        inside = dot(apart, apart) <= self.radius * self.radius
        return jnp.where(inside, jnp.ones_like(self.radius), 0.0)

    def breaks(self, path: AbstractPath) -> Float[Array, "2"]:
        return through_sphere(path, self.centre, self.radius)

    def most(self, lower: Position, upper: Position) -> Number:
        return sphere_meets(self.centre, self.radius, lower, upper)

    @property
    def box(self) -> tuple[Position, Position]:
        return self.centre - self.radius, self.centre + self.radius
