"""Between the levels at which light is known."""

import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from ..quantity import Length


def between(
    altitude: Float[Array, "level"], here: Length
) -> tuple[Int[Array, "4"], Float[Array, "4"]]:
    """Which levels to mix at an altitude, and how much of each.

    A cubic between two levels whose slope at either is that of the parabola through it
    and its neighbours (Catmull and Rom 1974, for uneven steps); a straight line's at
    the ends, and beside a thin layer, beyond which light may change otherwise.
    """
    last = len(altitude) - 1
    i = jnp.searchsorted(altitude, here, side="right") - 1
    i = jnp.clip(i, 0, last - 1).astype(jnp.int32)
    levels = jnp.stack([jnp.maximum(i - 1, 0), i, i + 1, jnp.minimum(i + 2, last)])
    before, step, after = jnp.diff(altitude[levels])
    x = jnp.clip((here - altitude[i]) / jnp.where(step > 0.0, step, 1.0), 0.0, 1.0)
    (a, b), (c, d) = _slope(step, before), _slope(step, after)
    low, high = x * (1.0 - x) ** 2, x * x * (x - 1.0)
    rise = x * x * (3.0 - 2.0 * x)
    weights = [
        -a * low,
        1.0 - rise + low * (a - b) - high * d,
        rise + low * b + high * (d - c),
        high * c,
    ]
    return levels, jnp.stack(weights)


def bends(depth: Float[Array, "layer wl"]) -> Float[Array, "layer 4 wl"]:
    """What levels weigh in the midst of layers, beyond the mean of both faces.

    Of those around each layer, on the same cubics in optical depth; on a parabola
    through both faces and the level beyond one of them where there is none, or only a
    thin layer, beyond the other.
    """
    none = jnp.zeros_like(depth[:1])
    before = jnp.concatenate([none, depth[:-1]])
    after = jnp.concatenate([depth[1:], none])
    (a, b), (c, d) = _slope(depth, before), _slope(depth, after)
    alone = (a == 0.0) | (c == 0.0)
    weights = jnp.stack([-a, a - b + d, b - d + c, -c], 1)
    return jnp.where(alone, 0.25, 0.125)[:, None] * weights


def _slope(step: Array, side: Array) -> tuple[Array, Array]:
    """What differences, beyond a level and from there on, weigh in the slope there.

    In steps; along a parabola through three levels, or a straight line beside a thin
    layer.
    """
    known = side > 0.25 * step
    ratio = step / jnp.where(known, side, 1.0)
    beyond = jnp.where(known, ratio * ratio / (1.0 + ratio), 0.0)
    return beyond, jnp.where(known, 1.0 / (1.0 + ratio), 1.0)
