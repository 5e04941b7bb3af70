"""How much lies between a place and a light."""

import abc
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PyTree

from ..geometry import Point
from ..light import Sun
from ..medium._trilinear import trilinear
from ..quantity import dot, Position
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


class Cache(eqx.Module):
    """How much lies between each node of a box and each light, of media in boxes."""

    lower: Position
    upper: Position
    directions: Float[Array, "light 3"]
    columns: Float[Array, "light nx ny nz bounded"]


class ShadowCache(AbstractShadows):
    """Rays to the lights from a grid, with `cells` along each axis, and lines between.

    For the media that lie in boxes, in a box about them all; for the others a ray from
    every place, with `nodes` a piece. It blurs shadows by the size of its cells.
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
        axis = np.linspace(0.0, 1.0, self.cells + 1)
        share = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1)
        share = jnp.asarray(share.reshape(-1, 3), lower.dtype)
        shape = (self.cells + 1,) * 3

        def look(light, share):
            point = scene.geometry.locate(lower + share * (upper - lower))
            return _columns(scene, light, point, bounded, self.nodes)

        tables = [
            jax.lax.map(lambda x, light=light: look(light, x), share, batch_size=2**14)
            for light in scene.suns
        ]
        return Cache(
            lower,
            upper,
            jnp.stack([x.direction for x in scene.suns]),
            jnp.stack([x.reshape(*shape, len(bounded)) for x in tables]),
        )

    def towards(self, prepared: Cache | None, scene: Scene, light: Sun) -> Columns:
        bounded, others = _sorted(scene)
        if prepared is None:
            return lambda point: _columns(scene, light, point, others, self.nodes)
        cosines = dot(prepared.directions, light.direction)
        table = prepared.columns[jnp.argmax(cosines)]
        order = np.argsort(np.array([*bounded, *others]))

        def columns(point):
            far = _columns(scene, light, point, others, self.nodes)
            near = _look_up(prepared, table, light, point.position)
            return jnp.concatenate([near, far])[order]

        return columns


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


def _look_up(
    cache: Cache,
    table: Float[Array, "nx ny nz bounded"],
    light: Sun,
    position: Position,
) -> Float[Array, "bounded"]:
    slope = light.direction
    slope = jnp.where(jnp.abs(slope) < 1e-12, 1e-12, slope)
    cells = jnp.array(table.shape[:3], slope.dtype) - 1.0
    each, faster = cells / (cache.upper - cache.lower), 1.0 / slope
    enter, leave = jnp.zeros_like(position[0]), jnp.full_like(position[0], jnp.inf)
    # One number at a time: XLA on CPUs is slow with vectors of three.
    for axis in range(3):
        one, other = (
            (x[axis] - position[axis]) * faster[axis]
            for x in (cache.lower, cache.upper)
        )
        enter = jnp.maximum(enter, jnp.minimum(one, other))
        leave = jnp.minimum(leave, jnp.maximum(one, other))
    # From outside, all that counts lies beyond where the ray to the light enters.
    position = position + enter * light.direction
    places = [(position[i] - cache.lower[i]) * each[i] for i in range(3)]
    return jnp.where(leave > enter, trilinear(table, *places), 0.0)
