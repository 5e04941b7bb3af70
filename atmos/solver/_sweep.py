"""Diffuse light carried once through round air, from shell to shell."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..quantity import Fraction
from ..transport import contract
from ._harmonics import harmonics, pairs
from ._once import Once
from ._rays import Rays
from ._step import step, Suns


class Light(eqx.Module):
    """Diffuse light at all levels, relative to a reference.

    `moments` as of `_ordinates.Diffuse`; `up` and `down` are its fluxes.
    """

    moments: Float[Array, "level pair sun wl"]
    up: Float[Array, "level sun wl"]
    down: Float[Array, "level sun wl"]


class Sweep(eqx.Module):
    """All that does not change from one order of scattering to the next.

    `turned` is the single-scattering albedo of each layer times the moments of its
    phase function, `up` and `down` are optical depths of steps. The logarithm of what
    light is told relative to is `reference`.
    """

    rays: Rays
    suns: Suns
    up: Float[Array, "layer ray wl"]
    down: Float[Array, "layer ray wl"]
    turned: Float[Array, "layer l wl"]
    albedo: Fraction
    reference: Float[Array, "level sun"]

    def carry(self, moments: Float[Array, "level pair sun wl"]) -> Light:
        """The light that these moments turn into, with its reflection by the ground."""
        return self._carry(moments, None)

    def first(self, once: Once) -> Light:
        """The light that turned once; with what the ground returns, the sun's too."""
        return self._carry(None, once)

    def _carry(self, moments: Array | None, once: Once | None) -> Light:
        falls, kept = self._fall(moments, once)
        shines = falls.down[0]
        if once is not None:
            shines += once.ground() * jnp.exp(-self.reference[0])[:, None]
        rises = self._rise(moments, once, kept, shines * self.albedo[None])
        return jax.tree.map(jnp.add, falls, rises)

    def _fall(
        self, moments: Array | None, once: Once | None
    ) -> tuple[Light, Float[Array, "layer azimuth sun wl"]]:
        """What comes down; and what of it turns round in each layer, at its top."""
        rays = self.rays
        size = rays.cosine.shape[1], self.reference.shape[1]

        @jax.checkpoint
        def fall(light, x):
            i, angle, depth, turned, begins, ends = x
            begins, ends = (jnp.broadcast_to(y, size) for y in (begins, ends))
            here = self._basis(rays.cosine[i])[0]
            sources = None
            if moments is not None:
                above = self._basis(rays.cosine[i + 1])[0]
                sources = (
                    _source(above, turned, moments[i + 1]),
                    _source(here, turned, moments[i]),
                )
            light = step(self.suns, angle, depth, begins, ends).carry(light, sources)
            if once is not None:
                light += once.rising(i) * self._scale(i)
            light = jnp.where(rays.cosine[i][:, None, None, None] > 0.0, light, 0.0)
            turns = light[rays.grounded + jnp.maximum(i - 1, 0)]
            return light, (*self._gathered(here, i, light), turns)

        each = jnp.arange(len(self.turned), dtype=jnp.int32)
        reference = self.reference[1:], self.reference[:-1]
        steps = each, rays.up.angle, self.up, self.turned, *reference
        _, (found, down, kept) = jax.lax.scan(fall, self._dark(), steps, reverse=True)
        found, down, kept = (
            jnp.concatenate([x, jnp.zeros_like(x[:1])]) for x in (found, down, kept)
        )
        return Light(found, jnp.zeros_like(down), down), kept[1:]

    def _rise(
        self,
        moments: Array | None,
        once: Once | None,
        kept: Float[Array, "layer azimuth sun wl"],
        shines: Float[Array, "sun wl"],
    ) -> Light:
        """What comes up, of light that shines from the ground and what turned round."""
        rays = self.rays
        size = rays.cosine.shape[1], self.reference.shape[1]

        @jax.checkpoint
        def rise(light, x):
            i, angle, depth, turned, kept, begins, ends = x
            turns = rays.grounded + i
            which = jnp.arange(size[0], dtype=i.dtype) == turns
            # A line that turns round comes from the level where it ends.
            swap = lambda all, one: jnp.where(
                which.reshape(-1, *(1,) * (all.ndim - 1)), one[None], all
            )
            begins, ends = (jnp.broadcast_to(y, size) for y in (begins, ends))
            ahead, here = self._basis(rays.cosine[i + 1])
            sources = None
            if moments is not None:
                below = self._basis(rays.cosine[i])[1]
                far = _source(below, turned, moments[i])
                one = _source(ahead[turns][None], turned, moments[i + 1])[0]
                sources = swap(far, one), _source(here, turned, moments[i + 1])
            steps = step(self.suns, angle, depth, swap(begins, ends[0]), ends)
            light = steps.carry(swap(light, kept), sources)
            if once is not None:
                light += once.falling(i) * self._scale(i + 1)
            return light, self._gathered(here, i + 1, light)

        each = jnp.arange(len(self.turned), dtype=jnp.int32)
        ground = jnp.broadcast_to(shines[None, None] / math.pi, self._dark().shape)
        first = self._gathered(self._basis(rays.cosine[0])[1], each[0], ground)
        reference = self.reference[:-1], self.reference[1:]
        steps = each, rays.down.angle, self.down, self.turned, kept, *reference
        _, rest = jax.lax.scan(rise, ground, steps)
        join = lambda x, y: jnp.concatenate([x[None], y])
        found, up = jax.tree.map(join, first, rest)
        return Light(found, up, jnp.zeros_like(up))

    def _dark(self) -> Float[Array, "ray azimuth sun wl"]:
        rays, suns = self.rays.cosine.shape[1], self.reference.shape[1]
        shape = rays, self.suns.azimuths, suns, self.turned.shape[-1]
        return jnp.zeros(shape, self.reference.dtype)

    def _scale(self, level: Int[Array, ""]) -> Float[Array, "1 1 sun 1"]:
        return jnp.exp(-self.reference[level])[None, None, :, None]

    def _basis(
        self, cosine: Float[Array, "ray"]
    ) -> Float[Array, "way ray azimuth pair"]:
        """The harmonics of travel for views upwards and downwards."""
        count, azimuths = self.turned.shape[1], self.suns.azimuths
        l, m = pairs(count)
        azimuth = (np.arange(azimuths) + 0.5) * (math.pi / azimuths)
        around = jnp.asarray(np.cos(np.multiply.outer(azimuth, m)), cosine.dtype)
        found = harmonics(-cosine, count)[:, l, m]
        sign = jnp.asarray((-1.0) ** (l + m), found.dtype)
        both = jnp.stack([found, found * sign[None]])
        return both[:, :, None] * around[None, None]

    def _gathered(
        self,
        basis: Float[Array, "ray azimuth pair"],
        level: Int[Array, ""],
        light: Float[Array, "ray azimuth sun wl"],
    ) -> tuple[Float[Array, "pair sun wl"], Float[Array, "sun wl"]]:
        """Moments and flux of the light that arrives at a level from one side."""
        weight, cosine = self.rays.weight[level], self.rays.cosine[level]
        _, m = pairs(self.turned.shape[1])
        # Both halves of the circle, over 2 pi; twice for all but m = 0.
        share = np.where(m == 0, 1.0, 2.0) / self.suns.azimuths
        share = jnp.asarray(share, weight.dtype)[None, None]
        basis = basis * weight[:, None, None] * share
        across = weight * cosine * (2.0 * math.pi / self.suns.azimuths)
        moments = contract("kap,kasw->psw", basis, light)
        return moments, contract("k,kasw->sw", across, light)


def _source(
    basis: Float[Array, "ray azimuth pair"],
    turned: Float[Array, "l wl"],
    moments: Float[Array, "pair sun wl"],
) -> Float[Array, "ray azimuth sun wl"]:
    """What a layer adds to light, for an optical depth of 1."""
    l, _ = pairs(turned.shape[0])
    weight = turned[l] * jnp.asarray(l + 0.5, turned.dtype)[:, None]
    return contract("kap,psw->kasw", basis, weight[:, None] * moments)
