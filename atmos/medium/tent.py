import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import AbstractPath, Point
from ..quantity import as_float, Length, Number
from ._base import AbstractProfile, check_above_zero, crossings


class Tent(AbstractProfile):
    """1 at `centre`, gone at `half_width` above and below: ozone (Bruneton 2017).

    Both in m.
    """

    centre: Length = eqx.field(converter=as_float)
    half_width: Length = eqx.field(converter=as_float)

    def __check_init__(self):
        check_above_zero("half_width", self.half_width)

    def density(self, point: Point) -> Number:
        return jnp.maximum(
            1.0 - jnp.abs(point.altitude - self.centre) / self.half_width, 0.0
        )

    @property
    def levels(self) -> Float[Array, "n"]:
        w = self.half_width
        return self.centre + w * jnp.array([-1.0, 0.0, 1.0], w.dtype)

    def breaks(self, path: AbstractPath) -> Float[Array, "n"]:
        return crossings(path, self.levels)
