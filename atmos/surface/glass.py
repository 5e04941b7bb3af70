from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..medium import check_above_zero
from ..quantity import as_float, Cosine, Direction, dot, Number, Spectral, Wavelength
from ._base import AbstractMaterial


class Glass(AbstractMaterial):
    """Bends light, or sends it back, as Snell and Fresnel say: smooth, and clear.

    `index` is the refractive index of what the normal stands on, relative to what it
    points into. A point-like light is not seen through it, and it casts a shadow.
    """

    smooth: ClassVar[bool] = True
    index: Number = eqx.field(converter=as_float, default=1.5)

    def __check_init__(self):
        check_above_zero("index", self.index)

    def share(self, wavelength: Wavelength) -> Spectral:
        return jnp.ones_like(wavelength[:1])

    def turn(
        self, inward: Direction, normal: Direction, u: Float[Array, "3"]
    ) -> Direction:
        cosine = dot(inward, normal)
        enters = cosine < 0.0
        out = jnp.where(enters, normal, -normal)
        cosine = jnp.minimum(jnp.abs(cosine), 1.0)
        ratio = jnp.where(enters, 1.0 / self.index, self.index)
        squared = 1.0 - ratio * ratio * (1.0 - cosine * cosine)
        passes = squared > 0.0
        within = jnp.where(passes, jnp.sqrt(jnp.where(passes, squared, 1.0)), 0.0)
        bent = ratio * inward + (ratio * cosine - within) * out
        back = inward + 2.0 * cosine * out
        returns = ~passes | (u[0] < _fresnel(cosine, within, ratio))
        found = jnp.where(returns, back, bent)
        return found / jnp.sqrt(dot(found, found))


def _fresnel(cosine: Cosine, within: Cosine, ratio: Number) -> Number:
    """How much is sent back, of light without polarisation."""
    across = (ratio * cosine - within) / (ratio * cosine + within)
    along = (cosine - ratio * within) / (cosine + ratio * within)
    return 0.5 * (across * across + along * along)
