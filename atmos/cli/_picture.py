"""`atmos sky`: pictures."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import jax.numpy as jnp
import numpy as np

from .. import colour, image
from ..camera import AbstractCamera, LatLong
from ..disk import render_disks
from ..render import render, render_stokes
from ..scene import Scene
from ..solver import SolvedSky
from ._app import app, CAMERA, flat, option, OUTPUT, refuse, SUN, WORLD
from ._lamp import header, measure_lamp
from ._options import (
    Bake,
    check_bake,
    Files,
    observed,
    Solver,
    Stokes,
    SunPosition,
    View,
    World,
)
from ._session import progress_bar, start
from ._world import make_scene, solve_file, solver_named


_LARGEST_HALF = 65504.0


@app.command
def sky(
    scene: Annotated[Path | None, option("A scene file instead of a world.")] = None,
    /,
    *,
    solver: Solver = "single",
    stokes: Stokes = 1,
    bake: Bake = None,
    world: Annotated[World | None, flat(WORLD)] = None,
    sun: Annotated[SunPosition | None, flat(SUN)] = None,
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
    """
    world, sun, view = world or World(), sun or SunPosition(), view or View()
    files = files or Files()
    preview = files.check()
    check_bake(bake, solver)
    start()

    wavelength = np.array(files.wavelength, np.float32)
    step = (wavelength[-1] - wavelength[0]) / max(1, wavelength.size - 1) or 10.0
    found = make_scene(scene, world, sun, float(step))
    camera = view.camera()
    method = solver_named(solver, stokes, float(camera.position[2]))
    solved = lambda: solve_file(found, method, wavelength, scene, bake)
    said = observed(sun, view)
    write_picture(found, solved, camera, wavelength, files, preview, said)


def write_picture(
    scene: Scene,
    solved: Callable[[], SolvedSky],
    camera: AbstractCamera,
    wavelength: np.ndarray,
    files: Files,
    preview: Path | None,
    observed: dict[str, str | float],
) -> None:
    """Renders the sky of a scene and writes what was asked for."""
    spectral = files.colour_space == "spectral"
    space = colour.COLOUR_SPACES["rec709" if spectral else files.colour_space]
    seen = not spectral or (
        wavelength.size > 1 and colour.has_colour(wavelength.astype(float))
    )
    bands = jnp.asarray(wavelength)
    weights = colour.response(bands) if seen else None
    response = None if spectral else space.from_xyz(weights)

    # First what may be refused.
    sky = solved()
    disks = render_disks(sky, camera, response) if files.sun else np.zeros(1)
    if files.half and np.max(disks) > _LARGEST_HALF:
        rule = "cannot hold the sun's disk; leave it to a lamp with --no-sun"
        refuse("--half", rule, f"{np.max(disks):g}")
    lamps = [measure_lamp(sky, x, camera, space, weights) for x in sky.scene.lights]
    look = render if sky.solver.stokes == 1 else render_stokes
    with progress_bar("sky") as tell:
        picture = np.asarray(look(sky, camera, response, progress=tell))
    polarised = None
    if sky.solver.stokes == 3:
        picture, polarised = picture[0], picture[1:]
    picture = picture + disks.astype(picture.dtype)

    said = header(scene, sky.solver, wavelength, lamps) | observed
    latlong = isinstance(camera, LatLong)
    kind = {
        "stokes": polarised,
        "half": files.half,
        "latlong": latlong,
        "attributes": said,
    }
    if spectral:
        image.write_spectral_exr(files.output, picture, wavelength, **kind)
    else:
        image.write_exr(files.output, picture, space, **kind)
    for lamp in lamps:
        print(lamp)
    size = f"{camera.width} x {camera.height}"
    print(f"wrote {files.output}: {size}, {files.colour_space}")
    if preview is not None and seen:
        xyz = jnp.asarray(picture)
        xyz = colour.to_xyz(xyz, bands) if spectral else space.to_xyz(xyz)
        exposure = files.exposure
        if exposure is None:
            exposure = round(float(colour.automatic_exposure(xyz)), 2)
        note = {"exposure": f"EV {exposure:g} at ISO 100"}
        image.write_png(preview, colour.preview(xyz, exposure), note)
        print(f"wrote {preview}: exposure EV {exposure:g}")
