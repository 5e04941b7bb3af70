import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import AbstractPath, Point
from ..quantity import as_float, Length, Number
from ._base import AbstractProfile, check_above_zero, crossings


class Exponential(AbstractProfile):
    """1 at the ground, less by a factor e every `scale_height`, in m."""

    scale_height: Length = eqx.field(converter=as_float)

    def __check_init__(self):
        check_above_zero("scale_height", self.scale_height)

    def density(self, point: Point) -> Number:
        return jnp.exp(-point.altitude / self.scale_height)

    @property
    def levels(self) -> Float[Array, "n"]:
        # Smooth everywhere, but most of it lies low.
        scales = jnp.array([2.0, 6.0], self.scale_height.dtype)
        return scales * self.scale_height

    def breaks(self, path: AbstractPath) -> Float[Array, "n"]:
        return crossings(path, self.levels)
