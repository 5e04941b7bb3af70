import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import AbstractPath, Point
from ..quantity import Length, Number, Position
from ._base import AbstractProfile


class Product(AbstractProfile):
    """One density times another: noise within a bound, a cloud that thins out."""

    one: AbstractProfile
    other: AbstractProfile

    def density(self, point: Point) -> Number:
        return self.one.density(point) * self.other.density(point)

    @property
    def levels(self) -> Float[Array, "n"]:
        one, other = self.one.levels, self.other.levels
        return jnp.sort(jnp.concatenate([one, other.astype(one.dtype)]))

    def breaks(self, path: AbstractPath) -> Float[Array, "n"]:
        return jnp.sort(
            jnp.concatenate([self.one.breaks(path), self.other.breaks(path)])
        )

    def most(self, lower: Position, upper: Position) -> Number:
        return self.one.most(lower, upper) * self.other.most(lower, upper)

    def most_between(self, low: Length, high: Length) -> Number:
        return self.one.most_between(low, high) * self.other.most_between(low, high)

    @property
    def layered(self) -> bool:
        return self.one.layered and self.other.layered

    @property
    def box(self) -> tuple[Position, Position] | None:
        one, other = self.one.box, self.other.box
        if one is None or other is None:
            return one or other
        lower = jnp.maximum(one[0], other[0])
        # Where they do not meet, a box without room.
        return lower, jnp.maximum(jnp.minimum(one[1], other[1]), lower)
