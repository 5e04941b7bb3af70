"""Light that is about to turn for the second time, and what turns of it do."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..geometry import AbstractPath
from ..optics import Mixture
from ..quantity import Depth
from ..scene import Scene
from ..transport import contract, densities, gauss_legendre
from ._sight import sight
from ._slants import horizons, slants


# Directions around a place: rings above its horizon and as many below, and azimuths on
# half of each, as the other half is alike: 64 in all.
_RINGS, _TURNS = 4, 4
_PIECES = 20  # of a line of sight


class Turns(eqx.Module):
    """What arrives straight above the origin from a set of directions.

    `cosine` is that of the angle between a direction and straight up, and `weight` the
    share of the sphere that it stands for. `once` is light that turned once, as if it
    then went anywhere, of suns of irradiance 1; `again` what a turn makes of light 1
    that is everywhere and goes anywhere; `ground` how much one sees of the ground.
    """

    cosine: Float[Array, "level view"]
    weight: Float[Array, "level view"]
    once: Float[Array, "level view sun wl"]
    again: Float[Array, "level view wl"]
    ground: Float[Array, "level view wl"]

    def mean(self, light: Float[Array, "level view ..."]) -> Float[Array, "level ..."]:
        """The mean of light over all directions."""
        return contract("kv,kv...->k...", self.weight, light)

    def flux(
        self, light: Float[Array, "level view ..."], sign: float
    ) -> Float[Array, "level ..."]:
        """The flux of light through a level plane: 1 for that downwards, -1 upwards."""
        share = jnp.maximum(sign * self.cosine, 0.0) * (4.0 * math.pi * self.weight)
        return contract("kv,kv...->k...", share, light)


def turns(
    scene: Scene,
    mixture: Mixture,
    albedo: Float[Array, "wl"],
    altitude: Float[Array, "level"],
    zeniths: Float[Array, "sun"],
) -> Turns:
    """What suns at these zenith angles do, and light that comes from everywhere."""
    towards = slants(scene, altitude)
    turn = (np.arange(_TURNS) + 0.5)[None] * (math.pi / _TURNS)
    turn = jnp.asarray(turn, altitude.dtype)
    level, rise = jnp.sin(zeniths)[:, None], jnp.cos(zeniths)[:, None]
    suns = [level * jnp.cos(turn), level * jnp.sin(turn), rise + jnp.zeros_like(turn)]
    suns = jnp.stack(suns, -1)

    def look(ray):
        altitude, cosine = ray
        start = scene.geometry.locate(jnp.zeros(3, altitude.dtype).at[2].set(altitude))
        level = jnp.sqrt(jnp.maximum(1.0 - cosine * cosine, 0.0))
        direction = jnp.stack([level, jnp.zeros_like(level), cosine])
        extinction = mixture.extinction
        line = sight(scene, start.position, direction, extinction, _PIECES)
        path, begin, length = line.path, line.begin, line.length
        turned, passed = _steps(scene, mixture, path, begin, length)

        places = jnp.concatenate([begin + 0.5 * length, line.far[None]])
        points = jax.vmap(path.at)(places)
        rises = contract("pc,sac->psa", points.up, suns)
        depth = jax.vmap(towards.depths, (0, 0, None))(
            points.altitude, rises, extinction
        )
        left = jnp.exp(-depth)
        dark = jax.vmap(jax.vmap(lambda x: path.shadow(x, jnp.zeros_like(cosine))))
        lit = lit_share(begin, length, dark(suns))
        once = contract("psa,psal,pl->sl", lit, left[:-1], turned)
        ground = jnp.where(line.grounded, jnp.exp(-passed), 0.0)
        bounced = contract("sa,sal->sl", jnp.maximum(rises[-1], 0.0), left[-1])
        once = 0.25 * once + (albedo * ground)[None] * bounced
        return once / (math.pi * _TURNS), jnp.sum(turned, 0), ground

    cosine, weight = _views(scene, altitude)
    above = jnp.broadcast_to(altitude[:, None], cosine.shape)
    # A gradient would else keep every step of every ray.
    found = jax.lax.map(jax.checkpoint(look), (above.ravel(), cosine.ravel()))
    found = [x.reshape(*cosine.shape, *x.shape[1:]) for x in found]
    return Turns(cosine, weight, *found)


def _views(scene: Scene, altitude: Float[Array, "level"]) -> tuple[Array, Array]:
    """Cosines from straight up by Gauss and Legendre, above and below the horizon."""
    horizon = horizons(scene, altitude)[:, None]
    u, w = (jnp.asarray(x, altitude.dtype) for x in gauss_legendre(_RINGS))
    above, below = 1.0 - horizon, 1.0 + horizon
    u, w = u[None], w[None]
    cosine = jnp.concatenate([horizon + above * u, horizon - below * u], 1)
    return cosine, 0.5 * jnp.concatenate([above * w, below * w], 1)


def _steps(
    scene: Scene,
    mixture: Mixture,
    path: AbstractPath,
    begin: Float[Array, "piece"],
    length: Float[Array, "piece"],
) -> tuple[Float[Array, "piece wl"], Depth]:
    """The share of light from anywhere that each piece turns; the depth of them all.

    What a piece takes is exactly what it lets not through, so that all shares together
    never exceed 1, however thick the pieces are.
    """
    amount = jnp.zeros((begin.shape[0], len(scene.media)), begin.dtype)
    for u, w in zip(*(x.tolist() for x in gauss_legendre(3)), strict=True):
        points = jax.vmap(path.at)(begin + u * length)
        amount += (w * length)[:, None] * jax.vmap(lambda x: densities(scene, x))(
            points
        )
    depth = contract("pm,ml->pl", amount, mixture.extinction)
    scattered = contract("pm,ml->pl", amount, mixture.scattering[:, 0])
    share = scattered / jnp.where(depth > 0.0, depth, 1.0)
    passed = jnp.cumsum(depth, 0)
    turned = -jnp.expm1(-depth) * jnp.exp(depth - passed) * share
    return turned, passed[-1]


def lit_share(
    begin: Float[Array, "piece"],
    length: Float[Array, "piece"],
    dark: Float[Array, "sun turn 2"],
) -> Float[Array, "piece sun turn"]:
    """The share of each piece that the world does not hide from the sun."""
    begin, length = begin[:, None, None], length[:, None, None]
    end = (begin + length)[..., None]
    hidden = jnp.diff(jnp.clip(dark[None], begin[..., None], end))[..., 0]
    return jnp.clip(1.0 - hidden / jnp.where(length > 0.0, length, 1.0), 0.0, 1.0)
