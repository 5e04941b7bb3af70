import equinox as eqx
import jax
import jax.numpy as jnp
from jax.lax import stop_gradient
from jaxtyping import Array, ArrayLike, Float, PRNGKeyArray

from ..quantity import Number, PhaseValue, Versine, Wavelength
from ..spectrum import AbstractSpectrum, as_spectrum
from ._base import AbstractPhaseFunction
from ._check import check_between
from .henyey_greenstein import lobe, powers, quantile, STEEPEST


class Draine(AbstractPhaseFunction):
    """A Henyey-Greenstein lobe times 1 + alpha cos^2, between dust and molecules.

    Draine (2003). `g` is as in Henyey-Greenstein, which is alpha = 0; it is not the
    mean cosine here. `alpha` is 0 or more; g = 0, alpha = 1 is Rayleigh.
    """

    g: AbstractSpectrum = eqx.field(converter=as_spectrum)
    alpha: AbstractSpectrum = eqx.field(converter=as_spectrum)

    def __check_init__(self):
        check_between("g", self.g, -STEEPEST, STEEPEST)
        check_between("alpha", self.alpha, 0.0)

    def evaluate(self, versine: Versine, wavelength: Wavelength) -> PhaseValue:
        g, alpha = self.g.evaluate(wavelength), self.alpha.evaluate(wavelength)
        cosine = 1.0 - versine
        tilt = (1.0 + alpha * (cosine * cosine)) / _total(g, alpha)
        return lobe(versine, g) * tilt

    def sample(self, key: PRNGKeyArray, wavelength: Wavelength) -> Versine:
        g, alpha = self.g.evaluate(wavelength)[0], self.alpha.evaluate(wavelength)[0]
        u = jax.random.uniform(key, (), wavelength.dtype)
        return quantile(lobe_share(u, g, alpha), g)

    def moments(self, count: int, wavelength: Wavelength) -> Float[Array, "l #wl"]:
        g, alpha = self.g.evaluate(wavelength), self.alpha.evaluate(wavelength)
        plain = powers(g, count + 2)
        squared = _times_cosine(_times_cosine(plain))
        return (plain[:count] + alpha[None] * squared) / _total(g, alpha)[None]


def CornetteShanks(g: ArrayLike | AbstractSpectrum) -> Draine:
    """Draine's function at alpha = 1: a haze of drops, Rayleigh where `g` is 0.

    Cornette and Shanks (1992). The mean cosine is g (12 + 3 g^2) / (10 + 5 g^2).
    """
    return Draine(as_spectrum(g), as_spectrum(1.0))


def _total(g: Array, alpha: Array) -> Array:
    """The mean of 1 + alpha cos^2 over a Henyey-Greenstein lobe."""
    return 1.0 + alpha * (1.0 + 2.0 * g * g) / 3.0


def _times_cosine(moments: Float[Array, "l wl"]) -> Float[Array, "k wl"]:
    """The moments, but for the last, of a function times the cosine."""
    # (2 l + 1) x P_l = (l + 1) P_(l+1) + l P_(l-1), where l = 0 has nothing below.
    l = jnp.arange(len(moments) - 1, dtype=moments.dtype)[:, None]
    below = jnp.concatenate([moments[:1], moments[:-2]])
    return ((l + 1.0) * moments[1:] + l * below) / (2.0 * l + 1.0)


def cumulative(s: Number, g: Number, alpha: Number) -> tuple[Number, Number]:
    """Draine's share of light where the lobe's share is `s`, and its slope.

    Both are counted from straight back. The lobe's shares are the variable in which
    this is gentle however narrow the lobe: the steepest slope is at most 1 + alpha
    times the least.
    """
    # The cosine is p^2 - q^2 + 2 g p q, and its square integrates over s to s times the
    # cubic below.
    behind, ahead = (1.0 - g) * (1.0 - s), (1.0 + g) * s
    p, q = ahead / (behind + ahead), behind / (behind + ahead)
    a = 1.0 - 2.0 * g
    b = 1.0 + 2.0 * g * g
    cubic = q * q * q + p * (a * q * q + p * (a * a * q + b * p) / 3.0)
    cosine = p * p - q * q + 2.0 * g * p * q
    total = _total(g, alpha)
    return s * (1.0 + alpha * cubic) / total, (1.0 + alpha * cosine * cosine) / total


def lobe_share(u: Number, g: Number, alpha: Number) -> Number:
    """The share of the lobe's light in what is the share `u` of Draine's.

    The inverse of `cumulative`, to rounding: Newton's steps, halving the bracket
    instead wherever they would leave it.
    """
    fixed_g, fixed_alpha = stop_gradient(g), stop_gradient(alpha)
    target = stop_gradient(u)
    near = 8.0 * float(jnp.finfo(target.dtype).eps)

    def miss(s):
        value, slope = cumulative(s, fixed_g, fixed_alpha)
        return value - target, slope

    def unsolved(state):
        _, _, _, error, _, step = state
        return (jnp.abs(error) > near) & (step < 40)

    def closer(state):
        s, low, high, error, slope, step = state
        low, high = jnp.where(error < 0.0, s, low), jnp.where(error < 0.0, high, s)
        newton = s - error / slope
        inside = (newton >= low) & (newton <= high)
        s = jnp.where(inside, newton, 0.5 * (low + high))
        return s, low, high, *miss(s), step + 1

    start = (target, jnp.zeros_like(target), jnp.ones_like(target), *miss(target), 0)
    s = jax.lax.while_loop(unsolved, closer, start)[0]
    # The derivatives are those of the equation solved, not of the steps.
    value, slope = cumulative(s, g, alpha)
    error = value - u
    return s - (error - stop_gradient(error)) / stop_gradient(slope)
