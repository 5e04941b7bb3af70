import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import AbstractPath, Point
from ..quantity import as_float, Length, Number, Position
from ..spectrum import check_table
from ._base import AbstractProfile, check_not_negative, crossings


class Tabulated(AbstractProfile):
    """Straight lines between `values` at the rising altitudes `knots`, in m.

    Nothing below the first knot or above the last.
    """

    knots: Float[Array, "n"] = eqx.field(converter=as_float)
    values: Float[Array, "n"] = eqx.field(converter=as_float)

    def __check_init__(self):
        check_table("knots", self.knots, "values", self.values)
        check_not_negative("values", self.values)

    def density(self, point: Point) -> Number:
        return jnp.interp(point.altitude, self.knots, self.values, left=0.0, right=0.0)

    def most(self, lower: Position, upper: Position) -> Number:
        return jnp.max(self.values)

    @property
    def levels(self) -> Float[Array, "n"]:
        return self.knots

    def breaks(self, path: AbstractPath) -> Float[Array, "n"]:
        return crossings(path, self.levels)

    def most_between(self, low: Length, high: Length) -> Number:
        # What lies at an edge alone is not between.
        meets = (low < self.knots[-1]) & (high > self.knots[0])
        inside = jnp.clip(self.knots, jnp.maximum(low, self.knots[0]), high)
        most = jnp.max(jnp.interp(inside, self.knots, self.values))
        return jnp.where(meets, most, 0.0)
