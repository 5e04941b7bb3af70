import abc

import equinox as eqx

from ..quantity import Direction, Position, Radiance, Wavelength
from .panorama import Panorama


class AbstractSky(eqx.Module):
    """The light in the air: a function of place, direction and wavelength.

    This is all that a camera knows. A solver makes one from a scene; a fitted model is
    one as it stands.
    """

    wavelength: eqx.AbstractVar[Wavelength]

    @abc.abstractmethod
    def radiance(self, position: Position, direction: Direction) -> Radiance:
        """What one sees from `position` in `direction`, but for the disks of lights."""

    @property
    def has_panorama(self) -> bool:
        """Whether all that one sees from a place can be tabulated."""
        return True

    @abc.abstractmethod
    def panorama(self, position: Position) -> Panorama:
        """All that one sees from `position`, made ready for millions of looks."""
