"""How much lies between a place and a light."""

import abc
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PyTree

from ..geometry import AbstractPath, Point
from ..light import Sun
from ..medium import AbstractProfile
from ..medium._trilinear import trilinear
from ..quantity import Direction, dot, inner, Position
from ..scene import Scene
from ..transport import column


Columns = Callable[[Point], Float[Array, "medium"]]


class AbstractShadows(eqx.Module):
    """How much of each medium lies between a place and a light."""

    @abc.abstractmethod
    def prepare(self, scene: Scene) -> PyTree[Any]:
        """What can be worked out before the first look; None if nothing."""

    @abc.abstractmethod
    def towards(self, prepared: PyTree[Any], scene: Scene, light: Sun) -> Columns:
        """How much of each medium, in m of density 1, lies between a place and it."""


class ShadowRays(AbstractShadows):
    """A ray to the light from every place, with so many `nodes` in each medium."""

    nodes: int = eqx.field(static=True, default=32)

    def prepare(self, scene: Scene) -> None:
        return None

    def towards(self, prepared: None, scene: Scene, light: Sun) -> Columns:
        every = [i for i, _ in enumerate(scene.media)]
        return lambda point: _columns(scene, light, point, every, self.nodes)


# Looks at the media in each cell of a cache.
_LOOKS = 2


class Cache(eqx.Module):
    """How much lies between each node and a light, of media in boxes.

    The nodes lie on lines to the light. A place has the coordinates
    `turn @ (place - lower) + offset`, in cells: two across the lines, which do not
    change along them, and one along, which rises towards the light.
    """

    lower: Position
    direction: Direction
    turn: Float[Array, "3 3"]
    offset: Float[Array, "3"]
    columns: Float[Array, "cell cell place bounded"]


class ShadowCache(AbstractShadows):
    """Lines to the lights through a grid, and in between by interpolation.

    For the media that lie in boxes, in a box about them all, with `cells` along each
    axis; for the others a ray from every place, with `nodes` a piece. It blurs shadows
    by the size of its cells, which slanting light draws out to up to twice that.
    """

    cells: int = eqx.field(static=True, default=64)
    nodes: int = eqx.field(static=True, default=32)

    def __check_init__(self):
        if self.cells < 1:
            raise ValueError(f"`cells` must be at least 1; got {self.cells}.")

    def prepare(self, scene: Scene) -> Cache | None:
        bounded, _ = _sorted(scene)
        if not bounded or not scene.lights:
            return None
        boxes = [scene.media[i].profile.box for i in bounded]
        lower = jnp.min(jnp.stack([x[0] for x in boxes if x is not None]), 0)
        upper = jnp.max(jnp.stack([x[1] for x in boxes if x is not None]), 0)
        # A box without room holds nothing.
        size = jnp.where(upper > lower, upper - lower, 1.0)
        caches = [
            _cache(scene, x, bounded, lower, size, self.cells) for x in scene.suns
        ]
        return jax.tree.map(lambda *x: jnp.stack(x), *caches)

    def towards(self, prepared: Cache | None, scene: Scene, light: Sun) -> Columns:
        bounded, others = _sorted(scene)
        if prepared is None:
            return lambda point: _columns(scene, light, point, others, self.nodes)
        nearest = jnp.argmax(dot(prepared.direction, light.direction))
        cache = jax.tree.map(lambda x: x[nearest], prepared)
        order = np.argsort(np.array([*bounded, *others]))

        def columns(point):
            far = _columns(scene, light, point, others, self.nodes)
            near = _look_up(cache, point.position)
            return jnp.concatenate([near, far])[order]

        return columns


def _cache(
    scene: Scene,
    light: Sun,
    which: list[int],
    lower: Position,
    size: Position,
    cells: int,
) -> Cache:
    """What lies on lines to a light that fill a box."""
    turn, offset = _sheared(light.direction / size, cells)
    back = size[:, None] * jnp.linalg.inv(turn)
    apart = cells * back[:, 2]
    step = jnp.sqrt(dot(apart, apart)) / (cells * _LOOKS)
    edges = jnp.arange(cells * _LOOKS + 1, dtype=size.dtype) * step

    def line(x, y):
        place = jnp.stack([x, y, jnp.zeros_like(x)])
        start = scene.geometry.locate(lower + dot(back, place - offset))
        path = scene.geometry.path(start, light.direction)
        found = [_ahead(scene, scene.media[i].profile, path, edges) for i in which]
        return jnp.stack(found, -1)

    each = jnp.arange(cells, dtype=size.dtype) + 0.5
    row = lambda x: jax.vmap(lambda y: line(x, y))(each)
    return Cache(
        lower, light.direction, turn / size[None], offset, jax.lax.map(row, each)
    )


def _sheared(
    light: Float[Array, "3"], cells: int
) -> tuple[Float[Array, "3 3"], Float[Array, "3"]]:
    """The matrix and the offset of a cache, for places in a box from 0 to 1.

    Planes across the axis that the light comes along most, in that box, are moved until
    lines to the light stand upright on them.
    """
    axis = jnp.argmax(jnp.abs(light))
    axes = (axis + jnp.arange(1, 4)) % 3
    unit = jnp.eye(3, dtype=light.dtype)[axes]
    slant = light[axes[:2]] / light[axis]
    across = cells / (1.0 + jnp.abs(slant))
    turn = across[:, None] * (unit[:2] - slant[:, None] * unit[2:])
    rises = light[axis] > 0.0
    along = jnp.where(rises, unit[2:], -unit[2:]) * cells
    ends = jnp.where(rises, jnp.zeros_like(across[:1]), cells)
    offset = jnp.concatenate([across * jnp.maximum(slant, 0.0), ends])
    return jnp.concatenate([turn, along]), offset


def _ahead(
    scene: Scene,
    profile: AbstractProfile,
    path: AbstractPath,
    edges: Float[Array, "edge"],
) -> Float[Array, "place"]:
    """How much of a medium lies ahead of places on a ray, one every few looks at it."""
    breaks = profile.breaks(path)
    edges = jnp.clip(edges, breaks[0], breaks[-1])
    points = jax.vmap(path.at)(0.5 * (edges[:-1] + edges[1:]))
    density = jax.vmap(profile.density)(points)
    amount = jnp.where(points.altitude <= scene.top, density, 0.0) * jnp.diff(edges)
    amount = jnp.sum(amount.reshape(-1, _LOOKS), 1)
    ahead = jnp.cumsum(amount[::-1])[::-1]
    return jnp.concatenate([ahead, jnp.zeros_like(ahead[:1])])


def _sorted(scene: Scene) -> tuple[list[int], list[int]]:
    """Which media lie in boxes, and which do not."""
    boxed = [x.profile.box is not None for x in scene.media]
    every = range(len(boxed))
    return [i for i in every if boxed[i]], [i for i in every if not boxed[i]]


def _columns(
    scene: Scene, light: Sun, point: Point, which: list[int], nodes: int
) -> Float[Array, "some"]:
    path = scene.geometry.path(point, light.direction)
    far = path.span(scene.top).far
    found = [column(scene.media[i].profile, path, far, nodes=nodes) for i in which]
    return jnp.stack(found) if found else jnp.zeros(0, far.dtype)


def _look_up(cache: Cache, position: Position) -> Float[Array, "bounded"]:
    apart = position - cache.lower
    # One number at a time: XLA on CPUs is slow with vectors of three.
    x, y, place = (inner(cache.turn[i], apart) + cache.offset[i] for i in range(3))
    cells = cache.columns.shape[0]
    meets = (x >= 0.0) & (x <= cells) & (y >= 0.0) & (y <= cells)
    found = trilinear(cache.columns, x - 0.5, y - 0.5, place)
    return jnp.where(meets, found, 0.0)
