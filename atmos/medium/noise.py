import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import AbstractPath, Point
from ..quantity import as_float, Length, Number
from ._base import AbstractLocal, check_above_zero
from ._noise import fractal


class Noise(AbstractLocal):
    """Billows of `size` m without end, fractal in `octaves`: 0 where it is clear, to 1.

    Where the noise, from -1 to 1, is below `level` there is nothing; from there on the
    density grows, to 1 at `level + softness`. It is the product of this with a bound
    that makes a cloud.
    """

    size: Length = eqx.field(converter=as_float)
    level: Number = eqx.field(converter=as_float, default=0.0)
    softness: Number = eqx.field(converter=as_float, default=0.5)
    octaves: int = eqx.field(static=True, default=5)
    seed: int = eqx.field(static=True, default=0)

    def __check_init__(self):
        check_above_zero("size", self.size)
        check_above_zero("softness", self.softness)

    def density(self, point: Point) -> Number:
        found = fractal(point.position / self.size, self.octaves, self.seed)
        return jnp.clip((found - self.level) / self.softness, 0.0, 1.0)

    def breaks(self, path: AbstractPath) -> Float[Array, "0"]:
        return jnp.zeros(0, path.start.altitude.dtype)
