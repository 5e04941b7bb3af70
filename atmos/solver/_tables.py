"""Radiance in tables over altitude, view and sun, looked up at the eye."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import Point
from ..light import Sun
from ..optics import Mixture
from ..quantity import Depth, dot, Wavelength
from ..scene import Scene
from ..transport import contract
from ._field import AbstractField
from ._sight import Sight
from ._suns import cubic, RoundSuns, zenith_angle
from ._views import nearby, Views


class Tables(AbstractField):
    """Light that turned more than once, as one sees it from everywhere.

    Of a sun of irradiance 1, relative to the exponential of `reference`. `up` and
    `down` are the fluxes of all light but the sun's own.
    """

    mixture: Mixture
    altitude: Float[Array, "level"]
    suns: RoundSuns
    seen: Float[Array, "level view turn sun wl"]
    reference: Float[Array, "level sun"]
    up: Float[Array, "level sun wl"]
    down: Float[Array, "level sun wl"]
    views: Views = eqx.field(static=True)

    def fluxes(self, scene: Scene, light: Sun, point: Point) -> tuple[Depth, Depth]:
        del scene
        level, x = self._level(point)
        sun, y = self._sun(zenith_angle(point.up, light.direction))
        weight = jnp.multiply.outer(jnp.stack([1.0 - x, x]), jnp.stack([1.0 - y, y]))

        def mix(table):
            start = level, sun, jnp.zeros_like(sun)
            near = jax.lax.dynamic_slice(table, start, (2, 2, table.shape[2]))
            return contract("ks,ksl->l", weight, near)

        return mix(self.up), mix(self.down)

    def gather(
        self,
        scene: Scene,
        light: Sun,
        towards: Float[Array, "light 3"],
        wavelength: Wavelength,
        sight: Sight,
        once: Float[Array, "light part wl"],
        *,
        nodes: int,
    ) -> Float[Array, "light 1 wl"]:
        del once, nodes
        eye, view = sight.path.start, sight.path.direction
        horizon = -jnp.sin(scene.geometry.dip(eye.altitude, jnp.zeros_like(sight.far)))
        cosine = dot(eye.up, view)
        level, x = self._level(eye)
        height = eye.altitude / scene.top
        first, y = self.views.place(cosine, horizon, height, sight.grounded)
        near = jnp.stack([1.0 - x, x])
        weight = jnp.multiply.outer(near, cubic(y))

        def of(sun):
            turn, z = self._turn(eye, view, sun)
            zenith, s = self._sun(zenith_angle(eye.up, sun))
            over = jnp.stack([1.0 - s, s])
            rows = level, zenith
            reference = jax.lax.dynamic_slice(self.reference, rows, (2, 2))
            scale = jnp.exp(contract("ks,k,s->", reference, near, over))
            start = level, first, turn, zenith, jnp.zeros_like(level)
            size = 2, 4, 2, 2, wavelength.size
            found = jax.lax.dynamic_slice(self.seen, start, size)
            around = jnp.stack([1.0 - z, z])
            return scale * contract("kv,t,s,kvtsl->l", weight, around, over, found)

        seen = jax.vmap(of)(towards)[:, None]
        seen = jnp.where(sight.far > 0.0, seen, 0.0)
        return seen * light.irradiance.evaluate(wavelength)[None, None]

    def _level(self, point: Point):
        """The level below, and the share of the way to the next."""
        last = len(self.altitude) - 2
        i = jnp.searchsorted(self.altitude, point.altitude, side="right") - 1
        i = jnp.clip(i, 0, last).astype(jnp.int32)
        low, high = self.altitude[i], self.altitude[i + 1]
        step = jnp.where(high > low, high - low, 1.0)
        return i, jnp.clip((point.altitude - low) / step, 0.0, 1.0)

    def _sun(self, zenith: Float[Array, ""]):
        return beside(self.suns, zenith)

    def _turn(self, eye: Point, view, sun):
        """The azimuth between view and sun, among those of the table."""
        level = view - dot(view, eye.up) * eye.up
        ahead = dot(level, sun)
        across = jnp.cross(level, sun)
        aside = dot(across, eye.up)
        squared = aside * aside
        some = squared > 1e-16
        aside = jnp.where(some, jnp.sqrt(jnp.where(some, squared, 1.0)), 1e-8)
        return around(jnp.arctan2(aside, ahead), self.views.turns)


def around(azimuth: Float[Array, "*n"], turns: int):
    """The first of two azimuths to mix, and how far one is from it."""
    place = jnp.clip(azimuth * (turns / math.pi) - 0.5, 0.0, turns - 1.0)
    return nearby(place, turns, 2)


def beside(suns: RoundSuns, zenith: Float[Array, "*n"]):
    """The first of two suns to mix, and how far one is from it."""
    first, x = suns.place(zenith)
    step = jnp.clip(jnp.floor(jax.lax.stop_gradient(x)), 0.0, 2.0)
    return first + step.astype(jnp.int32), x - step


def relative(
    table: Float[Array, "level ... sun wl"],
) -> tuple[Float[Array, "level ... sun wl"], Float[Array, "level sun"]]:
    """A table over how bright it is, and the logarithm of that."""
    inner = tuple(range(1, table.ndim - 2))
    mean = jnp.mean(table, inner)
    whole = jnp.max(mean, (0, 1), keepdims=True)
    share = mean / jnp.where(whole > 0.0, whole, 1.0)
    least = float(jnp.finfo(table.dtype).tiny) ** 0.5
    reference = jnp.log(jnp.maximum(jnp.mean(share, -1), least))
    scale = jnp.exp(-reference)
    return table * jnp.expand_dims(scale, (*inner, table.ndim - 1)), reference
