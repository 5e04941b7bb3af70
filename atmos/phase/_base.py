import abc
import math
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from ..quantity import PhaseValue, Spectral, Versine, Wavelength


class AbstractPhaseFunction(eqx.Module):
    """How light that scatters is spread over directions.

    The angle of scattering is given by its versine, one minus its cosine: 0 when light
    goes straight on, 2 when it turns back. Narrow forward peaks need the digits that
    the cosine would lose. The integral over the sphere is 1. Beyond `degree` all
    Legendre moments are 0.
    """

    degree: ClassVar[float] = math.inf

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

    def polarisation(self, versine: Versine, wavelength: Wavelength) -> PhaseValue:
        """How much more scatters vibrating across the plane of scattering than in it.

        Per steradian, of light that came without polarisation: -P12, or -F12, where
        Q counts what vibrates in that plane. 0 for a function that knows no better.
        """
        return jnp.zeros_like(self.evaluate(versine, wavelength))

    def polarisation_moments(
        self, count: int, wavelength: Wavelength
    ) -> Float[Array, "k 3 #wl"]:
        """Moments of the rest of the scattering matrix, of degrees 0, 1, ... below k.

        In columns alpha2, alpha3 and beta1: with Wigner's functions d^l of the angle of
        scattering, as `moments` without the factor 2l + 1,

            P22 + P33 = (alpha2 + alpha3) d_22,  P22 - P33 = (alpha2 - alpha3) d_2-2,
            -P12 = beta1 d_02,

        each summed over l with (2l + 1) / (4 pi): those of Hovenier and van der Mee
        (1983), and Siewert's (1982) alpha, zeta and gamma. There are no more than
        `count` degrees, and only as many as differ from 0: none by default, for what
        scatters leaves without polarisation then.
        """
        del count
        return jnp.zeros((0, 3, 1), wavelength.dtype)

    def terms(
        self, wavelength: Wavelength
    ) -> "tuple[tuple[AbstractPhaseFunction, Spectral], ...]":
        """Phase functions that make up this one, and the weight of each.

        Where a function changes with the wavelength, and yet is a mixture of some that
        do not, pictures are quicker to make of those.
        """
        return ((self, jnp.ones_like(wavelength[:1])),)
