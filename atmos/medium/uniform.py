import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import AbstractPath, Point
from ..quantity import as_float, Length, Number
from ._base import AbstractProfile, check_above_zero, crossings


class Uniform(AbstractProfile):
    """1 between the altitudes `bottom` and `top`, in m, and 0 elsewhere."""

    bottom: Length = eqx.field(converter=as_float)
    top: Length = eqx.field(converter=as_float)

    def __check_init__(self):
        check_above_zero("top - bottom", self.top - self.bottom)

    def density(self, point: Point) -> Number:
        inside = (point.altitude >= self.bottom) & (point.altitude <= self.top)
        return jnp.where(inside, jnp.ones_like(point.altitude), 0.0)

    @property
    def levels(self) -> Float[Array, "n"]:
        return jnp.stack([self.bottom, self.top])

    def breaks(self, path: AbstractPath) -> Float[Array, "n"]:
        return crossings(path, self.levels)

    def most_between(self, low: Length, high: Length) -> Number:
        meets = (low < self.top) & (high > self.bottom)
        return jnp.where(meets, jnp.ones_like(low), 0.0)
