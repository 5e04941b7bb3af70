"""Cells that directions are sorted into."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Integer

from ..quantity import Direction, dot
from ..rotation import basis


# Rings about the zenith, and parts of the half circle from the sun's azimuth.
_RINGS, _TURNS = 8, 6


def views(dtype: jnp.dtype) -> tuple[Float[Array, "view 3"], Float[Array, "view"]]:
    """The middles of the cells of `sort`, and their shares of the sphere."""
    z, turn = (np.arange(x) + 0.5 for x in (_RINGS, _TURNS))
    z, turn = 2.0 * z / _RINGS - 1.0, turn * np.pi / _TURNS
    level = np.sqrt(1.0 - z * z)[:, None]
    views = [level * np.cos(turn), level * np.sin(turn), z[:, None] + 0.0 * turn]
    views = np.stack(views, -1).reshape(-1, 3)
    return jnp.asarray(views, dtype), jnp.full(len(views), 1.0 / len(views), dtype)


def draw(
    index: Integer[Array, ""], u: Float[Array, "2"], up: Direction, sun: Direction
) -> Direction:
    """A direction from a cell of directions: they are alike in size.

    Cells are rings about the zenith, cut by the angle from the sun's azimuth, to either
    side of it alike.
    """
    ring = (index // _TURNS).astype(u.dtype)
    turn = (index % _TURNS).astype(u.dtype)
    z = 2.0 * (ring + u[0]) / _RINGS - 1.0
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
    ring = jnp.int32((0.5 * _RINGS) * (dot(direction, up) + 1.0))
    turn = jnp.int32(angle * (_TURNS / jnp.pi))
    return jnp.clip(ring, 0, _RINGS - 1) * _TURNS + jnp.clip(turn, 0, _TURNS - 1)


def _axes(up: Direction, sun: Direction) -> tuple[Direction, Direction]:
    """Level towards the sun, and level across."""
    level = sun - dot(sun, up) * up
    squared = dot(level, level)
    aside = squared > 1e-10
    level = level / jnp.sqrt(jnp.where(aside, squared, 1.0))
    ahead = jnp.where(aside, level, basis(up)[0])
    return ahead, jnp.cross(up, ahead)
