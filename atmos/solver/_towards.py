"""What scatters towards one of light that is known by its moments.

In the functions of direction of `_harmonics`: apart for each multiple m of the azimuth
from the light's, so that lights all around share all but the last step.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..polarisation import frame
from ..quantity import Direction, dot, Number
from ..transport import contract
from ._harmonics import harmonics, pairs, spin_harmonics


class Travel(eqx.Module):
    """Functions P, R and S of one direction, of `_harmonics`, for all pairs."""

    p: Float[Array, "pair"]
    r: Float[Array, "some"]
    s: Float[Array, "some"]


def travel(cosine: Number, count: int, polarised: int) -> Travel:
    """Of degrees below a count: for radiance, and for polarisation."""
    l, m = pairs(count)
    p = harmonics(cosine, count)[l, m]
    l, m = pairs(polarised)
    r, s = (x[l, m] for x in spin_harmonics(cosine, polarised))
    return Travel(p, r, s)


def turned(
    scattering: Float[Array, "l wl"],
    polarised: Float[Array, "k 3 wl"],
    travel: Travel,
    moments: Float[Array, "row column"],
    stokes: int,
) -> Float[Array, "{stokes} m column"]:
    """I, or I, Q and U, that a metre adds to light that travels in one direction.

    `polarised` is the scattering coefficient times alpha2, alpha3 and beta1. `moments`
    are T of all pairs of degrees below l, and then E and B of those below k; columns
    run over wavelengths, once or again and again.
    """
    count, k = scattering.shape[0], polarised.shape[0]
    l, m = pairs(count)
    times = moments.shape[1] // scattering.shape[1]
    wide = lambda x, l: jnp.tile(x[l] * jnp.asarray(l + 0.5, x.dtype)[:, None], times)
    # Sums over degrees as a product, with a row for each m.
    row = m == np.arange(count)[:, None]
    sums = lambda x: x[None] * jnp.asarray(row[:, : len(x)], x.dtype)
    intensity, rest = moments[: len(l)], moments[len(l) :]
    add = lambda x, y: contract("mp,pc->mc", sums(x), y)
    seen = add(travel.p, wide(scattering, l) * intensity)[None]
    if stokes == 1:
        return seen
    l, m = pairs(k)
    t, (e, b) = intensity[: len(l)], jnp.split(rest, 2)
    alpha2, alpha3, beta = (wide(polarised[:, i], l) for i in range(3))
    # As of `_harmonics`.
    t, e, b = beta * e, beta * t + alpha2 * e, alpha3 * b
    i = seen[0] + add(travel.p[: len(l)], t)
    q = add(travel.r, e) + add(travel.s, b)
    u = add(travel.s, e) + add(travel.r, b)
    return jnp.stack([i, q, u])


def waves(
    up: Direction,
    view: Direction,
    towards: Float[Array, "light 3"],
    count: int,
    stokes: int,
) -> Float[Array, "light {stokes} m"]:
    """What each multiple of the azimuth of a view, from a light's, counts in them.

    Cosines in I and Q, and sines in U.
    """
    right, _ = frame(up, view)
    forward = jnp.cross(up, right)

    def of(sun):
        aside, ahead = dot(right, sun), dot(forward, sun)
        squared = aside * aside + ahead * ahead
        known = squared > float(jnp.finfo(up.dtype).tiny)
        root = jnp.sqrt(jnp.where(known, squared, 1.0))
        cosine, sine = jnp.where(known, ahead / root, 1.0), -aside / root
        one = jnp.ones_like(cosine)
        found = [jnp.stack([one, 0.0 * one]), jnp.stack([cosine, sine])]
        for _ in range(count - 2):
            found.append(2.0 * cosine * found[-1] - found[-2])
        cosines, sines = jnp.stack(found[:count], 1)
        return jnp.stack([cosines, cosines, sines][:stokes])

    return jax.vmap(of)(towards)
