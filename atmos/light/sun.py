import datetime
import math

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from ..geometry import FAR
from ..quantity import (
    Angle,
    as_float,
    deg,
    Direction,
    Irradiance,
    Number,
    Position,
    Radiance,
    Versine,
    versine,
    Wavelength,
)
from ..reference import solar_irradiance
from ..rotation import around
from ..spectrum import AbstractSpectrum, as_spectrum, BandAverage
from ._base import AbstractLight, Shine


SOLAR_RADIUS = 0.26656 * deg  # 959.63 arcseconds, seen from 1 astronomical unit

# Neckel 2005, Solar Physics 229, 13: brightness towards the limb, relative to the
# centre, is the sum over k of (a + b / w + c / w^5) mu^k, with w in um; from w on,
# until the next.
_LIMB = [
    (
        0.300,
        [0.35601, 1.11529, -0.67237, 0.18696, 0.00038, 0.01373],
        [-0.085217, 0.085217, 0.0, 0.0, 0.0, 0.0],
        [0.0, -0.001871, 0.003589, -0.002415, 0.000897, -0.000200],
    ),
    (
        0.385,
        [0.09900, 1.96884, -2.80511, 3.32780, -2.17878, 0.58825],
        [0.010643, -0.010643, 0.0, 0.0, 0.0, 0.0],
        [0.0, -0.009166, 0.024873, -0.029317, 0.018273, -0.004663],
    ),
    (
        0.42257,
        [0.75267, 0.93874, -1.89287, 2.42234, -1.71150, 0.49062],
        [-0.265577, 0.265577, 0.0, 0.0, 0.0, 0.0],
        [0.0, -0.004095, 0.012582, -0.017117, 0.011977, -0.003347],
    ),
]


class Sun(AbstractLight):
    """A disk at infinity, darker towards its limb, the more so the shorter the wave.

    `irradiance` is that of a plane that faces it outside the air, in W m^-2 nm^-1. With
    `angular_radius` 0 it is a point: it shines, but is not seen.
    """

    direction: Direction = eqx.field(converter=as_float)
    irradiance: AbstractSpectrum = eqx.field(converter=as_spectrum)
    angular_radius: Angle = eqx.field(converter=as_float, default=SOLAR_RADIUS)

    @classmethod
    def at(
        cls,
        zenith: ArrayLike,
        azimuth: ArrayLike,
        irradiance: AbstractSpectrum,
        angular_radius: ArrayLike = SOLAR_RADIUS,
    ) -> "Sun":
        """A sun at a zenith angle and an azimuth clockwise from north, both in rad."""
        zenith, azimuth = as_float(zenith), as_float(azimuth)
        level = jnp.sin(zenith)
        direction = [
            level * jnp.sin(azimuth),
            level * jnp.cos(azimuth),
            jnp.cos(zenith),
        ]
        return cls(jnp.stack(direction), irradiance, angular_radius)

    @property
    def horizontal(self) -> Float[Array, "2"]:
        """East and north of the unit vector on the ground that points towards the
        sun."""
        east, north, _ = self.direction
        squared = east * east + north * north
        aside = squared > 0.0
        level = jnp.sqrt(jnp.where(aside, squared, 1.0))
        return jnp.stack(
            [jnp.where(aside, east / level, 0.0), jnp.where(aside, north / level, 1.0)]
        )

    @property
    def zenith(self) -> Angle:
        """The angle between the sun and straight up at the origin."""
        east, north = self.horizontal
        level = east * self.direction[0] + north * self.direction[1]
        return jnp.arctan2(level, self.direction[2])

    @property
    def azimuth(self) -> Angle:
        """Clockwise from north, as seen from the origin; 0 for a sun in the zenith."""
        east, north = self.horizontal
        return jnp.arctan2(east, north)

    def sample(
        self, position: Position, u: Float[Array, "2"], wavelength: Wavelength
    ) -> Shine:
        # Seen on the sphere, rings of the disk have areas in proportion to the versine.
        apart = self._widest * u[0]
        return Shine(
            direction=around(self.direction, apart, 2.0 * math.pi * u[1]),
            distance=jnp.full_like(apart, FAR),
            irradiance=self._brightness(u[0], wavelength),
            solid_angle=2.0 * math.pi * self._widest,
        )

    def radiance(self, direction: Direction, wavelength: Wavelength) -> Radiance:
        """The brightness of the disk in a direction, outside the air; 0 beside it."""
        widest = jnp.maximum(self._widest, _TINY)
        share = versine(direction, self.direction) / widest
        even = self._brightness(jnp.minimum(share, 1.0), wavelength)
        return jnp.where(share < 1.0, even / (2.0 * math.pi * widest), 0.0)

    def solid_angle(self, direction: Direction) -> Number:
        return 2.0 * math.pi * self._widest

    @property
    def _widest(self) -> Versine:
        return 2.0 * jnp.sin(0.5 * self.angular_radius) ** 2

    def _brightness(self, share: Number, wavelength: Wavelength) -> Irradiance:
        """What it would shine if all were as bright as it is where a share of the disk
        lies nearer to its middle."""
        squared = 1.0 - share
        inside = squared > 0.0
        cosine = jnp.where(inside, jnp.sqrt(jnp.where(inside, squared, 1.0)), 0.0)
        coefficients = limb_darkening(wavelength)
        shape = jnp.zeros_like(wavelength)
        for each in coefficients[::-1]:
            shape = shape * cosine + each
        return self.irradiance.evaluate(wavelength) * shape / _mean(coefficients)

    def slice(self, height: Number, wavelength: Wavelength) -> Float[Array, "wl"]:
        """The share of the irradiance that comes from a strip across the disk.

        Per unit of `height`, which is counted in radii from the centre: its integral
        from -1 to 1 is 1.
        """
        coefficients = limb_darkening(wavelength)
        squared = 1.0 - height * height
        inside = squared > 0.0
        half = jnp.where(inside, jnp.sqrt(jnp.where(inside, squared, 1.0)), 0.0)
        # A strip of half-width s integrates s^(k + 1) cos^(k + 1) over half a turn.
        chords = [_CHORDS[k] * half ** (k + 1) for k in range(6)]
        total = jnp.sum(coefficients * jnp.stack(chords)[:, None], 0)
        return total / (math.pi * _mean(coefficients))


_TINY = 1e-30
_CHORDS = [
    math.sqrt(math.pi) * math.gamma(k / 2 + 1) / math.gamma(k / 2 + 1.5)
    for k in range(6)
]


def limb_darkening(wavelength: Wavelength) -> Float[Array, "6 wl"]:
    """The coefficients of brightness on the sun's disk as a polynomial.

    Its variable is the cosine of the angle at which one looks into the sun, 1 in the
    middle and 0 at the limb; in the middle the brightness is 1. Known from 300 to 1100
    nm (Neckel 2005), and held from there on.
    """
    w = jnp.clip(wavelength, 300.0, 1100.0)[None, :] / 1000.0
    found = jnp.zeros_like(w)
    for start, *terms in _LIMB:
        a, b, c = (jnp.asarray(x, w.dtype)[:, None] for x in terms)
        found = jnp.where(w >= start, a + b / w + c / w**5, found)
    return found


def _mean(coefficients: Float[Array, "6 wl"]) -> Float[Array, "wl"]:
    """The mean brightness of the disk, relative to its centre."""
    weights = [2.0 / (k + 2.0) for k in range(6)]
    return jnp.sum(coefficients * jnp.array(weights, coefficients.dtype)[:, None], 0)


def sunlight(bandwidth: ArrayLike = 10.0, distance: ArrayLike = 1.0) -> BandAverage:
    """The sun's spectrum outside the air, in W m^-2 nm^-1 (ASTM G173-03).

    Averaged over bands of `bandwidth` nm, at a `distance` in astronomical units: 1.524
    is that of Mars.
    """
    wavelength, irradiance = solar_irradiance()
    return BandAverage(wavelength, irradiance / distance**2, bandwidth)


def ephemeris(
    moment: datetime.datetime, latitude: float, longitude: float
) -> tuple[float, float, float]:
    """Where the sun stands: zenith angle, azimuth from north (rad), distance (au).

    For a place given in degrees north and east. A `moment` without a time zone is UTC.
    Refraction is left out, as everywhere here. Agrees with NREL's algorithm (Reda and
    Andreas 2004) to 4e-4 degrees. Raises `ValueError` for a place that is not on Earth.
    """
    import ephem

    for name, value, most in [
        ("latitude", latitude, 90.0),
        ("longitude", longitude, 360.0),
    ]:
        if not -most <= value <= most:
            raise ValueError(
                f"`{name}` must lie between {-most} and {most}; got {value}."
            )
    place = ephem.Observer()
    place.lat, place.lon = math.radians(latitude), math.radians(longitude)
    place.pressure = 0.0
    if moment.tzinfo is not None:
        moment = moment.astimezone(datetime.UTC).replace(tzinfo=None)
    place.date = ephem.Date(moment)
    sun = ephem.Sun(place)
    return math.pi / 2 - float(sun.alt), float(sun.az), float(sun.earth_distance)
