"""Diffuse light as a field of moments, and what of it one sees along a line."""

import abc
import dataclasses
import math

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from ..geometry import Point
from ..light import Sun
from ..optics import Mixture
from ..quantity import Depth, Direction, dot, Wavelength
from ..scene import Scene
from ..transport import contract, cumulative, densities, gauss_legendre
from ._levels import between
from ._sight import Sight
from ._suns import AbstractSuns, zenith_angle
from ._towards import Travel, travel, turned, waves


# So many suns at most are mixed at a place, or so many, or all.
_FEW, _MORE = 6, 24


class Ground(eqx.Module):
    """Diffuse light of nothing but ground that shines evenly, with radiance 1.

    With moments like those of a `Field`. Of each sun it receives `sky` from the air,
    where it is black, and `lit` in all; of its own light it receives `back`.
    """

    moments: Float[Array, "level pair wl"]
    sky: Float[Array, "sun wl"]
    lit: Float[Array, "sun wl"]
    back: Float[Array, "wl"]


class AbstractField(eqx.Module):
    """Light that turned more than once, or that is about to, as solvers find it.

    `mixture` are the media without their forward peaks, which the light does not
    notice.
    """

    mixture: eqx.AbstractVar[Mixture]

    @abc.abstractmethod
    def fluxes(self, scene: Scene, light: Sun, point: Point) -> tuple[Depth, Depth]:
        """Diffuse flux upwards and downwards, for a light of irradiance 1."""

    @abc.abstractmethod
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
        """Light of more than one turn from along a line of sight, and from its end.

        Of a light that stands in one of several directions, of which light that turned
        `once` is known.
        """

    def received(self, scene: Scene, light: Sun, foot: Point) -> Depth:
        """The diffuse flux on ground that one sees, for a light of irradiance 1."""
        return self.fluxes(scene, light, foot)[1]

    def sent_down(
        self,
        scene: Scene,
        light: Sun,
        towards: Float[Array, "light 3"],
        sight: Sight,
    ) -> Float[Array, "light wl"]:
        """The same where a line of sight ends, of a light in several directions."""
        foot = sight.path.at(sight.far)
        foot = Point(foot.position, jnp.zeros_like(sight.far), foot.up)

        def of(towards):
            stands = dataclasses.replace(light, direction=towards)
            return self.received(scene, stands, foot)

        return jax.vmap(of)(towards)


class Field(AbstractField):
    """The moments of diffuse light over altitude, from the ground up, and suns.

    Of a light of irradiance 1, relative to the exponential of `reference`; `moments` as
    of `_ordinates.Diffuse`. With `stokes` 3 it is I, Q and U that one sees.
    """

    mixture: Mixture
    altitude: Float[Array, "level"]
    suns: AbstractSuns
    moments: Float[Array, "level pair sun wl"]
    up: Float[Array, "level sun wl"]
    down: Float[Array, "level sun wl"]
    reference: Float[Array, "level sun"]
    stokes: int = eqx.field(static=True, default=1)

    def fluxes(self, scene: Scene, light: Sun, point: Point) -> tuple[Depth, Depth]:
        del scene
        suns, by_sun = self.suns.near(light, point)
        levels, by_level = between(self.altitude, point.altitude)
        mix = lambda x: contract("i,j,ij...->...", by_level, by_sun, x[levels][:, suns])
        scale = jnp.exp(mix(self.reference))
        return scale * mix(self.up), scale * mix(self.down)

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
        del once
        seen, column = self.along(scene, light, towards, sight, nodes)
        depth = contract("m,ml->l", column, self.mixture.extinction)
        albedo = scene.ground.evaluate(wavelength) * jnp.exp(-depth)
        down = self.sent_down(scene, light, towards, sight)
        ground = albedo[None] / math.pi * down
        seen = seen.at[:, 0].add(jnp.where(sight.grounded, ground, 0.0))
        return seen * light.irradiance.evaluate(wavelength)[None, None]

    def along(
        self,
        scene: Scene,
        light: Sun,
        towards: Float[Array, "light 3"],
        sight: Sight,
        nodes: int,
        ground: Ground | None = None,
    ) -> tuple[Float[Array, "light part wl"], Float[Array, "medium"]]:
        """Light of irradiance 1 from along a line, without its end; and its columns.

        Where there is ground apart, what it adds to I, or I, Q and U, if it sends back
        as a radiance what it receives while it is black, follows them.
        """
        # The line's vertical plane is the same everywhere, so that Q and U simply add.
        path, length = sight.path, sight.length
        u, w = (jnp.asarray(x, length.dtype) for x in gauss_legendre(nodes))
        inner = jnp.asarray(cumulative(nodes), length.dtype)
        places = sight.begin[:, None] + length[:, None] * u[None]
        points = jax.vmap(jax.vmap(path.at))(places)
        density = jax.vmap(jax.vmap(lambda x: densities(scene, x)))(points)
        amount = density * length[:, None, None]
        lost = contract("pjm,ml->pjl", amount, self.mixture.extinction)
        depth = contract("j,pjl->pl", w, lost)
        within = contract("ij,pjl->pil", inner, lost)
        # The rule by Gauss, made exact for light that is everywhere the same.
        share = w[None, :, None] * jnp.exp(within[:, :1] - within)
        even = jnp.sum(share * lost, 1)
        empty = even <= 0.0
        whole = jnp.where(empty, 1.0, -jnp.expm1(-depth) / jnp.where(empty, 1.0, even))
        arrives = whole * jnp.exp(depth - jnp.cumsum(depth, 0))
        share = share * (length[:, None] * arrives)[:, None]
        source = self._sources(light, towards, points, density, path.direction, ground)
        seen = contract("pjl,pjasl->asl", share, source)
        return seen, contract("j,pjm->m", w, amount)

    def _sources(
        self,
        light: Sun,
        towards: Float[Array, "light 3"],
        points: Point,
        density: Float[Array, "piece node medium"],
        view: Direction,
        ground: Ground | None,
    ) -> Float[Array, "piece node light part wl"]:
        """What a metre adds, at places along a ray, to the light that arrives."""

        def near(point):
            zenith = jax.vmap(lambda x: zenith_angle(point.up, x))(towards)
            around = waves(point.up, view, towards, count, self.stokes)
            basis = travel(-dot(point.up, view), count, k)
            levels, by_level = between(self.altitude, point.altitude)
            return levels, by_level, basis, around, *self.suns.between(light, zenith)

        count, k = self.mixture.scattering.shape[1], self.mixture.polarised.shape[1]
        *known, first, by_sun = jax.vmap(jax.vmap(near))(points)
        taps, suns = by_sun.shape[-1], self.reference.shape[1]

        def sources(width):
            start = jnp.minimum(jnp.min(first, -1), suns - width)
            spread = jax.vmap(jax.vmap(lambda i, by: _spread(i, by, width)))
            weights = spread(first - start[..., None], by_sun)
            # Its gradient finds what was mixed anew: kept, it would fill the memory.
            mixed = lambda *x: self._source(ground, *x)
            of_place = jax.checkpoint(mixed, prevent_cse=False)
            of_piece = lambda x: jax.vmap(of_place)(*x)
            places = density, *known, start, weights
            return lambda: jax.lax.map(of_piece, places)

        widths = [taps]
        if len(towards) > 1:
            widths = sorted({min(x, suns) for x in (_FEW, _MORE, suns)})
        needed = jnp.max(jnp.max(first, -1) - jnp.min(first, -1)) + taps
        which = jnp.sum(needed > jnp.array(widths[:-1], jnp.int32), dtype=jnp.int32)
        return jax.lax.switch(which, [sources(x) for x in widths])

    def _source(
        self,
        ground: Ground | None,
        density: Float[Array, "medium"],
        levels: Int[Array, "4"],
        by_level: Float[Array, "4"],
        basis: Travel,
        around: Float[Array, "light stokes m"],
        start: Int[Array, ""],
        by_sun: Float[Array, "light near"],
    ) -> Float[Array, "light part wl"]:
        """The same at one place, with weights of the suns from one on."""
        _, rows, suns, wl = self.moments.shape
        width = by_sun.shape[1]
        # Rows without an end are several times as quick as tables of tables.
        table = self.moments.reshape(-1, rows, suns * wl)
        size = 1, rows, width * wl
        mixed = jnp.zeros(size[1:], table.dtype)
        for i, level in enumerate(levels):
            at = level, jnp.zeros_like(start), start * wl
            mixed += by_level[i] * jax.lax.dynamic_slice(table, at, size)[0]
        near = jax.lax.dynamic_slice_in_dim(self.reference, start, width, 1)
        reference = contract("i,is->s", by_level, near[levels])
        bright = by_sun * jnp.exp(contract("as,s->a", by_sun, reference))[:, None]
        if ground is not None:
            glow = contract("i,irl->rl", by_level, ground.moments[levels])
            mixed = jnp.concatenate([mixed, glow], 1)
        add = lambda x: contract("m,m...->...", density, x)
        scattering, polarised = self.mixture.scattering, self.mixture.polarised
        seen = turned(add(scattering), add(polarised), basis, mixed, self.stokes)
        seen = seen.reshape(self.stokes, -1, mixed.shape[1] // wl, wl)
        found = contract("asm,ak,smkl->asl", around, bright, seen[:, :, :width])
        if ground is None:
            return found
        lit = jax.lax.dynamic_slice_in_dim(ground.lit, start, width, 0)
        lit = contract("ak,kl->al", bright, lit)
        glow = contract("asm,sml->asl", around, seen[:, :, width]) * lit[:, None]
        return jnp.concatenate([found, glow], 1)


def _spread(
    first: Int[Array, "light"], weights: Float[Array, "light k"], width: int
) -> Float[Array, "light {width}"]:
    """Weights of a few in a row among as many as `width`."""
    place = first[:, None] + jnp.arange(weights.shape[1], dtype=jnp.int32)[None]
    taken = place[:, :, None] == jnp.arange(width, dtype=jnp.int32)[None, None]
    return jnp.sum(jnp.where(taken, weights[:, :, None], 0.0), 1)
