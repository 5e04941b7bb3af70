import abc
import dataclasses
import math
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, ArrayLike, Float, PyTree

from ..light import AbstractLight, Sun
from ..phase import Isotropic
from ..polarisation import vibration
from ..quantity import (
    Angle,
    as_float,
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


class AbstractSolver(eqx.Module):
    """A way to find the light in a scene.

    By day, what it finds varies little between `around` azimuths on half a circle. It
    is radiance alone where `stokes` is 1, and I, Q and U where that is 3. What media
    shine of themselves is found where `shining`; elsewhere such media are refused, as
    are lights other than suns but for `lamps`, and surfaces but where `solid`.
    """

    around: ClassVar[int]
    shining: ClassVar[bool] = False
    lamps: ClassVar[bool] = False
    solid: ClassVar[bool] = False
    stokes: eqx.AbstractVar[int]

    def check(self, scene: Scene, wavelength: Wavelength) -> Scene:
        """The scene, if the method holds for it; raises `ValueError` otherwise.

        Where that hangs on numbers yet to be traced, what is made of the scene raises
        when it is run.
        """
        return scene

    def baked(self, scene: Scene) -> Scene:
        """All of a scene that `prepare` is told: less than the whole if that will do.

        What was worked out then serves every scene that differs in the rest alone.
        """
        return scene

    @abc.abstractmethod
    def prepare(self, scene: Scene, wavelength: Wavelength) -> PyTree[Any]:
        """What can be worked out before the first look; None if nothing."""

    def found(self, prepared: PyTree[Any]) -> PyTree[Any]:
        """What `prepare` made, if it is good enough; raises `ValueError` otherwise.

        Where that hangs on numbers yet to be traced, it raises when it is run.
        """
        return prepared

    @abc.abstractmethod
    def scattered(
        self,
        prepared: PyTree[Any],
        scene: Scene,
        light: Sun,
        wavelength: Wavelength,
        position: Position,
        direction: Direction,
    ) -> Float[Array, "part wl"]:
        """What one sees by one light, in parts.

        A part for each medium that scatters, which is yet to be multiplied by the
        medium's phase function towards the light, and then radiance as it stands, or
        I, Q and U as they stand.
        """

    def scattered_from(
        self,
        prepared: PyTree[Any],
        scene: Scene,
        light: Sun,
        towards: Float[Array, "light 3"],
        wavelength: Wavelength,
        position: Position,
        direction: Direction,
    ) -> Float[Array, "light part wl"]:
        """The same for a light that stands in one of several directions instead."""

        def of(towards):
            stands = dataclasses.replace(light, direction=towards)
            look = scene, stands, wavelength, position, direction
            return self.scattered(prepared, *look)

        return jax.vmap(of)(towards)

    def emitted(
        self,
        prepared: PyTree[Any],
        scene: Scene,
        wavelength: Wavelength,
        position: Position,
        direction: Direction,
    ) -> Radiance:
        """What one sees of media that shine of themselves."""
        return jnp.zeros_like(wavelength)

    def shone(
        self,
        prepared: PyTree[Any],
        scene: Scene,
        light: AbstractLight,
        wavelength: Wavelength,
        position: Position,
        direction: Direction,
    ) -> Radiance:
        """What one sees by a light that is no sun."""
        return jnp.zeros_like(wavelength)


def check_stokes(stokes: int) -> None:
    """Raises `ValueError` for a number of Stokes parameters that is not 1 or 3."""
    if stokes not in (1, 3):
        raise ValueError(f"`stokes` must be 1 or 3; got {stokes}.")


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
        straight above it: raises `ValueError` otherwise.
        """
        if not isinstance(position, Tracer) and np.any(np.asarray(position)[:2] != 0.0):
            raise ValueError(
                f"`position` must lie straight above the origin; got {position}."
            )
        dip, _ = self._edges(position[2])
        lowest = max((_known(x.zenith + dip) for x in self.scene.suns), default=0.0)
        size = fine_enough(_known(position[2]), lowest, self.solver.around)
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


# So far from straight up, in rad, single precision still knows the azimuth.
_SLIVER = 1e-6
# How many azimuths, at most, and rings are looked at together: grids of all sizes share
# a compilation. On a CPU rings go one after the other, which fit into its cache.
_AROUND = 17
_RINGS, _RINGS_ON_CPU = 80, 8


def _tabulate(sky: SolvedSky, position: Position, resolution: Resolution) -> Panorama:
    """The sky on a grid of directions, one light after the other."""
    grid, phases, sides, zenith, azimuth = _frame(sky, position, resolution)
    rings, around = resolution.above + resolution.below, resolution.around

    def table(light):
        look = lambda x, y: _looks(sky, light, position, x, y)
        if any(isinstance(x, Tracer) for x in jax.tree.leaves((sky, position))):
            # A gradient would else keep every place on every ray.
            block = jax.checkpoint(look)
            along = lambda y: jax.lax.map(lambda x: block(x, y), zenith)
            found = jax.lax.map(along, azimuth)
        else:
            found = jnp.stack(
                [jnp.stack([look(x, y) for x in zenith]) for y in azimuth]
            )
        found = jnp.moveaxis(found, 0, 2)
        found = found.reshape(zenith.size, azimuth.size, *found.shape[4:])
        return found[:rings, :around]

    tables = [table(x) for x in sky.scene.suns]
    parts = len(phases) + sky.solver.stokes
    none = jnp.zeros((0, rings, around, parts, sky.wavelength.size), zenith.dtype)
    return Panorama(
        grid=grid,
        table=jnp.stack(tables) if tables else none,
        light_zenith=sides[0],
        light_azimuth=sides[1],
        phases=phases,
        wavelength=sky.wavelength,
    )


@eqx.filter_jit
def _frame(
    sky: SolvedSky, position: Position, resolution: Resolution
) -> tuple[Any, ...]:
    """The grid, the phase functions to put on, where the lights stand; directions."""
    dip, first = sky._edges(position[2])
    grid = Grid(first, 0.5 * math.pi + dip, resolution)
    on_cpu = jax.default_backend() == "cpu"
    blocks = [
        jnp.pad(x, (0, -x.size % size), mode="edge").reshape(-1, size)
        for x, size in (
            (grid.zeniths(), _RINGS_ON_CPU if on_cpu else _RINGS),
            (grid.azimuths(), min(resolution.around, _AROUND)),
        )
    ]
    terms = [x.phase.terms(sky.wavelength) for x in sky.scene.scattering_media]
    phases = [x for mixture in terms for x, _ in mixture]
    phases = [x for x in phases if not isinstance(x, Isotropic)]
    lights = sky.scene.suns
    sides = [[x.zenith for x in lights], [x.azimuth for x in lights]]
    return grid, tuple(phases), jnp.array(sides, dip.dtype), *blocks


@eqx.filter_jit
def _looks(
    sky: SolvedSky,
    light: Sun,
    position: Position,
    zenith: Float[Array, "ring"],
    azimuth: Float[Array, "around"],
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
            sky.prepared, sky.scene, light, towards, *look
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


def solve(scene: Scene, solver: AbstractSolver, wavelength: ArrayLike) -> SolvedSky:
    """Finds the light in a scene, at wavelengths in nm.

    All numbers take on the precision of `wavelength`. Raises `ValueError` unless the
    wavelengths are one-dimensional, lie between 100 nm and 100 um, and every table of
    the scene covers them; and for a scene that the solver does not hold for.
    """
    scene, nm = admit(scene, solver, wavelength)
    prepared = solver.found(_prepare(solver, solver.baked(scene), nm))
    return SolvedSky(scene=scene, solver=solver, wavelength=nm, prepared=prepared)


def admit(
    scene: Scene, solver: AbstractSolver, wavelength: ArrayLike
) -> tuple[Scene, Wavelength]:
    """A scene and wavelengths as a solver is told them, or the errors of `solve`."""
    nm = as_float(wavelength)
    if nm.ndim != 1:
        raise ValueError(f"`wavelength` must be one-dimensional; got shape {nm.shape}.")
    if isinstance(nm, Tracer):
        known = jnp.all((nm >= 100.0) & (nm <= 1e5))
        nm = eqx.error_if(nm, ~known, "`wavelength` must lie between 100 and 1e5 nm.")
    else:
        _check_wavelength(scene, np.asarray(nm))
    for i, x in enumerate(scene.media):
        if x.emission is not None and not solver.shining:
            raise ValueError(
                f"`scene.media[{i}].emission` must be None, for this solver; got "
                f"{type(x.emission).__name__}."
            )
    for i, x in enumerate(scene.lights):
        if not (isinstance(x, Sun) or solver.lamps):
            raise ValueError(
                f"`scene.lights[{i}]` must be a sun, for this solver; got "
                f"{type(x).__name__}."
            )
    if scene.surfaces and not solver.solid:
        raise ValueError(
            f"`scene.surfaces` must be empty, for this solver; got "
            f"{len(scene.surfaces)}."
        )
    scene = jax.tree.map(lambda x: x.astype(nm.dtype), scene)
    return solver.check(scene, nm), nm


@eqx.filter_jit
def _prepare(solver: AbstractSolver, scene: Scene, wavelength: Wavelength):
    return solver.prepare(scene, wavelength)


def _check_wavelength(scene: Scene, wavelength: np.ndarray) -> None:
    for value in wavelength:
        if not 100.0 <= value <= 1e5:
            raise ValueError(
                f"`wavelength` must lie between 100 and 100000 nm; got {value}."
            )
    if not wavelength.size:
        return
    known = lambda x: hasattr(type(x), "domain")
    for path, leaf in jax.tree_util.tree_leaves_with_path(scene, is_leaf=known):
        if not known(leaf) or any(isinstance(x, Tracer) for x in jax.tree.leaves(leaf)):
            continue
        low, high = leaf.domain
        if wavelength.min() < low or wavelength.max() > high:
            raise ValueError(
                f"`scene{jax.tree_util.keystr(path)}` must cover the wavelengths "
                f"{wavelength.min():g} to {wavelength.max():g} nm; it is known from "
                f"{low:g} to {high:g} nm."
            )
