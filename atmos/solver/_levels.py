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

    def slope(side):
        """What the value at the level itself, and that beyond it, add to the slope."""
        known = side > 0.25 * step
        ratio = step / jnp.where(known, side, 1.0)
        beyond = jnp.where(known, ratio * ratio / (1.0 + ratio), 0.0)
        return beyond, jnp.where(known, 1.0 / (1.0 + ratio), 1.0)

    (a, b), (c, d) = slope(before), slope(after)
    low, high = x * (1.0 - x) ** 2, x * x * (x - 1.0)
    rise = x * x * (3.0 - 2.0 * x)
    weights = [
        -a * low,
        1.0 - rise + low * (a - b) - high * d,
        rise + low * b + high * (d - c),
        high * c,
    ]
    return levels, jnp.stack(weights)
