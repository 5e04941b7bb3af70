import jax
import jax.numpy as jnp
from jaxtyping import PRNGKeyArray

from ..quantity import Direction, Position


def of_look(
    key: PRNGKeyArray, position: Position, direction: Direction
) -> PRNGKeyArray:
    """A key of a look's own: noise in neighbouring pixels has nothing in common."""
    looks = jnp.concatenate([position, direction]).astype(jnp.float32)
    bits = jax.lax.bitcast_convert_type(looks, jnp.uint32)
    return jax.lax.scan(lambda x, y: (jax.random.fold_in(x, y), None), key, bits)[0]
