import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike

from ..geometry import Flat
from ._base import AbstractProfile
from .grid import Grid


def sampled(
    profile: AbstractProfile,
    lower: ArrayLike,
    upper: ArrayLike,
    cells: tuple[int, int, int],
) -> Grid:
    """A grid of what a profile is in the middle of each cell of a box, in m.

    Looking it up takes less time than working out noise. What depends on altitude is
    taken as above flat ground. Raises `ValueError` for a box without cells.
    """
    if min(cells) < 1:
        raise ValueError(f"`cells` must be 1 or more along each axis; got {cells}.")
    lower, upper = np.asarray(lower, float), np.asarray(upper, float)
    share = (np.indices(cells).reshape(3, -1).T + 0.5) / np.asarray(cells)
    places = jnp.asarray(lower + share * (upper - lower))
    density = jax.jit(lambda x: profile.density(Flat().locate(x)))
    found = jax.lax.map(density, places, batch_size=4096)
    return Grid(found.reshape(cells), lower, upper)
