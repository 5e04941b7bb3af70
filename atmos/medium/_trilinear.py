import jax.numpy as jnp
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
