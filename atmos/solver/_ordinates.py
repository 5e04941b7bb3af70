"""Diffuse light in a stack of flat layers, by discrete ordinates.

In every layer the sum s and the difference d of the radiance upwards and downwards obey
s' = A d - q, d' = B s - p, with small symmetric matrices; so do those of I, Q and U
together, if U is taken with the other sign downwards. What a layer does is then

    d_bottom - d_top = Y (s_bottom + s_top) + beam
    s_bottom - s_top = Z (d_bottom + d_top) + beam,

where Y and Z are matrices of the hyperbolic tangent of half its thickness: begun on a
thin slice as a ratio of polynomials and doubled by the theorem of addition. No
eigenvalue is asked for, so that nothing is special where light is conserved, where a
layer is empty or where the sun stands at an ordinate. Layers are joined from the ground
up, where d = G s + g relates the two at each level.

Small matrices lie along the first axes and everything that is alike along the last.
"""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ._basis import Basis, basis
from ._harmonics import harmonics, pairs
from ._layer import identity, inverse_of, product, respond, START


class Diffuse(eqx.Module):
    """Diffuse light at levels, top first, for beams of irradiance 1 across them.

    The last of the suns is none: it is ground that shines evenly, with radiance 1.
    `moments` are integrals over all directions of travel of the radiance times
    `harmonics`, in the order of `pairs`: the T of `_harmonics`. Where there is
    polarisation, the moments E of all pairs of degrees that it has follow, and then B.
    Up and down are fluxes.
    """

    moments: Float[Array, "level sun pair wl"]
    up: Float[Array, "level sun wl"]
    down: Float[Array, "level sun wl"]


def solve_column(
    depth: Float[Array, "layer wl"],
    scattering: Float[Array, "layer l wl"],
    slant: Float[Array, "level sun wl"],
    cosine: Float[Array, "sun"],
    polarised: Float[Array, "layer k 3 wl"],
    *,
    nodes: int,
) -> Diffuse:
    """The diffuse light in layers, top first, over black ground, and of such ground.

    `scattering` is the depth of scattering times the moments of the phase function, no
    more than twice the ordinates to either side, `nodes`. `polarised` is that times the
    moments of polarisation; with no degree of these it is radiance alone that is found.
    `slant` is the optical depth along the beam to each level, and `cosine` that of the
    zenith angle of where it comes from. The last sun is to be none, whose light does
    not arrive, as the ground shines in its place.
    """
    count, k = scattering.shape[1], polarised.shape[1]
    matrix = [scattering, *(polarised[:, :, i] for i in range(3))]
    solve = lambda made, known: _solve(made, depth, known, slant, cosine)
    # Orders of azimuth that polarisation has no part in are solved without it.
    parts = []
    if k:
        made = basis(nodes, count, k, 0, k)
        parts.append(solve(made, jnp.concatenate(matrix, 1)))
    if k < count:
        parts.append(solve(basis(nodes, count, 0, k, count), scattering))
    l, m = pairs(count)
    radiance = jnp.concatenate([x[:, :, :, :count] for x, _, _ in parts], 2)
    moments = [radiance[:, :, m, l]]
    if k:
        l, m = pairs(k)
        rest = parts[0][0][:, :, :, count:]
        moments += [rest[:, :, m, l], rest[:, :, m, k + l]]
    return Diffuse(jnp.concatenate(moments, 2), *parts[0][1:])


def _solve(
    made: Basis, depth: Array, scattering: Array, slant: Array, cosine: Array
) -> tuple[Array, Array, Array]:
    """Moments [level, sun, m, term, wl] of some orders of azimuth; fluxes of order 0.

    `scattering` has the coefficients that are those of the basis.
    """
    constant = lambda x: jnp.asarray(x, depth.dtype)
    scale = np.sqrt(made.weight / made.cosine)

    # What scatters from one ordinate to another, over the root of both cosines.
    turn = constant(made.sums), constant(made.differences)
    along = constant(np.diag(1.0 / made.cosine)[:, :, None, None])
    # What scatters out of the beam.
    beam = jnp.moveaxis(harmonics(-cosine, made.degrees), 0, -1)
    beam = beam[made.degree][:, made.orders]
    reach = constant(made.reach)
    beam = jnp.einsum("imq,qms->ismq", reach, beam, precision="highest")
    sides = made.alike.T[None, None]
    lit = beam * constant(sides), beam * constant(~sides)
    into = lambda a, b: jnp.einsum("...l,lw->...w", a, b, precision="highest")
    # Orders and wavelengths as one axis, as processors are quick along long ones.
    both = len(made.orders), depth.shape[1]
    joined = lambda x: x.reshape(*x.shape[:-2], -1)
    apart = lambda x: x.reshape(*x.shape[:-1], *both)

    fall = jnp.diff(slant, axis=0)
    doublings = _doublings(depth / float(made.cosine[0]), fall)

    @jax.checkpoint
    def up(below, layer):
        stack, light = below
        depth, scattering, top, fall, doublings = layer
        small = jnp.exp2(-doublings.astype(depth.dtype))
        thin = along * (small * depth)[None, None, None]
        b, a = (joined(thin - into(x, small * scattering)) for x in turn)
        arrives = small * jnp.exp(-top)[None, :, None]
        p, q = (joined(into(x, scattering) * arrives) for x in lit)
        fall = jnp.broadcast_to((small * fall)[:, None], (len(fall), *both))
        y, z, p, r = respond(a, b, p, q, joined(fall)[None], doublings)
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

    # Of intensities alone: what the ground sends is not polarised.
    intensity = np.arange(len(scale)) < made.nodes
    c = constant(np.where(intensity, np.sqrt(made.weight * made.cosine), 0.0))
    ground = _ground(c, constant(made.orders == 0), jnp.zeros_like(slant[0]))
    below = joined(ground[0]), joined(ground[1])
    (stack, light), layers = jax.lax.scan(
        up, below, (depth, scattering, slant[:-1], fall, doublings), reverse=True
    )
    # At the top nothing comes down: s = d.
    top = product(inverse_of(identity(stack) - stack), light)
    _, (sums, differences) = jax.lax.scan(down, top, layers)
    sums = apart(jnp.concatenate([top[None], sums]))
    differences = apart(jnp.concatenate([top[None], differences]))

    weigh = lambda kind, x: jnp.einsum(
        "tmi,kismw->ksmtw",
        constant(made.functions * scale * kind[:, :, None]),
        x,
        precision="highest",
    )
    moments = weigh(made.even, sums) + weigh(~made.even, differences)
    flux = lambda x: (
        math.pi * jnp.einsum("i,kisw->ksw", c, x[:, :, :, 0], precision="highest")
    )
    return moments, flux(sums + differences), flux(sums - differences)


def _doublings(
    steepest: Float[Array, "layer wl"], fall: Float[Array, "layer sun wl"]
) -> Int[Array, "layer"]:
    """How often to halve each layer until its slices are thin enough."""
    largest = jnp.maximum(jnp.max(steepest, 1), jnp.max(fall, (1, 2), initial=0.0))
    halves = jnp.maximum(0.5 * jax.lax.stop_gradient(largest) / START, 1.0)
    return jnp.ceil(jnp.log2(halves)).astype(jnp.int32)


def _ground(c: Array, first: Array, none: Array) -> tuple[Array, Array]:
    """G and g of ground that returns nothing, and that shines in place of the last sun.

    With c the root of weight times cosine: of a radiance of 1 that is c, upwards alone,
    so that the sum is s = c + v of what comes down and the difference d = 2 c - s.
    """
    shape = len(c), len(first), none.shape[-1]
    black = -jnp.eye(len(c), dtype=c.dtype)[:, :, None, None]
    shines = jnp.ones_like(none).at[:-1].set(0.0)
    glow = first[None, None, :, None] * shines[None, :, None]
    glow = 2.0 * c[:, None, None, None] * glow
    return jnp.broadcast_to(black, (len(c), *shape)), glow
