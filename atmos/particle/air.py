import equinox as eqx
from jax.core import Tracer

from ..quantity import as_float, Number, Spectral, Wavelength
from .gas import AbstractGas


class Air(AbstractGas):
    """Dry air, of whose molecules the fraction `co2` is carbon dioxide.

    Refractive index of Peck and Reeder (1972), King factor of Bates (1984), both as in
    Bodhaine et al. (1999).
    """

    co2: Number = eqx.field(converter=as_float, default=360e-6)

    def __check_init__(self):
        if not (isinstance(self.co2, Tracer) or 0.0 <= float(self.co2) <= 1.0):
            raise ValueError(f"`co2` must lie between 0 and 1; got {self.co2}.")

    def refractivity(self, wavelength: Wavelength) -> Spectral:
        squared = 1e6 / wavelength**2  # the wavenumber squared, in um^-2
        at_300_ppm = 1e-8 * (
            8060.51 + 2480990.0 / (132.274 - squared) + 17455.7 / (39.32957 - squared)
        )
        return at_300_ppm * (1.0 + 0.54 * (self.co2 - 300e-6))

    def king_factor(self, wavelength: Wavelength) -> Spectral:
        squared = 1e6 / wavelength**2
        nitrogen = 1.034 + 3.17e-4 * squared
        oxygen = 1.096 + 1.385e-3 * squared + 1.448e-4 * squared**2
        co2 = 100.0 * self.co2
        rest = 0.934 + 1.15 * co2
        parts = 78.084 * nitrogen + 20.946 * oxygen + rest
        return parts / (78.084 + 20.946 + 0.934 + co2)
