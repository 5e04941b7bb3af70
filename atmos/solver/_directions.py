"""Cells that directions are sorted into."""

import math

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Integer

from ..quantity import Direction, dot
from ..rotation import basis


# Rings about the zenith, the thinner the nearer to the horizon, where at dusk all light
# comes from; and parts of the half circle from the sun's azimuth.
_RINGS, _TURNS = 16, 8


def views(dtype: jnp.dtype) -> tuple[Float[Array, "view 3"], Float[Array, "view"]]:
    """The middles of the cells of `sort`, and their shares of the sphere."""
    edges = np.linspace(-1.0, 1.0, _RINGS + 1)
    edges = edges * np.abs(edges)
    z = 0.5 * (edges[1:] + edges[:-1])
    turn = (np.arange(_TURNS) + 0.5) * (np.pi / _TURNS)
    level = np.sqrt(1.0 - z * z)[:, None]
    views = [level * np.cos(turn), level * np.sin(turn), z[:, None] + 0.0 * turn]
    views = np.stack(views, -1).reshape(-1, 3)
    shares = np.repeat(np.diff(edges) / (2.0 * _TURNS), _TURNS)
    return jnp.asarray(views, dtype), jnp.asarray(shares, dtype)


def draw(
    index: Integer[Array, ""], u: Float[Array, "2"], up: Direction, sun: Direction
) -> Direction:
    """A direction from a cell of directions, all in it alike.

    Cells are rings about the zenith, cut by the angle from the sun's azimuth, to either
    side of it alike.
    """
    low, high = _ring(index, u.dtype)
    turn = (index % _TURNS).astype(u.dtype)
    z = low + (high - low) * u[0]
    side = 2.0 * u[1] - 1.0
    angle = (turn + jnp.abs(side)) * (jnp.pi / _TURNS)
    ahead, aside = _axes(up, sun)
    level = jnp.sqrt(jnp.maximum(1.0 - z * z, 0.0))
    across = jnp.sign(side) * jnp.sin(angle) * aside
    found = z * up + level * (jnp.cos(angle) * ahead + across)
    return found / jnp.sqrt(dot(found, found))


def sort(direction: Direction, up: Direction, sun: Direction) -> Integer[Array, ""]:
    """The cell that a direction lies in."""
    ahead, aside = _axes(up, sun)
    x, y = dot(direction, ahead), dot(direction, aside)
    angle = jnp.arctan2(jnp.abs(y), x)
    z = dot(direction, up)
    ring = jnp.int32((0.5 * _RINGS) * (jnp.sign(z) * jnp.sqrt(jnp.abs(z)) + 1.0))
    turn = jnp.int32(angle * (_TURNS / jnp.pi))
    return jnp.clip(ring, 0, _RINGS - 1) * _TURNS + jnp.clip(turn, 0, _TURNS - 1)


def solid_angle(index: Integer[Array, ""], dtype: jnp.dtype) -> Float[Array, ""]:
    """The size of a cell, on both sides of the sun's azimuth."""
    low, high = _ring(index, dtype)
    return (high - low) * (2.0 * math.pi / _TURNS)


def _ring(index: Integer[Array, ""], dtype: jnp.dtype) -> tuple[Array, Array]:
    """The heights of both edges of a cell's ring."""
    ring = (index // _TURNS).astype(dtype)
    low, high = (2.0 / _RINGS * (ring + i) - 1.0 for i in (0.0, 1.0))
    return low * jnp.abs(low), high * jnp.abs(high)


def _axes(up: Direction, sun: Direction) -> tuple[Direction, Direction]:
    """Level towards the sun, and level across."""
    level = sun - dot(sun, up) * up
    squared = dot(level, level)
    aside = squared > 1e-10
    level = level / jnp.sqrt(jnp.where(aside, squared, 1.0))
    ahead = jnp.where(aside, level, basis(up)[0])
    return ahead, jnp.cross(up, ahead)
