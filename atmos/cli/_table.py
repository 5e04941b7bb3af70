"""`atmos radiance` and `atmos optical-depth`: numbers."""

import dataclasses
import math
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any

import equinox as eqx
import numpy as np

from ..image import whole_file
from ..rays import (
    angles,
    combinations,
    direction,
    optical_depths,
    padded,
    polarised_radiances,
    radiances,
)
from ..scenefile import load
from ..solver import admit, SolvedSky
from ._app import app, numbers_option, refuse
from ._options import (
    Altitudes,
    Bake,
    check_bake,
    check_output,
    default_solver,
    File,
    Output,
    Precise,
    Solver,
    Stokes,
    Wavelengths,
    Zeniths,
)
from ._session import progress_bar, start
from ._world import of_file, solve_file, solver_named


@app.command
def radiance(
    scene: File,
    /,
    *,
    solver: Solver = None,
    stokes: Stokes = 1,
    sun_zenith: Annotated[
        tuple[float, ...] | None,
        numbers_option("Zenith angles of the sun, in degrees.", 0, 180),
    ] = None,
    altitude: Altitudes = (0.0,),
    view_zenith: Zeniths = (0.0,),
    azimuth: Annotated[
        tuple[float, ...],
        numbers_option("View azimuths relative to the sun's, in degrees.", -360, 360),
    ] = (0.0,),
    wavelength: Wavelengths = (450.0, 550.0, 650.0),
    bake: Bake = None,
    output: Output = None,
    float64: Precise = False,
) -> None:
    """Spectral radiance of the sky, without the sun's disk, as a CSV table.

    All combinations of the numbers given; a view zenith beyond 90 looks down.

    sun_zenith, view_zenith, azimuth are in degrees, altitude in m, wavelength in
    nm, and radiance in W m^-2 sr^-1 nm^-1 if that is the scene's irradiance per sr;
    with --stokes 3 q and u, in the same unit, follow.

    For example:

    atmos radiance my.toml --view-zenith 0:85:5,89 --azimuth 0,90,180
    """
    if output is not None:
        check_output("--output", output)
    chosen = solver or default_solver(stokes)
    check_bake(bake, chosen)
    start(float64)

    found = load(scene)
    method = solver_named(chosen, stokes)
    bands = padded(np.array(wavelength, np.float64 if float64 else np.float32))
    if len(found.suns) != 1:
        if found.lights:
            with of_file(found, scene):
                admit(found, method, bands)
        refuse("sun", "must be one alone", f"{len(found.suns)} in '{scene}'")
    own, towards = angles(np.asarray(found.suns[0].direction))
    suns = (own,) if sun_zenith is None else sun_zenith
    each = bool(method.baked(found).lights)  # solved for each sun
    if bake is not None and len(suns) > 1 and each:
        refuse("--bake", f"serves one sun with --solver {chosen}", len(suns))
    axes = [np.array(x) for x in (altitude, view_zenith, azimuth)]

    def skies() -> Iterator[SolvedSky]:
        sky = None
        for zenith in suns:
            light = direction(zenith, towards).astype(bands.dtype)
            if sky is None or each:
                lit = eqx.tree_at(lambda x: x.lights[0].direction, found, light)
                sky = solve_file(lit, method, bands, scene, bake)
            yield eqx.tree_at(lambda x: x.scene.lights[0].direction, sky, light)

    def blocks() -> Iterator[tuple[Sequence[Any], Any]]:
        for zenith, sky in zip(suns, skies(), strict=True):
            for height, tilt, turn in combinations(sky, *axes):
                values = look(sky, height, direction(tilt, towards + turn))
                yield (np.full(height.shape, zenith), height, tilt, turn), values

    look = radiances if stokes == 1 else polarised_radiances
    names = "sun_zenith,altitude,view_zenith,azimuth,wavelength,radiance"
    names = names if stokes == 1 else f"{names},q,u"
    count = len(suns) * math.prod(x.size for x in axes)
    write_table(output, names, wavelength, blocks(), count)


@app.command
def optical_depth(
    scene: File,
    /,
    *,
    altitude: Altitudes = (0.0,),
    view_zenith: Zeniths = (0.0,),
    wavelength: Wavelengths = (450.0, 550.0, 650.0),
    output: Output = None,
    float64: Precise = False,
) -> None:
    """Optical depth from the observer to the ground or the top of the air, as CSV.

    All combinations of the numbers given, looking towards north.

    altitude is in m, view_zenith in degrees, wavelength in nm.

    For example:

    atmos optical-depth my.toml --view-zenith 0,60,90 --wavelength 300:800:50
    """
    if output is not None:
        check_output("--output", output)
    start(float64)

    bands = padded(np.array(wavelength, np.float64 if float64 else np.float32))
    found = load(scene)
    # What shines has no part in it.
    dark = [dataclasses.replace(x, emission=None) for x in found.media]
    found = dataclasses.replace(found, lights=(), media=tuple(dark))
    sky = solve_file(found, solver_named("single"), bands, scene)
    axes = [np.array(x) for x in (altitude, view_zenith)]

    def blocks() -> Iterator[tuple[Sequence[Any], Any]]:
        for height, tilt in combinations(sky, *axes):
            yield (height, tilt), optical_depths(sky, height, direction(tilt, 0.0))

    names = "altitude,view_zenith,wavelength,optical_depth"
    write_table(output, names, wavelength, blocks(), math.prod(x.size for x in axes))


def write_table(
    output: Path | None,
    names: str,
    wavelength: Sequence[float],
    blocks: Iterator[tuple[Sequence[Any], Any]],
    count: int,
) -> None:
    """Writes rows as CSV, a line for each ray and wavelength."""

    name = names.split(",wavelength,")[1].split(",")[0]
    bands = [f"{x:.10g}" for x in wavelength]

    def write(file):
        done = 0
        for columns, values in blocks:
            if done == 0:
                file.write(f"{names}\n")
            if not np.all(np.isfinite(values)):
                raise ValueError(f"`{name}` is not finite somewhere.")
            values = values.reshape(*values.shape[:2], -1)
            digits = 17 if values.dtype == np.float64 else 9
            for *row, line in zip(*columns, values.tolist(), strict=True):
                start = ",".join(f"{x:.10g}" for x in row)
                for band, found in zip(bands, line, strict=False):
                    text = ",".join(f"{x:.{digits}g}" for x in found)
                    file.write(f"{start},{band},{text}\n")
            done += len(values)
            tell(done / count)

    with progress_bar(name) as tell:
        if output is None:
            write(sys.stdout)
            return
        with whole_file(output) as part, open(part, "w", newline="") as file:
            write(file)
