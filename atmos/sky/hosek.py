"""Hosek and Wilkie 2012, "An analytic model for full spectral sky-dome radiance".

With the sun of 2013, "Adding a solar-radiance function to the Hosek-Wilkie skylight
model". The coefficients are read from the package `mitsuba` when they are needed.
"""

import math
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from ..light import SOLAR_RADIUS, Sun
from ..quantity import (
    Angle,
    Cosine,
    Depth,
    Direction,
    dot,
    Number,
    Position,
    Radiance,
    Spectral,
    Versine,
    Wavelength,
)
from ..spectrum import AbstractSpectrum, Tabulated
from ._fitted import (
    AbstractFittedSky,
    angle_between,
    straight,
)
from ._hosek_formula import between, configured, LEAST_ELEVATION, RANGES, shape
from ._hosek_tables import sky_tables, sun_tables
from ._parameters import set_parameters
from ._range import AbstractBeyond, Range, REFUSE


_CHANNELS = np.arange(320.0, 721.0, 40.0)  # nm
_PIECES = 45
_LEAST = 1e-30


class Hosek(AbstractFittedSky):
    """A clear sky by its turbidity and the albedo of the ground, from 320 to 720 nm.

    Fitted to path-traced atmospheres, each wavelength by itself, with the sun's rays of
    2013; between the 11 wavelengths on straight lines. Where the fit falls below 0 (at
    the horizon, suns below 10 degrees) it is black.

    Angles in rad; turbidity from 1, air alone, to 10. Raises `ValueError` outside
    `ranges`, unless `beyond` is `Clamp()`, and `ImportError` without coefficients.
    """

    ranges: ClassVar = {**RANGES, "wavelength": Range(320.0, 720.0, " nm")}

    sun_zenith: Angle
    sun_azimuth: Angle
    turbidity: Number
    wavelength: Wavelength
    ground: AbstractSpectrum

    def __init__(
        self,
        sun_zenith: ArrayLike,
        sun_azimuth: ArrayLike,
        turbidity: ArrayLike,
        wavelength: ArrayLike,
        ground: ArrayLike | AbstractSpectrum = 0.0,
        beyond: AbstractBeyond = REFUSE,
    ):
        sky_tables("spec")
        set_parameters(
            self,
            beyond,
            sun_zenith=sun_zenith,
            sun_azimuth=sun_azimuth,
            turbidity=turbidity,
            wavelength=wavelength,
            ground=ground,
        )

    def parts(self, up: Cosine, turned: Versine) -> Float[Array, "part"]:
        albedo = self.ground.evaluate(jnp.asarray(_CHANNELS, up.dtype))
        found = configured("spec", self.turbidity, albedo, self.sun_zenith)
        return shape(*found, up, turned)

    @property
    def basis(self) -> Float[Array, "part wl"]:
        return straight(_CHANNELS, self.wavelength)

    @property
    def lights(self) -> tuple[Sun]:
        # As it arrives, from the middle of the disk; `depth` is relative to that.
        weights = jnp.asarray([2.0 / (k + 2.0) for k in range(6)], self._dtype)
        limb = jnp.asarray(sun_tables().limb, self._dtype)
        mean = jnp.matmul(limb, weights, precision="highest")
        radius = jnp.asarray(SOLAR_RADIUS, self._dtype)
        area = math.pi * jnp.sin(radius) ** 2
        values = area * mean * self._solar(jnp.cos(self.sun_zenith))
        knots = jnp.asarray(_CHANNELS, self._dtype)
        irradiance = Tabulated(knots, values, values[0], values[-1])
        return (Sun.at(self.sun_zenith, self.sun_azimuth, irradiance, radius),)

    def depth(self, position: Position, direction: Direction) -> Depth:
        """How much less of the sun arrives in a direction than from its middle."""
        del position
        solar = lambda up: jnp.maximum(self._along(self._solar(up)), _LEAST)
        middle = jnp.cos(self.sun_zenith)
        return jnp.log(solar(middle) / solar(jnp.maximum(direction[2], 0.0)))

    def solar_radiance(self, direction: Direction, apart: Number) -> Radiance:
        """The sun's disk seen in a direction, in W m^-2 sr^-1 nm^-1.

        `apart` is how far that is from the middle of the disk, as a share of its
        radius. Pictures draw the disk with this irradiance, and the limb darkening of
        `Sun`.
        """
        cosine = jnp.sqrt(jnp.maximum(1.0 - apart * apart, 0.0))
        limb = jnp.asarray(sun_tables().limb, self._dtype)
        limb = jnp.matmul(limb.T, self.basis, precision="highest")
        powers = jnp.stack([cosine**k for k in range(6)])
        shape = dot(powers, limb)
        return shape * self._along(self._solar(direction[2]))

    @property
    def _dtype(self) -> np.dtype:
        return self.wavelength.dtype

    def _along(self, values: Float[Array, "channel"]) -> Spectral:
        return dot(values, self.basis)

    def _solar(self, up: Cosine) -> Float[Array, "channel"]:
        """The middle of the disk at its wavelengths, by the elevation of the view."""
        elevation = 0.5 * math.pi - angle_between(1.0 - jnp.clip(up, 0.0, 1.0))
        elevation = jnp.maximum(elevation, LEAST_ELEVATION)
        at = jnp.cbrt(elevation * (2.0 / math.pi)) * _PIECES
        piece = jnp.clip(jnp.floor(at), 0.0, _PIECES - 1.0)
        x = elevation - 0.5 * math.pi * (piece / _PIECES) ** 3
        table = jnp.asarray(sun_tables().radiance, self._dtype)
        cubic = between(table, self.turbidity - 1.0)[piece.astype(int)]
        powers = jnp.stack([x**k for k in range(4)])
        return jnp.maximum(dot(cubic, powers), 0.0)
