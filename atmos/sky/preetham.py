"""Preetham, Shirley and Smits 1999, "A practical analytic model for daylight"."""

import functools as ft
import math
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .. import data
from ..light import SOLAR_RADIUS, Sun
from ..quantity import (
    Angle,
    Cosine,
    deg,
    Depth,
    Direction,
    dot,
    Fraction,
    Length,
    Number,
    Position,
    Radiance,
    Versine,
    Wavelength,
)
from ..spectrum import AbstractSpectrum, Tabulated
from ..transport import contract
from ._aerial import airlight, haze
from ._daylight import components, DAYLIGHT, luminances, mixture
from ._fitted import (
    AbstractFittedSky,
    angle_between,
    straight,
)
from ._parameters import set_parameters
from ._range import AbstractBeyond, degrees, Range, REFUSE


# Appendix 2: the coefficients of Perez's formula, times the turbidity and without.
_LUMINANCE = [
    (0.1787, -1.4630),
    (-0.3554, 0.4275),
    (-0.0227, 5.3251),
    (0.1206, -2.5771),
    (-0.0670, 0.3703),
]
_X = [
    (-0.0193, -0.2592),
    (-0.0665, 0.0008),
    (-0.0004, 0.2125),
    (-0.0641, -0.8989),
    (-0.0033, 0.0452),
]
_Y = [
    (-0.0167, -0.2608),
    (-0.0950, 0.0092),
    (-0.0079, 0.2102),
    (-0.0441, -1.6537),
    (-0.0109, 0.0529),
]
# Chromaticity at the zenith: powers 2, 1, 0 of the turbidity times powers 3 to 0 of the
# sun's zenith angle.
_ZENITH_X = [
    (0.00166, -0.00375, 0.00209, 0.0),
    (-0.02903, 0.06377, -0.03202, 0.00394),
    (0.11693, -0.21196, 0.06052, 0.25886),
]
_ZENITH_Y = [
    (0.00275, -0.00610, 0.00317, 0.0),
    (-0.04214, 0.08970, -0.04153, 0.00516),
    (0.15346, -0.26756, 0.06670, 0.26688),
]
_LEAST_RISE = 1e-3  # cosine of the zenith angle, as in the authors' program
_SOLID_ANGLE = 6.7443e-5  # sr, of the sun, as in the authors' program
_OZONE, _WATER = 0.35, 2.0  # cm


class Preetham(AbstractFittedSky):
    """A clear sky by its turbidity: 2 is very clear, 3 clear, 6 light haze.

    Its luminance and chromaticity are Perez's formula (1993), fitted to simulations of
    turbidities 2 to 6 for suns above the horizon, and its spectra are those of daylight
    of that chromaticity. The sun and the air between things near the ground come from
    the same paper.

    Angles in rad, wavelengths in nm; `ground` is the albedo of what lies below the
    horizon, of which the paper says nothing. Raises `ValueError` outside `ranges`,
    unless `beyond` is `Clamp()`.
    """

    ranges: ClassVar = {
        "turbidity": Range(2.0, 6.0),
        "sun_zenith": degrees(0.0, 90.0),
        "wavelength": DAYLIGHT,
    }

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
        set_parameters(
            self,
            beyond,
            sun_zenith=sun_zenith,
            sun_azimuth=sun_azimuth,
            turbidity=turbidity,
            wavelength=wavelength,
            ground=ground,
        )

    @property
    def zenith(self) -> Float[Array, "3"]:
        """Luminance in cd m^-2 and chromaticity x, y straight up."""
        t, sun = self.turbidity, self.sun_zenith
        chi = (4.0 / 9.0 - t / 120.0) * (math.pi - 2.0 * sun)
        luminance = (4.0453 * t - 4.9710) * jnp.tan(chi) - 0.2155 * t + 2.4192
        x, y = (
            jnp.polyval(jnp.stack([_cubic(row, sun) for row in rows]), t)
            for rows in (_ZENITH_X, _ZENITH_Y)
        )
        return jnp.stack([1000.0 * luminance, x, y])

    def colour(self, up: Cosine, turned: Versine) -> Float[Array, "3"]:
        """Luminance in cd m^-2 and chromaticity x, y of the sky in one direction."""
        up = jnp.maximum(up, _LEAST_RISE)
        gamma, cosine = angle_between(turned), 1.0 - turned
        sun, one = self.sun_zenith, jnp.ones_like(up)

        def relative(rows):
            a, b, c, d, e = (slope * self.turbidity + rest for slope, rest in rows)
            grade = lambda up: 1.0 + a * jnp.exp(b / up)
            glow = lambda gamma, cosine: (
                1.0 + c * jnp.exp(d * gamma) + e * cosine * cosine
            )
            over = grade(up) * glow(gamma, cosine)
            return over / (grade(one) * glow(sun, jnp.cos(sun)))

        return self.zenith * jnp.stack([relative(r) for r in (_LUMINANCE, _X, _Y)])

    def parts(self, up: Cosine, turned: Versine) -> Float[Array, "part"]:
        luminance, x, y = self.colour(up, turned)
        mixed = mixture(x, y)
        return luminance * mixed / dot(mixed, jnp.asarray(luminances(), x.dtype))

    @property
    def basis(self) -> Float[Array, "part wl"]:
        return components(self.wavelength)

    @property
    def lights(self) -> tuple[Sun]:
        knots, values = _sunlight(self.wavelength.dtype)
        irradiance = Tabulated(knots, values, values[0], values[-1])
        radius = jnp.asarray(SOLAR_RADIUS, self.wavelength.dtype)
        return (Sun.at(self.sun_zenith, self.sun_azimuth, irradiance, radius),)

    def depth(self, position: Position, direction: Direction) -> Depth:
        """The optical depth in front of the sun (appendix 1).

        By molecules, haze, ozone, gases and water vapour.
        """
        del position
        zenith = angle_between(1.0 - jnp.clip(direction[2], 0.0, 1.0)) / deg
        mass = 1.0 / (jnp.cos(zenith * deg) + 0.15 * (93.885 - zenith) ** -1.253)
        um = jnp.clip(self.wavelength, DAYLIGHT.low, DAYLIGHT.high) / 1000.0
        knots, ozone, gas, vapour = _absorption()
        weights = straight(knots, self.wavelength)
        at = lambda x: contract("n,nl->l", jnp.asarray(x, um.dtype), weights)
        beta = 0.04608 * self.turbidity - 0.04586
        wet, mixed = _WATER * mass * at(vapour), mass * at(gas)
        return (
            mass * (0.008735 * um**-4.08 + beta * um**-1.3 + _OZONE * at(ozone))
            + 1.41 * mixed / (1.0 + 118.93 * mixed) ** 0.45
            + 0.2385 * wet / (1.0 + 20.07 * wet) ** 0.45
        )

    def aerial_perspective(
        self, position: Position, direction: Direction, distance: Length
    ) -> tuple[Fraction, Radiance]:
        """What the air does to a view that ends at a `distance`, in m.

        The share of what is there that arrives, and the radiance that the air adds, in
        W m^-2 sr^-1 nm^-1. Molecules and haze thin out exponentially above the ground,
        where the light that they turn is taken to be as it is at the observer; the
        integral along the view, which the paper approximates by a cubic, is done by
        quadrature.
        """
        (sun,) = self.lights
        beam = self.beam(sun, position)
        air = haze(self.turbidity, self.wavelength)
        return airlight(self, air, sun.direction, beam, position, direction, distance)


def _cubic(coefficients: tuple[float, ...], x: Number) -> Number:
    return jnp.polyval(jnp.asarray(coefficients, x.dtype), x)


@ft.cache
def _absorption() -> tuple[np.ndarray, ...]:
    table = data.read("preetham_sun")
    names = "wavelength", "ozone", "gas", "vapour"
    return tuple(table[x].astype(float) for x in names)


def _sunlight(dtype: np.dtype) -> tuple[Array, Array]:
    """Wavelengths, and the irradiance outside the air in W m^-2 nm^-1."""
    table = data.read("preetham_sun")
    known = np.isfinite(table["sun"])
    values = 10.0 * _SOLID_ANGLE * table["sun"][known]
    return jnp.asarray(table["wavelength"][known], dtype), jnp.asarray(values, dtype)
