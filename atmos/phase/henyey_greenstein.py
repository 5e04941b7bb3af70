import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from ..quantity import Number, PhaseValue, Spectral, Versine, Wavelength
from ..spectrum import AbstractSpectrum, as_spectrum
from ._base import AbstractPhaseFunction
from ._check import check_between


# Nearer to 1 than this, one minus g has no digits left in single precision.
STEEPEST = 0.9999999


class HenyeyGreenstein(AbstractPhaseFunction):
    """One lobe of mean cosine `g`: 0 is isotropic, towards 1 ever narrower ahead.

    Henyey and Greenstein (1941). `g` lies between -1 and 1, by 1e-7 at least.
    """

    g: AbstractSpectrum = eqx.field(converter=as_spectrum)

    def __check_init__(self):
        check_between("g", self.g, -STEEPEST, STEEPEST)

    def evaluate(self, versine: Versine, wavelength: Wavelength) -> PhaseValue:
        return lobe(versine, self.g.evaluate(wavelength))

    def sample(self, key: PRNGKeyArray, wavelength: Wavelength) -> Versine:
        u = jax.random.uniform(key, (), wavelength.dtype)
        return quantile(u, self.g.evaluate(wavelength)[0])

    def moments(self, count: int, wavelength: Wavelength) -> Float[Array, "l #wl"]:
        return powers(self.g.evaluate(wavelength), count)


def lobe(versine: Versine, g: Spectral) -> PhaseValue:
    """The lobe's fraction per steradian."""
    # 1 + g^2 - 2 g cos, as a sum of what is positive: it keeps its digits in a narrow
    # peak ahead, where it is (1 - g)^2 + 2 g versine, as in one behind.
    half = 0.5 * versine
    spread = (1.0 - half) * (1.0 - g) ** 2 + half * (1.0 + g) ** 2
    return 0.25 / jnp.pi * (1.0 - g) * (1.0 + g) / (spread * jnp.sqrt(spread))


def quantile(u: Number, g: Number) -> Versine:
    """The versine that a share 1 - u of the light stays below."""
    # The textbook's inverse, solved for the versine: without division by g, and with
    # the relative precision of u or 1 - u at either end.
    w = 1.0 - u
    ahead = w + (1.0 + g) * u
    ratio = (1.0 - g) / ((1.0 - g) * w + (1.0 + g) * u)
    return jnp.minimum(2.0 * ratio * ratio * w * ahead, 2.0)


def powers(g: Spectral, count: int) -> Float[Array, "l #wl"]:
    """The lobe's Legendre moments: 1, g, g^2, ..."""
    rising = jnp.broadcast_to(g, (count, *g.shape)).at[0].set(1.0)
    return jnp.cumprod(rising, axis=0)
