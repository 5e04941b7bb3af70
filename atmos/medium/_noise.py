"""Smooth random numbers in space: gradient noise (Perlin 2002)."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Integer

from ..quantity import Number


def fractal(place: Float[Array, "3"], octaves: int, seed: int) -> Number:
    """Noise and noise of half the size and the strength, and so on: from -1 to 1.

    Its largest billows have a size of about 1.
    """
    powers = jnp.arange(octaves, dtype=place.dtype)
    places = place[None, :] * jnp.exp2(powers)[:, None]
    seeds = jnp.uint32(seed) + jnp.arange(octaves, dtype=jnp.uint32)
    weights = jnp.exp2(-powers)
    found = jnp.sum(jax.vmap(_noise)(places, seeds) * weights) / jnp.sum(weights)
    return jnp.clip(found, -1.0, 1.0)


def _noise(place: Float[Array, "3"], seed: Integer[Array, ""]) -> Number:
    low = jnp.floor(place)
    part = place - low
    smooth = part * part * part * (part * (part * 6.0 - 15.0) + 10.0)
    corners = jnp.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    cells = jnp.int32(low)[None, :] + corners.astype(jnp.int32)
    apart = part[None, :] - corners.astype(place.dtype)
    found = jax.vmap(_slope, (0, 0, None))(cells, apart, seed).reshape(2, 2, 2)
    for share in smooth:
        found = found[0] + share * (found[1] - found[0])
    return found


def _slope(
    cell: Integer[Array, "3"], apart: Float[Array, "3"], seed: Integer[Array, ""]
) -> Number:
    """How far one has gone up a slope towards one of the twelve edges of a cube."""
    x, y, z = cell.astype(jnp.uint32) * jnp.uint32(1664525) + seed
    # Jarzynski and Olano (2020): pcg3d, a hash of three numbers.
    for _ in range(2):
        x += y * z
        y += z * x
        z += x * y
        x, y, z = (a ^ (a >> jnp.uint32(16)) for a in (x, y, z))
    edge = x & jnp.uint32(15)
    one = jnp.where(edge < 8, apart[0], apart[1])
    last = (edge == 12) | (edge == 14)
    other = jnp.where(edge < 4, apart[1], jnp.where(last, apart[0], apart[2]))
    one = jnp.where(edge & jnp.uint32(1), -one, one)
    return one + jnp.where(edge & jnp.uint32(2), -other, other)
