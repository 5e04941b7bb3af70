"""Diffuse light as a field of moments, and what of it one sees."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from ..geometry import Point
from ..light import Sun
from ..optics import Mixture
from ..quantity import Depth, Direction, Length, Position, Wavelength
from ..scene import Scene
from ..transport import contract, cumulative, densities, enter, gauss_legendre
from ._harmonics import harmonics, pairs
from ._polarised import scattered
from ._sight import cut
from ._suns import AbstractSuns, zenith_angle
from .single_scattering import SingleScattering


class Field(eqx.Module):
    """The moments of diffuse light over altitude, from the ground up, and suns.

    Of a light of irradiance 1, relative to the exponential of `reference`; `moments` as
    of `_ordinates.Diffuse`. `mixture` are the media without their forward peaks, which
    the light does not notice. With `stokes` 3 it is I, Q and U that one sees.
    """

    mixture: Mixture
    altitude: Float[Array, "level"]
    suns: AbstractSuns
    moments: Float[Array, "sun level pair wl"]
    up: Float[Array, "sun level wl"]
    down: Float[Array, "sun level wl"]
    reference: Float[Array, "sun level"]
    stokes: int = eqx.field(static=True, default=1)

    def _look(self, table: Array, light: Sun, point: Point) -> Array:
        """A table at a place, by cubics in altitude and between suns."""
        levels, by_level = _between(self.altitude, point.altitude)
        zenith = zenith_angle(point.up, light.direction)
        suns, by_sun = self.suns.between(light, zenith)
        weights = by_sun[:, None] * by_level[None]
        brightness = self.reference[suns][:, levels]
        scale = jnp.exp(jnp.sum(weights * brightness))
        mixed = jnp.zeros_like(table[0, 0])
        for i, sun in enumerate(suns):
            for j, level in enumerate(levels):
                mixed += weights[i, j] * table[sun, level]
        return scale * mixed

    def fluxes(self, light: Sun, point: Point) -> tuple[Depth, Depth]:
        """Diffuse flux upwards and downwards, for a light of irradiance 1."""
        return self._look(self.up, light, point), self._look(self.down, light, point)

    def source(
        self,
        scattering: Float[Array, "l wl"],
        polarised: Float[Array, "k 3 wl"],
        point: Point,
        light: Sun,
        view: Direction,
    ) -> tuple[Float[Array, "wl"], ...]:
        """What a metre adds to the light that arrives from direction `view`.

        Alone, or I, Q and U: apart from each other, as that is quicker to compute.
        """
        count = scattering.shape[0]
        l, m = pairs(count)
        cosine = -jnp.dot(point.up, view)
        turn = harmonics(cosine, count)[l, m]
        turn = turn * _cosines(point.up, view, light.direction, count)[m]
        turn = turn * jnp.asarray(l + 0.5, turn.dtype)
        moments = self._look(self.moments, light, point)
        if self.stokes == 1:
            return (jnp.sum(turn[:, None] * scattering[l] * moments, 0),)
        radiance, rest = moments[: len(l)], moments[len(l) :]
        seen = jnp.sum(turn[:, None] * scattering[l] * radiance, 0)
        more = scattered(polarised, radiance, rest, point.up, view, light.direction)
        return seen + more[0], more[1], more[2]

    def gather(
        self,
        scene: Scene,
        light: Sun,
        wavelength: Wavelength,
        position: Position,
        direction: Direction,
        *,
        pieces: int,
        nodes: int,
    ) -> Float[Array, "stokes wl"]:
        """Light of more than one turn from along a line of sight, and from its end.

        Its vertical plane is the same everywhere, so that Q and U simply add.
        """
        path, far, grounded = enter(scene, position, direction)
        extinction = self.mixture.extinction
        begin, length = cut(scene, path, far, extinction, pieces)
        u, w = (jnp.asarray(x, far.dtype) for x in gauss_legendre(nodes))
        inner = jnp.asarray(cumulative(nodes), far.dtype)

        def piece(passed, interval):
            begin, length = interval
            points = jax.vmap(path.at)(begin + length * u)
            density = jax.vmap(lambda x: densities(scene, x))(points)
            lost = length * contract("jm,ml->jl", density, extinction)
            scattering = contract("jm,mkl->jkl", density, self.mixture.scattering)
            polarised = contract("jm,mkpl->jkpl", density, self.mixture.polarised)
            shine = lambda s, p, x: self.source(s, p, x, light, direction)
            source = jax.vmap(shine)(scattering, polarised, points)
            depth, within = (
                contract("j,jl->l", w, lost),
                contract("ij,jl->il", inner, lost),
            )
            # The rule by Gauss, made exact for light that is everywhere the same.
            share = w[:, None] * jnp.exp(within[:1] - within)
            even = jnp.sum(share * lost, 0)
            empty = even <= 0.0
            whole = -jnp.expm1(-depth) / jnp.where(empty, 1.0, even)
            whole = jnp.where(empty, 1.0, whole)
            arrives = jnp.exp(-passed) * whole
            seen = tuple(arrives * jnp.sum(share * (length * x), 0) for x in source)
            return passed + depth, seen

        passed, seen = jax.lax.scan(piece, jnp.zeros_like(wavelength), (begin, length))
        foot = path.at(far)
        foot = Point(foot.position, jnp.zeros_like(far), foot.up)
        _, down = self.fluxes(light, foot)
        ground = scene.ground.evaluate(wavelength) / math.pi * down * jnp.exp(-passed)
        radiance, *rest = (jnp.sum(x, 0) for x in seen)
        total = [radiance + jnp.where(grounded, ground, 0.0), *rest]
        return jnp.stack(total) * light.irradiance.evaluate(wavelength)[None]


def see_all(
    field: Field,
    single: SingleScattering,
    scene: Scene,
    light: Sun,
    wavelength: Wavelength,
    position: Position,
    direction: Direction,
    *,
    pieces: int,
    nodes: int,
) -> Float[Array, "part wl"]:
    """Radiance by a field, and light that turned once in the round, with its peak.

    Nakajima and Tanaka 1988: the latter is dimmed as if the peak were not scattered.
    """
    look = light, wavelength, position, direction
    once = single.march(scene, field.mixture.extinction, *look)
    more = field.gather(scene, *look, pieces=pieces, nodes=nodes)
    return once.at[-1:].add(more)


def _between(
    altitude: Float[Array, "level"], here: Length
) -> tuple[Int[Array, "4"], Float[Array, "4"]]:
    """Which levels to mix at an altitude, and how much of each.

    A cubic between two levels whose slope at either is that of the parabola through it
    and its neighbours (Catmull and Rom 1974, for uneven steps); a straight line's at
    the ends, and beside a thin layer, beyond which light may change otherwise.
    """
    last = len(altitude) - 1
    i = jnp.searchsorted(altitude, here, side="right") - 1
    i = jnp.clip(i, 0, last - 1).astype(jnp.int32)
    levels = jnp.stack([jnp.maximum(i - 1, 0), i, i + 1, jnp.minimum(i + 2, last)])
    before, step, after = jnp.diff(altitude[levels])
    x = jnp.clip((here - altitude[i]) / jnp.where(step > 0.0, step, 1.0), 0.0, 1.0)

    def slope(side):
        """What the value at the level itself, and that beyond it, add to the slope."""
        known = side > 0.25 * step
        ratio = step / jnp.where(known, side, 1.0)
        beyond = jnp.where(known, ratio * ratio / (1.0 + ratio), 0.0)
        return beyond, jnp.where(known, 1.0 / (1.0 + ratio), 1.0)

    (a, b), (c, d) = slope(before), slope(after)
    low, high = x * (1.0 - x) ** 2, x * x * (x - 1.0)
    rise = x * x * (3.0 - 2.0 * x)
    weights = [
        -a * low,
        1.0 - rise + low * (a - b) - high * d,
        rise + low * b + high * (d - c),
        high * c,
    ]
    return levels, jnp.stack(weights)


def _cosines(
    up: Direction, view: Direction, sun: Direction, count: int
) -> Float[Array, "m"]:
    """Of multiples of the azimuth between two directions; 1 where it is not known."""
    view, sun = (x - jnp.dot(up, x) * up for x in (view, sun))
    squared = jnp.dot(view, view) * jnp.dot(sun, sun)
    known = squared > float(jnp.finfo(up.dtype).tiny)
    root = jnp.sqrt(jnp.where(known, squared, 1.0))
    cosine = jnp.where(known, jnp.dot(view, sun) / root, 1.0)
    cosine = jnp.clip(cosine, -1.0, 1.0)
    found = [jnp.ones_like(cosine), cosine]
    for _ in range(count - 2):
        found.append(2.0 * cosine * found[-1] - found[-2])
    return jnp.stack(found[:count])
