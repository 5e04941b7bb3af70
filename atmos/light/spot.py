import math

import equinox as eqx
import jax.numpy as jnp
from jax.core import Tracer
from jaxtyping import Array, Float

from ..quantity import (
    Angle,
    as_float,
    Direction,
    Number,
    Position,
    Radiance,
    versine,
    Wavelength,
)
from ..spectrum import AbstractSpectrum, as_spectrum
from ._base import AbstractLight, from_place, Shine


class Spot(AbstractLight):
    """A place that shines into a cone, but is not seen itself.

    `intensity`, in W sr^-1 nm^-1, is that within the angle `inner` of `direction`; from
    there it falls smoothly to nothing at the angle `outer`. Both in rad.
    """

    position: Position = eqx.field(converter=as_float)
    direction: Direction = eqx.field(converter=as_float)
    intensity: AbstractSpectrum = eqx.field(converter=as_spectrum)
    inner: Angle = eqx.field(converter=as_float)
    outer: Angle = eqx.field(converter=as_float)

    def __check_init__(self):
        angles = self.inner, self.outer
        if any(isinstance(x, Tracer) for x in angles):
            return
        if not 0.0 <= self.inner < self.outer <= math.pi:
            raise ValueError(
                "`inner` and `outer` must rise between 0 and pi; got "
                f"{self.inner} and {self.outer}."
            )

    def sample(
        self, position: Position, u: Float[Array, "2"], wavelength: Wavelength
    ) -> Shine:
        within = self.intensity.evaluate(wavelength)
        shine = from_place(self.position, position, within, wavelength)
        narrow, wide = (2.0 * jnp.sin(0.5 * x) ** 2 for x in (self.inner, self.outer))
        apart = versine(-shine.direction, self.direction)
        share = jnp.clip((wide - apart) / (wide - narrow), 0.0, 1.0)
        smooth = share * share * (3.0 - 2.0 * share)
        return eqx.tree_at(lambda x: x.irradiance, shine, smooth * shine.irradiance)

    def radiance(self, direction: Direction, wavelength: Wavelength) -> Radiance:
        return jnp.zeros_like(wavelength)

    def solid_angle(self, direction: Direction) -> Number:
        return jnp.zeros_like(direction[0])
