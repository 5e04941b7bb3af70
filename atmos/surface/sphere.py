import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool

from ..geometry import FAR
from ..medium import check_above_zero
from ..quantity import as_float, Direction, dot, Length, Position
from ._base import AbstractShape


class Sphere(AbstractShape):
    """All that is `radius` m from `centre`."""

    centre: Position = eqx.field(converter=as_float)
    radius: Length = eqx.field(converter=as_float)

    def __check_init__(self):
        check_above_zero("radius", self.radius)

    def meet(
        self, start: Position, direction: Direction, leaves: Bool[Array, ""]
    ) -> Length:
        ahead = self.centre - start
        middle = dot(ahead, direction)
        aside = ahead - middle * direction
        squared = self.radius * self.radius - dot(aside, aside)
        hit = squared > 0.0
        half = jnp.where(hit, jnp.sqrt(jnp.where(hit, squared, 1.0)), 0.0)
        near, far = middle - half, middle + half
        found = jnp.where(near > 0.0, near, far)
        # From a place on it the other end of the chord is twice as far as its middle.
        found = jnp.where(leaves, 2.0 * middle, found)
        return jnp.where((hit | leaves) & (found > 0.0), found, FAR)

    def normal(self, position: Position) -> Direction:
        out = position - self.centre
        return out / jnp.sqrt(dot(out, out))
