"""Functions of wavelength."""

import abc
import math

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, ArrayLike, Float

from .quantity import as_float, Number, Radiance, Spectral, Wavelength


def _optional(x: ArrayLike | None) -> Array | None:
    return None if x is None else as_float(x)


class AbstractSpectrum(eqx.Module):
    """A function of wavelength, in whatever unit its owner says."""

    @abc.abstractmethod
    def evaluate(self, wavelength: Wavelength) -> Spectral:
        """The value at each wavelength; of length 1 if it is the same at all."""

    @property
    def domain(self) -> tuple[float, float]:
        """The wavelengths between which this is known, in nm."""
        return 0.0, math.inf


class Constant(AbstractSpectrum):
    """The same at every wavelength."""

    value: Number = eqx.field(converter=as_float)

    def evaluate(self, wavelength: Wavelength) -> Spectral:
        del wavelength
        return self.value[None]


class PowerLaw(AbstractSpectrum):
    """`value * (wavelength / at) ** exponent`: Rayleigh is -4, Angstrom about -1.3."""

    value: Number = eqx.field(converter=as_float)
    exponent: Number = eqx.field(converter=as_float)
    at: Number = eqx.field(converter=as_float, default=550.0)

    def evaluate(self, wavelength: Wavelength) -> Spectral:
        return self.value * (wavelength / self.at) ** self.exponent


class Tabulated(AbstractSpectrum):
    """Straight lines between `values` at the rising wavelengths `knots`, in nm.

    Beyond the knots it is `below` and `above`; where these are None it is not known,
    and a scene that asks for it there is refused.
    """

    knots: Float[Array, "n"] = eqx.field(converter=as_float)
    values: Float[Array, "n"] = eqx.field(converter=as_float)
    below: Number | None = eqx.field(converter=_optional, default=None)
    above: Number | None = eqx.field(converter=_optional, default=None)

    def __check_init__(self):
        check_table("knots", self.knots, "values", self.values)

    def evaluate(self, wavelength: Wavelength) -> Spectral:
        return jnp.interp(
            wavelength, self.knots, self.values, left=self.below, right=self.above
        )

    @property
    def domain(self) -> tuple[float, float]:
        low, high = ends(self.knots)
        return (
            low if self.below is None else 0.0,
            high if self.above is None else math.inf,
        )


class BandAverage(AbstractSpectrum):
    """A table averaged over a band of `bandwidth` nm around each wavelength.

    A spectrum full of lines, such as the sun's, must not be sampled at points: between
    the lines it would be too bright by up to a fifth.
    """

    knots: Float[Array, "n"] = eqx.field(converter=as_float)
    values: Float[Array, "n"] = eqx.field(converter=as_float)
    bandwidth: Number = eqx.field(converter=as_float)

    def __check_init__(self):
        check_table("knots", self.knots, "values", self.values)
        if not (isinstance(self.bandwidth, Tracer) or float(self.bandwidth) > 0.0):
            raise ValueError(f"`bandwidth` must be above 0 nm; got {self.bandwidth}.")

    def evaluate(self, wavelength: Wavelength) -> Spectral:
        steps = jnp.diff(self.knots)
        slopes = jnp.diff(self.values) / steps
        pieces = 0.5 * (self.values[1:] + self.values[:-1]) * steps
        total = jnp.concatenate([jnp.zeros_like(pieces[:1]), jnp.cumsum(pieces)])

        def integral(at):
            i = jnp.searchsorted(self.knots, at, side="right") - 1
            i = jnp.clip(i, 0, len(steps) - 1)
            x = at - self.knots[i]
            return total[i] + x * (self.values[i] + 0.5 * x * slopes[i])

        half = 0.5 * self.bandwidth
        gain = integral(wavelength + half) - integral(wavelength - half)
        return gain / self.bandwidth

    @property
    def domain(self) -> tuple[float, float]:
        half = 0.5 * float(self.bandwidth)
        low, high = ends(self.knots)
        return low + half, high - half


class Product(AbstractSpectrum):
    """One spectrum times another: an extinction and a single-scattering albedo."""

    one: AbstractSpectrum
    other: AbstractSpectrum

    def evaluate(self, wavelength: Wavelength) -> Spectral:
        return self.one.evaluate(wavelength) * self.other.evaluate(wavelength)

    @property
    def domain(self) -> tuple[float, float]:
        (low, high), (other_low, other_high) = self.one.domain, self.other.domain
        return max(low, other_low), min(high, other_high)


class Complement(AbstractSpectrum):
    """One minus a spectrum: what is absorbed of what is not scattered."""

    of: AbstractSpectrum

    def evaluate(self, wavelength: Wavelength) -> Spectral:
        return 1.0 - self.of.evaluate(wavelength)

    @property
    def domain(self) -> tuple[float, float]:
        return self.of.domain


# 2 h c^2, in W m^-2 sr^-1 nm^-1 um^5, and h c / k, in um K (CODATA 2018: both exact).
_FIRST, _SECOND = 1.191042972397188e5, 1.438776877503933e4
# Where the exponential would leave single precision, nothing is left to see.
_COLD = 85.0


def planck(wavelength: Wavelength, temperature: Number) -> Radiance:
    """The radiance of a black body at a temperature in K (Planck 1901); 0 if cold."""
    w = wavelength * 1e-3
    cold = temperature * _COLD * w <= _SECOND
    safe = jnp.where(cold, _SECOND / w, temperature)
    x = _SECOND / (w * safe)
    found = _FIRST / w**5 * jnp.exp(-x) / -jnp.expm1(-x)
    return jnp.where(cold, 0.0, found)


def as_spectrum(x: ArrayLike | AbstractSpectrum) -> AbstractSpectrum:
    """The converter of fields that vary with wavelength: a number is a `Constant`."""
    return x if isinstance(x, AbstractSpectrum) else Constant(x)


def ends(knots: Float[Array, "n"]) -> tuple[float, float]:
    """The first and the last, as plain numbers even while others are traced."""
    known = np.asarray(knots)
    return float(known[0]), float(known[-1])


def check_table(key: str, knots: Array, name: str, values: Array) -> None:
    """Refuses a table that does not rise, or does not pair.

    Raises `ValueError` unless `knots` are two or more finite numbers, each above the
    last, with as many finite `values`.
    """
    if knots.ndim != 1 or knots.shape[0] < 2 or knots.shape != values.shape:
        raise ValueError(
            f"`{name}` must pair with two or more `{key}`; got shapes "
            f"{values.shape} and {knots.shape}."
        )
    if isinstance(knots, Tracer) or isinstance(values, Tracer):
        return
    if not (np.all(np.isfinite(knots)) and np.all(np.diff(knots) > 0.0)):
        raise ValueError(f"`{key}` must be finite and rise; got {np.asarray(knots)}.")
    if not np.all(np.isfinite(values)):
        raise ValueError(f"`{name}` must be finite; got {np.asarray(values)}.")
