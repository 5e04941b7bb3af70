"""What polarisation adds to the light that scatters towards one."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..polarisation import frame
from ..quantity import Direction
from ._harmonics import harmonics, pairs, spin_harmonics


def scattered(
    polarised: Float[Array, "k 3 wl"],
    radiance: Float[Array, "pair wl"],
    rest: Float[Array, "part wl"],
    up: Direction,
    view: Direction,
    sun: Direction,
) -> Float[Array, "3 wl"]:
    """I, Q and U that a metre adds in direction `view`, but for alpha1 times T.

    `polarised` is the scattering coefficient times alpha2, alpha3 and beta1 of degrees
    below k. `radiance` are moments T in the order of `pairs`, of these degrees and
    maybe more; `rest` are E and then B of all pairs of these.
    """
    k = polarised.shape[0]
    if not k:
        return jnp.zeros((3, *radiance.shape[1:]), radiance.dtype)
    l, m = pairs(k)
    t, (e, b) = radiance[: len(l)], jnp.split(rest, 2)
    alpha2, alpha3, beta = (polarised[l, i] for i in range(3))
    # As of `_harmonics`.
    t, e, b = beta * e, beta * t + alpha2 * e, alpha3 * b
    cosine = -jnp.dot(up, view)
    p, r, s = (x[l, m] for x in (harmonics(cosine, k), *spin_harmonics(cosine, k)))
    cosines, sines = (
        x[m] * jnp.asarray(l + 0.5, x.dtype) for x in _turns(up, view, sun, k)
    )
    add = lambda weight, moments: jnp.sum(weight[:, None] * moments, 0)
    i = add(p * cosines, t)
    q = add(r * cosines, e) + add(s * cosines, b)
    u = add(s * sines, e) + add(r * sines, b)
    return jnp.stack([i, q, u])


def _turns(
    up: Direction, view: Direction, sun: Direction, count: int
) -> tuple[Float[Array, "m"], Float[Array, "m"]]:
    """Cosines and sines of multiples of the azimuth of the view, from the sun's."""
    right, _ = frame(up, view)
    aside, ahead = jnp.dot(right, sun), jnp.dot(jnp.cross(up, right), sun)
    squared = aside * aside + ahead * ahead
    known = squared > float(jnp.finfo(up.dtype).tiny)
    root = jnp.sqrt(jnp.where(known, squared, 1.0))
    cosine, sine = jnp.where(known, ahead / root, 1.0), -aside / root
    one = jnp.ones_like(cosine)
    found = [jnp.stack([one, 0.0 * one]), jnp.stack([cosine, sine])]
    for _ in range(count - 2):
        found.append(2.0 * cosine * found[-1] - found[-2])
    cosines, sines = jnp.stack(found[:count], 1)
    return cosines, sines
