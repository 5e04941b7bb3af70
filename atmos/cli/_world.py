"""From words to worlds: scene files and ready-made worlds."""

import contextlib
import dataclasses
from collections.abc import Iterator
from pathlib import Path

import equinox as eqx
from jaxtyping import ArrayLike

from .. import bake
from ..light import SOLAR_RADIUS, Sun, sunlight
from ..particle.surface import albedo
from ..quantity import km
from ..rays import direction
from ..scene import earth, mars, Scene
from ..scenefile import load, opac
from ..solver import (
    AbstractSolver,
    AbstractTracing,
    Bruneton,
    Columns,
    PathTracing,
    QUICK,
    Shared,
    Shells,
    SingleScattering,
    solve,
    SolvedSky,
    VolumeTracing,
)
from ..spectrum import AbstractSpectrum, Constant
from ._app import refuse
from ._march import March
from ._options import SunPosition, World


def make_scene(
    path: Path | None, world: World, position: SunPosition, bandwidth: float
) -> Scene:
    """The scene of a file, or a ready-made world, under the sun that is asked for."""

    where = position.find()
    if path is not None:
        for name, value in vars(world).items():
            if value is not None:
                option = f"--{name.replace('_', '-')}"
                refuse(option, "must not stand beside a scene file", path)
        found = load(path)
        if where is None:
            return found
        if len(found.suns) != 1:
            refuse("sun", "must be one alone to be moved", len(found.suns))
        towards = direction(*where[:2]).astype(found.suns[0].direction.dtype)
        return eqx.tree_at(lambda x: x.lights[0].direction, found, towards)
    zenith, azimuth, distance = where or (75.0, 40.0, 1.0)
    if world.world == "mars":
        if position.date is not None:
            refuse("--date", "is for the Earth; give angles on Mars")
        distance = 1.524
    light = sunlight(bandwidth, distance)
    sun = Sun(direction(zenith, azimuth), light, SOLAR_RADIUS / distance)
    return _mars(world, sun) if world.world == "mars" else _earth(world, sun)


def _mars(world: World, sun: Sun) -> Scene:
    for name in ("aerosol", "visibility", "ozone"):
        if getattr(world, name) is not None:
            refuse(f"--{name}", "is not for --world mars")
    dust = 0.5 if world.optical_depth is None else world.optical_depth
    return mars(sun, dust, ground(world.ground))


def _earth(world: World, sun: Sun) -> Scene:
    amounts = {
        "--optical-depth": world.optical_depth,
        "--visibility": world.visibility,
    }
    given = [name for name, x in amounts.items() if x is not None]
    column = 300.0 if world.ozone is None else world.ozone
    if world.aerosol == "none":
        if given:
            refuse(given[0], "must not stand beside --aerosol none")
        clear = earth(sun, None, column, ground(world.ground))
        return dataclasses.replace(clear, media=clear.media[:2])
    if len(given) > 1:
        refuse("--visibility", "must not stand beside --optical-depth")
    name = (world.aerosol or "continental_clean").replace("-", "_")
    with about({"name": "--aerosol", "visibility": "--visibility"}):
        aerosol = opac(name, world.optical_depth, world.visibility)
    return earth(sun, aerosol, column, ground(world.ground))


def ground(text: str | None) -> AbstractSpectrum | None:
    """The albedo of a ground: a name or a number; None for that of the world."""
    if text is None:
        return None
    try:
        value = float(text)
    except ValueError:
        with about({"name": "--ground"}):
            return albedo(text)
    if not 0.0 <= value <= 1.0:
        refuse("--ground", "must be a name, or a number from 0 to 1", text)
    return Constant(value)


@contextlib.contextmanager
def about(options: dict[str, str]) -> Iterator[None]:
    """Errors about arguments become errors about options."""
    try:
        yield
    except ValueError as error:
        text = str(error)
        for argument, option in options.items():
            text = text.replace(f"`{argument}`", f"`{option}`")
        raise ValueError(text) from error


def solver_named(
    name: str, stokes: int = 1, altitude: float | None = None
) -> AbstractSolver:
    """The solver of that name, at its finest; or for pictures from an altitude.

    From high above, rays pass more edges of media than the quick solver tells apart.
    """
    quick = altitude is not None and altitude < 20.0 * km
    single = QUICK if quick else SingleScattering()
    if name == "columns":
        return Columns(single=single, stokes=stokes)
    if name == "shells":
        return Shells(single=single, stokes=stokes)
    if name in ("bruneton", "shared", "march") and stokes != 1:
        refuse("--stokes", f"must be 1 with --solver {name}", stokes)
    if name == "bruneton":
        return Bruneton(single=single)
    if name == "shared":
        return Shared(single=single)
    if name == "march":
        return March(steps="fixed").solver()
    return dataclasses.replace(single, stokes=stokes)


# The paths of a look: some after another, so that fewer wait for the longest.
_WALKS, _PATHS = 2, 8
EACH = _WALKS * _PATHS


def tracer(scene: Scene) -> AbstractTracing:
    """The solver that traces paths through a scene: layers have one of their own."""
    plain = len(scene.suns) == len(scene.lights) and not scene.surfaces
    if plain and all(x.profile.layered and x.emission is None for x in scene.media):
        return PathTracing(walks=_WALKS, paths=_PATHS)
    return VolumeTracing(walks=_WALKS, paths=_PATHS, cells=32)


def solve_file(
    scene: Scene,
    solver: AbstractSolver,
    bands: ArrayLike,
    path: Path | None,
    kept: Path | None = None,
) -> SolvedSky:
    """The sky of a scene; errors about a scene that was read name its file and keys.

    With `kept`, from that file if there is one; else there will be.
    """
    with of_file(scene, path):
        if kept is not None and kept.exists():
            return bake.load(kept, scene, solver, bands)
        sky = solve(scene, solver, bands)
        if kept is not None:
            bake.save(sky, kept)
        return sky


@contextlib.contextmanager
def of_file(scene: Scene, path: Path | None) -> Iterator[None]:
    """Errors about a scene that was read name its file and keys."""
    # In a file suns come before other lights.
    suns = len(scene.suns)
    keys = ["sun"] if suns == 1 else [f"sun[{i}]" for i in range(suns)]
    keys += [f"light[{i}]" for i in range(len(scene.lights) - suns)]
    names = {f"scene.lights[{i}]": key for i, key in enumerate(keys)} | {
        "scene.lights": "sun",
        "scene.surfaces": "surface",
        "scene.media": "medium",
        "scene.ground": "planet.ground_albedo",
    }
    try:
        yield
    except ValueError as error:
        if path is None:
            raise
        text = str(error)
        for ours, theirs in names.items():
            text = text.replace(ours, theirs)
        raise ValueError(f"{path}: {text}") from error
