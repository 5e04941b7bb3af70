"""Perez, Seals and Michalsky 1993, "All-weather model for sky luminance distribution".

With the luminous efficacies of Perez et al. 1990, "Modeling daylight availability".
"""

import functools as ft
import math
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, ArrayLike, Float

from .. import data
from ..light import SOLAR_RADIUS, Sun
from ..quantity import Angle, as_float, Cosine, deg, dot, Number, Versine, Wavelength
from ..spectrum import AbstractSpectrum, Tabulated
from ._daylight import D65, DAYLIGHT, spectrum, TEMPERATURES
from ._fitted import AbstractFittedSky, angle_between, hemisphere
from ._parameters import set_parameters
from ._range import AbstractBeyond, degrees, Range, REFUSE


_SOLAR_CONSTANT = 1367.0  # W m^-2
_DULL, _CLEAR = 1.065, 2.8  # clearness of overcast skies; of those that are clear
_ZENITH_FACTOR = 1.041
_MOST_EXCESS = 1.05
_LEAST_RISE = 0.01  # cosine of the zenith angle, as in Radiance's perezlum.cal


class Perez(AbstractFittedSky):
    """The sky of any weather, from how clear and how bright it is.

    `clearness` is 1 where the sun does not shine, and above 6 under a clear sky;
    `brightness` is the light of the sky relative to that outside the air, on a level
    plane and times the air mass. Both come from two readings, see `measured`. They fix
    how bright the sky is, and the sun. Where the fit falls below 0 it is black. Its
    spectrum is daylight of one correlated colour `temperature`, in K, all over, and
    for the sun.

    Angles in rad, wavelengths in nm, `water` vapour in cm, `distance` of the sun in
    astronomical units; `ground` is the albedo of what lies below the horizon. Raises
    `ValueError` outside `ranges`, unless `beyond` is `Clamp()`, for a sun
    stronger than outside the air, and where most of the fit is below 0 (in 1 of 70
    skies of these ranges, clear ones with a bright sky and a low sun).
    """

    ranges: ClassVar = {
        "sun_zenith": degrees(0.0, 90.0),
        "clearness": Range(1.0, 12.01),
        "brightness": Range(0.01, 0.6),
        "temperature": TEMPERATURES,
        "water": Range(0.0, 10.0, " cm"),
        "distance": Range(0.9, 1.1, " au"),
        "wavelength": DAYLIGHT,
    }

    sun_zenith: Angle
    sun_azimuth: Angle
    clearness: Number
    brightness: Number
    wavelength: Wavelength
    ground: AbstractSpectrum
    temperature: Number
    water: Number
    distance: Number

    def __init__(
        self,
        sun_zenith: ArrayLike,
        sun_azimuth: ArrayLike,
        clearness: ArrayLike,
        brightness: ArrayLike,
        wavelength: ArrayLike,
        ground: ArrayLike | AbstractSpectrum = 0.0,
        temperature: ArrayLike = D65,
        water: ArrayLike = 2.0,
        distance: ArrayLike = 1.0,
        beyond: AbstractBeyond = REFUSE,
    ):
        set_parameters(
            self,
            beyond,
            sun_zenith=sun_zenith,
            sun_azimuth=sun_azimuth,
            clearness=clearness,
            brightness=brightness,
            wavelength=wavelength,
            ground=ground,
            temperature=temperature,
            water=water,
            distance=distance,
        )
        self._check()

    def _check(self) -> None:
        """Refuses skies that there are not, if all numbers are known."""
        direct = self.irradiances[0]
        if any(isinstance(x, Tracer) for x in (direct, *jax.tree.leaves(self))):
            return
        most = _SOLAR_CONSTANT / self.distance**2
        if not direct <= most:
            raise ValueError(
                "`clearness` and `brightness` must leave the sun weaker than outside "
                f"the air, {float(most):.5g} W m^-2; got {float(direct):.5g} W m^-2."
            )
        # One wavelength will do, so that all share a compilation.
        short = eqx.tree_at(lambda x: x.wavelength, self, self.wavelength[:1])
        if not _excess(short) <= _MOST_EXCESS:
            raise ValueError(
                "`clearness` and `brightness` must be those of a measured sky; "
                f"got {float(self.clearness):.4g} and {float(self.brightness):.4g}, "
                "where under this sun most of the fit is below 0."
            )

    @classmethod
    def measured(
        cls,
        sun_zenith: ArrayLike,
        sun_azimuth: ArrayLike,
        direct: ArrayLike,
        diffuse: ArrayLike,
        wavelength: ArrayLike,
        distance: ArrayLike = 1.0,
        **rest,
    ) -> "Perez":
        """The sky of two readings in W m^-2.

        `direct` is what a plane facing the sun receives from it, `diffuse` what a level
        plane receives from the sky without the sun. `rest` is that of the class.
        """
        zenith, direct, diffuse = (
            as_float(x).astype(float) for x in (sun_zenith, direct, diffuse)
        )
        if not isinstance(diffuse, Tracer) and not diffuse > 0.0:
            raise ValueError(f"`diffuse` must be above 0 W m^-2; got {diffuse}.")
        apart = _ZENITH_FACTOR * zenith**3
        clearness = ((diffuse + direct) / diffuse + apart) / (1.0 + apart)
        outside = _SOLAR_CONSTANT / as_float(distance).astype(float) ** 2
        brightness = diffuse * _air_mass(zenith) / outside
        return cls(
            zenith,
            sun_azimuth,
            clearness,
            brightness,
            wavelength,
            distance=distance,
            **rest,
        )

    @property
    def irradiances(self) -> tuple[Number, Number]:
        """What `measured` was told: direct on a facing, diffuse on a level plane."""
        outside = _SOLAR_CONSTANT / self.distance**2
        diffuse = self.brightness * outside / _air_mass(self.sun_zenith)
        apart = _ZENITH_FACTOR * self.sun_zenith**3
        return diffuse * (self.clearness - 1.0) * (1.0 + apart), diffuse

    @property
    def illuminances(self) -> tuple[Number, Number]:
        """The same two in lux."""
        direct, diffuse = self.irradiances
        sun = self.sun_zenith
        one, across = jnp.ones_like(sun), jnp.exp(5.73 * sun - 5.0)
        log = jnp.log(self.brightness)
        for_sky = jnp.stack([one, self.water, jnp.cos(sun), log])
        for_sun = jnp.stack([one, self.water, across, self.brightness])
        of_sky = dot(self._row("sky"), for_sky)
        of_sun = jnp.maximum(dot(self._row("sun"), for_sun), 0.0)
        return direct * of_sun, diffuse * of_sky

    @property
    def coefficients(self) -> Float[Array, "5"]:
        """a to e of the formula."""
        bright = self.brightness
        # Radiance's remedy for middle skies, whose fit is wrong where they are dark.
        middle = (self.clearness > _DULL) & (self.clearness < _CLEAR)
        bright = jnp.where(middle, jnp.maximum(bright, 0.2), bright)
        sun, rows = self.sun_zenith, self._row("abcde")
        found = rows[:, 0] + rows[:, 1] * sun + bright * (rows[:, 2] + rows[:, 3] * sun)
        # Overcast skies have formulas of their own, not to be asked elsewhere.
        overcast = self.clearness < _DULL
        c, d = (jnp.where(overcast, x, 1.0) for x in (rows[2], rows[3]))
        dull_c = jnp.exp((bright * (c[0] + c[1] * sun)) ** c[2]) - c[3]
        dull_d = -jnp.exp(bright * (d[0] + d[1] * sun)) + d[2] + bright * d[3]
        dull = found.at[2].set(dull_c).at[3].set(dull_d)
        return jnp.where(overcast, dull, found)

    def relative(self, up: Cosine, turned: Versine) -> Number:
        """The formula: luminance in whatever unit, below 0 if that is."""
        a, b, c, d, e = self.coefficients
        cosine = 1.0 - turned
        grade = 1.0 + a * jnp.exp(b / jnp.maximum(up, _LEAST_RISE))
        glow = 1.0 + c * jnp.exp(d * angle_between(turned)) + e * cosine * cosine
        return grade * glow

    def parts(self, up: Cosine, turned: Versine) -> Float[Array, "part"]:
        look = lambda up, turned: self.relative(up, turned)[None]
        whole = hemisphere(look, self.sun_zenith)
        return jnp.maximum(look(up, turned) * (self.illuminances[1] / whole), 0.0)

    @property
    def basis(self) -> Float[Array, "part wl"]:
        return spectrum(self.temperature, self.wavelength)[None]

    @property
    def lights(self) -> tuple[Sun]:
        dtype = self.wavelength.dtype
        knots = jnp.asarray(np.linspace(DAYLIGHT.low, DAYLIGHT.high, 41), dtype)
        values = self.illuminances[0] * spectrum(self.temperature, knots)
        irradiance = Tabulated(knots, values, values[0], values[-1])
        radius = jnp.asarray(SOLAR_RADIUS, dtype) / self.distance
        return (Sun.at(self.sun_zenith, self.sun_azimuth, irradiance, radius),)

    def _row(self, name: str) -> Float[Array, "..."]:
        """The coefficients of that name in the bin of this clearness."""
        table = _table()
        bins = jnp.asarray(table["clearness"], self.clearness.dtype)
        row = jnp.clip(jnp.searchsorted(bins, self.clearness, side="right") - 1, 0)
        return jnp.asarray(table[name], self.clearness.dtype)[row]


@ft.cache
def _table() -> dict[str, np.ndarray]:
    table = data.read("perez")
    four = lambda name: np.stack([table[f"{name}{i}"] for i in range(1, 5)], -1)
    shape = np.stack([four(x) for x in "abcde"], 1)
    found = {"clearness": table["clearness"], "sky": four("sky"), "sun": four("sun")}
    return found | {"abcde": shape}


@eqx.filter_jit
def _excess(sky: Perez) -> Number:
    """How much more light there is than the sky should have, as none is below 0."""
    return hemisphere(sky.parts, sky.sun_zenith)[0] / sky.illuminances[1]


def _air_mass(zenith: Angle) -> Number:
    """Kasten 1966."""
    low = 93.885 - jnp.minimum(zenith / deg, 90.0)
    return 1.0 / (jnp.cos(jnp.minimum(zenith, 0.5 * math.pi)) + 0.15 * low**-1.253)
