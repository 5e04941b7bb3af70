"""Work that is done once, and not again by all that asks for it."""

from typing import TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float


Found = TypeVar("Found")


def settled(found: Found, known: Float[Array, "n"]) -> Found:
    """The same. XLA on CPUs else works it out anew for each of its users.

    It does not, of what is chosen by something that it does not know: by numbers
    `known` to be above 0, such as wavelengths.
    """
    if jax.default_backend() != "cpu":
        return found
    arrays, rest = eqx.partition(found, eqx.is_array)
    other = lambda x: jax.tree.map(jnp.zeros_like, x)
    arrays = jax.lax.cond(known[0] > 0.0, lambda x: x, other, arrays)
    return eqx.combine(arrays, rest)
