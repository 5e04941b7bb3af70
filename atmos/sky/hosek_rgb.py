"""The sky of Hosek and Wilkie 2012, fitted as colour."""

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from ..colour import REC709, response
from ..light import Sun
from ..quantity import (
    Angle,
    Cosine,
    Depth,
    Direction,
    Number,
    Position,
    Versine,
    Wavelength,
)
from ..spectrum import AbstractSpectrum
from ._fitted import AbstractFittedSky
from ._hosek_formula import configured, RANGES, shape
from ._hosek_tables import sky_tables
from ._parameters import set_parameters
from ._range import AbstractBeyond, Clamp, Range, REFUSE
from .hosek import Hosek


class HosekRGB(AbstractFittedSky):
    """The same sky as linear Rec. 709, fitted in colour: `colour` is the model.

    Its spectra are made up, so that they have these colours under the wavelengths
    asked for, which must cover what the eye sees: for pictures in colour, not for
    light at one wavelength. The sun is that of `Hosek`.
    """

    ranges: ClassVar = {**RANGES, "wavelength": Range(360.0, 830.0, " nm")}

    sun_zenith: Angle
    sun_azimuth: Angle
    turbidity: Number
    wavelength: Wavelength
    ground: AbstractSpectrum

    def __init__(
        self,
        sun_zenith: ArrayLike,
        sun_azimuth: ArrayLike,
        turbidity: ArrayLike,
        wavelength: ArrayLike,
        ground: ArrayLike | AbstractSpectrum = 0.0,
        beyond: AbstractBeyond = REFUSE,
    ):
        sky_tables("rgb")
        set_parameters(
            self,
            beyond,
            sun_zenith=sun_zenith,
            sun_azimuth=sun_azimuth,
            turbidity=turbidity,
            wavelength=wavelength,
            ground=ground,
        )

    def colour(self, up: Cosine, turned: Versine) -> Float[Array, "3"]:
        """Red, green and blue of the sky, as `atmos.colour.REC709` counts them.

        Not below 0, as the fit is in places.
        """
        found = configured("rgb", self.turbidity, self._albedo, self.sun_zenith)
        return jnp.maximum(shape(*found, up, turned), 0.0)

    def parts(self, up: Cosine, turned: Versine) -> Float[Array, "part"]:
        return self.colour(up, turned)

    @property
    def basis(self) -> Float[Array, "part wl"]:
        # Of all spectra of the three colours the least.
        weights = REC709.from_xyz(response(self.wavelength))
        square = jnp.matmul(weights.T, weights, precision="highest")
        return jnp.linalg.solve(square, weights.T)

    @property
    def lights(self) -> tuple[Sun]:
        return self._spectral.lights

    def depth(self, position: Position, direction: Direction) -> Depth:
        return self._spectral.depth(position, direction)

    @property
    def _spectral(self) -> Hosek:
        """The same as spectra, for its sun; beyond 720 nm as there."""
        return Hosek(
            self.sun_zenith,
            self.sun_azimuth,
            self.turbidity,
            self.wavelength,
            self.ground,
            Clamp(),
        )

    @property
    def _albedo(self) -> Float[Array, "3"]:
        """What the ground reflects of each colour of a white light."""
        weights = REC709.from_xyz(response(self.wavelength))
        albedo = self.ground.evaluate(self.wavelength)
        seen = jnp.sum(albedo[:, None] * weights, 0) / jnp.sum(weights, 0)
        return jnp.clip(seen, 0.0, 1.0)
