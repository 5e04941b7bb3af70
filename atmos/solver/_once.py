"""Light of the sun that turns once on its way from level to level."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from ..geometry import Point
from ..optics import above, Mixture
from ..polarisation import vibration
from ..quantity import dot
from ..scene import Scene
from ..transport import contract, gauss_legendre
from ._harmonics import legendre, second_order
from ._rays import Rays, Steps
from ._sunlight import Sunlight


# Places a step.
_NODES = 3


class Once(eqx.Module):
    """What a sun of irradiance 1 adds to light on its steps, with exact shadows."""

    scene: Scene
    mixture: Mixture
    rays: Rays
    sunlight: Sunlight
    zenith: Float[Array, "sun"]
    azimuth: Float[Array, "azimuth"]
    stokes: int = eqx.field(static=True)

    def ground(self) -> Float[Array, "sun wl"]:
        """What of it reaches the ground without a turn, on a square metre."""
        rise = jnp.cos(self.zenith)
        up = rise > 0.0
        ahead = self.sunlight.radius * jnp.where(up, rise, 1.0)
        column = self.sunlight.columns(jnp.zeros_like(rise), ahead)
        direct = jnp.exp(-contract("sm,ml->sl", column, self.mixture.extinction))
        return jnp.where(up, rise, 0.0)[:, None] * direct

    def rising(
        self, layer: Int[Array, ""]
    ) -> Float[Array, "stokes ray azimuth sun wl"]:
        """In views upwards from the lower level of a layer."""
        return self._turned(layer, layer, self.rays.up, 1.0)

    def falling(
        self, layer: Int[Array, ""]
    ) -> Float[Array, "stokes ray azimuth sun wl"]:
        """In views downwards from the upper level of a layer."""
        return self._turned(layer + 1, layer, self.rays.down, -1.0)

    def _turned(self, level, layer, steps: Steps, sign: float):
        altitude = self.rays.altitude[level]
        radius = self.sunlight.radius + altitude
        up = jnp.zeros(3, altitude.dtype).at[2].set(1.0)
        start = Point(altitude * up, altitude, up)
        u, w = (jnp.asarray(x, altitude.dtype) for x in gauss_legendre(_NODES))
        here = above(self.scene, altitude)

        def one(cosine, ahead, length, azimuth, zenith):
            flat = jnp.sqrt(jnp.maximum(1.0 - cosine * cosine, 0.0))
            # Clockwise from the sun, as of `_harmonics`.
            level = flat * jnp.cos(azimuth), -flat * jnp.sin(azimuth)
            view = jnp.stack([*level, sign * cosine])
            zero, rises = jnp.zeros_like(zenith), jnp.cos(zenith)
            sun = jnp.stack([jnp.sin(zenith), zero, rises])
            path = self.scene.geometry.path(start, view)
            begins, ends = jnp.clip(path.shadow(sun, zero), 0.0, length)

            def at(along):
                q = along * (along + 2.0 * sign * ahead)
                root = jnp.sqrt(jnp.maximum(radius * radius + q, 0.0))
                return jnp.maximum(altitude + q / (root + radius), 0.0)

            lit = length - (ends - begins)
            along = lit * u
            along = jnp.where(along < begins, along, along + (ends - begins))
            height = at(along)
            turn = dot(view, sun)
            past = self.sunlight.columns(height, radius * rises + along * turn)
            densities = jax.vmap(lambda x: above(self.scene, x))
            density, between = densities(height), densities(at(0.5 * along))
            # By Simpson's rule.
            past += (along / 6.0)[:, None] * (density + 4.0 * between + here[None])
            return lit * w, density, past, turn, jnp.stack(vibration(up, view, sun))

        over = jax.vmap(one, (None, None, None, None, 0))
        over = jax.vmap(over, (None, None, None, 0, None))
        over = jax.vmap(over, (0, 0, 0, None, None))
        cosine, ahead = self.rays.cosine[level], self.rays.ahead[level]
        share, density, past, turn, vibrates = over(
            cosine, ahead, steps.length[layer], self.azimuth, self.zenith
        )
        lost = lambda x: contract("kasm,ml->kasl", x, self.mixture.extinction)
        arrives = [jnp.exp(-lost(past[..., n, :])) for n in range(_NODES)]
        _, k, *_ = self.mixture.polarised.shape
        broad = legendre(1.0 - turn, self.mixture.scattering.shape[1])
        across = second_order(1.0 - turn, k)
        total = [jnp.zeros_like(arrives[0])] * (1 if self.stokes == 1 else 2)
        for m, scattering in enumerate(self.mixture.scattering):
            seen = jnp.zeros_like(arrives[0])
            for n, arrived in enumerate(arrives):
                seen += (share[..., n] * density[..., n, m])[..., None] * arrived
            lobes = [(broad, scattering), (across, self.mixture.polarised[m, :, 2])]
            for i, (basis, lobe) in enumerate(lobes[: len(total)]):
                total[i] += contract("jkas,jw->kasw", basis, lobe) * seen
        if self.stokes == 1:
            return total[0][None]
        q, u = vibrates[..., 0, None], vibrates[..., 1, None]
        return jnp.stack([total[0], q * total[1], u * total[1]])
