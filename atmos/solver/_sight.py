"""Where to cut a line of sight so that each piece is smooth, and matters."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.lax import stop_gradient
from jaxtyping import Array, Bool, Float

from ..geometry import AbstractPath
from ..quantity import Direction, Length, Position
from ..scene import Scene
from ..transport import contract, densities, enter, gauss_legendre


# Where to cut a ray: fractions of its length in which depth is summed up coarsely. From
# above it is the far end that counts, where the air is thick.
_NEAR, _FAR = 2.0 ** np.linspace(-20.0, -1.0, 23), 2.0 ** np.linspace(-2.0, -10.0, 10)
_COARSE = np.concatenate([[0.0], _NEAR, 1.0 - _FAR, [1.0]])


class Sight(eqx.Module):
    """A line of sight from where it enters the air, and where its pieces begin."""

    path: AbstractPath
    far: Length
    grounded: Bool[Array, ""]
    begin: Float[Array, "piece"]
    length: Float[Array, "piece"]


def sight(
    scene: Scene,
    position: Position,
    direction: Direction,
    extinction: Float[Array, "medium wl"],
    pieces: int,
) -> Sight:
    """Cut at edges of media, and so that pieces are alike.

    Each holds a fair share of what one sees in the thinnest and the thickest light.
    """
    path, far, grounded = enter(scene, position, direction)
    places = far * jnp.asarray(_COARSE, far.dtype)
    step = jnp.diff(places)
    column = jnp.zeros((len(_COARSE) - 1, len(scene.media)), far.dtype)
    for u, w in zip(*(x.tolist() for x in gauss_legendre(2)), strict=True):
        points = jax.vmap(path.at)(places[:-1] + u * step)
        column += (w * step)[:, None] * jax.vmap(lambda x: densities(scene, x))(points)
    depth = jnp.cumsum(contract("im,ml->il", column, extinction), 0)
    depth = jnp.concatenate([jnp.zeros_like(depth[:1]), depth])
    seen = depth / (1.0 + depth)
    order = jnp.argsort(depth[-1])
    measure = places / jnp.where(far > 0.0, far, 1.0)
    measure += seen[:, order[0]] + seen[:, order[-1]]
    wanted = jnp.asarray(np.arange(1, pieces) / pieces, far.dtype) * measure[-1]
    cuts = jnp.interp(wanted, measure, places)
    edges = [jnp.zeros_like(far)[None], far[None], cuts]
    edges += [x.profile.breaks(path) for x in scene.media]
    edges = jnp.sort(jnp.clip(jnp.concatenate(edges), 0.0, far))
    # Joined, always where least is, until so many pieces are left.
    amount = stop_gradient(jnp.interp(edges, places, measure))
    last = edges.shape[0] - 1
    index = jnp.arange(last + 1, dtype=jnp.int32)

    def drop(count, kept):
        at = amount[kept]
        joined = jnp.where(index[1:-1] < last - count, at[2:] - at[:-2], jnp.inf)
        return jnp.where(
            index <= jnp.argmin(joined).astype(jnp.int32), kept, jnp.roll(kept, -1)
        )

    kept = jax.lax.fori_loop(0, last - pieces, drop, index)[: pieces + 1]
    return Sight(path, far, grounded, edges[kept[:-1]], jnp.diff(edges[kept]))
