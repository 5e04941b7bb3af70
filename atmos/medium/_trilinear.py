import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..quantity import Number


def trilinear(
    values: Float[Array, "nx ny nz *channel"], x: Number, y: Number, z: Number
) -> Float[Array, "*channel"]:
    """The value at a place counted in cells; beyond the edge that of the edge."""
    # One number at a time, as XLA on CPUs is five times slower with vectors of three.
    index, parts, steps = 0, [], []
    for n, cell in zip(values.shape[:3], (x, y, z), strict=True):
        cell = jnp.clip(cell, 0.0, n - 1.0)
        first = jnp.minimum(jnp.floor(cell), max(n - 2.0, 0.0))
        parts.append(cell - first)
        index = index * n + first.astype(jnp.int32)
        steps = [n * step for step in steps] + [int(n > 1)]
    flat = values.reshape(-1, *values.shape[3:])

    def between(index, axis):
        if axis == 3:
            return flat.at[index].get(mode="promise_in_bounds")
        low = between(index, axis + 1)
        return low + parts[axis] * (between(index + steps[axis], axis + 1) - low)

    return between(index, 0)


# Windows along each axis that cover a range of cells.
_WINDOWS = 3


def window_most(
    values: Float[Array, "nx ny nz"],
    low: Float[Array, "3"],
    high: Float[Array, "3"],
) -> Number:
    """No less than any value of `trilinear` between two places.

    A few cubes of cells, of the size 1, 2, 4, ... that is about right, cover the box.
    """
    last = jnp.array(values.shape, jnp.int32) - 1
    first = jnp.clip(jnp.int32(jnp.floor(low)), 0, last)
    count = jnp.clip(jnp.int32(jnp.floor(high)) + 1, 0, last) + 1 - first
    longest = jnp.max(count)
    windows = np.arange(_WINDOWS)
    steps = np.stack(np.meshgrid(*[windows] * 3, indexing="ij"), -1).reshape(-1, 3)
    found, done, side = jnp.zeros_like(low[0]), jnp.array(False), 1
    while True:
        # Along an axis no farther than the last window has to begin.
        starts = jnp.minimum(jnp.array(steps * side, jnp.int32), (count - side)[None])
        places = first[None] + jnp.maximum(starts, 0)
        most = jnp.max(values[places[:, 0], places[:, 1], places[:, 2]])
        fits = longest <= side * _WINDOWS
        found = jnp.where(fits & ~done, most, found)
        done = done | fits
        if side * _WINDOWS >= max(values.shape):
            return found
        for axis in range(3):
            ends = np.minimum(
                np.arange(values.shape[axis]) + side, values.shape[axis] - 1
            )
            values = jnp.maximum(values, jnp.take(values, ends, axis))
        side *= 2
