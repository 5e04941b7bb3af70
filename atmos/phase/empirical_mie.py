import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from ..quantity import PhaseValue, Versine, Wavelength
from ..spectrum import AbstractSpectrum, as_spectrum
from ._base import AbstractPhaseFunction
from ._check import check_between


class EmpiricalMie(AbstractPhaseFunction):
    """Half of the light alike in all directions, half in a lobe ahead: fog by eye.

    (1 / 4 pi) (1/2 + (z + 1)/2 ((1 + cos)/2)^z): the form that Nishita, Miyawaki and
    Nakamae (1987) fitted to Mie theory, normalised. `z` is 0 or more; 0 is isotropic.
    """

    z: AbstractSpectrum = eqx.field(converter=as_spectrum)

    def __check_init__(self):
        check_between("z", self.z, 0.0)

    @classmethod
    def hazy(cls) -> "EmpiricalMie":
        """A hazy atmosphere: z = 8."""
        return cls(as_spectrum(8.0))

    @classmethod
    def murky(cls) -> "EmpiricalMie":
        """A murky atmosphere: z = 32."""
        return cls(as_spectrum(32.0))

    def evaluate(self, versine: Versine, wavelength: Wavelength) -> PhaseValue:
        z = self.z.evaluate(wavelength)
        # The least number above 0 keeps the logarithm finite where light turns back.
        height = 0.5 * (2.0 - versine) + float(jnp.finfo(versine.dtype).tiny)
        return 0.125 / jnp.pi * (1.0 + (z + 1.0) * jnp.exp(z * jnp.log(height)))

    def sample(self, key: PRNGKeyArray, wavelength: Wavelength) -> Versine:
        which, where = jax.random.split(key)
        u = jax.random.uniform(where, (), wavelength.dtype)
        z = self.z.evaluate(wavelength)[0]
        ahead = -2.0 * jnp.expm1(jnp.log1p(-u) / (z + 1.0))
        alike = jax.random.bernoulli(which)
        return jnp.where(alike, 2.0 * u, ahead)

    def moments(self, count: int, wavelength: Wavelength) -> Float[Array, "l #wl"]:
        # The lobe's moments are the products of (z + 1 - k) / (z + 1 + k), k = 1 ... l.
        z = self.z.evaluate(wavelength)[None]
        k = jnp.arange(count, dtype=z.dtype)[:, None]
        lobe = jnp.cumprod((z + 1.0 - k) / (z + 1.0 + k), axis=0)
        return (0.5 * lobe).at[0].set(1.0)
