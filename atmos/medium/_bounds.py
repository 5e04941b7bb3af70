"""Where rays enter and leave shapes. Directions need not have unit length here."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import AbstractPath
from ..quantity import dot, Length, Number, Position


def through_box(
    path: AbstractPath, lower: Position, upper: Position
) -> Float[Array, "2"]:
    """Where a ray enters and leaves a box; twice the same if it misses it."""
    slope = path.direction
    slope = jnp.where(jnp.abs(slope) < 1e-12, 1e-12, slope)
    one = (lower - path.start.position) / slope
    other = (upper - path.start.position) / slope
    enter = jnp.max(jnp.minimum(one, other))
    leave = jnp.min(jnp.maximum(one, other))
    return jnp.stack([enter, jnp.maximum(enter, leave)])


def through_sphere(
    path: AbstractPath, centre: Position, radius: Length
) -> Float[Array, "2"]:
    """Where a ray enters and leaves a sphere; twice the same if it misses it."""
    to_centre = centre - path.start.position
    speed = dot(path.direction, path.direction)
    middle = dot(to_centre, path.direction) / speed
    aside = to_centre - middle * path.direction
    squared = (radius * radius - dot(aside, aside)) / speed
    hit = squared > 0.0
    half = jnp.where(hit, jnp.sqrt(jnp.where(hit, squared, 1.0)), 0.0)
    return jnp.stack([middle - half, middle + half])


def sphere_meets(
    centre: Position, radius: Length, lower: Position, upper: Position
) -> Number:
    """1 if a sphere and a box have a place in common, 0 otherwise."""
    apart = centre - jnp.clip(centre, lower, upper)
    meets = dot(apart, apart) <= radius * radius * (1.0 + 1e-5)
    return jnp.where(meets, jnp.ones_like(radius), 0.0)
