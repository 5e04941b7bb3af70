"""`atmos render`: pictures of clouds, smoke and fire that grow until they are good."""

import contextlib
import os
import sys
from typing import Annotated, Literal

import numpy as np

from ..denoise import denoiser
from ..scenefile import load_camera
from ._app import app, CAMERA, flat, MARCH, option, OUTPUT, refuse, STOP, SUN
from ._lamp import described
from ._march import March
from ._model import Model
from ._options import check_output, File, Files, observed, SunPosition, World
from ._session import start
from ._stop import Stop
from ._view import View
from ._work import Work
from ._world import EACH, make_scene, solve_file, tracer
from ._write import write_picture


@app.command
def render(
    scene: File,
    /,
    *,
    solver: Annotated[
        Literal["trace", "march"],
        option(
            "How: trace for light that turned any number of times, by random paths; "
            "march for light that turned once, by steps along every ray."
        ),
    ] = "trace",
    stop: Annotated[Stop | None, flat(STOP)] = None,
    march: Annotated[March | None, flat(MARCH)] = None,
    sun: Annotated[SunPosition | None, flat(SUN)] = None,
    view: Annotated[View | None, flat(CAMERA)] = None,
    files: Annotated[Files | None, flat(OUTPUT)] = None,
    denoise: Annotated[
        bool,
        option(
            "Take the noise out, by guess; layer noisy holds what was seen. Needs "
            "pip install 'atmos[denoise]'.",
            group=OUTPUT,
        ),
    ] = False,
) -> None:
    """Render a scene of clouds, smoke or fire, until enough light has been gathered.

    What is missing is noise. Layer variance of the OpenEXR file holds the square of the
    standard error of each value; the header has the relative one of all.

    Ctrl-C leaves a picture of what there is. A file beside the output, its name with
    .checkpoint at the end, lets the same command go on from there, or from where it was
    killed, to the same picture bit for bit; when the picture is done, it is removed.

    For example:

    atmos render cloud.toml --output cloud.exr

    atmos render cloud.toml --error 0.02 --time 600 --wavelength 400:700:50

    atmos render fire.toml --samples 64 --denoise --azimuth 90 --position -6,0,1.7

    atmos render smoke.toml --solver march --steps adaptive --tolerance 0.01 --samples 4
    """
    stop, sun, view = stop or Stop(), sun or SunPosition(), view or View()
    files, march = files or Files(), march or March()
    march.check(solver)
    paths = files.check(scene.stem)
    kept = paths[0].with_name(f"{paths[0].name}.checkpoint")
    check_output("--output", kept)
    if denoise and files.colour_space == "spectral":
        refuse("--denoise", "is for colours; not for --colour-space spectral")
    if denoise:
        denoiser()
    start()

    wavelength = np.array(files.wavelength or Model().bands(None), np.float32)
    camera = view.camera(load_camera(scene))
    step = (wavelength[-1] - wavelength[0]) / max(1, wavelength.size - 1) or 10.0
    found = make_scene(scene, World(), sun, float(step))
    method = march.solver() if solver == "march" else tracer(found)
    solved = lambda: solve_file(found, method, wavelength, scene)
    said = {"solver": str(method)} | observed(sun, camera) | described(found, camera)
    work = Work(stop, kept, EACH if solver == "trace" else 1)
    write_picture(solved, camera, wavelength, files, paths, said, work.look, denoise)
    if work.interrupted:
        print(f"atmos: interrupted; {kept} lets it go on from here", file=sys.stderr)
        raise KeyboardInterrupt
    with contextlib.suppress(FileNotFoundError):
        os.unlink(kept)
