"""How much air lies between a place and the sun, as a table."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..optics import above
from ..quantity import Length
from ..scene import Scene
from ..transport import gauss_legendre
from ._rays import radius_of


# Places on each line that meets the ground, or on half of one that does not; lines.
_PLACES, _LINES = 320, 384


class Sunlight(eqx.Module):
    """Columns of every medium from a place in the air to its top, by straight lines.

    A line is known by how far it passes from the planet, a place on it by the distance
    from the line's lowest place: in these columns are smooth on both sides of it. Rows
    are lines, from one straight up to one that grazes the ground and on to one that
    grazes the top; in each, places from the far side of the lowest one to the near one.
    """

    radius: Length
    top: Length
    table: Float[Array, "line place medium"]

    def columns(
        self, altitude: Float[Array, "*n"], ahead: Float[Array, "*n"]
    ) -> Float[Array, "*n medium"]:
        """For places `ahead` of the lowest on a line to the sun; not in shadow."""
        up = altitude * (altitude + 2.0 * self.radius)
        squared = ahead * ahead - up
        meets = squared >= 0.0
        x = jnp.where(meets, jnp.sqrt(jnp.where(meets, squared, 1.0)), 0.0)
        nearest = jnp.sqrt(jnp.maximum(self.radius**2 - squared, 0.0))
        low = jnp.where(meets, 0.0, -squared / (nearest + self.radius))
        core = jnp.where(meets, jnp.sqrt(jnp.where(meets, x / self.radius, 1.0)), 0.0)
        limb = low / self.top
        limb = jnp.where(meets, 0.0, jnp.sqrt(jnp.where(meets, 1.0, limb)))
        line = (_LINES - 1) * (1.0 + limb - core)
        # As a share of the way to the top.
        gone = jnp.where(meets, up / (jnp.abs(ahead) + x + 1.0), jnp.abs(ahead))
        whole = _reach(self.radius, self.top, x, low)
        share = jnp.sqrt(jnp.clip(gone / whole, 0.0, 1.0) + 1e-12)
        place = (_PLACES - 1) * (1.0 + jnp.where(ahead < 0.0, -share, share))
        i = jnp.clip(jnp.floor(line), 0.0, 2.0 * _LINES - 3.0)
        j = jnp.clip(jnp.floor(place), 0.0, 2.0 * _PLACES - 3.0)
        s, t = (line - i)[..., None], (place - j)[..., None]
        width = self.table.shape[1]
        flat = self.table.reshape(-1, self.table.shape[-1])
        at = (i * width + j).astype(jnp.int32)
        near = (1.0 - t) * flat[at] + t * flat[at + 1]
        far = (1.0 - t) * flat[at + width] + t * flat[at + width + 1]
        return (1.0 - s) * near + s * far


def _reach(radius, top, x, low):
    """How far along a line the air reaches, from the ground or the lowest place."""
    least = 1e-6 * top
    squared = x * x + (top - low) * (top + low + 2.0 * radius)
    return jnp.maximum(jnp.sqrt(jnp.maximum(squared, least * least)) - x, least)


def sunlight(scene: Scene) -> Sunlight:
    """The table of a round world."""
    radius, top = radius_of(scene), scene.top
    share = np.linspace(0.0, 1.0, _LINES) ** 2
    zero = np.zeros(_LINES - 1)
    x = radius * jnp.asarray(np.concatenate([share[:0:-1], [0.0], zero]), top.dtype)
    low = top * jnp.asarray(np.concatenate([zero, share]), top.dtype)
    places = np.linspace(-1.0, 1.0, 2 * _PLACES - 1)
    places = jnp.asarray(places * np.abs(places), top.dtype)
    u, w = gauss_legendre(3)

    def line(x, low):
        begins = places * _reach(radius, top, x, low)
        step = jnp.diff(begins)
        column = jnp.zeros((step.shape[0], len(scene.media)), step.dtype)
        for share, weight in zip(u.tolist(), w.tolist(), strict=True):
            beyond = jnp.abs(begins[:-1] + share * step)
            # Of lines that meet the ground only one half lies in the air.
            q = beyond * (beyond + 2.0 * x)
            foot = radius + low
            root = jnp.sqrt(foot**2 + q)
            altitude = low + q / (root + foot)
            found = jax.vmap(lambda h: above(scene, h))(jnp.clip(altitude, 0.0, top))
            column += (weight * step)[:, None] * found
        summed = jnp.cumsum(column[::-1], 0)[::-1]
        return jnp.concatenate([summed, jnp.zeros_like(summed[:1])])

    return Sunlight(radius, top, jax.vmap(line)(x, low))
