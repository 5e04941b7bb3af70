"""What the light of the sun passes on its way to any place of layered air."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..quantity import Length, Number
from ..scene import Scene
from ..transport import columns, contract


# Heights of the sun, from where the ground would hide it, 0, to the zenith, 1; in
# between their squares.
_SLANTS = 32


class Slants(eqx.Module):
    """The columns of media towards the sun, by altitude and the sun's height.

    Relative to how they roughly grow as the sun sinks, so that straight lines will do.
    """

    altitude: Float[Array, "level"]
    horizon: Float[Array, "level"]
    softening: Number
    table: Float[Array, "level slant medium"]

    def depths(
        self,
        altitude: Length,
        rises: Float[Array, "*sun"],
        extinction: Float[Array, "medium wl"],
    ) -> Float[Array, "*sun wl"]:
        """Optical depths up to suns of these cosines from straight up.

        To suns behind the ground as if they stood just above it.
        """
        k = jnp.searchsorted(self.altitude, altitude, side="right") - 1
        k = jnp.clip(k, 0, len(self.altitude) - 2)
        step = self.altitude[k + 1] - self.altitude[k]
        x = (altitude - self.altitude[k]) / jnp.where(step > 0.0, step, 1.0)
        x = jnp.clip(x, 0.0, 1.0)
        row = (1.0 - x) * self.table[k] + x * self.table[k + 1]
        row = contract("xm,ml->xl", row, extinction)
        horizon = (1.0 - x) * self.horizon[k] + x * self.horizon[k + 1]
        above = jnp.maximum(rises - horizon, 0.0)
        up = above > 0.0
        root = jnp.sqrt(jnp.where(up, above / (1.0 - horizon), 1.0))
        place = jnp.where(up, root, 0.0) * (_SLANTS - 1)
        i = jnp.clip(jnp.floor(place), 0.0, _SLANTS - 2.0)
        y = (place - i)[..., None]
        i = i.astype(jnp.int32)
        depth = (1.0 - y) * row[i] + y * row[i + 1]
        return depth / _nearness(above, self.softening)[..., None]


def slants(scene: Scene, altitude: Float[Array, "level"]) -> Slants:
    """Of all media, from rising altitudes, the last of them the top."""
    horizon = horizons(scene, altitude)
    # About the cosine below which the roundness of the world matters.
    softening = -0.15 * horizon[-1]
    share = jnp.asarray(np.linspace(0.0, 1.0, _SLANTS) ** 2, altitude.dtype)

    def column(altitude, above, cosine):
        start = scene.geometry.locate(jnp.zeros(3, altitude.dtype).at[2].set(altitude))
        aside = cosine * cosine < 1.0
        level = jnp.sqrt(jnp.where(aside, 1.0 - cosine * cosine, 1.0))
        level = jnp.where(aside, level, 0.0)
        direction = jnp.stack([level, jnp.zeros_like(level), cosine])
        path = scene.geometry.path(start, direction)
        # Not `span`: what grazes the ground may by rounding end there.
        far = jnp.maximum(path.crossings(scene.top)[1], 0.0)
        return columns(scene, path, far, nodes=6) * _nearness(above, softening)

    above = (1.0 - horizon[:, None]) * share[None]
    each = jax.vmap(jax.vmap(column, (None, 0, 0)))
    table = each(altitude, above, horizon[:, None] + above)
    return Slants(altitude, horizon, softening, table)


def horizons(scene: Scene, altitude: Float[Array, "level"]) -> Float[Array, "level"]:
    """The cosine of the angle between straight up and the horizon."""
    dip = jax.vmap(lambda x: scene.geometry.dip(x, jnp.zeros_like(x)))(altitude)
    return -jnp.sin(dip)


def _nearness(above: Float[Array, "*sun"], softening: Number) -> Float[Array, "*sun"]:
    """Roughly one over the way to a sun by its cosine less the horizon's."""
    return jnp.maximum(above + softening, 1e-6)
