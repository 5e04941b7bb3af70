import math
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..quantity import Direction, dot, Spectral, Wavelength
from ..rotation import around
from ..spectrum import AbstractSpectrum, as_spectrum
from ._base import AbstractMaterial


class Lambertian(AbstractMaterial):
    """As bright from all sides: sends on the share `albedo` of what falls on it."""

    smooth: ClassVar[bool] = False
    albedo: AbstractSpectrum = eqx.field(converter=as_spectrum)

    def share(self, wavelength: Wavelength) -> Spectral:
        return self.albedo.evaluate(wavelength)

    def turn(
        self, inward: Direction, normal: Direction, u: Float[Array, "3"]
    ) -> Direction:
        out = jnp.where(dot(inward, normal) > 0.0, -normal, normal)
        return around(out, 1.0 - jnp.sqrt(u[0]), 2.0 * math.pi * u[1])
