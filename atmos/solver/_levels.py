"""Between the levels at which light is known."""

import equinox as eqx
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


class Bends(eqx.Module):
    """What there is half way through layers, beyond the mean of what faces have.

    `weights` are those of four levels around each layer, on cubics in optical depth as
    of `between`; on a parabola through both faces and the level beyond one of them
    where there is none, or only a thin layer, beyond the other. `before` and `after`
    are the depths of the layers next to each, in its own.
    """

    weights: Float[Array, "layer 4 wl"]
    before: Float[Array, "layer wl"]
    after: Float[Array, "layer wl"]

    @classmethod
    def of(cls, depth: Float[Array, "layer wl"]) -> "Bends":
        """In layers of such optical depths."""
        none = jnp.zeros_like(depth[:1])
        before = jnp.concatenate([none, depth[:-1]])
        after = jnp.concatenate([depth[1:], none])
        (a, b), (c, d) = _slope(depth, before), _slope(depth, after)
        alone = (a == 0.0) | (c == 0.0)
        weights = jnp.stack([-a, a - b + d, b - d + c, -c], 1)
        weights = jnp.where(alone, 0.25, 0.125)[:, None] * weights
        over = jnp.where(depth > 0.0, 1.0 / jnp.where(depth > 0.0, depth, 1.0), 0.0)
        return cls(weights, before * over, after * over)

    def midst(
        self,
        known: Float[Array, "level row sun wl"],
        reference: Float[Array, "level sun"],
    ) -> Float[Array, "layer row sun wl"]:
        """Of what is known at levels, relative to the exponential of a reference.

        Relative to the layer's own, which goes straight on beyond its faces.
        """
        layers, rise = len(self.weights), jnp.diff(reference, axis=0)
        none = jnp.zeros_like(rise[:1])
        below = self.before[:, None] * rise[..., None]
        below -= jnp.concatenate([none, rise[:-1]])[..., None]
        above = jnp.concatenate([rise[1:], none])[..., None]
        above -= self.after[:, None] * rise[..., None]
        even = jnp.zeros_like(below)
        around = jnp.pad(known, ((1, 1), (0, 0), (0, 0), (0, 0)), mode="edge")
        total = jnp.zeros_like(known[1:])
        for i, x in enumerate((below, even, even, above)):
            scale = self.weights[:, i, None] * jnp.exp(jnp.clip(x, -_MOST, _MOST))
            total += scale[:, None] * around[i : i + layers]
        return total


# By so much in its logarithm a reference that goes straight on is off at most.
_MOST = 3.0


def _slope(step: Array, side: Array) -> tuple[Array, Array]:
    """What differences, beyond a level and from there on, weigh in the slope there.

    In steps; along a parabola through three levels, or a straight line beside a thin
    layer.
    """
    known = side > 0.25 * step
    ratio = step / jnp.where(known, side, 1.0)
    beyond = jnp.where(known, ratio * ratio / (1.0 + ratio), 0.0)
    return beyond, jnp.where(known, 1.0 / (1.0 + ratio), 1.0)
