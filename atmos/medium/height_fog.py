import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import AbstractPath, Point
from ..quantity import as_float, Length, Number
from ._base import AbstractProfile, check_above_zero, crossings


class HeightFog(AbstractProfile):
    """1 up to the altitude `top`, from there less by a factor e every `scale_height`.

    Both in m.
    """

    top: Length = eqx.field(converter=as_float)
    scale_height: Length = eqx.field(converter=as_float)

    def __check_init__(self):
        check_above_zero("scale_height", self.scale_height)

    def density(self, point: Point) -> Number:
        above = jnp.maximum(point.altitude - self.top, 0.0)
        return jnp.exp(-above / self.scale_height)

    @property
    def levels(self) -> Float[Array, "4"]:
        scales = jnp.array([0.0, 2.0, 6.0, 20.0], self.scale_height.dtype)
        return self.top + scales * self.scale_height

    def breaks(self, path: AbstractPath) -> Float[Array, "9"]:
        return crossings(path, self.levels)
