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
from ..sky import AbstractSky
from ._app import app, CAMERA, flat, MODEL, option, OUTPUT, refuse, SUN, WORLD
from ._lamp import described, header, measure_lamp
from ._model import Model
from ._options import (
    Bake,
    check_bake,
    Files,
    HOW,
    observed,
    SOLVERS,
    Stokes,
    SunPosition,
    View,
    World,
)
from ._session import progress_bar, start
from ._world import about, make_scene, solve_file, solver_named


_LARGEST_HALF = 65504.0


@app.command
def sky(
    scene: Annotated[Path | None, option("A scene file instead of a world.")] = None,
    /,
    *,
    solver: Annotated[SOLVERS | None, option(f"{HOW}  [default: single]")] = None,
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
    preview = files.check()
    kind = model.model
    model.check([kind] if kind else [], world)
    if kind is not None:
        for name, value in {"scene": scene, "--solver": solver, "--bake": bake}.items():
            if value is not None:
                refuse(name, "must not stand beside --model", kind)
        if stokes != 1:
            refuse("--stokes", "must be 1 with --model", stokes)
    solver = solver or "single"
    check_bake(bake, solver)
    start()

    wavelength = np.array(files.wavelength or model.bands(kind), np.float32)
    camera, said = view.camera(), observed(sun, view)
    if kind is not None:
        if kind == "hosek-rgb" and files.colour_space == "spectral":
            refuse("--colour-space", "must not be spectral with --model hosek-rgb")
        said |= {"model": str(model)}
        fitted = lambda: model.sky(kind, sun, world, wavelength)
        with about({"position": "--altitude"}):
            write_picture(fitted, camera, wavelength, files, preview, said)
        return
    step = (wavelength[-1] - wavelength[0]) / max(1, wavelength.size - 1) or 10.0
    found = make_scene(scene, world, sun, float(step))
    method = solver_named(solver, stokes, float(camera.position[2]))
    solved = lambda: solve_file(found, method, wavelength, scene, bake)
    said |= {"solver": str(method)} | described(found)
    write_picture(solved, camera, wavelength, files, preview, said, stokes)


def write_picture(
    made: Callable[[], AbstractSky],
    camera: AbstractCamera,
    wavelength: np.ndarray,
    files: Files,
    preview: Path | None,
    said: dict[str, str | float],
    stokes: int = 1,
) -> None:
    """Renders a sky and writes what was asked for."""
    spectral = files.colour_space == "spectral"
    space = colour.COLOUR_SPACES["rec709" if spectral else files.colour_space]
    seen = not spectral or (
        wavelength.size > 1 and colour.has_colour(wavelength.astype(float))
    )
    bands = jnp.asarray(wavelength)
    weights = colour.response(bands) if seen else None
    response = None if spectral else space.from_xyz(weights)

    # First what may be refused.
    sky = made()
    disks = render_disks(sky, camera, response) if files.sun else np.zeros(1)
    if files.half and np.max(disks) > _LARGEST_HALF:
        rule = "cannot hold the sun's disk; leave it to a lamp with --no-sun"
        refuse("--half", rule, f"{np.max(disks):g}")
    lamps = [measure_lamp(sky, x, camera, space, weights) for x in sky.lights]
    look = render if stokes == 1 else render_stokes
    with progress_bar("sky") as tell:
        picture = np.asarray(look(sky, camera, response, progress=tell))
    polarised = None
    if stokes == 3:
        picture, polarised = picture[0], picture[1:]
    picture = picture + disks.astype(picture.dtype)

    latlong = isinstance(camera, LatLong)
    kind = {
        "stokes": polarised,
        "half": files.half,
        "latlong": latlong,
        "attributes": header(wavelength, lamps) | said,
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
