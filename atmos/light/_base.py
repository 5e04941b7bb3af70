import abc

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..quantity import (
    Direction,
    dot,
    Irradiance,
    Length,
    Number,
    Position,
    Radiance,
    Spectral,
    Wavelength,
)


class Shine(eqx.Module):
    """Light that a place is sent from one direction, over the chance to look there.

    `irradiance` is that of a plane that faces it, on average over many looks; what
    sends it is `distance` m away. `solid_angle` is that of `AbstractLight`.
    """

    direction: Direction
    distance: Length
    irradiance: Irradiance
    solid_angle: Number


class AbstractLight(eqx.Module):
    """What shines on the world: from beyond it, or from a place in it."""

    @abc.abstractmethod
    def sample(
        self, position: Position, u: Float[Array, "2"], wavelength: Wavelength
    ) -> Shine:
        """Light at a place, from a direction that two numbers from 0 to 1 choose."""

    @abc.abstractmethod
    def radiance(self, direction: Direction, wavelength: Wavelength) -> Radiance:
        """What one sees in a direction beyond the world, unless it is as a point."""

    @abc.abstractmethod
    def solid_angle(self, direction: Direction) -> Number:
        """One over the density, per sr, with which `sample` looks in a direction.

        0 for a light that has no other to look in.
        """

    @property
    def backdrop(self) -> bool:
        """Whether it is part of what one sees behind the world; disks are not."""
        return False


def from_place(
    source: Position, position: Position, intensity: Spectral, wavelength: Wavelength
) -> Shine:
    """What a place sends to another, by its intensity in W sr^-1 nm^-1."""
    apart = source - position
    squared = jnp.maximum(dot(apart, apart), 1e-30)
    distance = jnp.sqrt(squared)
    irradiance = jnp.broadcast_to(intensity / squared, wavelength.shape)
    return Shine(apart / distance, distance, irradiance, jnp.zeros_like(distance))
