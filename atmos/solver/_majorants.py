"""What clouds do not exceed, in cells, and how a ray goes through them."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Integer

from ..quantity import Direction, Length, Number, Position, Wavelength
from ..scene import Scene
from ..transport import extinctions


class Cells(eqx.Module):
    """Cells in a box that holds some media: bounds of the extinction, in m^-1.

    At all wavelengths alike, as a path serves them all.
    """

    lower: Position
    upper: Position
    bounds: Float[Array, "nx ny nz"]


def cells_of(scene: Scene, wavelength: Wavelength, cells: int) -> Cells:
    """Bounds on so many cells along each axis of the box of media that have one."""
    boxes = [x.profile.box for x in scene.media]
    lower = jnp.min(jnp.stack([x[0] for x in boxes if x is not None]), 0)
    upper = jnp.max(jnp.stack([x[1] for x in boxes if x is not None]), 0)
    # What shines must be met, even if it takes no light away.
    size = jnp.sqrt(jnp.sum((upper - lower) ** 2))
    most = at_most(scene, wavelength, 4.0 / size)
    index = jnp.stack(jnp.meshgrid(*[jnp.arange(cells)] * 3, indexing="ij"), -1)
    index = index.reshape(-1, 3)
    step = (upper - lower) / cells
    sliver = 1e-4 * step

    def bound(index):
        low = lower + index.astype(step.dtype) * step
        found = [x.profile.most(low - sliver, low + step + sliver) for x in scene.media]
        return jnp.sum(jnp.stack(found) * most)

    bounds = jax.lax.map(bound, index, batch_size=1024)
    return Cells(lower, upper, bounds.reshape(cells, cells, cells))


def at_most(
    scene: Scene, wavelength: Wavelength, least: Number
) -> Float[Array, "medium"]:
    """The extinction of each medium, in m^-1; of those that shine `least` or more."""
    most = jnp.max(extinctions(scene, wavelength), 1, initial=0.0)
    shines = jnp.array([x.emission is not None for x in scene.media], bool)
    return jnp.where(shines, jnp.maximum(most, least), most)


class Crossing(eqx.Module):
    """A ray on its way through the cells, at a distance from its start."""

    start: Position
    direction: Direction
    at: Length
    far: Length
    cell: Integer[Array, "3"]

    def inside(self, cells: Cells) -> Bool[Array, ""]:
        """Whether there is more to come."""
        size = jnp.array(cells.bounds.shape, jnp.int32)
        within = jnp.all((self.cell >= 0) & (self.cell < size))
        return within & (self.at < self.far)


def cross(
    cells: Cells, start: Position, direction: Direction, near: Length, far: Length
) -> Crossing:
    """The ray from where it enters the box, or from `near` if it is in it there."""
    slope = _slope(direction)
    ends = jnp.stack([cells.lower - start, cells.upper - start]) / slope[None]
    enter = jnp.maximum(jnp.max(jnp.min(ends, 0)), near)
    leave = jnp.minimum(jnp.min(jnp.max(ends, 0)), far)
    size = jnp.array(cells.bounds.shape, jnp.int32)
    share = (start + enter * direction - cells.lower) / (cells.upper - cells.lower)
    cell = jnp.int32(jnp.floor(share * size.astype(share.dtype)))
    at = jnp.where(leave > enter, enter, far)
    return Crossing(
        start, direction, at, jnp.minimum(leave, far), jnp.clip(cell, 0, size - 1)
    )


def fly(
    cells: Cells, ray: Crossing, depth: Number
) -> tuple[Crossing, Number, Bool[Array, ""]]:
    """On to where the bounds have added up to an optical depth, or out.

    With the bound there, and whether it was reached. The cells that lie on the way are
    gone through one after the other (Amanatides and Woo 1987).
    """
    slope = _slope(ray.direction)
    size = jnp.array(cells.bounds.shape, jnp.int32)
    step = (cells.upper - cells.lower) / size.astype(slope.dtype)
    ahead = (slope > 0.0).astype(jnp.int32)
    sign = 2 * ahead - 1

    def goes_on(state):
        ray, _, _, done = state
        return ~done & ray.inside(cells)

    def through(state):
        ray, depth, _, _ = state
        edges = cells.lower + (ray.cell + ahead).astype(step.dtype) * step
        ends = (edges - ray.start) / slope
        axis = jnp.argmin(ends)
        end = jnp.clip(ends[axis], ray.at, ray.far)
        i, j, k = jnp.clip(ray.cell, 0, size - 1)
        bound = cells.bounds[i, j, k]
        within = depth < bound * (end - ray.at)
        # 0 * inf, of a cell that is empty, cannot arise: rays end.
        stop = ray.at + depth / jnp.where(bound > 0.0, bound, 1.0)
        left = depth - bound * (end - ray.at)
        cell = ray.cell + jnp.where(jnp.arange(3) == axis, sign, 0)
        ray = Crossing(
            start=ray.start,
            direction=ray.direction,
            at=jnp.where(within, stop, end),
            far=ray.far,
            cell=jnp.where(within, ray.cell, cell),
        )
        return ray, jnp.where(within, 0.0, left), bound, within

    start = ray, depth, jnp.zeros_like(depth), jnp.array(False)
    ray, _, bound, done = jax.lax.while_loop(goes_on, through, start)
    return ray, bound, done


def _slope(direction: Direction) -> Direction:
    return jnp.where(jnp.abs(direction) < 1e-12, 1e-12, direction)
