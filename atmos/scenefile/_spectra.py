from typing import Literal

import numpy as np

from .. import light, particle, spectrum
from ..particle import ozone
from ._base import Above0, AtLeast0, Kind, Wavelength
from ._errors import refuse, renamed


class Constant(Kind, tag="constant"):
    makes = spectrum.Constant
    value: float


class PowerLaw(Kind, tag="power_law"):
    makes = spectrum.PowerLaw
    value: float
    exponent: float
    at: Wavelength = 550.0


class Tabulated(Kind, tag="table"):
    """Beyond the table one of `outside`, or the numbers `below` and `above`.

    With a `bandwidth` it is averaged over so many nm around each wavelength.
    """

    wavelength: list[Wavelength]
    value: list[float]
    outside: Literal["refuse", "zero", "hold"] | None = None
    below: float | None = None
    above: float | None = None
    bandwidth: Above0 | None = None

    def build(self) -> spectrum.AbstractSpectrum:
        ends = self.below, self.above
        beyond = self.outside is not None or ends != (None, None)
        if self.outside is not None and ends != (None, None):
            refuse("outside", "must not stand beside `below` and `above`")
        if self.bandwidth is not None and beyond:
            refuse("bandwidth", "must not stand beside what is `outside`")
        if self.outside == "zero":
            ends = 0.0, 0.0
        elif self.outside == "hold" and self.value:
            ends = self.value[0], self.value[-1]
        knots, values = np.array(self.wavelength), np.array(self.value)
        with renamed(spectrum.Tabulated, self.__struct_fields__):
            if self.bandwidth is not None:
                return spectrum.BandAverage(knots, values, self.bandwidth)
            return spectrum.Tabulated(knots, values, *ends)


class Solar(Kind, tag="solar"):
    """The sun's spectrum (ASTM G173-03) at a distance in astronomical units."""

    bandwidth: Above0 = 10.0
    distance: Above0 = 1.0

    def build(self) -> spectrum.BandAverage:
        return light.sunlight(self.bandwidth, self.distance)


def _gas(name: str, co2: float | None) -> particle.AbstractGas:
    if name == "air":
        return particle.Air() if co2 is None else particle.Air(co2)
    if co2 is not None:
        refuse("co2", "is the share of it in air; leave it out here", co2)
    return particle.CarbonDioxide()


class Molecules(Kind, tag="molecules"):
    """What `number_density` molecules in a cubic metre scatter."""

    gas: Literal["air", "carbon_dioxide"]
    number_density: AtLeast0 = particle.gas.STANDARD_DENSITY
    co2: float | None = None

    def build(self) -> particle.Scattering:
        return particle.Scattering(_gas(self.gas, self.co2), self.number_density)


class MoleculesDepolarise(Kind, tag="molecules"):
    """How they depolarise the light."""

    gas: Literal["air", "carbon_dioxide"]
    co2: float | None = None

    def build(self) -> particle.Depolarisation:
        return particle.Depolarisation(_gas(self.gas, self.co2))


class Ozone(Kind, tag="ozone"):
    """What `number_density` molecules of ozone in a cubic metre absorb."""

    number_density: AtLeast0

    def build(self) -> spectrum.Product:
        most = spectrum.Constant(self.number_density)
        return spectrum.Product(most, ozone.cross_section())


Spectrum = float | Constant | PowerLaw | Tabulated
