"""Diffuse light once more, along more directions than there are ordinates.

Near level, thin air shines as 1 - exp(-depth / cosine), which few ordinates resolve
badly. What they find is good as a source, though, as scattering has smoothed it: of
light that this source sends along many directions the moments are right, and those of
higher degrees are known as well.
"""

import math

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..transport import gauss_legendre
from ._harmonics import harmonics, pairs
from ._ordinates import Diffuse


# The thickest layer, across it or along the beam, within which a source may be taken as
# linear. Where there are thicker ones the ordinates, which ask nothing, know better.
_THICK = 0.5


def thin(
    depth: Float[Array, "layer wl"], slant: Float[Array, "level sun wl"]
) -> Float[Array, "sun wl"]:
    """From 1 where all layers are thin to 0 where any is thick."""
    thickest = jnp.max(jnp.diff(slant, axis=0), 0)
    thickest = jnp.maximum(thickest, jnp.max(depth, 0)[None])
    # Of four times that nothing is left, and its slope is none.
    return jnp.exp(-(jnp.minimum(thickest / _THICK, 4.0) ** 4))


def follow(
    light: Diffuse,
    depth: Float[Array, "layer wl"],
    scattering: Float[Array, "layer l wl"],
    slant: Float[Array, "level sun wl"],
    passed: Float[Array, "level sun wl"],
    cosine: Float[Array, "sun"],
    polarised: Float[Array, "layer k 3 wl"],
    share: Float[Array, "sun wl"],
    *,
    nodes: int,
) -> tuple[Diffuse, Float[Array, "sun wl"]]:
    """The same light with so many degrees, and what of it comes down to the ground.

    `scattering` is the depth of scattering times the moments of the phase function, of
    which `light` has fewer. `slant` is the optical depth along the beam to each level;
    `passed` is less, what the ordinates took from it. The rest, light that went on in
    peaks that are resolved here, is diffuse. `nodes` are the directions to either side.
    Of light that is `polarised` Q and U stay what they were. So much as `share` is
    followed, of `thin`.
    """
    count, k = scattering.shape[1], polarised.shape[1]
    l, m = pairs(count)
    old, rest = jnp.split(light.moments, [light.moments.shape[2] - k * (k + 1)], 2)
    once = jnp.asarray(np.where(m == 0, 1.0, 2.0) / (2.0 * math.pi), depth.dtype)
    beam = harmonics(-cosine, count)[:, l, m] * once[None]
    beam = beam[None, :, :, None]
    ahead = jnp.exp(-passed) * -jnp.expm1(passed - slant)
    more = len(l) - old.shape[2]
    moments = jnp.pad(old, ((0, 0), (0, 0), (0, more), (0, 0)))
    whole = moments + beam * jnp.exp(-passed)[:, :, None]
    moments = moments + beam * ahead[:, :, None]
    down = light.down + jnp.maximum(cosine, 0.0)[None, :, None] * ahead

    ground = light.up[-1] / math.pi
    # As of `_harmonics`: what E of polarised light adds to T.
    turned = _by_order(whole, count), scattering
    across = _by_order(rest[:, :, : k * (k + 1) // 2], k), polarised[:, :, 2]
    both = slice(-1), slice(1, None)
    top, bottom = (
        _source(*turned, x).at[:k, :k].add(_source(*across, x)) for x in both
    )
    found, received = _once_more(top, bottom, depth, ground, nodes)
    mix = lambda old, new, share: old + share * (new - old)
    received = mix(down[-1], received, share)
    moments = mix(moments, found, share[None, :, None])
    moments = jnp.concatenate([moments, rest], 2)
    return Diffuse(moments, light.up, down), received


def _by_order(moments, count):
    """From [level, sun, pair, wl] to [m, l, level, sun, wl]."""
    l, m = pairs(count)
    known = np.zeros((count, count), np.int32)
    known[m, l] = np.arange(len(l))
    rows = jnp.moveaxis(moments, 2, 0)[known.ravel()]
    return rows.reshape(count, count, *rows.shape[1:])


def _source(rows, coefficient, levels):
    """Of light at the levels above layers, or below them, what these scatter."""
    count = coefficient.shape[1]
    degrees = jnp.asarray(np.arange(count) + 0.5, rows.dtype)[None, :, None]
    turned = jnp.moveaxis(coefficient * degrees, 1, 0)[None, :, :, None]
    return rows[:, :, levels] * turned


def _once_more(top, bottom, depth, ground, nodes):
    """Moments [level, sun, pair, wl] of light from a source [m, l, layer, sun, wl].

    That is known at the top of layers and at their bottom.
    """
    count = top.shape[1]
    l, m = pairs(count)
    mu, weight = gauss_legendre(nodes)
    p = np.moveaxis(harmonics(mu, count), 0, -1).swapaxes(0, 1)  # m, l, node
    sign = (-1.0) ** (np.arange(count)[:, None] + np.arange(count))[:, :, None]
    constant = lambda x: jnp.asarray(x, depth.dtype)
    upwards, downwards = constant(p), constant(sign * p)

    cosine = constant(mu)[None, :, None]
    x = depth[:, None] / cosine
    near, far = _linear(x)
    fades = jnp.exp(-x)
    near, far = (y / cosine for y in (near, far))
    along = lambda way, x: jnp.einsum("mln,mlksw->kmnsw", way, x, precision="highest")
    wide = lambda x: x[:, None, :, None]
    down = wide(far) * along(downwards, top) + wide(near) * along(downwards, bottom)
    up = wide(near) * along(upwards, top) + wide(far) * along(upwards, bottom)

    def step(light, layer):
        fades, gain = layer
        light = light * fades[None, :, None] + gain
        return light, light

    none = jnp.zeros_like(down[0])
    _, falls = jax.lax.scan(step, none, (fades, down))
    falls = jnp.concatenate([none[None], falls])
    start = none.at[0].set(ground[None])
    _, rises = jax.lax.scan(step, start, (fades, up), reverse=True)
    rises = jnp.concatenate([rises, start[None]])
    sums = lambda way, x: jnp.einsum(
        "mln,kmnsw->mlksw", way * constant(weight)[None, None], x, precision="highest"
    )
    moments = sums(upwards, rises) + sums(downwards, falls)
    flux = constant(2.0 * math.pi * mu * weight)
    received = jnp.einsum("n,nsw->sw", flux, falls[-1, 0], precision="highest")
    return jnp.moveaxis(moments[m, l], 0, 2), received


def _linear(x):
    """What a source at the near and at the far face counts, over the depth between.

    That is (1 - s) / x and (s - exp(-x)) / x, with s = (1 - exp(-x)) / x.
    """
    thin = x < 0.1
    some = jnp.where(thin, 1.0, x)
    mean = -jnp.expm1(-some) / some
    near, far = (1.0 - mean) / some, (mean - jnp.exp(-some)) / some
    few = jnp.where(thin, x, 0.0)
    series = lambda terms: sum((-few) ** i * c for i, c in enumerate(terms))
    factorial = [1 / 2, 1 / 6, 1 / 24, 1 / 120, 1 / 720]
    close = series(factorial)
    away = series([(i + 1) * c for i, c in enumerate(factorial)])
    return jnp.where(thin, close, near), jnp.where(thin, away, far)
