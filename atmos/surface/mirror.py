from typing import ClassVar

import equinox as eqx
from jaxtyping import Array, Float

from ..quantity import Direction, dot, Spectral, Wavelength
from ..spectrum import AbstractSpectrum, as_spectrum
from ._base import AbstractMaterial


class Mirror(AbstractMaterial):
    """Sends back the share `reflectance`, as far off its normal as it came."""

    smooth: ClassVar[bool] = True
    reflectance: AbstractSpectrum = eqx.field(converter=as_spectrum, default=1.0)

    def share(self, wavelength: Wavelength) -> Spectral:
        return self.reflectance.evaluate(wavelength)

    def turn(
        self, inward: Direction, normal: Direction, u: Float[Array, "3"]
    ) -> Direction:
        return inward - 2.0 * dot(inward, normal) * normal
