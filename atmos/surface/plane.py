import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool

from ..geometry import FAR
from ..quantity import as_float, Direction, dot, Length, Position
from ._base import AbstractShape


class Plane(AbstractShape):
    """A plane without end, through `place`; `upright` stands on it."""

    place: Position = eqx.field(converter=as_float)
    upright: Direction = eqx.field(converter=as_float)

    def meet(
        self, start: Position, direction: Direction, leaves: Bool[Array, ""]
    ) -> Length:
        slope = dot(self.upright, direction)
        level = jnp.abs(slope) < 1e-12
        height = dot(self.upright, self.place - start)
        found = height / jnp.where(level, 1.0, slope)
        return jnp.where(level | leaves | (found <= 0.0), FAR, found)

    def normal(self, position: Position) -> Direction:
        return self.upright
