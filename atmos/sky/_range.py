"""Where a fitted model holds, and what becomes of what lies beyond."""

import abc
import math
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from ..quantity import deg


class Range(NamedTuple):
    """The values that a model was fitted to, in the unit that atmos uses.

    Messages show them divided by `scale`, followed by `unit`.
    """

    low: float
    high: float
    unit: str = ""
    scale: float = 1.0


def degrees(low: float, high: float) -> Range:
    """A range of angles, given in degrees."""
    return Range(low * deg, high * deg, " degrees", deg)


class AbstractBeyond(eqx.Module):
    """What is done with what lies beyond a range."""

    @abc.abstractmethod
    def admit(
        self, name: str, value: Float[Array, "*n"], range: Range
    ) -> Float[Array, "*n"]:
        """A value that the model may be asked for."""


class Refuse(AbstractBeyond):
    """Raises `ValueError` that names the argument, the range and the value.

    Numbers yet to be traced are let through.
    """

    def admit(
        self, name: str, value: Float[Array, "*n"], range: Range
    ) -> Float[Array, "*n"]:
        if isinstance(value, Tracer):
            return value
        found = np.asarray(value, float).ravel()
        # Single precision may push what lies on an edge beyond it.
        slack = 4.0 * float(jnp.finfo(value.dtype).eps) * max(1.0, abs(range.high))
        outside = ~((found >= range.low - slack) & (found <= range.high + slack))
        if np.any(outside):
            low, high = range.low / range.scale, range.high / range.scale
            got = found[outside][0] / range.scale
            raise ValueError(
                f"`{name}` must lie between {low:g} and {high:g}{range.unit}, where "
                f"the model holds; got {got:g}{range.unit}."
            )
        return value


class Clamp(AbstractBeyond):
    """Takes the nearest value in the range; refuses only what is no number."""

    def admit(
        self, name: str, value: Float[Array, "*n"], range: Range
    ) -> Float[Array, "*n"]:
        if not isinstance(value, Tracer) and np.any(np.isnan(np.asarray(value))):
            raise ValueError(f"`{name}` must be a number; got {math.nan}.")
        return jnp.clip(value, range.low, range.high)


REFUSE = Refuse()
