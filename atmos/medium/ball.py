import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import AbstractPath, Point
from ..quantity import as_float, Length, Number, Position
from ._base import AbstractProfile, check_above_zero


class Ball(AbstractProfile):
    """1 inside a sphere of `radius` m around `centre`, 0 outside."""

    centre: Position = eqx.field(converter=as_float)
    radius: Length = eqx.field(converter=as_float)

    def __check_init__(self):
        check_above_zero("radius", self.radius)

    def density(self, point: Point) -> Number:
        apart = point.position - self.centre
        inside = jnp.dot(apart, apart) <= self.radius * self.radius
        return jnp.where(inside, jnp.ones_like(self.radius), 0.0)

    @property
    def levels(self) -> Float[Array, "0"]:
        return jnp.zeros(0, self.radius.dtype)

    def breaks(self, path: AbstractPath) -> Float[Array, "n"]:
        to_centre = self.centre - path.start.position
        middle = jnp.dot(to_centre, path.direction)
        aside = to_centre - middle * path.direction
        squared = self.radius * self.radius - jnp.dot(aside, aside)
        hit = squared > 0.0
        half = jnp.where(hit, jnp.sqrt(jnp.where(hit, squared, 1.0)), 0.0)
        return jnp.stack([middle - half, middle + half])
