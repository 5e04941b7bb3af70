"""Flat layers as light is solved for in them, and how suns reach them."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..optics import Layers, Mixture
from ..quantity import Angle, Length
from ..scene import Scene
from ..transport import columns, contract


# Of light that meets so much more on its way into the shadow nothing is left there.
_SHADE, _NIGHT = 16.0, 1e3


class Stack(eqx.Module):
    """Layers, with suns whose rays reach each along their own curved way.

    What it tells goes from the top down; in place of one more sun there is the ground,
    which sends nothing straight. `slants` are the columns towards each sun from the
    ground up, and `dark` says where the world is in between.
    """

    column: Float[Array, "layer medium"]
    slants: Float[Array, "level sun medium"]
    dark: Bool[Array, "level sun 1"]
    cosine: Float[Array, "sun+1"]

    @classmethod
    def of(cls, scene: Scene, layers: Layers, zeniths: Float[Array, "sun"]) -> "Stack":
        at = jax.vmap(_towards, (None, 0, None))
        slants, dark = jax.vmap(at, (None, None, 0), 1)(scene, layers.altitude, zeniths)
        cosine = jnp.pad(jnp.cos(zeniths), (0, 1))
        return cls(layers.column, slants, dark[:, :, None], cosine)

    def amount(self, each: Float[Array, "medium *k"]) -> Float[Array, "layer *k"]:
        """What the media of a layer do, of what a metre of each does."""
        return contract("km,m...->k...", self.column, each)[::-1]

    def slant(self, mixture: Mixture) -> Float[Array, "level beam wl"]:
        """Optical depths towards the suns, far larger in the shadow of the world."""
        slant = contract("ksm,ml->ksl", self.slants, mixture.extinction)
        deepest = jnp.max(jnp.where(self.dark, 0.0, slant), 0, keepdims=True)
        shade = jnp.where(self.dark[-1:], _NIGHT, deepest + _SHADE)
        slant = jnp.where(self.dark, shade, slant)
        none = ((0, 0), (0, 1), (0, 0))
        return jnp.pad(slant, none, constant_values=_NIGHT)[::-1]

    def arrives(self, slant: Float[Array, "level beam wl"]) -> Float[Array, "beam wl"]:
        """The straight flux on the ground, of suns of irradiance 1."""
        return jnp.maximum(self.cosine, 0.0)[:, None] * jnp.exp(-slant[-1])


def _towards(
    scene: Scene, altitude: Length, zenith: Angle
) -> tuple[Float[Array, "medium"], Bool[Array, ""]]:
    """The columns from a place above the origin to the sun, and if it is in shadow."""
    start = scene.geometry.locate(jnp.zeros(3, altitude.dtype).at[2].set(altitude))
    zero = jnp.zeros_like(zenith)
    direction = jnp.stack([jnp.sin(zenith), zero, jnp.cos(zenith)])
    path = scene.geometry.path(start, direction)
    begins, ends = path.shadow(direction, zero)
    found = columns(scene, path, path.span(scene.top).far, nodes=16)
    return found, (begins < 0.0) & (ends > 0.0)
