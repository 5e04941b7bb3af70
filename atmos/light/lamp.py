import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..quantity import (
    as_float,
    Direction,
    Number,
    Position,
    Radiance,
    Wavelength,
)
from ..spectrum import AbstractSpectrum, as_spectrum
from ._base import AbstractLight, from_place, Shine


class Lamp(AbstractLight):
    """A place that shines in all directions alike, but is not seen itself.

    `intensity` is in W sr^-1 nm^-1. In a medium it lights what is next to it without
    bounds: there pictures are noisy.
    """

    position: Position = eqx.field(converter=as_float)
    intensity: AbstractSpectrum = eqx.field(converter=as_spectrum)

    def sample(
        self, position: Position, u: Float[Array, "2"], wavelength: Wavelength
    ) -> Shine:
        return from_place(
            self.position, position, self.intensity.evaluate(wavelength), wavelength
        )

    def radiance(self, direction: Direction, wavelength: Wavelength) -> Radiance:
        return jnp.zeros_like(wavelength)

    def solid_angle(self, direction: Direction) -> Number:
        return jnp.zeros_like(direction[0])
