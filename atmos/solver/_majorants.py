"""What clouds do not exceed, in cells, and how a ray goes through them."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Integer

from ..quantity import Direction, Length, Number, Position, Wavelength
from ..scene import Scene
from ..transport import extinctions


# How many cells a ray goes through, at most, before all others are waited for.
_STRIDE = 4


class Cells(eqx.Module):
    """Cells in a box that holds some media: bounds of the extinction, in m^-1.

    At all wavelengths alike, as a path serves them all. Where there is nothing: minus
    how many cells all around hold nothing either.
    """

    lower: Position
    upper: Position
    bounds: Float[Array, "nx ny nz"]

    @property
    def size(self) -> Integer[Array, "3"]:
        """How many there are along each axis."""
        return jnp.array(self.bounds.shape, jnp.int32)

    @property
    def step(self) -> Position:
        """How large each is, in m."""
        return (self.upper - self.lower) / self.size.astype(self.lower.dtype)


def cells_of(scene: Scene, wavelength: Wavelength, cells: int, slack: Number) -> Cells:
    """Bounds on so many cells along each axis of the box of media that have one.

    They are `slack` times as high as must be.
    """
    boxes = [x.profile.box for x in scene.media]
    lower = jnp.min(jnp.stack([x[0] for x in boxes if x is not None]), 0)
    upper = jnp.max(jnp.stack([x[1] for x in boxes if x is not None]), 0)
    # What shines must be met, even if it takes no light away.
    size = jnp.sqrt(jnp.sum((upper - lower) ** 2))
    most = slack * at_most(scene, wavelength, 4.0 / size)
    index = jnp.stack(jnp.meshgrid(*[jnp.arange(cells)] * 3, indexing="ij"), -1)
    index = index.reshape(-1, 3)
    step = (upper - lower) / cells
    sliver = 1e-4 * step

    def bound(index):
        low = lower + index.astype(step.dtype) * step
        found = [x.profile.most(low - sliver, low + step + sliver) for x in scene.media]
        return jnp.sum(jnp.stack(found) * most)

    bounds = jax.lax.map(bound, index, batch_size=1024)
    return Cells(lower, upper, _cleared(bounds.reshape(cells, cells, cells)))


def _cleared(bounds: Float[Array, "nx ny nz"]) -> Float[Array, "nx ny nz"]:
    """With the numbers of cells that hold nothing where there is nothing."""
    full, clear = bounds > 0.0, jnp.zeros_like(bounds)
    for _ in range(max(bounds.shape)):
        full = jax.lax.reduce_window(
            full, False, jax.lax.bitwise_or, (3, 3, 3), (1, 1, 1), "SAME"
        )
        clear += jnp.where(full, 0.0, 1.0)
    return jnp.where(bounds > 0.0, bounds, -clear)


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
        within = jnp.all((self.cell >= 0) & (self.cell < cells.size))
        return within & (self.at < self.far)


def cross(
    cells: Cells, start: Position, direction: Direction, near: Length, far: Length
) -> Crossing:
    """The ray from where it enters the box, or from `near` if it is in it there."""
    slope = _slope(direction)
    ends = jnp.stack([cells.lower - start, cells.upper - start]) / slope[None]
    enter = jnp.maximum(jnp.max(jnp.min(ends, 0)), near)
    leave = jnp.minimum(jnp.min(jnp.max(ends, 0)), far)
    at = jnp.where(leave > enter, enter, far)
    cell = jnp.clip(_cell(cells, start + enter * direction), 0, cells.size - 1)
    return Crossing(start, direction, at, jnp.minimum(leave, far), cell)


def fly(
    cells: Cells, ray: Crossing, depth: Number
) -> tuple[Crossing, Number, Number, Bool[Array, ""]]:
    """On to where the bounds have added up to an optical depth, or some cells on.

    With the depth that is left, the bound there, and whether it was reached. The cells
    that lie on the way are gone through one after the other (Amanatides and Woo 1987),
    those that hold nothing many at once.
    """
    slope = _slope(ray.direction)
    ahead = (slope > 0.0).astype(jnp.int32)
    step, last = cells.step, cells.size - 1
    most, met = jnp.ones_like(depth), jnp.array(False)
    for _ in range(_STRIDE):
        goes = ~met & ray.inside(cells)
        i, j, k = jnp.clip(ray.cell, 0, last)
        bound = cells.bounds[i, j, k]
        around = jnp.int32(jnp.maximum(-bound, 0.0))
        edge = ray.cell + jnp.where(ahead > 0, around + 1, -around)
        ends = (cells.lower + edge.astype(step.dtype) * step - ray.start) / slope
        end = jnp.clip(jnp.min(ends), ray.at, ray.far)
        gains = jnp.maximum(bound, 0.0) * (end - ray.at)
        here = goes & (depth < gains)
        # 0 * inf, of a cell that is empty, cannot arise: rays end.
        stop = ray.at + depth / jnp.where(bound > 0.0, bound, 1.0)
        # Into the next by number, as rounding may not have left the one before.
        there = _cell(cells, ray.start + end * ray.direction)
        there = jnp.clip(there, ray.cell - around, ray.cell + around)
        there = jnp.where(ends <= end, edge - 1 + ahead, there)
        on = goes & ~here
        ray = Crossing(
            start=ray.start,
            direction=ray.direction,
            at=jnp.where(here, stop, jnp.where(on, end, ray.at)),
            far=ray.far,
            cell=jnp.where(on, there, ray.cell),
        )
        depth = jnp.where(here, 0.0, jnp.where(on, depth - gains, depth))
        most, met = jnp.where(here, bound, most), met | here
    return ray, depth, most, met


def _cell(cells: Cells, place: Position) -> Integer[Array, "3"]:
    return jnp.int32(jnp.floor((place - cells.lower) / cells.step))


def _slope(direction: Direction) -> Direction:
    return jnp.where(jnp.abs(direction) < 1e-12, 1e-12, direction)
