"""From a few azimuths of a light, all on half a circle, to more between them."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PyTree

from ..transport import contract


def drawn(
    look: Callable[[Float[Array, "3"]], PyTree[Float[Array, "..."]]],
    towards: Float[Array, "light 3"],
    every: int,
) -> PyTree[Float[Array, "light ..."]]:
    """A look for each of several lights: for `every` so many of them, and cubics."""
    found = jax.vmap(look)(towards[::every])
    if every == 1:
        return found
    weights = _cubics(len(towards), every)
    mix = lambda x: contract("as,s...->a...", jnp.asarray(weights, x.dtype), x)
    return jax.tree.map(mix, found)


def _cubics(count: int, every: int) -> np.ndarray:
    """What some azimuths weigh at all, where beyond either end is what lies before.

    One alone is all there is.
    """
    last = (count - 1) // every
    if last == 0:
        return np.ones((count, 1))
    weights = np.zeros((count, last + 1))
    for i in range(count):
        x = 1.0 + i % every / every
        for k in range(4):
            at = abs(i // every - 1 + k)
            terms = [(x - j) / (k - j) for j in range(4) if j != k]
            weights[i, min(at, 2 * last - at)] += np.prod(terms)
    return weights
