from typing import ClassVar

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from ..quantity import PhaseValue, Versine, Wavelength
from ._base import AbstractPhaseFunction


class Isotropic(AbstractPhaseFunction):
    """Every direction alike."""

    degree: ClassVar[float] = 0

    def evaluate(self, versine: Versine, wavelength: Wavelength) -> PhaseValue:
        del wavelength
        return jnp.full_like(versine, 0.25 / jnp.pi)[None]

    def sample(self, key: PRNGKeyArray, wavelength: Wavelength) -> Versine:
        return jax.random.uniform(key, (), wavelength.dtype, maxval=2.0)

    def moments(self, count: int, wavelength: Wavelength) -> Float[Array, "l #wl"]:
        return jnp.zeros((count, 1), wavelength.dtype).at[0].set(1.0)
