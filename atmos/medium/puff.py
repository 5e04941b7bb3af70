import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import AbstractPath, Point
from ..quantity import as_float, dot, Length, Number, Position
from ._base import AbstractLocal, check_above_zero, check_not_negative
from ._bounds import sphere_meets, through_sphere
from ._noise import fractal


class Puff(AbstractLocal):
    """A ball of `radius` m around `centre` with a billowing edge: a puff of smoke.

    Noise with billows of `size` m, fractal in `octaves`, moves its edge in and out by
    the share `roughness` of the radius. Over the share `softness` of the radius the
    density grows from 0 to 1.
    """

    centre: Position = eqx.field(converter=as_float)
    radius: Length = eqx.field(converter=as_float)
    size: Length = eqx.field(converter=as_float)
    roughness: Number = eqx.field(converter=as_float, default=0.8)
    softness: Number = eqx.field(converter=as_float, default=0.2)
    octaves: int = eqx.field(static=True, default=5)
    seed: int = eqx.field(static=True, default=0)

    def __check_init__(self):
        check_above_zero("radius", self.radius)
        check_above_zero("size", self.size)
        check_not_negative("roughness", self.roughness)
        check_above_zero("softness", self.softness)

    def density(self, point: Point) -> Number:
        apart = point.position - self.centre
        squared = dot(apart, apart)
        middle = squared <= 0.0
        out = jnp.where(middle, 0.0, jnp.sqrt(jnp.where(middle, 1.0, squared)))
        noise = fractal(point.position / self.size, self.octaves, self.seed)
        inward = 1.0 - out / self.radius + self.roughness * noise
        return jnp.clip(inward / self.softness, 0.0, 1.0)

    @property
    def _reach(self) -> Length:
        return self.radius * (1.0 + self.roughness)

    def breaks(self, path: AbstractPath) -> Float[Array, "2"]:
        return through_sphere(path, self.centre, self._reach)

    def most(self, lower: Position, upper: Position) -> Number:
        return sphere_meets(self.centre, self._reach, lower, upper)

    @property
    def box(self) -> tuple[Position, Position]:
        return self.centre - self._reach, self.centre + self._reach
