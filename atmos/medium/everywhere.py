import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import AbstractPath, Point
from ..quantity import Number
from ._base import AbstractProfile, crossings


class Everywhere(AbstractProfile):
    """1 wherever there is air."""

    def density(self, point: Point) -> Number:
        return jnp.ones_like(point.altitude)

    @property
    def levels(self) -> Float[Array, "0"]:
        return jnp.zeros(0)

    def breaks(self, path: AbstractPath) -> Float[Array, "1"]:
        return crossings(path, self.levels.astype(path.start.altitude.dtype))
