import equinox as eqx
import jax.numpy as jnp
import jax.scipy as jsp
from jaxtyping import Array, Float

from ..geometry import AbstractPath, Point
from ..quantity import as_float, Number, Position
from ._base import AbstractProfile, check_above_zero, check_not_negative


class Grid(AbstractProfile):
    """Values at the centres of equal cells in the box from `lower` to `upper`, in m.

    Between the centres it is trilinear, in the outermost half cells constant, and
    outside the box 0.
    """

    values: Float[Array, "nx ny nz"] = eqx.field(converter=as_float)
    lower: Position = eqx.field(converter=as_float)
    upper: Position = eqx.field(converter=as_float)

    def __check_init__(self):
        check_not_negative("values", self.values)
        for size in self.upper - self.lower:
            check_above_zero("upper - lower", size)

    def density(self, point: Point) -> Number:
        share = (point.position - self.lower) / (self.upper - self.lower)
        inside = jnp.all((share >= 0.0) & (share <= 1.0))
        cell = share * jnp.asarray(self.values.shape, share.dtype) - 0.5
        value = jsp.ndimage.map_coordinates(
            self.values, list(cell), order=1, mode="nearest"
        )
        return jnp.where(inside, value, 0.0)

    @property
    def levels(self) -> Float[Array, "0"]:
        return jnp.zeros(0, self.values.dtype)

    def breaks(self, path: AbstractPath) -> Float[Array, "n"]:
        slope = path.direction
        slope = jnp.where(jnp.abs(slope) < 1e-12, 1e-12, slope)
        one = (self.lower - path.start.position) / slope
        other = (self.upper - path.start.position) / slope
        enter = jnp.max(jnp.minimum(one, other))
        leave = jnp.min(jnp.maximum(one, other))
        return jnp.stack([enter, jnp.maximum(enter, leave)])
