import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from ..quantity import PhaseValue, Versine, Wavelength
from ..spectrum import AbstractSpectrum, as_spectrum
from ._base import AbstractPhaseFunction
from ._check import check_between
from .henyey_greenstein import lobe, powers, quantile, STEEPEST


class DoubleHenyeyGreenstein(AbstractPhaseFunction):
    """Two Henyey-Greenstein lobes: most particles also throw some light back.

    A `weight` (0 to 1) of the light has mean cosine `forward`, the rest has `backward`,
    which is negative for a lobe that looks back.
    """

    forward: AbstractSpectrum = eqx.field(converter=as_spectrum)
    backward: AbstractSpectrum = eqx.field(converter=as_spectrum)
    weight: AbstractSpectrum = eqx.field(converter=as_spectrum)

    def __check_init__(self):
        check_between("forward", self.forward, -STEEPEST, STEEPEST)
        check_between("backward", self.backward, -STEEPEST, STEEPEST)
        check_between("weight", self.weight, 0.0, 1.0)

    def evaluate(self, versine: Versine, wavelength: Wavelength) -> PhaseValue:
        weight = self.weight.evaluate(wavelength)
        ahead = lobe(versine, self.forward.evaluate(wavelength))
        back = lobe(versine, self.backward.evaluate(wavelength))
        return weight * ahead + (1.0 - weight) * back

    def sample(self, key: PRNGKeyArray, wavelength: Wavelength) -> Versine:
        which, where = jax.random.split(key)
        g = jnp.where(
            jax.random.uniform(which, (), wavelength.dtype)
            < self.weight.evaluate(wavelength)[0],
            self.forward.evaluate(wavelength)[0],
            self.backward.evaluate(wavelength)[0],
        )
        return quantile(jax.random.uniform(where, (), wavelength.dtype), g)

    def moments(self, count: int, wavelength: Wavelength) -> Float[Array, "l #wl"]:
        weight = self.weight.evaluate(wavelength)[None]
        ahead = powers(self.forward.evaluate(wavelength), count)
        back = powers(self.backward.evaluate(wavelength), count)
        return weight * ahead + (1.0 - weight) * back
