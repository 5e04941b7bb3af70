import math
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from ..quantity import PhaseValue, Spectral, Versine, Wavelength
from ..spectrum import AbstractSpectrum, as_spectrum
from ._base import AbstractPhaseFunction
from ._check import check_between
from .isotropic import Isotropic


class Rayleigh(AbstractPhaseFunction):
    """Scattering by molecules, and by all that is far smaller than the wavelength.

    `depolarisation` is rho, the ratio of the light scattered sideways that vibrates in
    the plane of scattering to what vibrates across it, for unpolarised light: 0 to 0.5;
    0.028 or so for air. Form of Chandrasekhar (1960) as in Bucholtz (1995),

        3 / (16 pi) ((1 + 3 gamma) + (1 - gamma) cos^2) / (1 + 2 gamma),

    with gamma = rho / (2 - rho) multiplied out. The scattering matrix is that of Hansen
    and Travis (1974): a share 2 (1 - rho) / (2 + rho) scatters as a dipole, the rest
    alike in all directions and without polarisation.
    """

    degree: ClassVar[float] = 2
    depolarisation: AbstractSpectrum = eqx.field(converter=as_spectrum, default=0.0)

    def __check_init__(self):
        check_between("depolarisation", self.depolarisation, 0.0, 0.5)

    def evaluate(self, versine: Versine, wavelength: Wavelength) -> PhaseValue:
        rho = self.depolarisation.evaluate(wavelength)
        cosine = 1.0 - versine
        shape = (1.0 + rho) + (1.0 - rho) * (cosine * cosine)
        return 0.375 / jnp.pi * shape / (2.0 + rho)

    def sample(self, key: PRNGKeyArray, wavelength: Wavelength) -> Versine:
        # The cumulative distribution is the cubic c^3 + 3 p c = 2 s. Its one real root
        # by Cardano's formula, with hyperbolic functions, where nothing cancels.
        rho = self.depolarisation.evaluate(wavelength)[0]
        u = jax.random.uniform(key, (), wavelength.dtype)
        p = (1.0 + rho) / (1.0 - rho)
        s = (2.0 * u - 1.0) * (2.0 + rho) / (1.0 - rho)
        root = jnp.sqrt(p)
        cosine = 2.0 * root * jnp.sinh(jnp.arcsinh(s / (p * root)) / 3.0)
        return jnp.clip(1.0 - cosine, 0.0, 2.0)

    def moments(self, count: int, wavelength: Wavelength) -> Float[Array, "l #wl"]:
        rho = self.depolarisation.evaluate(wavelength)
        second = 0.2 * (1.0 - rho) / (2.0 + rho)
        moments = jnp.zeros((count, *rho.shape), rho.dtype).at[0].set(1.0)
        return moments.at[2:3].set(second) if count > 2 else moments

    def polarisation(self, versine: Versine, wavelength: Wavelength) -> PhaseValue:
        return 0.1875 / jnp.pi * self._pure(wavelength) * (versine * (2.0 - versine))

    def polarisation_moments(
        self, count: int, wavelength: Wavelength
    ) -> Float[Array, "k 3 #wl"]:
        second = jnp.array([0.6, 0.0, 0.1 * math.sqrt(6.0)], wavelength.dtype)
        second = second[:, None] * self._pure(wavelength)[None]
        return jnp.stack([jnp.zeros_like(second)] * 2 + [second])[:count]

    def _pure(self, wavelength: Wavelength) -> Spectral:
        """The share that scatters as a dipole."""
        rho = self.depolarisation.evaluate(wavelength)
        return 2.0 * (1.0 - rho) / (2.0 + rho)

    def terms(
        self, wavelength: Wavelength
    ) -> tuple[tuple[AbstractPhaseFunction, Spectral], ...]:
        pure = self._pure(wavelength)
        return (Rayleigh(jnp.zeros_like(pure[0])), pure), (Isotropic(), 1.0 - pure)
