"""The formula of Hosek and Wilkie 2012, whatever its channels are."""

import math

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..quantity import Angle, Cosine, Number, Spectral, Versine
from ._fitted import angle_between
from ._hosek_tables import sky_tables
from ._range import degrees, Range


LEAST_ELEVATION = 1e-15  # rad: a cube root has no slope at 0
RANGES = {"turbidity": Range(1.0, 10.0), "sun_zenith": degrees(0.0, 90.0)}


def configured(
    kind: str, turbidity: Number, albedo: Spectral, sun_zenith: Angle
) -> tuple[Float[Array, "channel 9"], Float[Array, "channel"]]:
    """The shape's coefficients, and the mean radiance that it multiplies."""
    elevation = jnp.maximum(0.5 * math.pi - sun_zenith, LEAST_ELEVATION)
    x = jnp.cbrt(elevation * (2.0 / math.pi))
    bezier = [math.comb(5, k) * x**k * (1.0 - x) ** (5 - k) for k in range(6)]
    weights = jnp.stack(bezier)

    def table(values):
        here = between(jnp.asarray(values, x.dtype), turbidity - 1.0)
        dark, white = jnp.tensordot(weights, here, (0, 1), precision="highest")
        share = albedo.reshape(-1, *(1,) * (dark.ndim - 1))
        return dark + share * (white - dark)

    tables = sky_tables(kind)
    return table(tables.shape), table(tables.mean)


def shape(
    coefficients: Float[Array, "channel 9"],
    mean: Float[Array, "channel"],
    up: Cosine,
    turned: Versine,
) -> Float[Array, "channel"]:
    """The formula of the paper."""
    a, b, c, d, e, f, g, i, h = coefficients.T
    cosine = 1.0 - turned
    square = cosine * cosine
    # 1 + h^2 - 2 h cos, which loses no digits near the sun.
    ring = (1.0 - h) ** 2 + 2.0 * h * turned
    chi = (1.0 + square) / (ring * jnp.sqrt(ring))
    some = up > 0.0
    root = jnp.where(some, jnp.sqrt(jnp.where(some, up, 1.0)), 0.0)
    glow = c + d * jnp.exp(e * angle_between(turned)) + f * square + g * chi + i * root
    return (1.0 + a * jnp.exp(b / (up + 0.01))) * glow * mean


def between(table: Float[Array, "n *rest"], place: Number) -> Float[Array, "*rest"]:
    """The table at a place between its entries, on a straight line."""
    first = jnp.clip(jnp.floor(place), 0.0, table.shape[0] - 2.0)
    low, high = table[first.astype(int)], table[first.astype(int) + 1]
    return low + (place - first) * (high - low)
