"""A solved scene as a sky, and as a panorama from one place."""

import functools as ft
import math
import os
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float, PyTree

from ..geometry import AbstractGeometry, Flat
from ..light import Sun
from ..phase import Isotropic
from ..polarisation import vibration
from ..quantity import (
    Angle,
    Depth,
    Direction,
    Irradiance,
    Length,
    Number,
    Position,
    Radiance,
    Stokes,
    versine,
    Wavelength,
)
from ..scene import Scene
from ..sky import AbstractSky, fine_enough, Grid, Panorama, Resolution
from ..transport import direct_irradiance, optical_depth
from ._base import AbstractSolver


class SolvedSky(AbstractSky):
    """A scene, seen through a solver."""

    scene: Scene
    solver: AbstractSolver
    wavelength: Wavelength
    prepared: PyTree[Any]

    @property
    def has_panorama(self) -> bool:
        scene = self.scene
        alike = all(x.profile.layered and x.emission is None for x in scene.media)
        return alike and not scene.surfaces and len(scene.suns) == len(scene.lights)

    def radiance(self, position: Position, direction: Direction) -> Radiance:
        total = jnp.zeros_like(self.wavelength)
        if any(x.emission is not None for x in self.scene.media):
            total += self.solver.emitted(
                self.prepared, self.scene, self.wavelength, position, direction
            )
        for light in self.scene.lights:
            if not isinstance(light, Sun):
                world = self.prepared, self.scene, light, self.wavelength
                total += self.solver.shone(*world, position, direction)
                continue
            parts = self._parts(light, position, direction)
            turned = versine(direction, light.direction)
            media = self.scene.scattering_media
            for medium, part in zip(media, parts, strict=False):
                total += medium.phase.evaluate(turned, self.wavelength) * part
            total += parts[len(media)]
        return total

    def stokes(self, position: Position, direction: Direction) -> Stokes:
        """I, Q and U of what one sees, in the frame of `atmos.polarisation`.

        Q counts what vibrates level, minus what vibrates in the vertical plane of the
        view. Raises `ValueError` unless the sky was solved with `stokes` 3.
        """
        if self.solver.stokes != 3:
            raise ValueError(
                "`sky` must be solved with `stokes` 3 to be polarised; got "
                f"{self.solver.stokes}."
            )
        up = self.scene.geometry.locate(position).up
        total = jnp.zeros((3, *self.wavelength.shape), self.wavelength.dtype)
        for light in self.scene.suns:
            parts = self._parts(light, position, direction)
            turned = versine(direction, light.direction)
            q, u = vibration(up, direction, light.direction)
            media = self.scene.scattering_media
            for medium, part in zip(media, parts, strict=False):
                across = medium.phase.polarisation(turned, self.wavelength) * part
                i = medium.phase.evaluate(turned, self.wavelength) * part
                total += jnp.stack([i, q * across, u * across])
            total += parts[len(media) :]
        return total

    def panorama(self, position: Position) -> Panorama:
        """All that one sees from `position`, made ready for millions of looks.

        Its zenith angles and azimuths are those at the origin, so the place must lie
        straight above it: raises `ValueError` otherwise, and from where the solver does
        not hold for what one sees. Where the place, the sun, or the size of the world
        are traced, it is as fine as any of them might ask for.
        """
        altitude = math.inf
        if not isinstance(position, Tracer):
            *aside, altitude = np.asarray(position).tolist()
            if any(aside):
                raise ValueError(
                    f"`position` must lie straight above the origin; got {position}."
                )
        with jax.ensure_compile_time_eval():  # what is not traced stays known
            towards = [x.direction for x in self.scene.suns]
            lowest = _known(_lowest(self.scene.geometry, position, towards))
            if math.isfinite(lowest):
                self.solver.check_panorama(self.scene, lowest)
            flat = isinstance(self.scene.geometry, Flat)
            size = fine_enough(altitude, lowest, self.solver.around, flat)
        return _tabulate(self, position, size)

    @property
    def lights(self) -> tuple[Sun, ...]:
        return self.scene.suns

    def depth(self, position: Position, direction: Direction) -> Depth:
        return optical_depth(self.scene, position, direction, self.wavelength)

    def dip(self, altitude: Length) -> Angle:
        return self.scene.geometry.dip(altitude, jnp.zeros_like(altitude))

    def beam(self, light: Sun, position: Position) -> Irradiance:
        return direct_irradiance(self.scene, light, position, self.wavelength)

    def _edges(self, altitude):
        """How far the horizon lies below level; the zenith angle where air begins."""
        geometry, top = self.scene.geometry, self.scene.top
        outside = altitude > top
        limb = geometry.dip(altitude, top)
        first = jnp.where(outside, 0.5 * jnp.pi + limb, 0.0)
        return geometry.dip(altitude, jnp.zeros_like(top)), first

    def _parts(
        self, light: Sun, position: Position, direction: Direction
    ) -> Float[Array, "part wl"]:
        return self.solver.scattered(
            self.prepared, self.scene, light, self.wavelength, position, direction
        )


def _known(x: Number) -> float:
    """A number; as large as can be where it is yet to be traced."""
    return math.inf if isinstance(x, Tracer) else float(x)


@eqx.filter_jit
def _lowest(
    geometry: AbstractGeometry, position: Position, towards: list[Direction]
) -> Angle:
    """The zenith angle of the lowest light, as it is where the horizon is."""
    _, _, altitude = position
    dip = geometry.dip(altitude, 0.0 * altitude)
    zeniths = [
        jnp.arctan2(jnp.sqrt(east * east + north * north), up)
        for east, north, up in towards
    ]
    return ft.reduce(jnp.maximum, [x + dip for x in zeniths], 0.0 * dip)


# So far from straight up, in rad, single precision still knows the azimuth.
_SLIVER = 1e-6
# How many azimuths, at most, and rings are looked at together: grids of all sizes share
# a compilation. On a CPU rings go one after the other, which fit into its cache.
_AROUND = 17
_RINGS, _RINGS_ON_CPU = 80, 8


def _tabulate(sky: SolvedSky, position: Position, resolution: Resolution) -> Panorama:
    """The sky on a grid of directions, one light after the other."""
    grid, phases, sides, blocks = _frame(sky, position, resolution)
    alone = resolution.every >= resolution.around
    every = resolution.every if alone or resolution.around <= _AROUND else 1

    def seen(light):
        look = lambda x: _looks(sky, light, position, x[0], x[1], every)
        if any(isinstance(x, Tracer) for x in jax.tree.leaves((sky, position))):
            # A gradient would else keep every place on every ray.
            return jax.lax.map(jax.checkpoint(look), blocks)
        each = list(zip(*(np.asarray(x) for x in blocks), strict=True))
        # The first compiles what the others, on as many cores as there are, use.
        first = look(each[0])
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            return [first, *pool.map(look, each[1:])]

    tables = [seen(x) for x in sky.scene.suns]
    rings, parts = resolution.above + resolution.below, len(phases) + sky.solver.stokes
    empty = 0, rings, resolution.around, parts, sky.wavelength.size
    none = lambda: jnp.zeros(empty, sky.wavelength.dtype)
    return Panorama(
        grid=grid,
        table=_joined(tables, resolution) if tables else none(),
        light_zenith=sides[0],
        light_azimuth=sides[1],
        phases=phases,
        wavelength=sky.wavelength,
    )


@eqx.filter_jit
def _frame(
    sky: SolvedSky, position: Position, resolution: Resolution
) -> tuple[Any, ...]:
    """The grid, the phase functions to put on, where the lights stand; blocks of rings
    and azimuths."""
    dip, first = sky._edges(position[2])
    grid = Grid(first, 0.5 * math.pi + dip, resolution)
    on_cpu = jax.default_backend() == "cpu"
    zenith, azimuth = (
        jnp.pad(x, (0, -x.size % size), mode="edge").reshape(-1, size)
        for x, size in (
            (grid.zeniths(), _RINGS_ON_CPU if on_cpu else _RINGS),
            (grid.azimuths(), min(resolution.around, _AROUND)),
        )
    )
    blocks = (
        jnp.tile(zenith, (len(azimuth), 1)),
        jnp.repeat(azimuth, len(zenith), 0),
    )
    terms = [x.phase.terms(sky.wavelength) for x in sky.scene.scattering_media]
    phases = [x for mixture in terms for x, _ in mixture]
    phases = [x for x in phases if not isinstance(x, Isotropic)]
    lights = sky.scene.suns
    sides = [[x.zenith for x in lights], [x.azimuth for x in lights]]
    sides = tuple(jnp.array(x, dip.dtype) for x in sides)
    return grid, tuple(phases), sides, blocks


@eqx.filter_jit
def _joined(
    tables: list[Any], resolution: Resolution
) -> Float[Array, "light ring around part wl"]:
    """The blocks of each light as one table."""
    rings, around = resolution.above + resolution.below, resolution.around

    def joined(blocks):
        found = jnp.asarray(blocks)
        size = found.shape[2]
        found = found.reshape(-(-around // size), -1, *found.shape[1:])
        found = jnp.moveaxis(found, 0, 2)
        rows, each, columns = found.shape[:3]
        found = found.reshape(rows * each, columns * size, *found.shape[4:])
        return found[:rings, :around]

    return jnp.stack([joined(x) for x in tables])


@eqx.filter_jit
def _looks(
    sky: SolvedSky,
    light: Sun,
    position: Position,
    zenith: Float[Array, "ring"],
    azimuth: Float[Array, "around"],
    every: int,
) -> Float[Array, "ring around part wl"]:
    """What one sees by one light, in azimuths relative to it, for a panorama's table.

    Parts whose phase function is isotropic, or partly so, join what has none. It is the
    light that goes around, so that a ring is one line of sight.
    """
    terms = [x.phase.terms(sky.wavelength) for x in sky.scene.scattering_media]
    east, north = light.horizontal
    ahead, aside = jnp.cos(azimuth), jnp.sin(azimuth)
    level = east * light.direction[0] + north * light.direction[1]
    across = (
        level * (east * ahead - north * aside),
        level * (north * ahead + east * aside),
    )
    height = jnp.broadcast_to(light.direction[2], azimuth.shape)
    towards = jnp.stack([*across, height], -1)

    def ring(zenith):
        up, flat = jnp.cos(zenith), jnp.sin(zenith)
        if sky.solver.stokes == 3:  # straight up too it is level in this azimuth
            flat = jnp.maximum(flat, _SLIVER)
        direction = jnp.stack([flat * east, flat * north, up])
        look = sky.wavelength, position, direction
        found = sky.solver.scattered_from(
            sky.prepared, sky.scene, light, towards, *look, every
        )
        parts, rest = [], found[:, len(terms) :]
        for part, mixture in zip(jnp.moveaxis(found, 1, 0), terms, strict=False):
            for phase, weight in mixture:
                if isinstance(phase, Isotropic):
                    rest = rest.at[:, 0].add(weight[None] * part * (0.25 / math.pi))
                else:
                    parts.append(weight[None] * part)
        return jnp.concatenate([*(x[:, None] for x in parts), rest], 1)

    if jax.default_backend() == "cpu":
        return jax.lax.map(ring, zenith)
    return jax.vmap(ring)(zenith)
