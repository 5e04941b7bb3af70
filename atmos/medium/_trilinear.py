import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..quantity import Number


def trilinear(
    values: Float[Array, "nx ny nz *channel"], x: Number, y: Number, z: Number
) -> Float[Array, "*channel"]:
    """The value at a place counted in cells; beyond the edge that of the edge."""
    first, parts = [], []
    for n, cell in zip(values.shape[:3], (x, y, z), strict=True):
        cell = jnp.clip(cell, 0.0, n - 1.0)
        low = jnp.minimum(jnp.floor(cell), max(n - 2.0, 0.0))
        parts.append(cell - low)
        first.append(low.astype(jnp.int32))
    # All that is around it at once: XLA on CPUs is three times slower one by one.
    sizes = *(min(n, 2) for n in values.shape[:3]), *values.shape[3:]
    around = jax.lax.GatherDimensionNumbers(
        offset_dims=tuple(range(values.ndim)),
        collapsed_slice_dims=(),
        start_index_map=(0, 1, 2),
    )
    # XLA on CPUs else works out again for each of the eight where they are.
    known = values.reshape(-1)[0] > -1.0
    other = lambda x: jax.tree.map(jnp.zeros_like, x)
    first, parts = jax.lax.cond(known, lambda x: x, other, (first, parts))
    found = jax.lax.gather(
        values, jnp.stack(first), around, sizes, mode="promise_in_bounds"
    )
    for part in parts:
        found = found[0] + part * (found[-1] - found[0])
    return found


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
