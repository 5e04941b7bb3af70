"""Directions around a direction."""

import jax.numpy as jnp

from .quantity import Angle, Direction, inner, Versine


def basis(axis: Direction) -> tuple[Direction, Direction]:
    """Two directions across an axis, and across each other (Duff et al. 2017)."""
    x, y, z = axis
    sign = jnp.where(z >= 0.0, 1.0, -1.0)
    a = -1.0 / (sign + z)
    b = x * y * a
    one = jnp.stack([1.0 + sign * x * x * a, sign * b, -sign * x])
    return one, jnp.stack([b, sign + y * y * a, -y])


def around(axis: Direction, apart: Versine, angle: Angle) -> Direction:
    """The direction that is so far from an axis, at an angle around it."""
    one, other = basis(axis)
    squared = apart * (2.0 - apart)
    aside = squared > 0.0
    sine = jnp.where(aside, jnp.sqrt(jnp.where(aside, squared, 1.0)), 0.0)
    across = jnp.cos(angle) * one + jnp.sin(angle) * other
    found = axis - apart * axis + sine * across
    return found / jnp.sqrt(inner(found, found))
