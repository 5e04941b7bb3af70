"""What the air does not exceed, between altitudes, and how a ray goes through it."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..geometry import AbstractPath
from ..quantity import Length, Number, Wavelength
from ..scene import Scene
from ._guess import tops
from ._majorants import at_most


# What shines must be met, even if it takes no light away: so often on the way up.
_OFTEN = 4.0
# How many strata a ray goes through, at most, before all others are waited for.
_STRIDE = 3


class Strata(eqx.Module):
    """Altitudes, from the ground to the top of the air, and bounds of the extinction.

    In m^-1, between each and the next.
    """

    altitudes: Float[Array, "edge"]
    bounds: Float[Array, "stratum"]

    def depth(self, path: AbstractPath, far: Length) -> Number:
        """What the bounds add up to from the start of a ray to `far`."""
        falling, rising = jax.vmap(path.crossings, out_axes=1)(self.altitudes)
        lowest = path.lowest()
        down = jnp.clip(jnp.minimum(falling, lowest), 0.0, far)
        up = jnp.clip(jnp.maximum(rising, lowest), 0.0, far)
        return jnp.sum(self.bounds * (jnp.diff(up) - jnp.diff(down)))


def strata_of(air: Scene, wavelength: Wavelength, slack: Number) -> Strata:
    """Bounds for media that depend on altitude alone.

    They are `slack` times as high as must be.
    """
    edges = tops(air)
    edges = jnp.concatenate([jnp.zeros_like(edges[:1]), edges])
    most = slack * at_most(air, wavelength, _OFTEN / air.top)

    def bound(low, high):
        found = [x.profile.most_between(low, high) for x in air.media]
        # A little more, as altitudes are rounded.
        return 1.0001 * jnp.sum(jnp.stack(found) * most)

    return Strata(edges, jax.vmap(bound)(edges[:-1], edges[1:]))


def climb(
    strata: Strata, path: AbstractPath, near: Length, far: Length, depth: Number
) -> tuple[Length, Number, Number, Bool[Array, ""]]:
    """On from `near` to where the bounds have added up to an optical depth.

    Or to `far`, or some strata on. With the depth that is left, the bound there, and
    whether it was reached.
    """
    last = strata.bounds.shape[0] - 1
    lowest = path.lowest()
    stratum = jnp.sum(strata.altitudes <= path.at(near).altitude) - 1
    stratum = jnp.clip(stratum, 0, last).astype(jnp.int32)
    at, most, met = near, jnp.ones_like(depth), jnp.array(False)
    for _ in range(_STRIDE):
        goes = ~met & (at < far)
        down, _ = path.crossings(strata.altitudes[stratum])
        _, up = path.crossings(strata.altitudes[stratum + 1])
        falls = at < lowest
        leaves = falls & (down < lowest)
        end = jnp.clip(jnp.where(falls, jnp.minimum(down, lowest), up), at, far)
        step = jnp.where(leaves, -1, jnp.where(falls, 0, 1))
        # Below the lowest and above the highest there is nothing to come.
        out = (stratum + step < 0) | (stratum + step > last)
        bound = strata.bounds[stratum]
        gains = bound * (end - at)
        here = goes & (depth < gains)
        on = goes & ~here
        stop = at + depth / jnp.where(bound > 0.0, bound, 1.0)
        depth = jnp.where(here, 0.0, jnp.where(on, depth - gains, depth))
        at = jnp.where(here, stop, jnp.where(on, jnp.where(out, far, end), at))
        stratum = jnp.clip(jnp.where(on, stratum + step, stratum), 0, last)
        most, met = jnp.where(here, bound, most), met | here
    return at, depth, most, met
