"""Diffuse light at few wavelengths, drawn out to all that are asked for.

Relative to light that turned once, diffuse light over black ground is so smooth in
wavelength that a few are enough. The albedo of ground need not be smooth: what the
ground adds is found for ground that shines evenly, and then is exact for any albedo.
"""

import math
from collections.abc import Iterator

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import Point
from ..light import Sun
from ..optics import Mixture
from ..quantity import Depth, Wavelength
from ..scene import Scene
from ..transport import columns, contract
from ._chosen import Chosen
from ._field import AbstractField, Field, Ground
from ._levels import between
from ._sight import Sight


class Glow(eqx.Module):
    """The fluxes of ground that shines evenly, with radiance 1, and how it is `lit`.

    As they balance, unlike those of `Ground`, which may be known better.
    """

    up: Float[Array, "level wl"]
    down: Float[Array, "level wl"]
    lit: Float[Array, "sun wl"]


class Interpolated(AbstractField):
    """A field at some wavelengths, over ground apart; everything else at all."""

    mixture: Mixture
    chosen: Chosen
    field: Field
    ground: Ground
    glow: Glow
    albedo: Float[Array, "wl"]

    def _returned(self, back: Float[Array, "few"]) -> Float[Array, "wl"]:
        """The radiance of ground over what it would receive if it were black."""
        # Of its light, what does not come down again.
        lost = 1.0 - back / math.pi
        if not self.chosen.whole:
            lost = jnp.exp(self.chosen.smooth(jnp.log(lost)))
        return self.albedo / (1.0 - self.albedo + self.albedo * lost) / math.pi

    def _guide(self, scene: Scene, light: Sun, point: Point) -> Float[Array, "wl"]:
        """How much comes straight from a light: fluxes are of its kind."""
        path = scene.geometry.path(point, light.direction)
        column = columns(scene, path, path.span(scene.top).far, nodes=8)
        return jnp.exp(-contract("m,ml->l", column, self.mixture.extinction))

    def _mixed(self, light: Sun, point: Point, *known: Array) -> Iterator[Array]:
        """Of what is known for each sun, that of a light."""
        suns, by_sun = self.field.suns.near(light, point)
        return (contract("j,jl->l", by_sun, x[suns]) for x in known)

    def fluxes(self, scene: Scene, light: Sun, point: Point) -> tuple[Depth, Depth]:
        (lit,) = self._mixed(light, point, self.glow.lit)
        levels, by_level = between(self.field.altitude, point.altitude)
        glow = lambda x: lit * contract("i,il->l", by_level, x[levels])
        black = self.field.fluxes(scene, light, point)
        guide = self._guide(scene, light, point)
        returned, like = self._returned(self.glow.down[0]), self.chosen.like
        up, down = (
            like(x, guide) + returned * like(glow(y), guide)
            for x, y in zip(black, (self.glow.up, self.glow.down), strict=True)
        )
        return up, down

    def received(self, scene: Scene, light: Sun, foot: Point) -> Depth:
        sky, lit = self._mixed(light, foot, self.ground.sky, self.ground.lit)
        guide, like = self._guide(scene, light, foot), self.chosen.like
        again = like(lit * self.ground.back, guide)
        return like(sky, guide) + self._returned(self.ground.back) * again

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
    ) -> Float[Array, "light stokes wl"]:
        known = scene, light, towards, sight, nodes
        found, column = self.field.along(*known, self.ground)
        irradiance = light.irradiance.evaluate(wavelength)
        irradiance = jnp.broadcast_to(irradiance, wavelength.shape)
        found = found * irradiance[self.chosen.index][None, None]
        guide = jnp.sum(once[:, :-1], 1)
        black, glow = (self._drawn(x, guide) for x in jnp.split(found, 2, 1))
        seen = black + glow * self._returned(self.ground.back)[None, None]

        down = self.sent_down(scene, light, towards, sight)
        depth = contract("m,ml->l", column, self.mixture.extinction)
        ground = self.albedo / math.pi * jnp.exp(-depth) * irradiance
        ground = down * ground[None]
        return seen.at[:, 0].add(jnp.where(sight.grounded, ground, 0.0))

    def _drawn(
        self, found: Float[Array, "light stokes few"], guide: Float[Array, "light wl"]
    ) -> Float[Array, "light stokes wl"]:
        """I like its guide; Q and U relative to I."""
        if self.chosen.whole:
            return found
        intensity = self.chosen.like(found[:, 0], guide)[:, None]
        some = found[:, :1] > 0.0
        share = jnp.where(some, found[:, 1:] / jnp.where(some, found[:, :1], 1.0), 0.0)
        return jnp.concatenate([intensity, intensity * self.chosen.smooth(share)], 1)
