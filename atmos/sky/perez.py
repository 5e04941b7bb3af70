"""Perez, Seals and Michalsky 1993, "All-weather model for sky luminance distribution".

With the luminous efficacies of Perez et al. 1990, "Modeling daylight availability".
"""

import math
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, ArrayLike, Float

from ..light import SOLAR_RADIUS, Sun
from ..quantity import Angle, as_float, Cosine, deg, Number, Versine, Wavelength
from ..spectrum import AbstractSpectrum, Tabulated
from ._daylight import D65, DAYLIGHT, spectrum, TEMPERATURES
from ._fitted import AbstractFittedSky, angle_between, hemisphere, set_parameters
from ._range import AbstractBeyond, degrees, Range, REFUSE


# Bins of clearness begin at these; table 1 of the paper has for each bin rows a to e of
# four coefficients.
_BINS = np.array([1.0, 1.065, 1.23, 1.5, 1.95, 2.8, 4.5, 6.2])
_SHAPE = np.array(
    [
        [
            [1.3525, -0.2576, -0.2690, -1.4366],
            [-0.7670, 0.0007, 1.2734, -0.1233],
            [2.8000, 0.6004, 1.2375, 1.0000],
            [1.8734, 0.6297, 0.9738, 0.2809],
            [0.0356, -0.1246, -0.5718, 0.9938],
        ],
        [
            [-1.2219, -0.7730, 1.4148, 1.1016],
            [-0.2054, 0.0367, -3.9128, 0.9156],
            [6.9750, 0.1774, 6.4477, -0.1239],
            [-1.5798, -0.5081, -1.7812, 0.1080],
            [0.2624, 0.0672, -0.2190, -0.4285],
        ],
        [
            [-1.1000, -0.2515, 0.8952, 0.0156],
            [0.2782, -0.1812, -4.5000, 1.1766],
            [24.7219, -13.0812, -37.7000, 34.8438],
            [-5.0000, 1.5218, 3.9229, -2.6204],
            [-0.0156, 0.1597, 0.4199, -0.5562],
        ],
        [
            [-0.5484, -0.6654, -0.2672, 0.7117],
            [0.7234, -0.6219, -5.6812, 2.6297],
            [33.3389, -18.3000, -62.2500, 52.0781],
            [-3.5000, 0.0016, 1.1477, 0.1062],
            [0.4659, -0.3296, -0.0876, -0.0329],
        ],
        [
            [-0.6000, -0.3566, -2.5000, 2.3250],
            [0.2937, 0.0496, -5.6812, 1.8415],
            [21.0000, -4.7656, -21.5906, 7.2492],
            [-3.5000, -0.1554, 1.4062, 0.3988],
            [0.0032, 0.0766, -0.0656, -0.1294],
        ],
        [
            [-1.0156, -0.3670, 1.0078, 1.4051],
            [0.2875, -0.5328, -3.8500, 3.3750],
            [14.0000, -0.9999, -7.1406, 7.5469],
            [-3.4000, -0.1078, -1.0750, 1.5702],
            [-0.0672, 0.4016, 0.3017, -0.4844],
        ],
        [
            [-1.0000, 0.0211, 0.5025, -0.5119],
            [-0.3000, 0.1922, 0.7023, -1.6317],
            [19.0000, -5.0000, 1.2438, -1.9094],
            [-4.0000, 0.0250, 0.3844, 0.2656],
            [1.0468, -0.3788, -2.4517, 1.4656],
        ],
        [
            [-1.0500, 0.0289, 0.4260, 0.3590],
            [-0.3250, 0.1156, 0.7781, 0.0025],
            [31.0625, -14.5000, -46.1148, 55.3750],
            [-7.2312, 0.4050, 13.3500, 0.6234],
            [1.5000, -0.6426, 1.8564, 0.5636],
        ],
    ]
)
# Luminous efficacy, lm/W, of what comes from the sky: a constant, and factors of the
# water vapour in cm, of the cosine of the sun's zenith angle, of the logarithm of the
# brightness.
_DIFFUSE = np.array(
    [
        [97.24, -0.46, 12.00, -8.91],
        [107.22, 1.15, 0.59, -3.95],
        [104.97, 2.96, -5.53, -8.77],
        [102.39, 5.59, -13.95, -13.90],
        [100.71, 5.94, -22.75, -23.74],
        [106.42, 3.83, -36.15, -28.83],
        [141.88, 1.90, -53.24, -14.03],
        [152.23, 0.35, -45.27, -7.98],
    ]
)
# The same of what comes from the sun: a constant, and factors of the water vapour, of
# exp(5.73 zenith angle - 5), and of the brightness.
_DIRECT = np.array(
    [
        [57.20, -4.55, -2.98, 117.12],
        [98.99, -3.46, -1.21, 12.38],
        [109.83, -4.90, -1.71, -8.81],
        [110.34, -5.84, -1.99, -4.56],
        [106.36, -3.97, -1.75, -6.16],
        [107.19, -1.25, -1.51, -26.73],
        [105.75, 0.77, -1.26, -34.44],
        [101.18, 1.58, -1.10, -8.29],
    ]
)
_SOLAR_CONSTANT = 1367.0  # W m^-2
_ZENITH_FACTOR = 1.041
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
    `ValueError` outside `ranges`, unless `beyond` is `Clamp()`, and for a sun
    stronger than outside the air.
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
        direct = self.irradiances[0]
        most = _SOLAR_CONSTANT / self.distance**2
        if not isinstance(direct, Tracer) and not direct <= most:
            raise ValueError(
                "`clearness` and `brightness` must leave the sun weaker than outside "
                f"the air, {float(most):.5g} W m^-2; got {float(direct):.5g} W m^-2."
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
        of_sky = jnp.dot(self._row(_DIFFUSE), for_sky)
        of_sun = jnp.maximum(jnp.dot(self._row(_DIRECT), for_sun), 0.0)
        return direct * of_sun, diffuse * of_sky

    @property
    def coefficients(self) -> Float[Array, "5"]:
        """a to e of the formula."""
        bright = self.brightness
        # Radiance's remedy for middle skies, whose fit is wrong where they are dark.
        middle = (self.clearness > 1.065) & (self.clearness < 2.8)
        bright = jnp.where(middle, jnp.maximum(bright, 0.2), bright)
        sun, rows = self.sun_zenith, self._row(_SHAPE)
        found = rows[:, 0] + rows[:, 1] * sun + bright * (rows[:, 2] + rows[:, 3] * sun)
        c, d = rows[2], rows[3]
        dull_c = jnp.exp((bright * (c[0] + c[1] * sun)) ** c[2]) - c[3]
        dull_d = -jnp.exp(bright * (d[0] + d[1] * sun)) + d[2] + bright * d[3]
        dull = found.at[2].set(dull_c).at[3].set(dull_d)
        return jnp.where(self.clearness < float(_BINS[1]), dull, found)

    def relative(self, up: Cosine, turned: Versine) -> Number:
        """The formula: luminance in whatever unit."""
        a, b, c, d, e = self.coefficients
        cosine = 1.0 - turned
        grade = 1.0 + a * jnp.exp(b / jnp.maximum(up, _LEAST_RISE))
        glow = 1.0 + c * jnp.exp(d * angle_between(turned)) + e * cosine * cosine
        return jnp.maximum(grade * glow, 0.0)

    def parts(self, up: Cosine, turned: Versine) -> Float[Array, "part"]:
        look = lambda up, turned: self.relative(up, turned)[None]
        whole = hemisphere(look, self.sun_zenith)
        return look(up, turned) * (self.illuminances[1] / whole)

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

    def _row(self, table: np.ndarray) -> Float[Array, "..."]:
        bins = jnp.asarray(_BINS, self.clearness.dtype)
        row = jnp.clip(jnp.searchsorted(bins, self.clearness, side="right") - 1, 0)
        return jnp.asarray(table, self.clearness.dtype)[row]


def _air_mass(zenith: Angle) -> Number:
    """Kasten 1966."""
    low = 93.885 - jnp.minimum(zenith / deg, 90.0)
    return 1.0 / (jnp.cos(jnp.minimum(zenith, 0.5 * math.pi)) + 0.15 * low**-1.253)
