import abc

import equinox as eqx

from ..geometry import Point
from ..quantity import Spectral, Wavelength


class AbstractEmission(eqx.Module):
    """How a medium shines of itself, in all directions alike."""

    @abc.abstractmethod
    def evaluate(
        self, point: Point, absorption: Spectral, wavelength: Wavelength
    ) -> Spectral:
        """The radiance that a metre adds where the medium's profile is 1.

        In W m^-2 sr^-1 nm^-1 per m. `absorption` is the medium's there, in m^-1.
        """
