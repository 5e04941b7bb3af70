"""What becomes of tabulated light that turns once more."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..optics import Layers, Mixture
from ..transport import contract
from ._harmonics import harmonics, pairs
from ._lines import Lines
from ._suns import cubic, RoundSuns
from ._tables import around, beside, relative
from ._views import nearby, Views


class Orders(eqx.Module):
    """How light of one order becomes that of the next, on its way to every level.

    Light is that of suns of irradiance 1, by level, view, azimuth and sun. What
    scatters of it is worked out in harmonics, in evenly spaced views.
    """

    cut: Layers
    mixture: Mixture
    albedo: Float[Array, "wl"]
    suns: RoundSuns
    lines: Lines
    cosine: Float[Array, "level view"]
    weight: Float[Array, "level view"]
    views: Views = eqx.field(static=True)

    def fluxes(
        self, light: Float[Array, "level view turn sun wl"]
    ) -> tuple[Float[Array, "level sun wl"], Float[Array, "level sun wl"]]:
        """Through a level plane, upwards and downwards."""
        across = self.weight * self.cosine
        through = lambda x: contract("kv,kvtsl->ksl", jnp.maximum(x, 0.0), light)
        return through(-across), through(across)

    def carry(
        self, light: Float[Array, "level view turn sun wl"]
    ) -> Float[Array, "level view turn sun wl"]:
        """The next order: from the air, and from the ground."""
        source, reference = self._source(light)
        evenly, count = source.shape[1], self.cosine.size
        source = source.reshape(-1, *source.shape[2:])
        _, down = self.fluxes(light)
        shines = (self.albedo / math.pi)[None] * down[0]
        stands = self.stands()

        def see(line):
            # Between two views next to four.
            place = jnp.arccos(jnp.clip(line.cosine, -_INSIDE, _INSIDE))
            view, x = nearby(place * ((evenly - 1) / math.pi), evenly, 4)
            over = jnp.stack([1.0 - line.height, line.height])
            near = jnp.zeros((len(view), *source.shape[1:]), source.dtype)
            dim = jnp.zeros((len(view), reference.shape[-1]), source.dtype)
            for end in range(2):
                row = 2 * line.layer + end
                dim += over[end, :, None] * reference[row]
                for i, share in enumerate(jnp.moveaxis(cubic(x), -1, 0)):
                    weight = (over[end] * share)[:, None, None, None]
                    near += weight * source[row * evenly + view + i]
            # As seen from there.
            rises = contract("px,tsx->pts", line.up, stands[..., ::2])
            ahead = line.up[:, None, None, 1] * stands[None, ..., 0]
            ahead -= line.up[:, None, None, 0] * stands[None, ..., 2]
            aside = jnp.broadcast_to(stands[None, ..., 1], ahead.shape)
            level = jnp.sqrt(ahead * ahead + aside * aside)
            sun, y = beside(self.suns, jnp.arctan2(level, rises))
            turn, z = around(jnp.arctan2(aside, ahead)[:-1], self.views.turns)

            which = jnp.arange(len(view), dtype=jnp.int32)[:, None, None]
            near_sun, t = sun[:-1], y[:-1]
            scale = (1.0 - t) * dim[which, near_sun] + t * dim[which, near_sun + 1]
            scale = jnp.exp(scale)
            seen = jnp.zeros((*stands.shape[:2], light.shape[-1]), light.dtype)
            for i in range(2):
                for j in range(2):
                    weight = (z if i else 1.0 - z) * (t if j else 1.0 - t) * scale
                    part = near[which, turn + i, near_sun + j]
                    seen += contract("pts,ptsl,pl->tsl", weight, part, line.share)
            foot, s = sun[-1], y[-1, ..., None]
            ground = (1.0 - s) * shines[foot] + s * shines[foot + 1]
            return seen + line.left[None, None] * ground

        flat = jax.tree.map(lambda x: x.reshape(count, *x.shape[2:]), self.lines)
        found = jax.lax.map(jax.checkpoint(see), flat)
        return found.reshape(light.shape)

    def stands(self) -> Float[Array, "turn sun 3"]:
        """Where suns stand, in azimuths from that of the views."""
        return stands(self.suns, self.views)

    def _source(
        self, light: Float[Array, "level view turn sun wl"]
    ) -> tuple[Float[Array, "end even turn sun wl"], Float[Array, "end sun"]]:
        """What scatters of it at the lower and upper ends of layers, one after another.

        For an optical depth of 1, over how bright it is there, and the logarithm of it.
        """
        count, turns = self.mixture.scattering.shape[1], self.views.turns
        l, m = pairs(count)
        l, m = l[m < turns], m[m < turns]
        azimuth = np.cos(np.outer(self.views.azimuths(), m))
        azimuth = jnp.asarray(azimuth, light.dtype)
        known = harmonics(self.cosine, count)[..., l, m] * self.weight[..., None]
        basis = known[:, :, None] * azimuth[None, None]
        moments = contract("kvtp,kvtsl->kpsl", basis, light)

        within = lambda x: contract("km,m...->k...", self.cut.column, x)
        depth = within(self.mixture.extinction)[:, None]
        thick = depth > 0.0
        turned = within(self.mixture.scattering) / jnp.where(thick, depth, 1.0)
        turned = jnp.where(thick, turned, 0.0)[:, l]
        ends = jnp.stack([moments[:-1], moments[1:]], 1) * turned[:, None, :, None]

        even = np.cos(np.linspace(0.0, np.pi, int(_FINER * count) + 2))
        wide = np.where(m == 0, 1.0, 2.0) * (2.0 * l + 1.0) / (4.0 * math.pi)
        known = jnp.asarray(harmonics(even, count)[:, l, m] * wide, light.dtype)
        basis = known[:, None] * azimuth[None]
        source = contract("vtp,kepsl->kevtsl", basis, ends)
        return relative(source.reshape(-1, *source.shape[2:]))


def stands(suns: RoundSuns, views: Views) -> Float[Array, "turn sun 3"]:
    """Suns in azimuths from that of the views, which lie in the plane of x and z."""
    zenith = suns.zeniths()[None]
    turn = jnp.asarray(views.azimuths(), zenith.dtype)[:, None]
    # Straight up there are azimuths too.
    level = jnp.maximum(jnp.sin(zenith), _SLIVER)
    rise = jnp.broadcast_to(jnp.cos(zenith), (len(turn), zenith.size))
    return jnp.stack([level * jnp.cos(turn), level * jnp.sin(turn), rise], -1)


# Views in which what scatters is known, over the degrees of its harmonics.
_FINER = 1.5
_SLIVER, _INSIDE = 1e-6, 1.0 - 1e-6
