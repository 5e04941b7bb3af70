"""The rays along which light comes to tables, and light of the first order on them."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from ..optics import Layers, Mixture
from ..quantity import versine
from ..scene import Scene
from ..transport import contract, cumulative, densities, gauss_legendre
from ._harmonics import legendre
from ._second import lit_share
from ._sight import Sight, sight
from ._slants import slants


class Lines(eqx.Module):
    """Rays from every level in every view, in pieces.

    They lie in the plane of x and straight up, z. `up` is straight up in the middle of
    each piece and, last, where the ray ends: x and z of it. `layer` and `height` are
    the layer that a piece lies in, and how far up in it; `cosine` is that of the view
    from straight up; `share` is what one sees of a source, `left` of the ground.
    """

    up: Float[Array, "*n place 2"]
    layer: Int[Array, "*n piece"]
    height: Float[Array, "*n piece"]
    cosine: Float[Array, "*n piece"]
    share: Float[Array, "*n piece wl"]
    left: Float[Array, "*n wl"]


def lines(
    scene: Scene,
    mixture: Mixture,
    albedo: Float[Array, "wl"],
    cut: Layers,
    cosine: Float[Array, "level view"],
    suns: Float[Array, "turn sun 3"],
    pieces: int,
) -> tuple[Lines, Float[Array, "level view turn sun wl"]]:
    """All rays, and what light of suns of irradiance 1 that turned once comes there."""
    towards = slants(scene, cut.altitude)

    def look(ray):
        altitude, cosine = ray
        origin = jnp.zeros(3, altitude.dtype).at[2].set(altitude)
        level = jnp.sqrt(jnp.maximum(1.0 - cosine * cosine, 0.0))
        view = jnp.stack([level, jnp.zeros_like(level), cosine])
        line = sight(scene, origin, view, mixture.extinction, pieces)
        amount, middle = _pieces(scene, mixture, line)
        depth = contract("pm,ml->pl", amount, mixture.extinction)
        passed = jnp.cumsum(depth, 0)
        # What a piece takes is exactly what it lets not through.
        share = -jnp.expm1(-depth) * jnp.exp(depth - passed)
        left = jnp.where(line.grounded, jnp.exp(-passed[-1]), 0.0)
        places = jnp.append(line.begin + middle * line.length, line.far)
        points = jax.vmap(line.path.at)(places)

        rises = contract("pc,tsc->pts", points.up, suns)
        known = jax.vmap(towards.depths, (0, 0, None))
        beam = jnp.exp(-known(points.altitude, rises, mixture.extinction))
        hidden = lambda x: line.path.shadow(x, jnp.zeros_like(cosine))
        dark = jax.vmap(jax.vmap(hidden))(suns)
        lit = lit_share(line.begin, line.length, dark)
        each = share / jnp.where(depth > 0.0, depth, 1.0)
        apart = jax.vmap(jax.vmap(lambda x: versine(view, x)))(suns)
        lobes = legendre(apart, mixture.scattering.shape[1])
        first = (albedo / math.pi * left)[None, None] * beam[-1]
        first *= jnp.maximum(rises[-1], 0.0)[..., None]
        for m, scattering in enumerate(mixture.scattering):
            turned = each * amount[:, m, None]
            arrives = contract("pts,ptsl,pl->tsl", lit, beam[:-1], turned)
            first += contract("jts,jl->tsl", lobes, scattering) * arrives

        layer = jnp.searchsorted(cut.altitude, points.altitude[:-1], side="right") - 1
        layer = jnp.clip(layer, 0, len(cut.column) - 1).astype(jnp.int32)
        low, high = cut.altitude[layer], cut.altitude[layer + 1]
        height = (points.altitude[:-1] - low) / jnp.where(high > low, high - low, 1.0)
        turned = contract("pc,c->p", points.up[:-1], view)
        up, height = points.up[:, ::2], jnp.clip(height, 0.0, 1.0)
        return Lines(up, layer, height, turned, share, left), first

    above = jnp.broadcast_to(cut.altitude[:, None], cosine.shape)
    # A gradient would else keep every step of every ray.
    found = jax.lax.map(jax.checkpoint(look), (above.ravel(), cosine.ravel()))
    wide = lambda x: x.reshape(*cosine.shape, *x.shape[1:])
    return jax.tree.map(wide, found)


def _pieces(
    scene: Scene, mixture: Mixture, line: Sight
) -> tuple[Float[Array, "piece medium"], Float[Array, "piece"]]:
    """How many metres of density 1 of each medium a piece holds.

    And how far along it lies what one sees of it, on average.
    """
    u, w = (jnp.asarray(x, line.far.dtype) for x in gauss_legendre(_NODES))
    inner = jnp.asarray(cumulative(_NODES), line.far.dtype)
    points = jax.vmap(jax.vmap(line.path.at))(
        line.begin[:, None] + line.length[:, None] * u[None]
    )
    density = jax.vmap(jax.vmap(lambda x: densities(scene, x)))(points)
    amount = density * line.length[:, None, None]
    lost = contract("pjm,ml->pjl", amount, mixture.extinction)
    within = contract("ij,pjl->pil", inner, lost)
    seen = w[None, :, None] * lost * jnp.exp(-within)
    whole = jnp.sum(seen, 1, keepdims=True)
    some = whole > 0.0
    share = seen / jnp.where(some, whole, 1.0)
    share = jnp.where(some, share, w[None, :, None])
    middle = contract("pjl,j->pl", share, u)
    return contract("j,pjm->pm", w, amount), jnp.mean(middle, -1)


# Places in a piece.
_NODES = 3
