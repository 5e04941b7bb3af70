"""The 15 CIE standard general skies (CIE S 011 / ISO 15469:2004)."""

import abc
import math
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.core import Tracer
from jaxtyping import Array, ArrayLike, Float

from ..quantity import Angle, as_float, Cosine, Number, Versine, Wavelength
from ..spectrum import AbstractSpectrum
from ._daylight import D65, DAYLIGHT, spectrum, TEMPERATURES
from ._fitted import AbstractFittedSky, angle_between, hemisphere
from ._parameters import set_parameters
from ._range import AbstractBeyond, degrees, REFUSE


# a and b of the gradation from zenith to horizon, c, d and e of the glow around the
# sun, by type.
COEFFICIENTS = {
    1: (4.0, -0.70, 0.0, -1.0, 0.00),
    2: (4.0, -0.70, 2.0, -1.5, 0.15),
    3: (1.1, -0.80, 0.0, -1.0, 0.00),
    4: (1.1, -0.80, 2.0, -1.5, 0.15),
    5: (0.0, -1.00, 0.0, -1.0, 0.00),
    6: (0.0, -1.00, 2.0, -1.5, 0.15),
    7: (0.0, -1.00, 5.0, -2.5, 0.30),
    8: (0.0, -1.00, 10.0, -3.0, 0.45),
    9: (-1.0, -0.55, 2.0, -1.5, 0.15),
    10: (-1.0, -0.55, 5.0, -2.5, 0.30),
    11: (-1.0, -0.55, 10.0, -3.0, 0.45),
    12: (-1.0, -0.32, 10.0, -3.0, 0.45),
    13: (-1.0, -0.32, 16.0, -3.0, 0.30),
    14: (-1.0, -0.15, 16.0, -3.0, 0.30),
    15: (-1.0, -0.15, 24.0, -2.8, 0.15),
}
_LEAST_RISE = 1e-6  # cosine of the zenith angle: below it nothing changes


class AbstractScale(eqx.Module):
    """How bright a sky is of which the shape is known: a value above 0."""

    value: eqx.AbstractVar[Number]

    def __check_init__(self):
        known = not isinstance(self.value, Tracer)
        if known and not (self.value.shape == () and 0.0 < self.value < math.inf):
            raise ValueError(f"`value` must be above 0; got {self.value}.")

    @abc.abstractmethod
    def zenith_luminance(self, per_luminance: Number) -> Number:
        """In cd m^-2, where a luminance of 1 there gives the ground so many lux."""


class ZenithLuminance(AbstractScale):
    """The luminance straight up, in cd m^-2."""

    value: Number = eqx.field(converter=as_float)

    def zenith_luminance(self, per_luminance: Number) -> Number:
        del per_luminance
        return self.value


class HorizontalIlluminance(AbstractScale):
    """What the ground receives from the sky without the sun, in lux."""

    value: Number = eqx.field(converter=as_float)

    def zenith_luminance(self, per_luminance: Number) -> Number:
        return self.value / per_luminance


class CIE(AbstractFittedSky):
    """A standard sky from overcast (type 1) over uniform (5) to clear and hazy (15).

    Types 1 to 5 with even numbers, and all from 6 on, brighten towards the sun; 12 is
    the clear sky of clean air, 13 that of a town. The standard gives luminance relative
    to the zenith; `scale` makes it absolute, and its spectrum is daylight of one
    correlated colour `temperature`, in K, all over. There is no sun: what the ground
    reflects is the light of the sky alone.

    Angles in rad, wavelengths in nm; `ground` is the albedo of what lies below the
    horizon. Raises `ValueError` for a type that there is not, a scale that is not above
    0, and outside `ranges`, unless `beyond` is `Clamp()`.
    """

    ranges: ClassVar = {
        "sun_zenith": degrees(0.0, 90.0),
        "temperature": TEMPERATURES,
        "wavelength": DAYLIGHT,
    }

    coefficients: Float[Array, "5"]  # a to e
    sun_zenith: Angle
    sun_azimuth: Angle
    scale: AbstractScale
    wavelength: Wavelength
    ground: AbstractSpectrum
    temperature: Number

    def __init__(
        self,
        sky_type: int,
        sun_zenith: ArrayLike,
        sun_azimuth: ArrayLike,
        scale: AbstractScale,
        wavelength: ArrayLike,
        ground: ArrayLike | AbstractSpectrum = 0.0,
        temperature: ArrayLike = D65,
        beyond: AbstractBeyond = REFUSE,
    ):
        if sky_type not in COEFFICIENTS:
            raise ValueError(
                f"`sky_type` must be a whole number from 1 to 15; got {sky_type!r}."
            )
        set_parameters(
            self,
            beyond,
            sun_zenith=sun_zenith,
            sun_azimuth=sun_azimuth,
            wavelength=wavelength,
            ground=ground,
            temperature=temperature,
        )
        self.coefficients = jnp.asarray(COEFFICIENTS[sky_type], self.wavelength.dtype)
        self.scale = jax.tree.map(lambda x: x.astype(self.wavelength.dtype), scale)

    def relative(self, up: Cosine, turned: Versine) -> Number:
        """The luminance, relative to that of the zenith."""
        a, b, c, d, e = self.coefficients
        grade = lambda up: 1.0 + a * jnp.exp(b / up)
        glow = lambda angle, cosine: (
            1.0 + c * (jnp.exp(d * angle) - jnp.exp(0.5 * math.pi * d)) + e * cosine**2
        )
        sun, one = self.sun_zenith, jnp.ones_like(up)
        here = grade(jnp.maximum(up, _LEAST_RISE))
        here *= glow(angle_between(turned), 1.0 - turned)
        return here / (grade(one) * glow(sun, jnp.cos(sun)))

    @property
    def zenith_luminance(self) -> Number:
        """The luminance straight up, in cd m^-2."""
        look = lambda up, turned: self.relative(up, turned)[None]
        return self.scale.zenith_luminance(hemisphere(look, self.sun_zenith)[0])

    def parts(self, up: Cosine, turned: Versine) -> Float[Array, "part"]:
        return self.relative(up, turned)[None]

    @property
    def basis(self) -> Float[Array, "part wl"]:
        light = spectrum(self.temperature, self.wavelength)
        return self.zenith_luminance * light[None]

    @property
    def lights(self) -> tuple[()]:
        return ()
