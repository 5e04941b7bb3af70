"""A few of many wavelengths, and smooth functions that are drawn through them."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..optics import Mixture
from ..quantity import Number, Wavelength
from ..transport import contract


# The rational function through the chosen joins polynomials of this degree.
_DEGREE = 4


class Chosen(eqx.Module):
    """Some of all wavelengths, and what they weigh in a smooth function at all."""

    index: Int[Array, "few"]
    weights: Float[Array, "few wl"]

    @classmethod
    def of(cls, wavelength: Wavelength, count: int) -> "Chosen":
        """All, or so many from the shortest to the longest, crowded at both ends.

        Between these, which must lie apart from each other, lies the rational function
        of Floater and Hormann (2007, "Barycentric rational interpolation with no
        poles", Numerische Mathematik 107).
        """
        size = wavelength.size
        if size <= count:
            every = jnp.arange(size, dtype=jnp.int32)
            return cls(every, jnp.eye(size, dtype=wavelength.dtype))
        t = np.linspace(0.0, 1.0, count)
        t = 0.5 * t + 0.25 - 0.25 * np.cos(math.pi * t)
        x = jax.lax.stop_gradient(wavelength)
        low, t = jnp.min(x), jnp.asarray(t, x.dtype)
        wanted = low + (jnp.max(x) - low) * t
        index = jnp.argmin(jnp.abs(x[None] - wanted[:, None]), 1).astype(jnp.int32)
        nodes = x[index]
        scale = (nodes[-1] - nodes[0]) / count
        apart = (nodes[:, None] - nodes[None]) / scale
        apart = jnp.abs(apart) + jnp.eye(count, dtype=x.dtype)
        # Windows of neighbours, a polynomial through each.
        first = np.arange(count - _DEGREE)[:, None]
        within = (np.arange(count) >= first) & (np.arange(count) <= first + _DEGREE)
        within = jnp.asarray(within, x.dtype)
        share = jnp.exp(-contract("ij,kj->ik", within, jnp.log(apart)))
        sign = jnp.asarray((-1.0) ** np.arange(count), x.dtype)
        share = sign * jnp.sum(within * share, 0)
        here = nodes[:, None] == x[None]
        away = jnp.where(here, 1.0, (x[None] - nodes[:, None]) / scale)
        share = share[:, None] / away
        share = share / jnp.sum(share, 0, keepdims=True)
        met = jnp.any(here, 0, keepdims=True)
        return cls(index, jnp.where(met, jnp.asarray(here, x.dtype), share))

    @property
    def whole(self) -> bool:
        """Whether all are chosen."""
        return self.weights.shape[0] == self.weights.shape[1]

    def of_mixture(self, mixture: Mixture) -> Mixture:
        """The media at some wavelengths."""
        if self.whole:
            return mixture
        return jax.tree.map(lambda x: x[..., self.index], mixture)

    def smooth(self, known: Float[Array, "*n few"]) -> Float[Array, "*n wl"]:
        """At all wavelengths, what is known at some."""
        return known if self.whole else contract("...k,kl->...l", known, self.weights)

    def like(
        self, known: Float[Array, "*n few"], guide: Float[Array, "*n wl"]
    ) -> Float[Array, "*n wl"]:
        """The same of what is never negative, and of a kind with a guide."""
        if self.whole:
            return known
        least = float(jnp.finfo(known.dtype).tiny) ** 0.5
        guide = guide + least
        ratio = jnp.log((jnp.maximum(known, 0.0) + least) / guide[..., self.index])
        return guide * jnp.exp(self.smooth(ratio))

    def relative(
        self, known: Float[Array, "*n few"], guide: Float[Array, "*n wl"]
    ) -> Float[Array, "*n wl"]:
        """The same of what is much less than a guide, and may be negative."""
        if self.whole:
            return known
        guide = guide + float(jnp.finfo(known.dtype).tiny) ** 0.5
        return guide * self.smooth(known / guide[..., self.index])


def misfit(depth: Float[Array, "*n wl"], wavelength: Wavelength, count: int) -> Number:
    """By how much optical depths differ at most from what is drawn through a few.

    Infinite where these do not lie apart from each other.
    """
    chosen = Chosen.of(wavelength, count)
    drawn = chosen.smooth(depth[..., chosen.index])
    apart = jnp.all(jnp.diff(wavelength[chosen.index]) > 0.0)
    most = jnp.max(jnp.abs(drawn - depth), initial=0.0)
    return jnp.where(apart, most, math.inf)
