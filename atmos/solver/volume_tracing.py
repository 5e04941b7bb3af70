import dataclasses
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Integer, PRNGKeyArray, Scalar

from ..light import Sun
from ..quantity import Direction, Position, Radiance, Wavelength
from ..scene import Scene
from ..transport import extinctions
from ._event import proceed
from ._look import of_look
from ._majorants import Majorants, majorants
from ._tally import AbstractTracing, Tally
from ._trip import begin, Quest
from .single_scattering import SingleScattering


class VolumeTracing(AbstractTracing):
    """Light that turned any number of times in clouds and fire: right on average.

    Random paths are followed backwards, from the eye, from collision to collision; that
    most of them are with nothing makes up for a density that changes from place to
    place (null collisions: Woodcock 1965, Galtier et al. 2013). How many is said by
    bounds on a grid of `cells` along each axis. There are `blocks` of `walks` times
    `paths` for each look; walks are independent, and the standard error is taken from
    how they differ. All is decided by `key` and the look. Suns are points. What shines
    lights all around it. Every medium must lie in a box: `check` raises `ValueError`
    otherwise. Where nothing is absorbed a path of more than 1000 turns is ended by
    chance, one in a hundred at each.
    """

    around: ClassVar[int] = 17
    shining: ClassVar[bool] = True
    key: PRNGKeyArray = eqx.field(default_factory=lambda: jax.random.key(0))
    blocks: int = eqx.field(static=True, default=1)
    walks: int = eqx.field(static=True, default=64)
    paths: int = eqx.field(static=True, default=4)
    cells: int = eqx.field(static=True, default=16)
    single: SingleScattering | None = eqx.field(init=False, default=None)
    stokes: int = eqx.field(static=True, init=False, default=1)

    def __check_init__(self):
        least = {"blocks": 1, "walks": 2, "paths": 1, "cells": 1}
        for name, number in least.items():
            if getattr(self, name) < number:
                raise ValueError(
                    f"`{name}` must be at least {number}; got {getattr(self, name)}."
                )

    def check(self, scene: Scene, wavelength: Wavelength) -> Scene:
        for i, x in enumerate(scene.media):
            if x.profile.box is None:
                raise ValueError(
                    f"`scene.media[{i}].profile` must lie in a box, for this solver; "
                    f"got {type(x.profile).__name__}."
                )
        return scene

    def prepare(self, scene: Scene, wavelength: Wavelength) -> Majorants | None:
        return majorants(scene, wavelength, self.cells) if scene.media else None

    def scattered(
        self,
        prepared: Majorants | None,
        scene: Scene,
        light: Sun,
        wavelength: Wavelength,
        position: Position,
        direction: Direction,
    ) -> Float[Array, "part wl"]:
        looks = position[None], direction[None]
        tally = self.tally(prepared, scene, light, wavelength, *looks)
        media = len(scene.scattering_media)
        parts = jnp.zeros((media + 1, *wavelength.shape), wavelength.dtype)
        return parts.at[-1].set(tally.mean[0])

    def emitted(
        self,
        prepared: Majorants | None,
        scene: Scene,
        wavelength: Wavelength,
        position: Position,
        direction: Direction,
    ) -> Radiance:
        looks = position[None], direction[None]
        return self.tally(prepared, scene, None, wavelength, *looks).mean[0]

    def tally(
        self,
        prepared: Majorants | None,
        scene: Scene,
        light: Sun | None,
        wavelength: Wavelength,
        positions: Float[Array, "look 3"],
        directions: Float[Array, "look 3"],
        first: Integer[Scalar, ""] | int = 0,
    ) -> Tally:
        if prepared is None:
            raise ValueError("`scene.media` must be one or more, for this solver.")
        scattering = [
            jnp.zeros_like(wavelength)
            if x.scattering is None
            else jnp.broadcast_to(x.scattering.evaluate(wavelength), wavelength.shape)
            for x in scene.media
        ]
        quest = Quest(
            scene,
            prepared,
            light,
            wavelength,
            extinctions(scene, wavelength),
            jnp.stack(scattering),
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
    share = jnp.ones_like(quest.wavelength) / solver.paths
    if quest.light is not None:
        share = share * quest.light.irradiance.evaluate(quest.wavelength)
    own = jax.vmap(lambda *look: of_look(solver.key, *look))(positions, directions)

    def block(index, tally):
        keys = jax.vmap(lambda key: jax.random.fold_in(key, first + index))(own)
        keys = jax.vmap(lambda key: jax.random.split(key, solver.walks))(keys)
        by_walk = jax.vmap(begin, (None, None, None, 0, None))
        by_look = jax.vmap(by_walk, (None, 0, 0, 0, None))
        trips = by_look(quest, positions, directions, keys, solver.paths)
        onwards = jax.vmap(jax.vmap(lambda x: proceed(quest, x)))
        left = lambda x: jnp.any(x.left > 0)
        found = jax.lax.while_loop(left, onwards, trips).total
        return tally.join(Tally.of(jnp.swapaxes(found, 0, 1) * share[None, None]))

    shape = (*positions.shape[:1], *quest.wavelength.shape)
    dark = jnp.zeros(shape, directions.dtype)
    none = Tally(jnp.zeros_like(share, shape=()), dark, dark)
    return jax.lax.fori_loop(0, blocks, block, none)
