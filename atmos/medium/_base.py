import abc
import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, ArrayLike, Float

from ..geometry import AbstractPath, Point
from ..phase import AbstractPhaseFunction, Isotropic
from ..quantity import Length, Number, Position, Spectral, Wavelength
from ..spectrum import AbstractSpectrum, as_spectrum, Complement, Product
from ._emission import AbstractEmission


class AbstractProfile(eqx.Module):
    """How much of a medium there is at each place, relative to its coefficients."""

    @abc.abstractmethod
    def density(self, point: Point) -> Number:
        """1 where the medium's coefficients hold as given."""

    @property
    @abc.abstractmethod
    def levels(self) -> Float[Array, "n"]:
        """The altitudes, rising, at which the density is not smooth; empty if none.

        One that depends on altitude alone rises or falls throughout between two.
        """

    @abc.abstractmethod
    def breaks(self, path: AbstractPath) -> Float[Array, "n"]:
        """The distances along a ray, rising, between which the density is smooth.

        Where it depends on altitude they include the lowest place of the ray, so that
        between two breaks the ray rises or falls. Numbers outside the ray do no harm.
        """

    @property
    def layered(self) -> bool:
        """Whether the density depends on altitude alone."""
        return True

    @property
    def box(self) -> tuple[Position, Position] | None:
        """The lower and upper corner of a box that holds all of it; None if none does.

        Nothing of it then lies before the first of its `breaks`, or after the last.
        """
        return None

    def most(self, lower: Position, upper: Position) -> Number:
        """What the density does not exceed anywhere in a box above the ground."""
        return jnp.ones_like(lower[0])

    def most_between(self, low: Length, high: Length) -> Number:
        """What it does not exceed between two altitudes, if it depends on them alone.

        As of a density without jumps; profiles that have some know better.
        """
        edges = jnp.stack([low, high])
        inside = jnp.clip(self.levels.astype(low.dtype), low, high)
        places = jnp.concatenate([edges, inside])
        zero = jnp.zeros_like(low)
        up = jnp.stack([zero, zero, zero + 1.0])
        look = lambda h: self.density(Point(h * up, h, up))
        return jnp.max(jax.vmap(look)(places))


class AbstractLocal(AbstractProfile):
    """A density that depends on the place."""

    @property
    def levels(self) -> Float[Array, "0"]:
        return jnp.zeros(0)

    @property
    def layered(self) -> bool:
        return False


def crossings(
    path: AbstractPath, altitudes: Float[Array, "n"]
) -> Float[Array, "2*n+1"]:
    """The breaks of a profile that is not smooth at these rising altitudes."""
    falling, rising = jax.vmap(path.crossings, out_axes=1)(altitudes)
    lowest = path.lowest()
    # On a ray that never falls, or never rises, the lowest place is out of their order.
    return jnp.concatenate(
        [
            jnp.minimum(falling[::-1], lowest),
            lowest[None],
            jnp.maximum(rising, lowest),
        ]
    )


def _maybe(x: ArrayLike | AbstractSpectrum | None) -> AbstractSpectrum | None:
    return None if x is None else as_spectrum(x)


class Medium(eqx.Module):
    """One kind of stuff in the air. A scene holds several; their effects add.

    `scattering` and `absorption` are coefficients in m^-1 where `profile` is 1. A
    medium that only absorbs has no `scattering`: solvers do not look for its light. One
    that shines has an `emission`.
    """

    profile: AbstractProfile
    scattering: AbstractSpectrum | None = eqx.field(converter=_maybe, default=None)
    absorption: AbstractSpectrum = eqx.field(converter=as_spectrum, default=0.0)
    phase: AbstractPhaseFunction = Isotropic()
    emission: AbstractEmission | None = None

    def extinction(self, wavelength: Wavelength) -> Spectral:
        """What one metre takes out of a beam where the profile is 1, in m^-1."""
        absorption = self.absorption.evaluate(wavelength)
        if self.scattering is None:
            return absorption
        return absorption + self.scattering.evaluate(wavelength)


def of_extinction(
    extinction: AbstractSpectrum,
    single_scattering_albedo: AbstractSpectrum,
    profile: AbstractProfile,
    phase: AbstractPhaseFunction,
) -> Medium:
    """A medium given by its extinction, in m^-1, and the share of it that scatters."""
    return Medium(
        profile,
        scattering=Product(extinction, single_scattering_albedo),
        absorption=Product(extinction, Complement(single_scattering_albedo)),
        phase=phase,
    )


def check_above_zero(name: str, value: Array) -> None:
    """Refuses a number that is not finite and above 0, with `ValueError`."""
    if not isinstance(value, Tracer) and not 0.0 < float(value) < math.inf:
        raise ValueError(f"`{name}` must be above 0 and finite; got {value}.")


def check_not_negative(name: str, values: Array) -> None:
    """Refuses an array with a number below 0 or not finite, with `ValueError`.

    It says where the first one is.
    """
    if not isinstance(values, Tracer):
        known = np.asarray(values)
        good = np.isfinite(known) & (known >= 0.0)
        if not np.all(good):
            first = tuple(int(x) for x in np.argwhere(~good)[0])
            where = f"{name}{list(first)} = " if first else ""
            raise ValueError(
                f"`{name}` must be 0 or above and finite; got {where}{known[first]}."
            )
