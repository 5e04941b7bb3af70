import abc

import equinox as eqx
from jaxtyping import Array, Float

from ..light import Sun
from ..quantity import (
    Angle,
    Depth,
    Direction,
    Irradiance,
    Length,
    Position,
    Radiance,
    Wavelength,
)


class AbstractPanorama(eqx.Module):
    """The light that arrives at one place from all directions."""

    @abc.abstractmethod
    def radiance(
        self,
        zenith: Float[Array, "#height #width"],
        azimuth: Float[Array, "#height #width"],
    ) -> Float[Array, "height width channel"]:
        """The radiance from each direction of a picture, in W m^-2 sr^-1 nm^-1.

        Angles in rad, azimuth clockwise from north.
        """

    @abc.abstractmethod
    def stokes(
        self,
        zenith: Float[Array, "#height #width"],
        azimuth: Float[Array, "#height #width"],
    ) -> Float[Array, "height width 3 channel"]:
        """I, Q and U from each direction, in the frame of `atmos.polarisation`.

        Raises `ValueError` for a sky without polarisation.
        """

    @property
    @abc.abstractmethod
    def even(self) -> bool:
        """Whether `weigh` is right."""

    @abc.abstractmethod
    def weigh(self, response: Float[Array, "wl channel"]) -> "AbstractPanorama":
        """The same for sums over wavelengths, with a channel in place of each."""

    @abc.abstractmethod
    def finer(self) -> "AbstractPanorama":
        """The same for pictures that are not in rows."""


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
    def panorama(self, position: Position) -> AbstractPanorama:
        """All that one sees from `position`, made ready for millions of looks."""

    @property
    @abc.abstractmethod
    def lights(self) -> tuple[Sun, ...]:
        """The lights whose disks stand in the sky, as they are behind `depth`."""

    @abc.abstractmethod
    def depth(self, position: Position, direction: Direction) -> Depth:
        """The optical depth in front of a light in that direction."""

    @abc.abstractmethod
    def dip(self, altitude: Length) -> Angle:
        """How far below level the horizon lies."""

    @abc.abstractmethod
    def beam(self, light: Sun, position: Position) -> Irradiance:
        """What a plane facing a light receives from its disk, in W m^-2 nm^-1."""
