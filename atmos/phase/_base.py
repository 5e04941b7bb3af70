import abc

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from ..quantity import PhaseValue, Spectral, Versine, Wavelength


class AbstractPhaseFunction(eqx.Module):
    """How light that scatters is spread over directions.

    The angle of scattering is given by its versine, one minus its cosine: 0 when light
    goes straight on, 2 when it turns back. Narrow forward peaks need the digits that
    the cosine would lose. The integral over the sphere is 1.
    """

    @abc.abstractmethod
    def evaluate(self, versine: Versine, wavelength: Wavelength) -> PhaseValue:
        """The fraction scattered per steradian; of length 1 if alike at all of them."""

    @abc.abstractmethod
    def sample(self, key: PRNGKeyArray, wavelength: Wavelength) -> Versine:
        """Draws a versine, in proportion to `evaluate` at the first wavelength."""

    @abc.abstractmethod
    def moments(self, count: int, wavelength: Wavelength) -> Float[Array, "l #wl"]:
        """The first `count` Legendre moments: 1, then the asymmetry g, and so on.

        The l-th is the mean of the Legendre polynomial P_l of the cosine, without the
        factor 2l + 1.
        """

    def terms(
        self, wavelength: Wavelength
    ) -> "tuple[tuple[AbstractPhaseFunction, Spectral], ...]":
        """Phase functions that make up this one, and the weight of each.

        Where a function changes with the wavelength, and yet is a mixture of some that
        do not, pictures are quicker to make of those.
        """
        return ((self, jnp.ones_like(wavelength[:1])),)
