import functools as ft

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..geometry import AbstractPath, Point
from ..quantity import Number
from ._base import AbstractProfile, crossings


# US Standard Atmosphere 1976, tables 2 and 4: the geopotential altitudes (m) at which
# the lapse rate (K/m) changes; above the last the air goes on at the same temperature.
_BASE = np.array([0.0, 11e3, 20e3, 32e3, 47e3, 51e3, 71e3, 84.852e3])
_LAPSE = np.array([-6.5e-3, 0.0, 1e-3, 2.8e-3, 0.0, -2.8e-3, -2e-3, 0.0])
_RADIUS = 6_356_766.0  # m, effective
_PULL = 9.80665 * 0.0289644 / 8.31432  # K/m
_TEMPERATURE = 288.15 + np.concatenate([[0.0], np.cumsum(_LAPSE[:-1] * np.diff(_BASE))])

SEA_LEVEL = 101_325.0 / (1.380622e-23 * 288.15)  # m^-3, molecules


def _log1p_over(x):
    """log(1 + x) / x, which is 1 at 0."""
    small = abs(x) < 1e-4
    safe = jnp.where(small, 1.0, x)
    return jnp.where(small, 1.0 - 0.5 * x + x * x / 3.0, jnp.log1p(safe) / safe)


def _log_density_at_bases():
    steps, temperature = np.diff(_BASE), _TEMPERATURE[:-1]
    x = _LAPSE[:-1] * steps / temperature
    ratio = np.where(x == 0.0, 1.0, np.log1p(x) / np.where(x == 0.0, 1.0, x))
    falls = _PULL / temperature * steps * ratio + np.log1p(x)
    return -np.concatenate([[0.0], np.cumsum(falls)])


_TABLES = (_BASE, _LAPSE, _TEMPERATURE, _log_density_at_bases())


class StandardAtmosphere(AbstractProfile):
    """The number density of air relative to sea level (US Standard Atmosphere 1976)."""

    def density(self, point: Point) -> Number:
        h = point.altitude
        geopotential = h * (_RADIUS / (_RADIUS + h))
        # A chain of selections, not an index: this is the innermost loop of all.
        passed = [geopotential > base for base in _BASE[1:].tolist()]
        base, lapse, temperature, start = (
            ft.reduce(
                lambda below, layer: jnp.where(layer[0], layer[1], below),
                zip(passed, table[1:], strict=True),
                jnp.full_like(h, table[0]),
            )
            for table in map(np.ndarray.tolist, _TABLES)
        )
        x = lapse * (geopotential - base) / temperature
        fall = _PULL / temperature * (geopotential - base) * _log1p_over(x)
        return jnp.exp(start - fall - jnp.log1p(x))

    @property
    def levels(self) -> Float[Array, "n"]:
        h = _BASE[1:] * _RADIUS / (_RADIUS - _BASE[1:])
        return jnp.asarray(h)

    def breaks(self, path: AbstractPath) -> Float[Array, "n"]:
        return crossings(path, self.levels.astype(path.start.altitude.dtype))
