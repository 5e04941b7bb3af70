"""Diffuse light in a stack of flat layers, by discrete ordinates.

In every layer the sum s and the difference d of the radiance upwards and downwards obey
s' = A d - q, d' = B s - p, with small symmetric matrices. What a layer does is then

    d_bottom - d_top = Y (s_bottom + s_top) + beam
    s_bottom - s_top = Z (d_bottom + d_top) + beam,

where Y and Z are matrices of the hyperbolic tangent of half its thickness: begun on a
thin slice as a ratio of polynomials and doubled by the theorem of addition. No
eigenvalue is asked for, so that nothing is special where light is conserved, where a
layer is empty or where the sun stands at an ordinate. Layers are joined from the ground
up, where d = G s + g relates the two at each level.

Small matrices lie along the first axes and everything that is alike along the last.
"""

import functools as ft
import math
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..transport import gauss_legendre
from ._layer import identity, inverse_of, product, respond, START


class Diffuse(eqx.Module):
    """Diffuse light at levels, top first, for a beam of irradiance 1 across it.

    `moments` are integrals over all directions of travel of the radiance times
    `harmonics`, in the order of `pairs`; up and down are fluxes.
    """

    moments: Float[Array, "level sun pair wl"]
    up: Float[Array, "level sun wl"]
    down: Float[Array, "level sun wl"]


@ft.cache
def pairs(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Degrees l below `count` and orders m up to l, by degree."""
    return np.tril_indices(count)


def harmonics(cosine: Array | np.ndarray, count: int) -> Any:
    """Associated Legendre functions of degree and order below `count`: [..., l, m].

    Normalised by ((l - m)! / (l + m)!)^(1/2), without the sign (-1)^m. Of NumPy's
    arrays they are one of NumPy's.
    """
    xp = np if isinstance(cosine, np.ndarray) else jnp
    x = cosine[..., None]
    m = np.arange(count)
    row_of = lambda values: np.asarray(values, x.dtype)[(None,) * (x.ndim - 1)]
    inside = x * x < 1.0
    sine = xp.where(inside, xp.sqrt(xp.where(inside, 1.0 - x * x, 1.0)), 0.0)
    edge = xp.ones_like(x)
    row = edge * row_of(m == 0)
    before, rows = xp.zeros_like(row), [row]
    for l in range(count - 1):
        edge = edge * sine * row_of([math.sqrt((2 * l + 1) / (2 * l + 2))])
        scale = np.sqrt(np.maximum((l + 1) ** 2 - m * m, 1.0))
        ahead = row_of((2 * l + 1) / scale * (m <= l))
        back = row_of(np.sqrt(np.maximum(l * l - m * m, 0.0)) / scale)
        row, before = ahead * x * row - back * before + edge * row_of(m == l + 1), row
        rows.append(row)
    return xp.stack(rows, -2)


@ft.cache
def _basis(n: int):
    """Cosines, weights and harmonics of the ordinates; what is even under reversal."""
    mu, w = gauss_legendre(n)
    legendre = np.moveaxis(harmonics(mu, 2 * n), 0, -1)  # l, m, node
    l, m = np.indices((2 * n, 2 * n))
    even = (l + m) % 2 == 0
    return mu, w, legendre, even


def solve_column(
    depth: Float[Array, "layer wl"],
    scattering: Float[Array, "layer l wl"],
    slant: Float[Array, "level sun wl"],
    cosine: Float[Array, "sun"],
    albedo: Float[Array, "wl"],
) -> Diffuse:
    """The diffuse light in layers, top first, over a Lambertian ground.

    `scattering` is the depth of scattering times the moments of the phase function, an
    even number of them: as many streams. `slant` is the optical depth along the beam to
    each level, and `cosine` that of the zenith angle of where it comes from.
    """
    streams = scattering.shape[1]
    mu, w, legendre, even = _basis(streams // 2)
    constant = lambda x: jnp.asarray(x, depth.dtype)
    odd = ~even
    scale = np.sqrt(w / mu)
    degree = 2.0 * np.arange(streams) + 1.0

    # What scatters from one ordinate to another, over the root of both cosines.
    both = np.einsum("l,lmi,lmj,i,j->ijml", degree, legendre, legendre, scale, scale)
    turn = constant(both * even.T), constant(both * odd.T)
    along = constant(np.diag(1.0 / mu)[:, :, None, None])
    # What scatters out of the beam.
    twice = np.where(np.arange(streams) == 0, 1.0, 2.0) / (2.0 * math.pi)
    reach = constant(np.einsum("l,lmi,i,m->iml", degree, legendre, scale, twice))
    beam = jnp.moveaxis(harmonics(-cosine, streams), 0, -1)
    beam = jnp.einsum("iml,lms->isml", reach, beam, precision="highest")
    lit = beam * constant(even.T)[None, None], beam * constant(odd.T)[None, None]
    into = lambda a, b: jnp.einsum("...l,lw->...w", a, b, precision="highest")

    fall = jnp.diff(slant, axis=0)
    doublings = _doublings(depth / float(mu[0]), fall)
    small = jnp.exp2(-doublings.astype(depth.dtype))

    @jax.checkpoint
    def up(below, layer):
        stack, light = below
        depth, scattering, top, fall = layer
        thin = along * (small * depth)[None, None, None]
        b, a = (thin - into(x, small * scattering) for x in turn)
        arrives = small * jnp.exp(-top)[None, :, None]
        p, q = (into(x, scattering) * arrives for x in lit)
        y, z, p, r = respond(a, b, p, q, (small * fall)[None, :, None], doublings)
        solved = inverse_of(identity(y) + product(z, y - 2.0 * stack))
        on = product(solved, identity(y) - product(z, y))
        start = product(solved, product(z, 2.0 * light - p) + r)
        light = product(stack - y, start) + light - p
        stack = product(stack - y, on) - y
        return (stack, light), (on, start, *below)

    def down(s, layer):
        on, start, stack, light = layer
        below = product(on, s) + start
        return below, (below, product(stack, below) + light)

    c = constant(np.sqrt(w * mu))
    arrives = jnp.maximum(cosine, 0.0)[:, None] * jnp.exp(-slant[-1])
    ground = _ground(c, streams, albedo[None, None, None], arrives)
    (stack, light), layers = jax.lax.scan(
        up, ground, (depth, scattering, slant[:-1], fall), reverse=True
    )
    # At the top nothing comes down: s = d.
    top = product(inverse_of(identity(stack) - stack), light)
    _, (sums, differences) = jax.lax.scan(down, top, layers)
    sums = jnp.concatenate([top[None], sums])
    differences = jnp.concatenate([top[None], differences])

    weigh = lambda kind, x: jnp.einsum(
        "lmi,kismw->ksmlw",
        constant(legendre * scale * kind[:, :, None]),
        x,
        precision="highest",
    )
    l, m = pairs(streams)
    moments = (weigh(even, sums) + weigh(odd, differences))[:, :, m, l]
    flux = lambda x: (
        math.pi * jnp.einsum("i,kisw->ksw", c, x[:, :, :, 0], precision="highest")
    )
    return Diffuse(moments, flux(sums + differences), flux(sums - differences))


def _doublings(steepest: Array, fall: Array) -> Array:
    """How often to halve the layers until their slices are thin enough."""
    largest = 0.5 * jnp.maximum(jnp.max(steepest), jnp.max(fall, initial=0.0))
    found = jnp.ceil(jnp.log2(jnp.maximum(jax.lax.stop_gradient(largest) / START, 1.0)))
    return found.astype(jnp.int32)


def _ground(
    c: Array, streams: int, albedo: Array, arrives: Array
) -> tuple[Array, Array]:
    """G and g of a Lambertian ground, on which a beam of flux `arrives` falls.

    With c the root of weight times cosine, the squares of which sum to 1/2: light that
    goes down as v comes up as 2 albedo c (c v).
    """
    first = jnp.asarray(np.arange(streams) == 0, c.dtype)[:, None]
    share = albedo / (1.0 + albedo)
    bounce = (c[:, None] * c[None])[:, :, None, None] * first[None, None]
    black = jnp.eye(len(c), dtype=c.dtype)[:, :, None, None]
    glow = c[:, None, None, None] * first[None, None] * arrives[None, :, None]
    return 4.0 * share * bounce - black, 2.0 / math.pi * share * glow
