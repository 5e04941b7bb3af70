"""How molecules scatter: from the refractive index of a gas to its cross section."""

import abc
import math

import equinox as eqx
from jax.core import Tracer

from ..quantity import as_float, Number, Spectral, Wavelength
from ..spectrum import AbstractSpectrum


# Molecules in a cubic metre at 288.15 K and 1013.25 hPa, where refractive indices are
# given (Bodhaine et al. 1999).
STANDARD_DENSITY = 2.546899e25

# The shortest wavelength at which the refractive indices were measured, in nm.
SHORTEST = 185.0


class AbstractGas(eqx.Module):
    """Molecules far smaller than the wavelength."""

    @abc.abstractmethod
    def refractivity(self, wavelength: Wavelength) -> Spectral:
        """The refractive index less 1, at 288.15 K and 1013.25 hPa, in vacuum nm.

        The index itself would hold four digits of it at most in single precision.
        """

    @abc.abstractmethod
    def king_factor(self, wavelength: Wavelength) -> Spectral:
        """By how much the molecules scatter more than round ones, whose factor is 1."""

    def cross_section(self, wavelength: Wavelength) -> Spectral:
        """What one molecule scatters, in m^2, as in Bodhaine et al. (1999), eq. 22.

        24 pi^3 / (wavelength^4 N^2) ((n^2 - 1) / (n^2 + 2))^2 king_factor
        """
        excess = self.refractivity(wavelength)
        excess = excess * (2.0 + excess)  # n^2 - 1
        # In um, and the index term in 1e-4: single precision underflows nowhere.
        amplitude = 1e4 * excess / (3.0 + excess) / (1e-3 * wavelength) ** 2
        scale = 24.0 * math.pi**3 * 1e-8 / (1e-12 * STANDARD_DENSITY) ** 2
        return scale * self.king_factor(wavelength) * amplitude**2

    def depolarisation(self, wavelength: Wavelength) -> Spectral:
        """The depolarisation of unpolarised light scattered sideways, 0.028 for air."""
        king = self.king_factor(wavelength)
        return 6.0 * (king - 1.0) / (3.0 + 7.0 * king)


class Scattering(AbstractSpectrum):
    """The scattering coefficient of `number_density` molecules of a gas, in m^-1.

    `number_density` is in m^-3; by default that of air at the ground.
    """

    gas: AbstractGas
    number_density: Number = eqx.field(converter=as_float, default=STANDARD_DENSITY)

    def __check_init__(self):
        n = self.number_density
        if not (isinstance(n, Tracer) or 0.0 <= float(n) < math.inf):
            raise ValueError(f"`number_density` must be 0 m^-3 or more; got {n}.")

    def evaluate(self, wavelength: Wavelength) -> Spectral:
        return self.number_density * self.gas.cross_section(wavelength)

    @property
    def domain(self) -> tuple[float, float]:
        return SHORTEST, math.inf


class Depolarisation(AbstractSpectrum):
    """The depolarisation of a gas, for the Rayleigh phase function."""

    gas: AbstractGas

    def evaluate(self, wavelength: Wavelength) -> Spectral:
        return self.gas.depolarisation(wavelength)

    @property
    def domain(self) -> tuple[float, float]:
        return SHORTEST, math.inf
