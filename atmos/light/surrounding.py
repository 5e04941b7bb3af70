import math

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Integer

from ..geometry import FAR
from ..quantity import (
    Angle,
    as_float,
    Direction,
    Number,
    Position,
    Radiance,
    Wavelength,
)
from ..spectrum import ends
from ._base import AbstractLight, Shine


# Where a picture is so dark, relative to its mean, it is never looked at on purpose.
_DARK = 1e-9


class Surrounding(AbstractLight):
    """What lies all around the world, infinitely far away: a picture of all directions.

    `picture` is the radiance in the pixels of a `LatLong` whose centre is at an azimuth
    `centre`, at the rising wavelengths `knots`; between them there are straight lines.
    It is seen behind the world, pixel by pixel. Raises `ValueError` for a radiance that
    is below 0 or not finite.
    """

    picture: Float[Array, "height width knot"]
    knots: Float[Array, "knot"]
    centre: Angle
    rows: Float[Array, "height"]
    columns: Float[Array, "height width"]

    def __init__(self, picture: ArrayLike, knots: ArrayLike, centre: ArrayLike = 0.0):
        self.picture, self.knots = as_float(picture), as_float(knots)
        self.centre = as_float(centre)
        if self.picture.ndim != 3 or self.picture.shape[2:] != self.knots.shape:
            raise ValueError(
                "`picture` must have rows, columns and as many channels as `knots`; "
                f"got shapes {self.picture.shape} and {self.knots.shape}."
            )
        known = np.asarray(self.picture, float)
        bad = ~(np.isfinite(known) & (known >= 0.0))
        if np.any(bad):
            first = tuple(int(x) for x in np.argwhere(bad)[0])
            raise ValueError(
                f"`picture` must be 0 or above and finite; got {list(first)} = "
                f"{known[first]}."
            )
        # The share of all light that comes from the rows up to each, and of that of a
        # row from the pixels up to each.
        light = known.mean(2) + _DARK * max(known.mean(), 1e-30)
        edges = np.cos(np.linspace(0.0, math.pi, len(known) + 1))
        rows = np.cumsum(light.mean(1) * (edges[:-1] - edges[1:]))
        columns = np.cumsum(light, 1)
        self.rows = jnp.asarray(rows / rows[-1], self.picture.dtype)
        shares = columns / columns[:, -1:]
        self.columns = jnp.asarray(shares, self.picture.dtype)

    @property
    def domain(self) -> tuple[float, float]:
        """The wavelengths between which this is known, in nm."""
        if self.knots.size == 1:
            return 0.0, math.inf
        return ends(self.knots)

    @property
    def backdrop(self) -> bool:
        return True

    def sample(
        self, position: Position, u: Float[Array, "2"], wavelength: Wavelength
    ) -> Shine:
        height, width = self.columns.shape
        row, down = _draw(self.rows, u[0])
        column, along = _draw(self.columns[row], u[1])
        above = row.astype(down.dtype) * (math.pi / height)
        top, bottom = jnp.cos(above), jnp.cos(above + math.pi / height)
        z = top + down * (bottom - top)
        across = (column.astype(along.dtype) + along) * (2.0 * math.pi / width)
        azimuth = self.centre - math.pi + across
        level = jnp.sqrt(jnp.maximum(1.0 - z * z, 0.0))
        ahead = [level * jnp.sin(azimuth), level * jnp.cos(azimuth), z]
        solid_angle = self._solid_angle(row, column)
        return Shine(
            direction=jnp.stack(ahead),
            distance=jnp.full_like(z, FAR),
            irradiance=self._pixel(row, column, wavelength) * solid_angle,
            solid_angle=solid_angle,
        )

    def radiance(self, direction: Direction, wavelength: Wavelength) -> Radiance:
        return self._pixel(*self._where(direction), wavelength)

    def solid_angle(self, direction: Direction) -> Number:
        return self._solid_angle(*self._where(direction))

    def _where(
        self, direction: Direction
    ) -> tuple[Integer[Array, ""], Integer[Array, ""]]:
        height, width = self.columns.shape
        east, north, up = direction
        level = jnp.sqrt(east * east + north * north)
        row = jnp.arctan2(level, up) * (height / math.pi)
        turn = jnp.arctan2(east, north) - self.centre + math.pi
        column = jnp.remainder(turn, 2.0 * math.pi) * (width / (2.0 * math.pi))
        low = lambda x, most: jnp.clip(x.astype(jnp.int32), 0, most - 1)
        return low(row, height), low(column, width)

    def _pixel(
        self, row: Integer[Array, ""], column: Integer[Array, ""], nm: Wavelength
    ) -> Radiance:
        return jnp.interp(nm, self.knots, self.picture[row, column])

    def _solid_angle(
        self, row: Integer[Array, ""], column: Integer[Array, ""]
    ) -> Number:
        """Of a pixel, over the chance to look at it."""
        height, width = self.columns.shape
        middle = (row.astype(self.rows.dtype) + 0.5) * (math.pi / height)
        whole = 4.0 * math.pi / width * math.sin(0.5 * math.pi / height)
        chance = _share(self.rows, row) * _share(self.columns[row], column)
        return whole * jnp.sin(middle) / jnp.maximum(chance, 1e-12)


def _share(upto: Float[Array, "n"], index: Integer[Array, ""]) -> Number:
    below = jnp.where(index > 0, upto[jnp.maximum(index - 1, 0)], 0.0)
    return upto[index] - below


def _draw(upto: Float[Array, "n"], u: Number) -> tuple[Integer[Array, ""], Number]:
    """Which part a number from 0 to 1 lies in, and how far on in it."""
    index = jnp.searchsorted(upto, u, side="right", method="scan_unrolled")
    index = jnp.minimum(index, upto.shape[0] - 1).astype(jnp.int32)
    share = _share(upto, index)
    within = (u - (upto[index] - share)) / jnp.where(share > 0.0, share, 1.0)
    return index, jnp.clip(within, 0.0, 1.0)
