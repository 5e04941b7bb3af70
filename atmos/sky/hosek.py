"""Hosek and Wilkie 2012, "An analytic model for full spectral sky-dome radiance".

With the sun of 2013, "Adding a solar-radiance function to the Hosek-Wilkie skylight
model". The coefficients are read from the package `mitsuba` when they are needed.
"""

import math
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from ..colour import REC709, response
from ..light import SOLAR_RADIUS, Sun
from ..quantity import (
    Angle,
    Cosine,
    Depth,
    Direction,
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
    set_parameters,
    straight,
)
from ._hosek_tables import sky_tables, sun_tables
from ._range import AbstractBeyond, degrees, Range, REFUSE


_CHANNELS = np.arange(320.0, 721.0, 40.0)  # nm
_RANGES = {"turbidity": Range(1.0, 10.0), "sun_zenith": degrees(0.0, 90.0)}
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

    ranges: ClassVar = {**_RANGES, "wavelength": Range(320.0, 720.0, " nm")}

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
        configured = _configured("spec", self.turbidity, albedo, self.sun_zenith)
        return _shape(*configured, up, turned)

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
        shape = jnp.dot(powers, limb, precision="highest")
        return shape * self._along(self._solar(direction[2]))

    @property
    def _dtype(self) -> np.dtype:
        return self.wavelength.dtype

    def _along(self, values: Float[Array, "channel"]) -> Spectral:
        return jnp.dot(values, self.basis, precision="highest")

    def _solar(self, up: Cosine) -> Float[Array, "channel"]:
        """The middle of the disk at its wavelengths, by the elevation of the view."""
        elevation = 0.5 * math.pi - jnp.arccos(jnp.clip(up, 0.0, 1.0))
        at = jnp.cbrt(elevation * (2.0 / math.pi)) * _PIECES
        piece = jnp.clip(jnp.floor(at), 0.0, _PIECES - 1.0)
        x = elevation - 0.5 * math.pi * (piece / _PIECES) ** 3
        table = jnp.asarray(sun_tables().radiance, self._dtype)
        cubic = _between(table, self.turbidity - 1.0)[piece.astype(int)]
        powers = jnp.stack([x**k for k in range(4)])
        return jnp.maximum(jnp.dot(cubic, powers, precision="highest"), 0.0)


class HosekRGB(AbstractFittedSky):
    """The same sky as linear Rec. 709, fitted in colour: `colour` is the model.

    Its spectra are made up, so that they have these colours under the wavelengths
    asked for, which must cover what the eye sees: for pictures in colour, not for
    light at one wavelength. There is no sun.
    """

    ranges: ClassVar = {**_RANGES, "wavelength": Range(360.0, 830.0, " nm")}

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
        sky_tables("rgb")
        set_parameters(
            self,
            beyond,
            sun_zenith=sun_zenith,
            sun_azimuth=sun_azimuth,
            turbidity=turbidity,
            wavelength=wavelength,
            ground=ground,
        )

    def colour(self, up: Cosine, turned: Versine) -> Float[Array, "3"]:
        """Red, green and blue of the sky, as `atmos.colour.REC709` counts them.

        Not below 0, as the fit is in places.
        """
        configured = _configured("rgb", self.turbidity, self._albedo, self.sun_zenith)
        return jnp.maximum(_shape(*configured, up, turned), 0.0)

    def parts(self, up: Cosine, turned: Versine) -> Float[Array, "part"]:
        return self.colour(up, turned)

    @property
    def basis(self) -> Float[Array, "part wl"]:
        # Of all spectra of the three colours the least.
        weights = REC709.from_xyz(response(self.wavelength))
        square = jnp.matmul(weights.T, weights, precision="highest")
        return jnp.linalg.solve(square, weights.T)

    @property
    def lights(self) -> tuple[()]:
        return ()

    @property
    def _albedo(self) -> Float[Array, "3"]:
        """What the ground reflects of each colour of a white light."""
        weights = REC709.from_xyz(response(self.wavelength))
        albedo = self.ground.evaluate(self.wavelength)
        seen = jnp.sum(albedo[:, None] * weights, 0) / jnp.sum(weights, 0)
        return jnp.clip(seen, 0.0, 1.0)


def _configured(
    kind: str, turbidity: Number, albedo: Spectral, sun_zenith: Angle
) -> tuple[Float[Array, "channel 9"], Float[Array, "channel"]]:
    """The shape's coefficients, and the mean radiance that it multiplies."""
    elevation = jnp.maximum(0.5 * math.pi - sun_zenith, 0.0)
    x = jnp.cbrt(elevation * (2.0 / math.pi))
    bezier = [math.comb(5, k) * x**k * (1.0 - x) ** (5 - k) for k in range(6)]
    weights = jnp.stack(bezier)

    def table(values):
        between = _between(jnp.asarray(values, x.dtype), turbidity - 1.0)
        dark, white = jnp.tensordot(weights, between, (0, 1), precision="highest")
        share = albedo.reshape(-1, *(1,) * (dark.ndim - 1))
        return dark + share * (white - dark)

    shape, mean = sky_tables(kind)
    return table(shape), table(mean)


def _shape(
    coefficients: Float[Array, "channel 9"],
    mean: Float[Array, "channel"],
    up: Cosine,
    turned: Versine,
) -> Float[Array, "channel"]:
    """The formula of the paper."""
    a, b, c, d, e, f, g, i, h = coefficients.T
    cosine = 1.0 - turned
    square = cosine * cosine
    # 1 + h^2 - 2 h cos, which loses no digits near the sun.
    ring = (1.0 - h) ** 2 + 2.0 * h * turned
    chi = (1.0 + square) / (ring * jnp.sqrt(ring))
    some = up > 0.0
    root = jnp.where(some, jnp.sqrt(jnp.where(some, up, 1.0)), 0.0)
    glow = c + d * jnp.exp(e * angle_between(turned)) + f * square + g * chi + i * root
    return (1.0 + a * jnp.exp(b / (up + 0.01))) * glow * mean


def _between(table: Float[Array, "n *rest"], place: Number) -> Float[Array, "*rest"]:
    """The table at a place between its entries, on a straight line."""
    first = jnp.clip(jnp.floor(place), 0.0, table.shape[0] - 2.0)
    low, high = table[first.astype(int)], table[first.astype(int) + 1]
    return low + (place - first) * (high - low)
