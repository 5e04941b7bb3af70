"""What the commands can be told, and the objects that these words become."""

import dataclasses
import datetime
import math
import os
from pathlib import Path
from typing import Annotated, Literal

import numpy as np

from ..camera import AbstractCamera
from ..image import Attribute
from ..light import ephemeris
from ._app import (
    exposure_value,
    HIGHEST,
    moment,
    numbers_option,
    option,
    real,
    refuse,
    SIGNED,
    switch,
)


Wavelengths = Annotated[
    tuple[float, ...],
    numbers_option("Wavelengths, in nm: numbers, or FIRST:LAST:STEP.", 100, 1e5),
]
Zeniths = Annotated[
    tuple[float, ...],
    numbers_option("Angles between the view and straight up, in degrees.", 0, 180),
]
Altitudes = Annotated[
    tuple[float, ...], numbers_option("Altitudes of the observer, in m.", 0, HIGHEST)
]
Output = Annotated[
    Path | None, option("The CSV file to write; standard output without it.")
]
Precise = Annotated[bool, option("Calculate in double precision.")]
Solver = Annotated[
    Literal["shells", "columns", "bruneton", "shared", "single", "march"] | None,
    option(
        "How: shells for all orders of scattering in the round, for any sun; columns "
        "for all orders, each column of air taken as flat (suns well above the "
        "horizon); bruneton for the first few orders, in tables (not for thick air); "
        "shared for all orders, those after the first roughly (quick, not for thick "
        "air); single for light that turned once; march for that in clouds, smoke and "
        "fire, by steps along every ray.  [default: shared; with --stokes 3 single]"
    ),
]
Bake = Annotated[
    Path | None,
    option(
        "Keep what the solver works out first in this file, or take it from there if "
        "the file exists; not for --solver single."
    ),
]
Stokes = Annotated[
    Literal[1, 3],
    option(
        "3 for polarised light, I, Q and U: Q counts what vibrates level minus "
        "upright, U what rises to the right minus what falls; 1 for radiance alone."
    ),
]
File = Annotated[Path, option("A scene file; see `atmos scene`.")]


@dataclasses.dataclass(frozen=True)
class World:
    """A ready-made world, as the options describe it."""

    world: Annotated[
        Literal["earth", "mars"] | None,
        option("A ready-made world.  [default: earth]"),
    ] = None
    aerosol: Annotated[
        str | None,
        option(
            "What floats in the air: an aerosol of OPAC (continental_clean, "
            "continental_average, continental_polluted, urban, desert, maritime_clean, "
            "maritime_polluted, maritime_tropical, arctic, antarctic), or none.  "
            "[default: continental_clean]"
        ),
    ] = None
    optical_depth: Annotated[
        float | None,
        real("Optical depth of the aerosol (on Mars: the dust) at 550 nm.", 0, 100, ""),
    ] = None
    visibility: Annotated[
        float | None,
        real("Visibility at the ground, instead of that.", 1, HIGHEST, "METRES"),
    ] = None
    ozone: Annotated[
        float | None, real("Column of ozone.  [default: 300]", 0, 10_000, "DOBSON")
    ] = None
    ground: Annotated[
        str | None,
        option(
            "What the ground is: grass, soil, sand, snow, sea, asphalt, concrete, "
            "mars, or a number, its albedo.  [default: grass, or mars on Mars]"
        ),
    ] = None


@dataclasses.dataclass(frozen=True)
class SunPosition:
    """Where the sun stands: given by angles, or by date, time and place on Earth."""

    sun_elevation: Annotated[
        float | None,
        real("Angle above the horizon.  [default: 15]", -90, 90, "DEGREES"),
    ] = None
    sun_azimuth: Annotated[
        float | None,
        real("Clockwise from north.  [default: 40]", -360, 360, "DEGREES"),
    ] = None
    date: Annotated[
        datetime.datetime | None,
        option(
            "Date and time (ISO 8601, UTC if it has no offset) instead of the angles. "
            "Without a scene file, it sets how far away the sun is, too.",
            converter=moment,
            n_tokens=1,
        ),
    ] = None
    latitude: Annotated[
        float | None, real("North, with --date.", -90, 90, "DEGREES")
    ] = None
    longitude: Annotated[
        float | None, real("East, with --date.", -180, 360, "DEGREES")
    ] = None

    def find(self) -> tuple[float, float, float] | None:
        """Zenith angle and azimuth, in degrees, and distance in au, if asked for."""
        place = {"--latitude": self.latitude, "--longitude": self.longitude}
        angles = {
            "--sun-elevation": self.sun_elevation,
            "--sun-azimuth": self.sun_azimuth,
        }
        given = [name for name, x in (place | angles).items() if x is not None]
        if self.date is None:
            if alone := [x for x in given if x in place]:
                refuse(alone[0], "needs a --date")
            if not given:
                return None
            elevation = 15.0 if self.sun_elevation is None else self.sun_elevation
            azimuth = 40.0 if self.sun_azimuth is None else self.sun_azimuth
            return 90.0 - elevation, azimuth, 1.0
        if extra := [x for x in given if x in angles]:
            refuse(extra[0], "must not stand beside --date")
        if self.latitude is None or self.longitude is None:
            refuse("--date", "needs --latitude and --longitude")

        zenith, azimuth, distance = ephemeris(self.date, self.latitude, self.longitude)
        return math.degrees(zenith), math.degrees(azimuth), distance


@dataclasses.dataclass(frozen=True)
class Files:
    """What is written, and how."""

    output: Annotated[
        Path | None,
        option(
            "The OpenEXR file.  [default: sky.exr; of a scene that is rendered, "
            "its name]"
        ),
    ] = None
    colour_space: Annotated[
        Literal["rec709", "acescg", "aces2065-1", "xyz", "spectral"],
        option(
            "What the channels hold: linear colour, or spectral radiance.",
            name=("--colour-space", "--color-space"),
        ),
    ] = "rec709"
    wavelength: Annotated[
        tuple[float, ...] | None,
        numbers_option(
            "Wavelengths, in nm: numbers, or FIRST:LAST:STEP.",
            100,
            1e5,
            "380:780:10, or up to what a model knows",
        ),
    ] = None
    half: Annotated[bool, option("Write 16-bit floats, not 32.")] = False
    sun: Annotated[
        bool,
        switch("Draw the sun's disk, or leave it to a lamp."),
    ] = True
    preview: Annotated[
        Path | None, option("The PNG file.  [default: beside the output]")
    ] = None
    no_preview: Annotated[bool, option("Write no PNG file.")] = False
    exposure: Annotated[
        float | None,
        option(
            "Exposure of the PNG, in EV at ISO 100 (15: full sun), or auto.",
            converter=exposure_value,
            n_tokens=1,
            show_default=lambda _: "auto",
            metavar="EV",
            **SIGNED,
        ),
    ] = None

    def check(self, name: str) -> tuple[Path, Path | None]:
        """The OpenEXR file, and the PNG file if one is wanted.

        Of this name, unless another is asked for. Refuses what could not be written.
        """
        output = self.output or Path(f"{name}.exr")
        check_output("--output", output, ".exr")
        if self.no_preview:
            if self.preview is not None or self.exposure is not None:
                name = "--exposure" if self.preview is None else "--preview"
                refuse(name, "must not stand beside --no-preview")
            return output, None
        preview = self.preview or output.with_suffix(".png")
        check_output("--preview", preview, ".png")
        return output, preview


def check_output(option: str, path: Path, suffix: str = "") -> None:
    """Refuses a file that could not be written, before the work is done."""
    folder = path.absolute().parent
    if suffix and path.suffix.lower() != suffix:
        refuse(option, f"must be the name of a {suffix} file", path)
    if not folder.is_dir():
        refuse(option, "must lie in a folder that exists", path)
    if path.exists() and not (path.is_file() and os.access(path, os.W_OK)):
        refuse(option, "must be a file that one may replace", path)
    if not os.access(folder, os.W_OK):
        refuse(option, "must lie in a folder that one may write to", path)


def default_solver(stokes: int) -> str:
    """The best that is quick from its first picture on."""
    return "shared" if stokes == 1 else "single"


def check_bake(path: Path | None, solver: str) -> None:
    """Refuses a file for what a solver does not do, or that could not be written."""
    if path is None:
        return
    if solver == "single":
        refuse("--bake", "is not for --solver single, which works nothing out first")
    if not path.exists():
        check_output("--bake", path)


def observed(sun: SunPosition, camera: AbstractCamera) -> dict[str, Attribute]:
    """What the header says of when and where."""
    place = [round(x, 6) for x in np.asarray(camera.position).tolist()]
    found: dict[str, Attribute] = {"altitude": place[2], "position": tuple(place)}
    if sun.date is not None and sun.latitude is not None and sun.longitude is not None:
        found["capDate"] = sun.date.strftime("%Y:%m:%d %H:%M:%S")
        ahead = sun.date.utcoffset() or datetime.timedelta()
        found["utcOffset"] = -ahead.total_seconds()
        found |= {"latitude": sun.latitude, "longitude": sun.longitude}
    return found
