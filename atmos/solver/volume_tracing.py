import dataclasses
import math
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.core import Tracer
from jaxtyping import Array, Float, Integer, PRNGKeyArray, Scalar

from ..light import AbstractLight
from ..quantity import as_float, Direction, Number, Position, Radiance, Wavelength
from ..scene import Scene
from ..transport import extinctions
from ._chance import quick
from ._event import proceed
from ._lanes import followed
from ._look import of_look
from ._majorants import cells_of
from ._strata import strata_of
from ._tally import AbstractTracing, joined, Tally
from ._trip import begin, Majorants, Quest
from .single_scattering import SingleScattering


class VolumeTracing(AbstractTracing):
    """Light that turned any number of times in a world: right on average.

    Random paths are followed backwards, from the eye, from collision to collision; that
    most of them are with nothing makes up for a density that changes from place to
    place (null collisions: Woodcock 1965, Galtier et al. 2013). How many is said by
    bounds: for media in boxes on a grid of `cells` along each axis, for those that
    depend on altitude alone between altitudes; the nearest collision of either is met.
    Light is looked for where it comes from, and where it happens to be found, as each
    is apt to find it (multiple importance sampling: Veach and Guibas 1995).

    There are `blocks` of `walks` times `paths` for each look; walks are independent,
    and the standard error is taken from how they differ. All is decided by `key` and
    the look. What shines lights all around it. `check` raises `ValueError` for a medium
    that lies in no box and does not depend on altitude alone. Where nothing is absorbed
    a path of more than `turns` turns is ended by chance, ten in `turns` at each: those
    that go on weigh more, which makes up for it on average, but is rarely seen. What
    share of the light of even surroundings comes by such paths is `late` in the tally.
    White stuff of an optical depth of 100 that scatters to all sides has few of them.

    Gradients of the mean by forward mode (`jax.jvp`, `jax.jacfwd`) are unbiased for how
    much media scatter, absorb and shine, and where to, and for what the ground and the
    lights send; not for where an edge lies. They are those of the weights of paths, and
    need collisions with nothing: bounds `slack` times as high as must be, such as 2.
    """

    around: ClassVar[int] = 17
    shining: ClassVar[bool] = True
    lamps: ClassVar[bool] = True
    solid: ClassVar[bool] = True
    key: PRNGKeyArray = eqx.field(default_factory=lambda: jax.random.key(0))
    blocks: int = eqx.field(static=True, default=1)
    walks: int = eqx.field(static=True, default=64)
    paths: int = eqx.field(static=True, default=4)
    cells: int = eqx.field(static=True, default=16)
    turns: int = eqx.field(static=True, default=10_000)
    slack: Number = eqx.field(converter=as_float, default=1.0)
    single: SingleScattering | None = eqx.field(init=False, default=None)
    stokes: int = eqx.field(static=True, init=False, default=1)

    def __check_init__(self):
        least = {"blocks": 1, "walks": 2, "paths": 1, "cells": 1, "turns": 100}
        for name, number in least.items():
            if getattr(self, name) < number:
                raise ValueError(
                    f"`{name}` must be at least {number}; got {getattr(self, name)}."
                )
        if (
            not isinstance(self.slack, Tracer)
            and not 1.0 <= float(self.slack) < math.inf
        ):
            raise ValueError(f"`slack` must be at least 1; got {self.slack}.")

    def check(self, scene: Scene, wavelength: Wavelength) -> Scene:
        for i, x in enumerate(scene.media):
            if x.profile.box is None and not x.profile.layered:
                raise ValueError(
                    f"`scene.media[{i}].profile` must lie in a box or depend on "
                    f"altitude alone, for this solver; got {type(x.profile).__name__}."
                )
        return scene

    def prepare(self, scene: Scene, wavelength: Wavelength) -> Majorants:
        part = lambda layered: eqx.tree_at(
            lambda x: x.media,
            scene,
            tuple(x for x in scene.media if x.profile.layered == layered),
        )
        air, clouds = part(True), part(False)
        slack = self.slack.astype(wavelength.dtype)
        cells = None
        if clouds.media:
            cells = cells_of(clouds, wavelength, self.cells, slack)
        strata = strata_of(air, wavelength, slack) if air.media else None
        return Majorants(cells, strata)

    def scattered(
        self,
        prepared: Majorants,
        scene: Scene,
        light: AbstractLight,
        wavelength: Wavelength,
        position: Position,
        direction: Direction,
    ) -> Float[Array, "part wl"]:
        seen = self.shone(prepared, scene, light, wavelength, position, direction)
        media = len(scene.scattering_media)
        parts = jnp.zeros((media + 1, *wavelength.shape), wavelength.dtype)
        return parts.at[-1].set(seen)

    def shone(
        self,
        prepared: Majorants,
        scene: Scene,
        light: AbstractLight,
        wavelength: Wavelength,
        position: Position,
        direction: Direction,
    ) -> Radiance:
        looks = position[None], direction[None]
        return self.tally(prepared, scene, light, wavelength, *looks).mean[0]

    def emitted(
        self,
        prepared: Majorants,
        scene: Scene,
        wavelength: Wavelength,
        position: Position,
        direction: Direction,
    ) -> Radiance:
        looks = position[None], direction[None]
        return self.tally(prepared, scene, None, wavelength, *looks).mean[0]

    def tally(
        self,
        prepared: Majorants,
        scene: Scene,
        light: AbstractLight | None,
        wavelength: Wavelength,
        positions: Float[Array, "look 3"],
        directions: Float[Array, "look 3"],
        first: Integer[Scalar, ""] | int = 0,
    ) -> Tally:
        scattering = [
            jnp.zeros_like(wavelength)
            if x.scattering is None
            else jnp.broadcast_to(x.scattering.evaluate(wavelength), wavelength.shape)
            for x in scene.media
        ]
        none = jnp.zeros((0, *wavelength.shape), wavelength.dtype)
        quest = Quest(
            scene,
            jax.lax.stop_gradient(prepared),
            light,
            wavelength,
            extinctions(scene, wavelength),
            jnp.stack(scattering) if scattering else none,
            self.turns,
        )
        # Compiled once, for any number of blocks.
        alike = dataclasses.replace(self, blocks=1)
        blocks = jnp.int32(self.blocks)
        return _tally(alike, quest, positions, directions, jnp.int32(first), blocks)


@eqx.filter_jit
def _tally(
    solver: VolumeTracing,
    quest: Quest,
    positions: Float[Array, "look 3"],
    directions: Float[Array, "look 3"],
    first: Integer[Scalar, ""],
    blocks: Integer[Scalar, ""],
) -> Tally:
    key = quick(solver.key)
    own = jax.vmap(lambda *look: of_look(key, *look))(positions, directions)
    looks, count = positions.shape[0], max(quest.wavelength.shape[0], 1)
    each = solver.walks, solver.paths, looks

    def trials(index):
        keys = jax.vmap(lambda key: jax.random.fold_in(key, index))(own)

        def start(number):
            look, number = number % looks, number // looks
            path, walk = number % solver.paths, number // solver.paths
            key = jax.random.fold_in(keys[look], walk)
            hero = jax.random.randint(key, (), 0, count, jnp.int32) + path
            key = jax.random.fold_in(key, path)
            return begin(quest, positions[look], directions[look], key, hero % count)

        onwards = lambda trip: proceed(quest, trip)
        found = followed(start, onwards, math.prod(each))
        return jnp.mean(found.reshape(*each, -1), 1)

    shape = (*positions.shape[:1], quest.wavelength.shape[0] + 1)
    found = joined(trials, first, blocks, jnp.zeros(shape, directions.dtype))
    mean, squares = found.mean[:, :-1], found.squares[:, :-1]
    return Tally(found.count, mean, squares, found.mean[:, -1])
