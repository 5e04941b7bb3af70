"""Diffuse light carried once through round air, from shell to shell."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..quantity import Fraction
from ..transport import contract
from ._harmonics import harmonics, pairs, spin_harmonics
from ._levels import Bends
from ._once import Once
from ._rays import Rays
from ._step import step, Suns


class Light(eqx.Module):
    """Diffuse light at all levels, relative to a reference.

    `moments` as of `_ordinates.Diffuse`; `up` and `down` are its fluxes.
    """

    moments: Float[Array, "level row sun wl"]
    up: Float[Array, "level sun wl"]
    down: Float[Array, "level sun wl"]


class Sweep(eqx.Module):
    """All that does not change from one order of scattering to the next.

    `turned` is the single-scattering albedo of each layer times the moments of its
    phase function, `polarised` that times those of polarisation, `up` and `down` are
    optical depths of steps. The logarithm of what light is told relative to is
    `reference`. Light is I, or I, Q and U where `stokes` is 3.
    """

    rays: Rays
    suns: Suns
    up: Float[Array, "layer ray wl"]
    down: Float[Array, "layer ray wl"]
    bends: Bends
    turned: Float[Array, "layer l wl"]
    polarised: Float[Array, "layer k 3 wl"]
    albedo: Fraction
    reference: Float[Array, "level sun"]
    stokes: int = eqx.field(static=True)

    def carry(self, moments: Float[Array, "level row sun wl"]) -> Light:
        """The light that these moments turn into, with its reflection by the ground."""
        return self._carry(moments, None)

    def first(self, once: Once) -> Light:
        """The light that turned once; with what the ground returns, the sun's too."""
        return self._carry(None, once)

    def _carry(self, moments: Array | None, once: Once | None) -> Light:
        known = None
        if moments is not None:
            known = moments, self.bends.midst(moments, self.reference)
        falls, kept = self._fall(known, once)
        shines = falls.down[0]
        if once is not None:
            shines += once.ground() * jnp.exp(-self.reference[0])[:, None]
        shines *= self.albedo[None]
        rises = self._rise(known, once, kept, shines)
        return jax.tree.map(jnp.add, falls, rises)

    def _fall(
        self, known: tuple[Array, Array] | None, once: Once | None
    ) -> tuple[Light, Float[Array, "layer stokes azimuth sun wl"]]:
        """What comes down; and what of it turns round in each layer, at its top.

        Of light that is known by its moments at levels, and more half way.
        """
        rays = self.rays
        size = rays.cosine.shape[1], self.reference.shape[1]

        @jax.checkpoint
        def fall(light, x):
            i, angle, depth, turned, begins, ends = x
            begins, ends = (jnp.broadcast_to(y, size) for y in (begins, ends))
            here = self._basis(rays.cosine[i])[0]
            sources = None
            if known is not None:
                moments, bent = known
                above = self._basis(rays.cosine[i + 1])[0]
                near = _source(here, turned, moments[i])
                other = _source(here, turned, moments[i + 1])
                middle = _source(here, turned, bent[i])
                sources = (
                    _source(above, turned, moments[i + 1]),
                    near,
                    _midst(near, other, middle, rays.skew[i], ends - begins),
                )
            light = step(self.suns, angle, depth, begins, ends).carry(light, sources)
            if once is not None:
                light += once.rising(i) * self._scale(i)
            there = rays.cosine[i][None, :, None, None, None] > 0.0
            light = jnp.where(there, light, 0.0)
            turns = light[:, rays.grounded + jnp.maximum(i - 1, 0)]
            return light, (*self._gathered(here, i, light), turns)

        each = jnp.arange(len(self.turned), dtype=jnp.int32)
        reference = self.reference[1:], self.reference[:-1]
        turned = self.turned, self.polarised
        steps = each, rays.up.angle, self.up, turned, *reference
        _, (found, down, kept) = jax.lax.scan(fall, self._dark(), steps, reverse=True)
        found, down, kept = (
            jnp.concatenate([x, jnp.zeros_like(x[:1])]) for x in (found, down, kept)
        )
        return Light(found, jnp.zeros_like(down), down), kept[1:]

    def _rise(
        self,
        known: tuple[Array, Array] | None,
        once: Once | None,
        kept: Float[Array, "layer stokes azimuth sun wl"],
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
            which = which[None, :, None, None, None]
            swap = lambda all, one: jnp.where(which, one[:, None], all)
            begins, ends = (jnp.broadcast_to(y, size) for y in (begins, ends))
            ahead, here = self._basis(rays.cosine[i + 1])
            sources = None
            if known is not None:
                moments, bent = known
                below = self._basis(rays.cosine[i])[1]
                far = _source(below, turned, moments[i])
                one = lambda x: x[:, turns][:, None]
                turn = _source(one(ahead), turned, moments[i + 1])
                # Such a line is lowest half way.
                half = jnp.exp(0.5 * (begins[0] - ends[0]))[None, :, None]
                midst = half * (0.5 * (moments[i] + moments[i + 1]) + bent[i])
                lower = _source(one(here), turned, midst - moments[i + 1])
                near = _source(here, turned, moments[i + 1])
                other = _source(here, turned, moments[i])
                middle = _source(here, turned, bent[i])
                middle = _midst(near, other, middle, -rays.skew[i], ends - begins)
                sources = swap(far, turn[:, 0]), near, swap(middle, lower[:, 0])
            begins = jnp.where(which[0, :, :, 0, 0], ends, begins)
            steps = step(self.suns, angle, depth, begins, ends)
            light = steps.carry(swap(light, kept), sources)
            if once is not None:
                light += once.falling(i) * self._scale(i + 1)
            return light, self._gathered(here, i + 1, light)

        each = jnp.arange(len(self.turned), dtype=jnp.int32)
        ground = self._dark().at[0].set(shines[None, None] / math.pi)
        first = self._gathered(self._basis(rays.cosine[0])[1], each[0], ground)
        reference = self.reference[:-1], self.reference[1:]
        turned = self.turned, self.polarised
        steps = each, rays.down.angle, self.down, turned, kept, *reference
        _, rest = jax.lax.scan(rise, ground, steps)
        join = lambda x, y: jnp.concatenate([x[None], y])
        found, up = jax.tree.map(join, first, rest)
        return Light(found, up, jnp.zeros_like(up))

    def _dark(self) -> Float[Array, "stokes ray azimuth sun wl"]:
        rays, suns = self.rays.cosine.shape[1], self.reference.shape[1]
        shape = self.stokes, rays, self.suns.azimuths, suns, self.turned.shape[-1]
        return jnp.zeros(shape, self.reference.dtype)

    def _scale(self, level: Int[Array, ""]) -> Float[Array, "1 1 1 sun 1"]:
        return jnp.exp(-self.reference[level])[None, None, None, :, None]

    def _basis(
        self, cosine: Float[Array, "ray"]
    ) -> Float[Array, "way stokes ray azimuth row"]:
        """The functions of travel of all moments, for views upwards and downwards.

        In I, Q and U, as of `_harmonics`.
        """
        count, k = self.turned.shape[1], self.polarised.shape[1]
        travels = jnp.stack([-cosine, cosine])
        multiples = lambda m: jnp.multiply.outer(
            self.suns.azimuth(), jnp.asarray(m, cosine.dtype)
        )
        spread = lambda x, wave, m: x[:, :, None] * wave(multiples(m))[None, None]
        l, m = pairs(count)
        p = spread(harmonics(travels, count)[..., l, m], jnp.cos, m)
        if self.stokes == 1:
            return p[:, None]
        l, m = pairs(k)
        r, s = (x[..., l, m] for x in spin_harmonics(travels, k))
        q = [spread(x, jnp.cos, m) for x in (r, s)]
        u = [spread(x, jnp.sin, m) for x in (s, r)]
        zero = jnp.zeros_like
        rows = [p, zero(q[0]), zero(q[1])], [zero(p), *q], [zero(p), *u]
        return jnp.stack([jnp.concatenate(x, -1) for x in rows], 1)

    def _gathered(
        self,
        basis: Float[Array, "stokes ray azimuth row"],
        level: Int[Array, ""],
        light: Float[Array, "stokes ray azimuth sun wl"],
    ) -> tuple[Float[Array, "row sun wl"], Float[Array, "sun wl"]]:
        """Moments and flux of the light that arrives at a level from one side."""
        weight, cosine = self.rays.weight[level], self.rays.cosine[level]
        m = pairs(self.turned.shape[1])[1]
        if self.stokes == 3:
            m = np.concatenate([m, *[pairs(self.polarised.shape[1])[1]] * 2])
        # Both halves of the circle, over 2 pi; twice for all but m = 0.
        share = np.where(m == 0, 1.0, 2.0) / self.suns.azimuths
        share = jnp.asarray(share, weight.dtype)[None, None, None]
        basis = basis * weight[None, :, None, None] * share
        across = weight * cosine * (2.0 * math.pi / self.suns.azimuths)
        moments = contract("vkap,vkasw->psw", basis, light)
        return moments, contract("k,kasw->sw", across, light[0])


def _source(
    basis: Float[Array, "stokes ray azimuth row"],
    turned: tuple[Float[Array, "l wl"], Float[Array, "k 3 wl"]],
    moments: Float[Array, "row sun wl"],
) -> Float[Array, "stokes ray azimuth sun wl"]:
    """What a layer adds to light, for an optical depth of 1."""
    wide = lambda x, l: x[l][:, None] * jnp.asarray(l + 0.5, x.dtype)[:, None, None]
    scattered, polarised = turned
    l, _ = pairs(scattered.shape[0])
    t, rest = moments[: len(l)], moments[len(l) :]
    rows = wide(scattered, l) * t
    if basis.shape[0] == 3:
        l, _ = pairs(polarised.shape[0])
        alpha2, alpha3, beta = (wide(polarised[:, i], l) for i in range(3))
        e, b = jnp.split(rest, 2)
        more = beta * t[: len(l)] + alpha2 * e, alpha3 * b
        rows = jnp.concatenate([rows.at[: len(l)].add(beta * e), *more])
    return contract("vkap,psw->vkasw", basis, rows)


def _midst(
    near: Float[Array, "stokes ray azimuth sun wl"],
    other: Float[Array, "stokes ray azimuth sun wl"],
    middle: Float[Array, "stokes ray azimuth sun wl"],
    skew: Float[Array, "ray"],
    rises: Float[Array, "ray sun"],
) -> Float[Array, "stokes ray azimuth sun wl"]:
    """What sources half way along steps are more than the mean of those at both ends.

    From those straight above each other, at the `near` end, at the `other` level and
    in the `middle` of the layer, of which the last is told as what it is more. Half way
    is closer to the near end by a share `skew` of the layer; the logarithm of the
    reference `rises` from the other level to the near one.
    """
    scale = jnp.exp(skew[:, None] * rises)[None, :, None, :, None]
    skew = skew[None, :, None, None, None]
    there = (0.5 + skew) * near + (0.5 - skew) * other
    there += (1.0 - 4.0 * skew * skew) * middle
    return scale * there - 0.5 * (near + other)
