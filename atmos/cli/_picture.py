"""`atmos sky`: pictures."""

from pathlib import Path
from typing import Annotated

import numpy as np

from ..camera import AbstractCamera
from ..render import render, render_stokes, Response
from ..scenefile import load_camera
from ..sky import AbstractSky
from ._app import app, CAMERA, flat, MODEL, option, OUTPUT, refuse, SUN, WORLD
from ._lamp import described
from ._model import Model
from ._options import (
    Bake,
    check_bake,
    default_solver,
    Files,
    observed,
    Solver,
    Stokes,
    SunPosition,
    World,
)
from ._session import progress_bar, start
from ._view import View
from ._world import about, make_scene, solve_file, solver_named
from ._write import Seen, write_picture


@app.command
def sky(
    scene: Annotated[Path | None, option("A scene file instead of a world.")] = None,
    /,
    *,
    solver: Solver = None,
    stokes: Stokes = 1,
    bake: Bake = None,
    world: Annotated[World | None, flat(WORLD)] = None,
    sun: Annotated[SunPosition | None, flat(SUN)] = None,
    model: Annotated[Model | None, flat(MODEL)] = None,
    view: Annotated[View | None, flat(CAMERA)] = None,
    files: Annotated[Files | None, flat(OUTPUT)] = None,
) -> None:
    """Render the sky as an OpenEXR picture, and a PNG to look at.

    Values are radiances; the header of the file has their unit, and the scene. With
    --stokes 3 layers Q and U hold how the light is polarised.

    For example:

    atmos sky

    atmos sky --sun-elevation 3 --aerosol maritime_clean --output sea.exr

    atmos sky --date 2026-06-21T18:30+02:00 --latitude 48.1 --longitude 11.6

    atmos sky --world mars --projection perspective --azimuth 40 --output mars.exr

    atmos sky my.toml --no-sun --half --colour-space acescg --solver columns

    atmos sky my.toml --solver columns --bake my.bake --azimuth 90

    atmos sky --model hosek --turbidity 4 --sun-elevation 20

    atmos sky --model perez --direct 700 --diffuse 120 --projection fisheye
    """
    world, sun, view = world or World(), sun or SunPosition(), view or View()
    files, model = files or Files(), model or Model()
    paths = files.check("sky")
    kind = model.model
    model.check([kind] if kind else [], world)
    if kind is not None:
        for name, value in {"scene": scene, "--solver": solver, "--bake": bake}.items():
            if value is not None:
                refuse(name, "must not stand beside --model", kind)
        if stokes != 1:
            refuse("--stokes", "must be 1 with --model", stokes)
    chosen = solver or default_solver(stokes)
    check_bake(bake, chosen)
    start()

    wavelength = np.array(files.wavelength or model.bands(kind), np.float32)
    camera = view.camera(None if scene is None else load_camera(scene))
    said = observed(sun, camera)
    look = lambda sky, camera, response: _seen(sky, camera, response, stokes)
    if kind is not None:
        if kind == "hosek-rgb" and files.colour_space == "spectral":
            refuse("--colour-space", "must not be spectral with --model hosek-rgb")
        said |= {"model": str(model)}
        fitted = lambda: model.sky(kind, sun, world, wavelength)
        with about({"position": "--altitude"}):
            write_picture(fitted, camera, wavelength, files, paths, said, look)
        return
    step = (wavelength[-1] - wavelength[0]) / max(1, wavelength.size - 1) or 10.0
    found = make_scene(scene, world, sun, float(step))
    *aside, altitude = np.asarray(camera.position).tolist()
    method = solver_named(chosen, stokes, altitude)

    def solved():
        made = solve_file(found, method, wavelength, scene, bake)
        if made.has_panorama and any(aside):
            rule = "must lie straight above the origin, in air that is layered"
            refuse("--position", rule, camera.position.tolist())
        return made

    said |= {"solver": str(method)} | described(found, camera)
    write_picture(solved, camera, wavelength, files, paths, said, look)


def _seen(
    sky: AbstractSky, camera: AbstractCamera, response: Response | None, stokes: int
) -> Seen:
    with progress_bar("sky") as tell:
        if stokes == 1:
            return Seen(np.asarray(render(sky, camera, response, progress=tell)))
        picture = np.asarray(render_stokes(sky, camera, response, progress=tell))
        return Seen(picture[0], stokes=picture[1:])
