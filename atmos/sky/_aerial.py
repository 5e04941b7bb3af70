"""The air between things, after Preetham, Shirley and Smits 1999 (section 4)."""

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..quantity import (
    Angle,
    deg,
    Direction,
    Fraction,
    Irradiance,
    km,
    Length,
    Number,
    Position,
    Radiance,
    Wavelength,
)
from ..transport import contract, gauss_legendre
from ._fitted import AbstractFittedSky, angle_between, straight


MOLECULES, HAZE = 0.1136 / km, 0.8333 / km  # how fast they thin out upwards
_NUMBER = 2.545e25  # molecules per m^3 at the ground
_ANISOTROPY = 1.06
# The square of n^2 - 1 of air, n its refractive index, in 1e-7.
_REFRACTION = np.array(
    [
        (380.0, 3.2255),
        (400.0, 3.1989),
        (450.0, 3.1486),
        (500.0, 3.1137),
        (550.0, 3.0884),
        (600.0, 3.0694),
        (650.0, 3.0547),
        (700.0, 3.0432),
        (750.0, 3.0340),
        (780.0, 3.0293),
    ]
)
# How haze of Junge's exponent 4 scatters (Bullrich 1964): angles in degrees, and the
# function eta at each, at these wavelengths. The logarithm is on straight lines.
_WAVELENGTHS = np.array([400.0, 450.0, 550.0, 650.0, 850.0])
_ANGLES = np.array([1, 4, 7, 10, 30, 60, 80, 90, 110, 120, 130, 150, 180], float)
_ETA = np.array(
    [
        [4.192, 4.193, 4.177, 4.147, 4.072],
        [3.311, 3.319, 3.329, 3.335, 3.339],
        [2.860, 2.868, 2.878, 2.883, 2.888],
        [2.518, 2.527, 2.536, 2.542, 2.547],
        [1.122, 1.129, 1.138, 1.142, 1.147],
        [0.3324, 0.3373, 0.3433, 0.3467, 0.3502],
        [0.1644, 0.1682, 0.1730, 0.1757, 0.1785],
        [0.1239, 0.1275, 0.1320, 0.1346, 0.1373],
        [0.08734, 0.09111, 0.09591, 0.09871, 0.10167],
        [0.08242, 0.08652, 0.09179, 0.09488, 0.09816],
        [0.08313, 0.08767, 0.09352, 0.09697, 0.10065],
        [0.09701, 0.1024, 0.1095, 0.1137, 0.1182],
        [0.1307, 0.1368, 0.1447, 0.1495, 0.1566],
    ]
)
_TOTAL = np.array([0.6596, 0.6694, 0.6817, 0.6885, 0.6959])  # over eta times the sine
_ALONG, _AROUND = 32, 24


class Air(NamedTuple):
    """What scatters at the ground, in m^-1, and eta over the angles of its table."""

    molecules: Float[Array, "wl"]
    haze: Float[Array, "wl"]
    forward: Float[Array, "wl"]  # haze per sr and unit of eta, in m^-1
    log_eta: Float[Array, "angle wl"]

    def scattered(self, angle: Angle) -> Float[Array, "2 wl"]:
        """What molecules and haze scatter into an angle, in m^-1 sr^-1."""
        dtype = angle.dtype
        eta = jnp.exp(
            jax.vmap(
                lambda row: jnp.interp(angle / deg, jnp.asarray(_ANGLES, dtype), row)
            )(self.log_eta.T)
        )
        cosine = jnp.cos(angle)
        rayleigh = 0.25 * 0.7629 / math.pi * (1.0 + 0.9324 * cosine * cosine)
        return jnp.stack([rayleigh * self.molecules, self.forward * eta])


def haze(turbidity: Number, wavelength: Wavelength) -> Air:
    """The air of a turbidity."""
    um = 1e-3 * wavelength
    at = lambda knots, rows: contract(
        "...n,nl->...l", jnp.asarray(rows, um.dtype), straight(knots, wavelength)
    )
    squared = 1e-7 * at(*_REFRACTION.T)
    # Lengths are in um where they are raised to powers, so that numbers stay near 1.
    crowd = 1e24 / _NUMBER
    molecules = 8.0 * math.pi**3 * squared * _ANISOTROPY * crowd / (3.0 * um**4)
    concentration = (0.6544 * turbidity - 0.6510) * 1e-6
    forward = 0.217 * concentration * (2.0 * math.pi / um) ** 2
    total = 2.0 * math.pi * forward * at(_WAVELENGTHS, _TOTAL)
    return Air(molecules, total, forward, at(_WAVELENGTHS, np.log(_ETA)))


def airlight(
    sky: AbstractFittedSky,
    air: Air,
    sun: Direction,
    beam: Irradiance,
    position: Position,
    direction: Direction,
    distance: Length,
) -> tuple[Fraction, Radiance]:
    """The transmittance of a piece of air, and the radiance that it adds."""
    turned = jnp.sum((direction - sun) ** 2) * 0.5
    sunny = beam[None] * air.scattered(angle_between(turned))
    turning = sunny + _ambient(sky, air, direction)
    thinning = jnp.asarray([MOLECULES, HAZE], distance.dtype)
    at_ground = jnp.stack([air.molecules, air.haze])
    start = jnp.exp(-thinning * position[2])
    slope = thinning * direction[2]

    def depth(length):
        x = slope * length
        level = jnp.abs(x) < 1e-4
        mean = jnp.where(level, 1.0 - 0.5 * x, -jnp.expm1(-x) / jnp.where(level, 1, x))
        return contract("k,kl->l", start * mean * length, at_ground)

    def added(u, w):
        # Nodes crowd at the observer.
        length = distance * u * u
        density = start * jnp.exp(-slope * length)
        seen = contract("k,kl->l", density, turning) * jnp.exp(-depth(length))
        return 2.0 * u * w * distance * seen

    u, w = (jnp.asarray(x, distance.dtype) for x in gauss_legendre(_ALONG))
    return jnp.exp(-depth(distance)), jnp.sum(jax.vmap(added)(u, w), 0)


def _ambient(
    sky: AbstractFittedSky, air: Air, direction: Direction
) -> Float[Array, "2 wl"]:
    """What the sky sends into a view, per m of molecules and haze at the ground."""
    u, w = (jnp.asarray(x, direction.dtype) for x in gauss_legendre(_AROUND))
    turn = (jnp.arange(2 * _AROUND, dtype=u.dtype) + 0.5) * (math.pi / _AROUND)

    def one(up, weight, azimuth):
        level = jnp.sqrt(1.0 - up * up)
        towards = jnp.stack([level * jnp.sin(azimuth), level * jnp.cos(azimuth), up])
        seen = sky.radiance(jnp.zeros_like(towards), towards)
        turned = 0.5 * jnp.sum((towards - direction) ** 2)
        weight = weight * (math.pi / _AROUND)
        return weight * seen[None] * air.scattered(angle_between(turned))

    rings = jax.vmap(jax.vmap(one, (None, None, 0)), (0, 0, None))(u, w, turn)
    return jnp.sum(rings, (0, 1))
