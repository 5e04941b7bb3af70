import math

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, ArrayLike, Float, PRNGKeyArray

from ..quantity import as_float, Number, PhaseValue, Versine, Wavelength
from ..spectrum import check_table, ends
from ._base import AbstractPhaseFunction


class Tabulated(AbstractPhaseFunction):
    """Straight lines in the cosine between measured or computed values.

    `value` is relative: it is normalised here. It has one row for each of the `cosine`,
    which rise from -1 to 1, and one column for each `wavelength` (nm, rising) if it
    varies; in between, the normalised columns are joined by straight lines, and beyond
    them it is not known: `evaluate` and its kin raise `ValueError`, or give NaN under a
    transformation that hides the wavelengths. Raises `ValueError` for a table that has
    another shape, is not finite, is negative, or is zero throughout at some wavelength.
    """

    versine: Float[Array, "angle"]
    value: Float[Array, "angle band"]
    wavelength: Float[Array, "band"] | None

    def __init__(
        self, cosine: ArrayLike, value: ArrayLike, wavelength: ArrayLike | None = None
    ):
        # Taken from one in double precision, and counted from straight ahead: a narrow
        # peak keeps the digits that the cosine loses once it is single.
        x = cosine if isinstance(cosine, Array) else np.asarray(cosine, np.float64)
        y = as_float(value)
        self.wavelength = None if wavelength is None else as_float(wavelength)
        _check(x, y, self.wavelength)
        self.versine = jnp.asarray(1.0 - x, y.dtype)[::-1]
        self.value = y.reshape(len(self.versine), -1)[::-1]

    @property
    def domain(self) -> tuple[float, float]:
        """The wavelengths between which this is known, in nm."""
        if self.wavelength is None:
            return 0.0, math.inf
        return ends(self.wavelength)

    def evaluate(self, versine: Versine, wavelength: Wavelength) -> PhaseValue:
        value = self._normalised(wavelength)
        i = jnp.searchsorted(self.versine, versine, side="right") - 1
        i = jnp.clip(i, 0, len(self.versine) - 2)
        width = self.versine[i + 1] - self.versine[i]
        # Angles that rounding to single precision made one leave an empty cell.
        x = (versine - self.versine[i]) / jnp.where(width > 0.0, width, 1.0)
        return (1.0 - x) * value[i] + x * value[i + 1]

    def sample(self, key: PRNGKeyArray, wavelength: Wavelength) -> Versine:
        u = jax.random.uniform(key, (), wavelength.dtype)
        return self._quantile(u, self._normalised(wavelength[:1])[:, 0])

    def moments(self, count: int, wavelength: Wavelength) -> Float[Array, "l #wl"]:
        # Within a cell the integrand is a polynomial, for which Gauss's rule is exact.
        nodes, weights = np.polynomial.legendre.leggauss(count // 2 + 1)
        x = jnp.asarray(0.5 + 0.5 * nodes, self.versine.dtype)[None]
        low, high = self.versine[:-1, None], self.versine[1:, None]
        share = jnp.asarray(np.pi * weights, x.dtype)[None] * (high - low)
        versine = (1.0 - x) * low + x * high

        def order(state, l):
            # P_(l+1) by its distance from P_l, exact where the versine is small.
            legendre, step = state
            cells = share * legendre
            step = (l * step - (2.0 * l + 1.0) * versine * legendre) / (l + 1.0)
            ends = jnp.sum(cells * (1.0 - x), 1), jnp.sum(cells * x, 1)
            return (legendre + step, step), ends

        start = jnp.ones_like(versine), jnp.zeros_like(versine)
        orders = jnp.arange(count, dtype=x.dtype)
        _, (near, far) = jax.lax.scan(order, start, orders)
        value = self._normalised(wavelength)
        ends = jnp.concatenate([near, far], 1)
        value = jnp.concatenate([value[:-1], value[1:]])
        return jnp.matmul(ends, value, precision="highest")

    def _quantile(self, u: Number, value: Float[Array, "angle"]) -> Versine:
        """The versine that the share u of the light stays below."""
        share = jnp.cumsum((value[1:] + value[:-1]) * jnp.diff(self.versine))
        share = jnp.concatenate([jnp.zeros_like(share[:1]), share])
        u = share[-1] * u
        i = jnp.searchsorted(share, u, side="right") - 1
        i = jnp.clip(i, 0, len(share) - 2)
        # Within a cell the cumulative distribution is a quadratic; its root x, without
        # cancellation. The least number above 0 keeps empty cells from 0 / 0.
        tiny = float(jnp.finfo(u.dtype).tiny)
        y = (u - share[i]) / jnp.maximum(share[i + 1] - share[i], tiny)
        left = value[i] / jnp.maximum(value[i] + value[i + 1], tiny)
        right = value[i + 1] / jnp.maximum(value[i] + value[i + 1], tiny)
        root = jnp.sqrt((1.0 - y) * left * left + y * right * right + tiny)
        x = jnp.minimum(y / (left + root), 1.0)
        return (1.0 - x) * self.versine[i] + x * self.versine[i + 1]

    def _normalised(self, wavelength: Wavelength) -> Float[Array, "angle #wl"]:
        """The fraction per steradian at each angle of the table."""
        means = 0.5 * (self.value[1:] + self.value[:-1])
        total = jnp.sum(means * jnp.diff(self.versine)[:, None], 0, keepdims=True)
        value = 0.5 / jnp.pi * self.value / total
        if self.wavelength is None:
            return value
        known = self.wavelength
        _check_covered(known, wavelength)
        i = jnp.searchsorted(known, wavelength, side="right") - 1
        i = jnp.clip(i, 0, len(known) - 2)
        x = (wavelength - known[i]) / (known[i + 1] - known[i])
        x = jnp.where((x >= 0.0) & (x <= 1.0), x, jnp.nan)[None]
        return (1.0 - x) * value[:, i] + x * value[:, i + 1]


def _check(cosine: Array | np.ndarray, value: Array, wavelength: Array | None) -> None:
    columns = () if wavelength is None else wavelength.shape
    matched = cosine.ndim == 1 and value.shape == cosine.shape + columns
    if not (matched and len(cosine) >= 2):
        raise ValueError(
            "`value` must have a row for each of two or more `cosine`, and a column "
            f"for each `wavelength` where these are given; got shapes {value.shape}, "
            f"{cosine.shape} and {columns}."
        )
    if not isinstance(cosine, Tracer):
        ends = cosine[0] == -1.0 and cosine[-1] == 1.0
        if not (ends and np.all(np.diff(cosine) > 0.0)):
            raise ValueError(f"`cosine` must rise from -1 to 1; got {cosine}.")
    if wavelength is not None:
        check_table("wavelength", wavelength, "value", value[0])
    if isinstance(value, Tracer):
        return
    bad = np.asarray(value)[~(np.isfinite(value) & (value >= 0.0))]
    if bad.size:
        raise ValueError(f"`value` must be finite and at least 0; got {bad[0]}.")
    if not np.all(np.any(value > 0.0, axis=0)):
        raise ValueError("`value` must be above 0 somewhere, at each wavelength.")


def _check_covered(known: Array, wavelength: Wavelength) -> None:
    if isinstance(known, Tracer) or isinstance(wavelength, Tracer):
        return
    beyond = np.asarray(wavelength)[(wavelength < known[0]) | (wavelength > known[-1])]
    if beyond.size:
        raise ValueError(
            f"`wavelength` must lie within the table, {known[0]} to {known[-1]} nm; "
            f"got {beyond[0]}."
        )
