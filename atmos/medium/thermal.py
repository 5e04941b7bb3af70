from ..geometry import Point
from ..quantity import Spectral, Wavelength
from ..spectrum import planck
from ._base import AbstractProfile
from ._emission import AbstractEmission


class Thermal(AbstractEmission):
    """As warm matter shines: what it absorbs, times a black body (Kirchhoff).

    `temperature` is in K; where it is 0, nothing shines.
    """

    temperature: AbstractProfile

    def evaluate(
        self, point: Point, absorption: Spectral, wavelength: Wavelength
    ) -> Spectral:
        return absorption * planck(wavelength, self.temperature.density(point))
