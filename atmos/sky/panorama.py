"""A sky as seen from one place: a table that is quick to look up."""

import dataclasses
import functools as ft
import math
import operator
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..phase import AbstractPhaseFunction
from ..polarisation import vibration_at
from ..quantity import Angle, deg, km, Wavelength
from ..transport import contract
from ._base import AbstractPanorama


# Rings keep this far off the horizon, so that rounding leaves no doubt on which side.
_SLIVER = 1e-5
# Rings that a cubic needs.
_FEWEST = 4
# How much finer a grid is that is joined by straight lines; azimuths on it, at least.
_FINER, _FINEST = 4, 33


class Resolution(eqx.Module):
    """How many rings lie above and below the horizon; azimuths on half of each.

    One azimuth in `every` is enough for light that turned once, a single one where
    `every` is no less than `around`. Rings above the horizon lie at the powers
    `crowded` of even steps.
    """

    above: int = eqx.field(static=True)
    below: int = eqx.field(static=True)
    around: int = eqx.field(static=True)
    every: int = eqx.field(static=True, default=1)
    crowded: int = eqx.field(static=True, default=3)


# What is enough up to which zenith angle of the light.
_ENOUGH = [
    (80.0 * deg, Resolution(48, 32, 5)),
    (88.0 * deg, Resolution(96, 48, 17)),
    (90.0 * deg, Resolution(96, 48, 33)),
    # The planet's shadow has an edge among what one sees: where the light stands about
    # level, between there and the horizon, which from near the ground are close by.
    (90.1 * deg, Resolution(384, 48, 65, crowded=5)),
    (math.inf, Resolution(192, 48, 65, crowded=5)),
]
_HIGH = 20.0 * km  # from here on up the thick air is a thin line


def fine_enough(
    altitude: float, lowest: float, around: int, flat: bool = False
) -> Resolution:
    """The grid that shows a sky to about 1e-3.

    For an observer's altitude in m, and the zenith angle of the lowest light, in rad,
    as it is where the horizon is; with no fewer azimuths than `around`. In a flat world
    air is lit alike in all azimuths.
    """
    size = next(size for most, size in _ENOUGH if lowest <= most)
    if altitude > _HIGH:
        size = Resolution(192, 48, max(2 * size.around - 1, 17))
    if altitude <= 0.0:  # of the ground one sees but where one stands
        size = dataclasses.replace(size, below=_FEWEST)
    every = max((around - 1) // (size.around - 1), 1)
    around = max(size.around, around)
    every = every if (around - 1) % every == 0 else 1
    return dataclasses.replace(size, around=around, every=around if flat else every)


class Grid(eqx.Module):
    """Directions: rings of equal zenith angle, and azimuths on them.

    Rings crowd at the horizon, most of all below it, where the ground is soon near; and
    at the edge of the air if that is seen from outside. Azimuths run from that of the
    light to the opposite one, since the other half of the sky is alike.
    """

    first: Angle  # the highest ring: what is above it is black
    horizon: Angle
    resolution: Resolution

    def zeniths(self) -> Float[Array, "ring"]:
        """The zenith angle of each ring, from the highest to the lowest."""
        dtype = self.horizon.dtype
        up = jnp.linspace(1.0, 0.0, self.resolution.above, dtype=dtype)
        up = up**self.resolution.crowded
        up = jnp.where(self.first > 0.0, up * (2.0 - up), up)
        down = jnp.linspace(0.0, 1.0, self.resolution.below, dtype=dtype) ** 5
        top, bottom = self.horizon - _SLIVER, self.horizon + _SLIVER
        return jnp.concatenate(
            [top - (top - self.first) * up, bottom + (math.pi - bottom) * down]
        )

    def azimuths(self) -> Float[Array, "around"]:
        """The azimuths on each ring, relative to that of the light."""
        return jnp.linspace(
            0.0, math.pi, self.resolution.around, dtype=self.horizon.dtype
        )

    def ring(self, zenith: Float[Array, "*n"]) -> Float[Array, "*n"]:
        """Where a zenith angle lies among the rings, counted from 0."""
        top, bottom = self.horizon - _SLIVER, self.horizon + _SLIVER
        up = (top - zenith) / jnp.maximum(top - self.first, _SLIVER)
        rest = jnp.maximum(1.0 - up, 0.0)
        up = jnp.where(self.first > 0.0, up / (1.0 + _root(rest, jnp.sqrt)), up)
        up = _root(up, lambda x: x ** (1.0 / self.resolution.crowded))
        down = _root((zenith - bottom) / (math.pi - bottom), lambda x: x**0.2)
        return jnp.where(
            zenith > self.horizon,
            self.resolution.above + down * (self.resolution.below - 1),
            (1.0 - up) * (self.resolution.above - 1),
        )

    def side(self, azimuth: Float[Array, "*n"]) -> Float[Array, "*n"]:
        """Where a relative azimuth lies on its ring, counted from 0."""
        turn = jnp.abs(jnp.remainder(azimuth + math.pi, 2.0 * math.pi) - math.pi)
        return turn * ((self.resolution.around - 1) / math.pi)


def _root(x: Array, function: Callable[[Array], Array]) -> Array:
    inside = x > 1e-20
    return jnp.where(inside, function(jnp.where(inside, x, 1.0)), 0.0)


def _cubic(
    x: Float[Array, "*n"], low: Array | float, high: Array | float
) -> tuple[Int[Array, "*n"], Float[Array, "*n 4"]]:
    """The first of four places, from `low` to `high`, around x; Lagrange's weights."""
    first = jnp.clip(jnp.floor(jax.lax.stop_gradient(x)) - 1.0, low, high - 3.0)
    a, b, c, d = (x - first - float(k) for k in range(4))
    weights = [-b * c * d / 6.0, a * c * d / 2.0, -a * b * d / 2.0, a * b * c / 6.0]
    return first.astype(int), jnp.stack(weights, -1)


def _matrix(
    first: Int[Array, "n"], weights: Float[Array, "n 4"], count: int
) -> Float[Array, "n {count}"]:
    """The same weights among all places: a product is quicker than a look-up."""
    place = jnp.arange(count)[None, :, None] - first[:, None, None]
    taken = place == jnp.arange(4)[None, None, :]
    return jnp.sum(jnp.where(taken, weights[:, None, :], 0.0), -1)


class Panorama(AbstractPanorama):
    """The light that arrives at one place, as a table of directions.

    For each light, `table` holds the radiance on a grid of directions, in parts: one
    for each phase function, which is put on only when looked up and so stays exact, and
    a last one that has none; or three, I, Q and U, where light is polarised.
    """

    grid: Grid
    table: Float[Array, "light ring around part channel"]
    light_zenith: Float[Array, "light"]
    light_azimuth: Float[Array, "light"]
    phases: tuple[AbstractPhaseFunction, ...]
    wavelength: Wavelength

    def radiance(
        self,
        zenith: Float[Array, "#height #width"],
        azimuth: Float[Array, "#height #width"],
    ) -> Float[Array, "height width channel"]:
        """The radiance from each direction of a picture, in W m^-2 sr^-1 nm^-1.

        Angles in rad, azimuth clockwise from north. Where the pixels of a row share
        their zenith angle, and those of a column their azimuth, it lies on a cubic
        through the directions of the grid; elsewhere on straight lines, for which see
        `finer`.
        """
        shape = jnp.broadcast_shapes(zenith.shape, azimuth.shape)
        total = jnp.zeros((*shape, self.table.shape[-1]), self.table.dtype)
        look = self._look_up(zenith, azimuth)
        table = self.table[..., : len(self.phases) + 1, :]
        for i in range(self.table.shape[0]):
            relative = azimuth - self.light_azimuth[i]
            turned = versine_between(zenith, self.light_zenith[i], relative)
            total += look(table[i], zenith, relative, self._weights(turned))
        # Between a lit place and a dark one a cubic may swing below nothing.
        least = jnp.where(jnp.min(table, initial=0.0) < 0.0, -math.inf, 0.0)
        visible = (zenith >= self.grid.first)[..., None]
        return jnp.where(visible, jnp.maximum(total, least), 0.0)

    def stokes(
        self,
        zenith: Float[Array, "#height #width"],
        azimuth: Float[Array, "#height #width"],
    ) -> Float[Array, "height width 3 channel"]:
        """I, Q and U from each direction, in the frame of `atmos.polarisation`.

        I is that of `radiance`. Raises `ValueError` for a sky without polarisation.
        """
        if not self._polarised:
            raise ValueError("`sky` must be solved with `stokes` 3 to be polarised.")
        radiance = self.radiance(zenith, azimuth)
        q, u = jnp.zeros_like(radiance), jnp.zeros_like(radiance)
        look, count = self._look_up(zenith, azimuth), len(self.phases)
        phases, rest = self.table[..., :count, :], self.table[..., count:, :]
        for i in range(self.table.shape[0]):
            relative = azimuth - self.light_azimuth[i]
            turned = versine_between(zenith, self.light_zenith[i], relative)
            level, slanted = vibration_at(zenith, self.light_zenith[i], relative)
            *across, one = self._weights(turned, polarisation=True)
            # To the left of the light U has the other sign.
            side = jnp.where(jnp.sin(relative) < 0.0, -one[..., 0], one[..., 0])
            part = lambda k, i=i: jnp.concatenate(
                [phases[i], rest[i, ..., k, None, :]], -2
            )
            put = lambda x, last, w=across: [*(x[..., None] * y for y in w), last]
            q += look(part(1), zenith, relative, put(level, one))
            u += look(part(2), zenith, relative, put(slanted, side[..., None]), odd=1)
        visible = (zenith >= self.grid.first)[..., None]
        q, u = (jnp.where(visible, x, 0.0) for x in (q, u))
        return jnp.stack([radiance, q, u], -2)

    @property
    def _polarised(self) -> bool:
        return self.table.shape[-2] == len(self.phases) + 3

    def _look_up(self, zenith, azimuth):
        in_rows = zenith.shape[1] == 1 and azimuth.shape[0] == 1
        return self._rows if in_rows else self._pixels

    def _weights(self, turned, polarisation=False):
        """What each part of the table is to be multiplied by, pixel by pixel."""

        def look(phase):
            value = phase.polarisation if polarisation else phase.evaluate
            return jax.vmap(jax.vmap(lambda v: value(v, self.wavelength)))(turned)

        return [*(look(x) for x in self.phases), jnp.ones_like(turned)[..., None]]

    def _rings(self, table, zenith, odd=0):
        """The table at other zenith angles, with one more azimuth at each end.

        The last so many parts are `odd`: they change their sign beyond an end.
        """
        grid, size = self.grid, self.grid.resolution
        grounded = zenith > grid.horizon
        low = jnp.where(grounded, float(size.above), 0.0)
        count = jnp.where(grounded, float(size.below), float(size.above))
        place, weights = _cubic(grid.ring(zenith), low, low + count - 1.0)
        mixing = _matrix(place, weights, size.above + size.below)
        rings = contract("hr,rapl->hapl", mixing, table)
        rings = jnp.pad(rings, ((0, 0), (1, 1), (0, 0), (0, 0)), mode="reflect")
        if not odd:
            return rings
        mirror = np.ones((*rings.shape[1:3], 1))
        mirror[[0, -1], -odd:] = -1.0
        return rings * jnp.asarray(mirror, rings.dtype)[None]

    def _mixing(self, relative):
        """What each azimuth of such rings counts at other azimuths."""
        count = self.grid.resolution.around + 2
        place = self.grid.side(relative) + 1.0
        return _matrix(*_cubic(place, 0.0, count - 1.0), count)

    def _rows(self, table, zenith, relative, weights, odd=0):
        rings, mixing = self._rings(table, zenith[:, 0], odd), self._mixing(relative[0])
        # Weights alike at all wavelengths go into the matrix that mixes azimuths.
        even = [i for i, x in enumerate(weights) if x.shape[-1] == 1]
        factor = jnp.concatenate([weights[i] for i in even], -1)
        factor = factor[..., :, None] * mixing[None, :, None, :]
        height, width, *_ = factor.shape
        rows = jnp.moveaxis(rings[:, :, jnp.array(even)], 2, 1)
        total = contract(
            "hwk,hkl->hwl",
            factor.reshape(height, width, -1),
            rows.reshape(height, -1, rows.shape[-1]),
        )
        for i in set(range(len(weights))) - set(even):
            total += weights[i] * contract("wa,hal->hwl", mixing, rings[:, :, i])
        return total

    def _pixels(self, table, zenith, relative, weights, odd=0):
        del odd
        grid, size = self.grid, self.grid.resolution
        ring, side = jnp.broadcast_arrays(grid.ring(zenith), grid.side(relative))
        grounded = zenith > grid.horizon
        low = jnp.where(grounded, float(size.above), 0.0)
        count = jnp.where(grounded, float(size.below), float(size.above))
        first = jnp.clip(jnp.floor(ring), low, low + count - 2.0)
        other = jnp.clip(jnp.floor(side), 0.0, size.around - 2.0)
        s, t = (ring - first)[..., None, None], (side - other)[..., None, None]
        i, j = first.astype(int), other.astype(int)
        upper = (1.0 - t) * table[i, j] + t * table[i, j + 1]
        lower = (1.0 - t) * table[i + 1, j] + t * table[i + 1, j + 1]
        parts = (1.0 - s) * upper + s * lower
        weighted = [x * parts[..., i, :] for i, x in enumerate(weights)]
        return ft.reduce(operator.add, weighted)

    @property
    def even(self) -> bool:
        """Whether no phase function depends on the wavelength."""
        here = jax.ShapeDtypeStruct((), self.wavelength.dtype)
        look = lambda versine: [
            y(versine, self.wavelength)
            for x in self.phases
            for y in (x.evaluate, x.polarisation)
        ]
        return all(x.shape == (1,) for x in jax.eval_shape(look, here))

    def weigh(self, response: Float[Array, "wl channel"]) -> "Panorama":
        """The same for sums over wavelengths, with a channel in place of each.

        Right only where `even`.
        """
        table = contract("nrapl,lc->nrapc", self.table, response)
        return eqx.tree_at(lambda x: x.table, self, table)

    def finer(self) -> "Panorama":
        """The same on a finer grid: for pictures that are not in rows."""
        size = self.grid.resolution
        size = Resolution(
            above=_FINER * (size.above - 1) + 1,
            below=_FINER * (size.below - 1) + 1,
            around=max(_FINER * (size.around - 1) + 1, _FINEST),
            crowded=size.crowded,
        )
        grid = Grid(self.grid.first, self.grid.horizon, size)
        mixing, odd = self._mixing(grid.azimuths()), int(self._polarised)
        rings = jax.vmap(lambda x: self._rings(x, grid.zeniths(), odd))(self.table)
        table = contract("wa,nhapl->nhwpl", mixing, rings)
        return eqx.tree_at(lambda x: (x.grid, x.table), self, (grid, table))


def versine_between(
    zenith: Float[Array, "*#n"], other: Angle, relative: Float[Array, "*#n"]
) -> Float[Array, "*n"]:
    """One minus the cosine of the angle between two directions, exact when small."""
    apart, aside = jnp.sin(0.5 * (zenith - other)), jnp.sin(0.5 * relative)
    return 2.0 * (apart * apart + jnp.sin(zenith) * jnp.sin(other) * aside * aside)
