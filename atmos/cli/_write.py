"""Pictures, from a sky to the files that were asked for."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .. import colour, image
from ..camera import AbstractCamera, LatLong
from ..denoise import denoise
from ..disk import render_disks
from ..image import Attribute
from ..quantity import as_float
from ..render import Response
from ..sky import AbstractSky
from ._app import refuse
from ._lamp import header, measure_lamp
from ._options import Files
from ._world import about


_LARGEST_HALF = 65504.0


class Seen(NamedTuple):
    """A picture but for the disks of lights, and what else is known of it."""

    picture: np.ndarray
    stokes: np.ndarray | None = None
    layers: dict[str, np.ndarray] = {}
    said: dict[str, Attribute] = {}


Look = Callable[[AbstractSky, AbstractCamera, Response | None], Seen]


def write_picture(
    made: Callable[[], AbstractSky],
    camera: AbstractCamera,
    wavelength: np.ndarray,
    files: Files,
    paths: tuple[Path, Path | None],
    said: dict[str, Attribute],
    look: Look,
    denoises: bool = False,
) -> None:
    """Makes a sky, looks at it and writes what was asked for."""
    spectral = files.colour_space == "spectral"
    space = colour.COLOUR_SPACES["rec709" if spectral else files.colour_space]
    seen = not spectral or (
        wavelength.size > 1 and colour.has_colour(wavelength.astype(float))
    )
    bands = as_float(wavelength)
    with about({"wavelength": "--wavelength"}):
        weights = colour.response(bands) if seen else None
    response = None if weights is None else space.from_xyz(weights)

    # First what may be refused.
    sky = made()
    shown = None if spectral else response
    disks = render_disks(sky, camera, shown) if files.sun else np.zeros(1)
    if files.half and np.max(disks) > _LARGEST_HALF:
        rule = "cannot hold the sun's disk; leave it to a lamp with --no-sun"
        refuse("--half", rule, f"{np.max(disks):g}")
    lamps = [measure_lamp(sky, x, camera, weights, response) for x in sky.lights]
    found = look(sky, camera, shown)
    picture, layers = found.picture, dict(found.layers)
    if denoises:
        layers["noisy"] = picture
        picture = denoise(picture, space)
    picture = picture + disks.astype(picture.dtype)

    latlong = isinstance(camera, LatLong)
    kind = {
        "stokes": found.stokes,
        "layers": layers,
        "half": files.half,
        "latlong": latlong,
        "attributes": header(wavelength, lamps) | said | found.said,
    }
    output, preview = paths
    if spectral:
        image.write_spectral_exr(output, picture, wavelength, **kind)
    else:
        image.write_exr(output, picture, space, **kind)
    for lamp in lamps:
        print(lamp)
    size = f"{camera.width} x {camera.height}"
    print(f"wrote {output}: {size}, {files.colour_space}")
    if preview is not None and seen:
        xyz = as_float(picture)
        xyz = colour.to_xyz(xyz, bands) if spectral else space.to_xyz(xyz)
        exposure = files.exposure
        if exposure is None:
            exposure = round(float(colour.automatic_exposure(xyz)), 2)
        note = {"exposure": f"EV {exposure:g} at ISO 100"}
        image.write_png(preview, colour.preview(xyz, exposure), note)
        print(f"wrote {preview}: exposure EV {exposure:g}")
