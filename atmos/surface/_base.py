import abc
from typing import ClassVar

import equinox as eqx
from jaxtyping import Array, Bool, Float

from ..quantity import Direction, Length, Position, Spectral, Wavelength


class AbstractShape(eqx.Module):
    """Where a surface lies."""

    @abc.abstractmethod
    def meet(
        self, start: Position, direction: Direction, leaves: Bool[Array, ""]
    ) -> Length:
        """How far ahead a ray first meets it; `geometry.FAR` or more if it never does.

        A ray that `leaves` it starts on it.
        """

    @abc.abstractmethod
    def normal(self, position: Position) -> Direction:
        """What stands upright on it at a place on it, to either side."""


class AbstractMaterial(eqx.Module):
    """What a surface does to light.

    A `smooth` one sends it on in one direction or another, a rough one in all.
    """

    smooth: ClassVar[bool]

    @abc.abstractmethod
    def share(self, wavelength: Wavelength) -> Spectral:
        """How much of the light that falls on it is sent on."""

    @abc.abstractmethod
    def turn(
        self, inward: Direction, normal: Direction, u: Float[Array, "3"]
    ) -> Direction:
        """Where light that is seen along `inward` comes from, drawn by chance.

        Of a rough material in proportion to the cosine.
        """


class Surface(eqx.Module):
    """A shape made of a material."""

    shape: AbstractShape
    material: AbstractMaterial
