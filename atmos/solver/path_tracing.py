import dataclasses
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from equinox.internal import nondifferentiable
from jaxtyping import Array, Float, Integer, PRNGKeyArray, Scalar

from ..light import AbstractLight, Sun
from ..optics import check_layered
from ..quantity import Direction, Position, Wavelength
from ..scene import Scene
from ..transport import enter, extinctions
from ._collision import Task
from ._flight import Layers
from ._guess import prepare
from ._tally import AbstractTracing, ended, joined, Tally
from ._walk import advance, begin
from .single_scattering import SingleScattering


_NO_SLOPE = (
    "`PathTracing` has no gradients; `SingleScattering`, `Columns`, `Shells` and, "
    "forwards, `VolumeTracing` have."
)


class PathTracing(AbstractTracing):
    """Light that turned any number of times, by random paths: right on average.

    Paths are followed backwards, from the eye, in `blocks` of `walks` times `paths`.
    The paths of a walk share out the first flight evenly; walks are independent, and
    the standard error is taken from how they differ. One more block changes nothing in
    those before: all is decided by `key`. Light that turned once comes from `single`;
    with None it is traced too. Suns are points. Media depend on altitude alone:
    `check` raises `ValueError` otherwise.

    It has no gradients and raises `RuntimeError` where one is asked for: where paths go
    hangs on the numbers too, by chance, of which there is no slope.
    """

    around: ClassVar[int] = 17
    key: PRNGKeyArray = eqx.field(default_factory=lambda: jax.random.key(0))
    blocks: int = eqx.field(static=True, default=1)
    walks: int = eqx.field(static=True, default=256)
    paths: int = eqx.field(static=True, default=64)
    single: SingleScattering | None = SingleScattering()
    stokes: int = eqx.field(static=True, init=False, default=1)

    def __check_init__(self):
        for name, least in [("blocks", 1), ("walks", 2), ("paths", 1)]:
            if getattr(self, name) < least:
                raise ValueError(
                    f"`{name}` must be at least {least}; got {getattr(self, name)}."
                )

    def check(self, scene: Scene, wavelength: Wavelength) -> Scene:
        check_layered(scene)
        return scene

    def prepare(self, scene: Scene, wavelength: Wavelength) -> Layers:
        return prepare(scene, wavelength)

    def scattered(
        self,
        prepared: Layers,
        scene: Scene,
        light: Sun,
        wavelength: Wavelength,
        position: Position,
        direction: Direction,
    ) -> Float[Array, "part wl"]:
        looks = position[None], direction[None]
        tally = self.tally(prepared, scene, light, wavelength, *looks)
        if self.single is None:
            media = len(scene.scattering_media)
            parts = jnp.zeros((media + 1, *wavelength.shape), wavelength.dtype)
        else:
            extinction = extinctions(scene, wavelength)
            parts = self.single.march(
                scene, extinction, light, wavelength, position, direction
            )
        return parts.at[-1].add(tally.mean[0])

    def tally(
        self,
        prepared: Layers,
        scene: Scene,
        light: AbstractLight | None,
        wavelength: Wavelength,
        positions: Float[Array, "look 3"],
        directions: Float[Array, "look 3"],
        first: Integer[Scalar, ""] | int = 0,
    ) -> Tally:
        assert isinstance(light, Sun), "all else was refused"
        once = 1 if self.single is None else 2
        task = Task(scene, prepared, light, wavelength, once)
        task, positions, directions = nondifferentiable(
            (task, positions, directions), msg=_NO_SLOPE
        )
        # Compiled once, for any number of blocks.
        alike = dataclasses.replace(self, blocks=1, single=None)
        blocks = jnp.int32(self.blocks)
        return _tally(alike, task, positions, directions, jnp.int32(first), blocks)


@eqx.filter_jit
def _tally(
    solver: PathTracing,
    task: Task,
    positions: Float[Array, "look 3"],
    directions: Float[Array, "look 3"],
    first: Integer[Scalar, ""],
    blocks: Integer[Scalar, ""],
) -> Tally:
    paths, _, _ = jax.vmap(enter, (None, 0, 0))(task.scene, positions, directions)
    irradiance = task.light.irradiance.evaluate(task.wavelength) / solver.paths

    def trials(index):
        key = jax.random.fold_in(solver.key, index)
        keys = jax.random.split(key, (solver.walks, *positions.shape[:1]))
        by_look = jax.vmap(begin, (None, 0, 0, 0, None))
        by_walk = jax.vmap(by_look, (None, None, None, 0, None))
        walks = by_walk(task, paths.start, directions, keys, solver.paths)
        onwards = jax.vmap(jax.vmap(lambda x: advance(task, x)))
        return ended(onwards, walks).total * irradiance[None, None]

    shape = (*positions.shape[:1], *task.wavelength.shape)
    return joined(trials, first, blocks, jnp.zeros(shape, directions.dtype))
