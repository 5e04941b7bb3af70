import equinox as eqx

from ..geometry import Point
from ..quantity import Spectral, Wavelength
from ..spectrum import AbstractSpectrum, as_spectrum
from ._emission import AbstractEmission


class Glow(AbstractEmission):
    """The same at every place: `spectrum`, in W m^-2 sr^-1 nm^-1 per m."""

    spectrum: AbstractSpectrum = eqx.field(converter=as_spectrum)

    def evaluate(
        self, point: Point, absorption: Spectral, wavelength: Wavelength
    ) -> Spectral:
        return self.spectrum.evaluate(wavelength)
