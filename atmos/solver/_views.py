"""The directions in which light is tabulated at an altitude."""

import math

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.lax import stop_gradient
from jaxtyping import Array, Bool, Float, Int

from ..quantity import Cosine, Number


# As near to the horizon, and to straight up and down, as single precision tells.
_NEAREST, _GRAZES = 1e-6, 1e-5
# The logarithm of how much closer views are at the limb, seen from the top of the air.
_CROWD = 4.4


class Views(eqx.Module):
    """As many views above the horizon as below it, and `turns` azimuths from the sun's.

    Cosines from straight up are those of Clenshaw and Curtis on either side, ends
    included: they crowd at the horizon, where light changes fast and stops, and higher
    up exponentially, as the air at the limb does. Azimuths lie in the middle of parts
    of half a circle, as the other half is alike.
    """

    side: int = eqx.field(static=True)
    turns: int = eqx.field(static=True)

    def cosines(
        self, horizon: Float[Array, "level"], height: Float[Array, "level"]
    ) -> Float[Array, "level view"]:
        """From the horizon up, and then from there down.

        For horizons of these cosines, at such shares of the altitude of the air's top.
        """
        share = 0.5 - 0.5 * np.cos(np.pi * np.linspace(0.0, 1.0, self.side))
        crowd = self._crowd(height)
        share = jnp.expm1(crowd * jnp.asarray(share, height.dtype)[None]) / jnp.expm1(
            crowd
        )
        # What grazes the ground would be on both sides of it, by rounding.
        share = jnp.clip(share, _GRAZES, 1.0 - _NEAREST)
        horizon = horizon[:, None]
        above, below = 1.0 - horizon, 1.0 + horizon
        return jnp.concatenate([horizon + above * share, horizon - below * share], 1)

    def weights(
        self, horizon: Float[Array, "level"], height: Float[Array, "level"]
    ) -> Float[Array, "level view"]:
        """The solid angle of a view in one of its azimuths, and in its mirror image."""
        n = self.side - 1
        even = np.arange(0, n + 1, 2)
        angle = np.pi * np.arange(n + 1) / n
        series = np.where((even == 0) | (even == n), 1.0, 2.0) / (1.0 - even**2)
        weight = np.cos(np.outer(angle, even)) @ series / n
        weight[[0, -1]] *= 0.5
        weight = jnp.asarray(weight * (2.0 * math.pi / self.turns), height.dtype)[None]
        share = jnp.asarray(0.5 - 0.5 * np.cos(angle), height.dtype)[None]
        crowd = self._crowd(height)
        weight = weight * crowd * jnp.exp(crowd * share) / jnp.expm1(crowd)
        above, below = 1.0 - horizon[:, None], 1.0 + horizon[:, None]
        return jnp.concatenate([above * weight, below * weight], 1)

    def _crowd(self, height: Float[Array, "*n"]) -> Float[Array, "*n 1"]:
        return _CROWD * jnp.sqrt(jnp.clip(height, 1e-5, 1.0))[..., None]

    def azimuths(self) -> np.ndarray:
        """In rad, from the sun's."""
        return (np.arange(self.turns) + 0.5) * (np.pi / self.turns)

    def place(
        self, cosine: Cosine, horizon: Cosine, height: Number, grounded: Bool[Array, ""]
    ) -> tuple[Int[Array, ""], Float[Array, ""]]:
        """The first of four views to mix, and how many steps from it one looks."""
        above, below = cosine - horizon, horizon - cosine
        share = jnp.where(grounded, below / (1.0 + horizon), above / (1.0 - horizon))
        crowd = self._crowd(height)[0]
        share = jnp.log1p(jnp.clip(share, 0.0, 1.0) * jnp.expm1(crowd)) / crowd
        share = jnp.clip(share, _NEAREST, 1.0 - _NEAREST)
        angle = 2.0 * jnp.arctan2(jnp.sqrt(share), jnp.sqrt(1.0 - share))
        first, x = nearby(angle * ((self.side - 1) / math.pi), self.side, 4)
        return first + jnp.where(grounded, self.side, 0).astype(jnp.int32), x


def nearby(
    place: Float[Array, "*n"], count: int, taps: int
) -> tuple[Int[Array, "*n"], Float[Array, "*n"]]:
    """The first of so many neighbours of a place among `count`; the steps from it."""
    before = taps // 2 - 1.0
    first = jnp.clip(jnp.floor(stop_gradient(place)) - before, 0.0, count - taps)
    return first.astype(jnp.int32), place - first
