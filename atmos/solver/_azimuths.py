"""From a few azimuths of a light, all on half a circle, to more between them."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..transport import contract


def drawn(
    look: Callable[[Float[Array, "3"]], Float[Array, "*n"]],
    towards: Float[Array, "light 3"],
    every: int,
) -> Float[Array, "light *n"]:
    """A look for each of several lights: for `every` so many of them, and cubics."""
    found = jax.vmap(look)(towards[::every])
    if every == 1:
        return found
    weights = jnp.asarray(_cubics(len(towards), every), found.dtype)
    return contract("as,s...->a...", weights, found)


def _cubics(count: int, every: int) -> np.ndarray:
    """What some azimuths weigh at all, where beyond either end is what lies before."""
    last = (count - 1) // every
    weights = np.zeros((count, last + 1))
    for i in range(count):
        x = 1.0 + i % every / every
        for k in range(4):
            at = abs(i // every - 1 + k)
            terms = [(x - j) / (k - j) for j in range(4) if j != k]
            weights[i, min(at, 2 * last - at)] += np.prod(terms)
    return weights
