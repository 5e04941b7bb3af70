"""A sky as seen from one place: a table that is quick to look up."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from ..phase import AbstractPhaseFunction
from ..quantity import Angle, Wavelength


# Rings keep this far off the horizon, so that rounding leaves no doubt on which side.
_SLIVER = 1e-5
_FINER = 4


class Grid(eqx.Module):
    """Directions: rings of equal zenith angle, and azimuths on them.

    Rings crowd at the horizon from both sides. Azimuths run from that of the light to
    the opposite one: the other half of the sky is alike.
    """

    first: Angle  # the highest ring: what is above it is black
    horizon: Angle
    above: int = eqx.field(static=True)
    below: int = eqx.field(static=True)
    around: int = eqx.field(static=True)

    def zeniths(self) -> Float[Array, "ring"]:
        """The zenith angle of each ring, from the highest to the lowest."""
        dtype = self.horizon.dtype
        up = jnp.linspace(1.0, 0.0, self.above, dtype=dtype)
        down = jnp.linspace(0.0, 1.0, self.below, dtype=dtype)
        top, bottom = self.horizon - _SLIVER, self.horizon + _SLIVER
        return jnp.concatenate(
            [top - (top - self.first) * up**3, bottom + (math.pi - bottom) * down**3]
        )

    def azimuths(self) -> Float[Array, "around"]:
        """The azimuths on each ring, relative to that of the light."""
        return jnp.linspace(0.0, math.pi, self.around, dtype=self.horizon.dtype)

    def ring(self, zenith: Float[Array, "*n"]) -> Float[Array, "*n"]:
        """Where a zenith angle lies among the rings, counted from 0."""
        top, bottom = self.horizon - _SLIVER, self.horizon + _SLIVER
        up = _cube_root((top - zenith) / (top - self.first))
        down = _cube_root((zenith - bottom) / (math.pi - bottom))
        return jnp.where(
            zenith > self.horizon,
            self.above + down * (self.below - 1),
            (1.0 - up) * (self.above - 1),
        )

    def side(self, azimuth: Float[Array, "*n"]) -> Float[Array, "*n"]:
        """Where a relative azimuth lies on its ring, counted from 0."""
        turn = jnp.abs(jnp.remainder(azimuth + math.pi, 2.0 * math.pi) - math.pi)
        return turn * ((self.around - 1) / math.pi)


def _cube_root(x: Array) -> Array:
    inside = x > 1e-12
    return jnp.where(inside, jnp.cbrt(jnp.where(inside, x, 1.0)), 0.0)


def _cubic(
    x: Float[Array, "*n"], low: Array | float, high: Array | float
) -> tuple[Int[Array, "*n"], Float[Array, "*n 4"]]:
    """The first of four places, from `low` to `high`, around x; Lagrange's weights."""
    first = jnp.clip(jnp.floor(jax.lax.stop_gradient(x)) - 1.0, low, high - 3.0)
    a, b, c, d = (x - first - k for k in range(4))
    weights = [-b * c * d / 6.0, a * c * d / 2.0, -a * b * d / 2.0, a * b * c / 6.0]
    return first.astype(int), jnp.stack(weights, -1)


class Panorama(eqx.Module):
    """The light that arrives at one place from all directions.

    For each light, `table` holds the radiance on a grid of directions, in parts: one for
    each phase function, which is put on only when looked up and so stays exact, and a
    last one that has none.
    """

    grid: Grid
    table: Float[Array, "light ring around part wl"]
    light_zenith: Float[Array, "light"]
    light_azimuth: Float[Array, "light"]
    phases: tuple[AbstractPhaseFunction, ...]
    wavelength: Wavelength

    def radiance(
        self,
        zenith: Float[Array, "#height #width"],
        azimuth: Float[Array, "#height #width"],
    ) -> Float[Array, "height width wl"]:
        """The radiance from each direction of a picture, in W m^-2 sr^-1 nm^-1.

        Angles in rad, azimuth clockwise from north. It is quickest where all pixels of a
        row share their zenith angle and all of a column their azimuth.
        """
        shape = jnp.broadcast_shapes(zenith.shape, azimuth.shape)
        total = jnp.zeros((*shape, *self.wavelength.shape), self.wavelength.dtype)
        lights = zip(self.table, self.light_zenith, self.light_azimuth, strict=True)
        for table, light_zenith, light_azimuth in lights:
            relative = azimuth - light_azimuth
            if zenith.shape[1] == 1 and azimuth.shape[0] == 1:
                parts = self._rows(table, zenith[:, 0], relative[0])
            else:
                parts = self._pixels(table, zenith, relative)
            black = (zenith < self.grid.first)[..., None]
            total += jnp.where(
                black, 0.0, self._join(parts, zenith, relative, light_zenith)
            )
        return total

    def _rows(self, table, zenith, relative):
        """Every azimuth on every ring asked for."""
        grid = self.grid
        at = grid.ring(zenith)
        low = jnp.where(zenith > grid.horizon, float(grid.above), 0.0)
        count = jnp.where(zenith > grid.horizon, float(grid.below), float(grid.above))
        first, weights = _cubic(at, low, low + count - 1.0)
        rings = sum(
            weights[:, k, None, None, None] * table[first + k] for k in range(4)
        )
        rings = jnp.pad(rings, ((0, 0), (1, 1), (0, 0), (0, 0)), mode="reflect")
        first, weights = _cubic(grid.side(relative) + 1.0, 0.0, grid.around + 1.0)
        places = jnp.arange(grid.around + 2)
        mixing = sum(
            jnp.where(first[:, None] + k == places, weights[:, k, None], 0.0)
            for k in range(4)
        )
        return jnp.einsum("wa,hapl->hwpl", mixing, rings, precision="highest")

    def _pixels(self, table, zenith, relative):
        """A straight line in a finer table, pixel by pixel."""
        grid = self.grid
        finer = Grid(
            grid.first,
            grid.horizon,
            _FINER * (grid.above - 1) + 1,
            _FINER * (grid.below - 1) + 1,
            _FINER * (grid.around - 1) + 1,
        )
        table = self._rows(table, finer.zeniths(), finer.azimuths())
        ring, side = jnp.broadcast_arrays(finer.ring(zenith), finer.side(relative))
        low = jnp.where(zenith > grid.horizon, finer.above, 0)
        high = jnp.where(zenith > grid.horizon, finer.above + finer.below, finer.above)
        i = jnp.clip(jnp.floor(ring).astype(int), low, high - 2)
        j = jnp.clip(jnp.floor(side).astype(int), 0, finer.around - 2)
        s, t = (ring - i)[..., None, None], (side - j)[..., None, None]
        here = (1.0 - t) * table[i, j] + t * table[i, j + 1]
        return (1.0 - s) * here + s * (
            (1.0 - t) * table[i + 1, j] + t * table[i + 1, j + 1]
        )

    def _join(self, parts, zenith, relative, light_zenith):
        # Between a lit place and a dark one a cubic may swing below nothing.
        parts = jnp.maximum(parts, 0.0)
        turned = versine_between(zenith, light_zenith, relative)
        total = parts[..., -1, :]
        for i, phase in enumerate(self.phases):
            look = jax.vmap(lambda v, p=phase: p.evaluate(v, self.wavelength))
            total += jax.vmap(look)(turned) * parts[..., i, :]
        return total


def versine_between(
    zenith: Float[Array, "*#n"], other: Angle, relative: Float[Array, "*#n"]
) -> Float[Array, "*n"]:
    """One minus the cosine of the angle between two directions, exact when small."""
    apart, aside = jnp.sin(0.5 * (zenith - other)), jnp.sin(0.5 * relative)
    return 2.0 * (apart * apart + jnp.sin(zenith) * jnp.sin(other) * aside * aside)
