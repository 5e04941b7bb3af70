"""The command line: `atmos sky`, `radiance`, `optical-depth` and `scene`.

What takes long to import is imported by the command that needs it: help is quick.
"""

import concurrent.futures
import contextlib
import dataclasses
import datetime
import importlib.metadata
import math
import os
import sys
import threading
import warnings
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, NoReturn, TYPE_CHECKING

from cyclopts import App, CycloptsError, Group, Parameter


if TYPE_CHECKING:
    import numpy as np

    from .camera import AbstractCamera
    from .scene import Scene
    from .solver import AbstractSolver, SolvedSky


# The largest picture is 32768 pixels high.
_MOST_PIXELS = 2**15
_MOST_NUMBERS = 10**6
# As far away as the moon is three times; squares still fit into single precision.
_HIGHEST = 1e9
_LARGEST_HALF = 65504.0


def _refuse(option: str, rule: str, value: object = None) -> NoReturn:
    got = "" if value is None else f"; got {value}"
    raise ValueError(f"`{option}` {rule}{got}.")


# What an option may be. cyclopts puts the name of the option in front of these errors.


def _number(text: str, low: float | int, high: float | int) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not low <= value <= high:
        rule = f"must be a number from {low:g} to {high:g}"
        raise ValueError(f"{rule}; got {text!r}.")
    return value


def _numbers(text: str, low: float | int, high: float | int) -> tuple[float, ...]:
    found: list[float] = []
    for part in text.split(","):
        ends = part.split(":")
        if len(ends) == 1:
            found.append(_number(part, low, high))
            continue
        first, last, step = (
            _number(ends[0], low, high),
            _number(ends[1], low, high),
            _number(ends[2], 0.0, _HIGHEST) if len(ends) == 3 else 0.0,
        )
        if not (step > 0.0 and last >= first):
            rule = "must be numbers and ranges FIRST:LAST:STEP, such as 0,30,40:80:10"
            raise ValueError(f"{rule}; got {part!r}.")
        count = (last - first) / step + 1e-9
        if count > _MOST_NUMBERS:
            raise ValueError(f"must be at most {_MOST_NUMBERS} numbers; got {part!r}.")
        found += [round(first + i * step, 9) for i in range(math.floor(count) + 1)]
    return tuple(found)


def _option(description: str, **more: Any) -> Parameter:
    return Parameter(help=description, negative=(), **more)


def _real(
    description: str, low: float | int, high: float | int, unit: str, **more: Any
) -> Parameter:
    def convert(type_, tokens):
        return _number(tokens[0].value, low, high)

    more |= {"converter": convert, "n_tokens": 1, "metavar": unit or "NUMBER"}
    return _option(description, **_SIGNED, **more)


def _whole(description: str, low: int, high: int, **more: Any) -> Parameter:
    def convert(type_, tokens):
        text = tokens[0].value
        value = _number(text, low, high)
        if value != math.floor(value):
            rule = f"must be a whole number from {low} to {high}"
            raise ValueError(f"{rule}; got {text!r}.")
        return int(value)

    return _option(description, converter=convert, n_tokens=1, **more)


def _list(
    description: str, low: float | int, high: float | int, **more: Any
) -> Parameter:
    def convert(type_, tokens):
        return _numbers(tokens[0].value, low, high)

    def show(values):
        if values is None:
            return "the scene's"
        if len(values) < 9:
            return ",".join(f"{x:g}" for x in values)
        return f"{values[0]:g}:{values[-1]:g}:{values[1] - values[0]:g}"

    return _option(
        description,
        converter=convert,
        n_tokens=1,
        show_default=show,
        metavar="LIST",
        **_SIGNED,
        **more,
    )


def _moment(type_, tokens) -> datetime.datetime:
    text = tokens[0].value
    try:
        return datetime.datetime.fromisoformat(text)
    except ValueError:
        rule = "must be a date and time, such as 2026-06-21T12:00+02:00"
        raise ValueError(f"{rule}; got {text!r}.") from None


def _exposure(type_, tokens) -> float | None:
    text = tokens[0].value
    return None if text == "auto" else _number(text, -50.0, 50.0)


_SIGNED = {"allow_leading_hyphen": True}
_WORLD = Group("World", sort_key=1)
_SUN = Group("Sun", sort_key=2)
_CAMERA = Group("Camera", sort_key=3)
_OUTPUT = Group("Output", sort_key=4)

_Wavelengths = Annotated[
    tuple[float, ...],
    _list("Wavelengths, in nm: numbers, or FIRST:LAST:STEP.", 100, 1e5),
]
_Zeniths = Annotated[
    tuple[float, ...],
    _list("Angles between the view and straight up, in degrees.", 0, 180),
]
_Altitudes = Annotated[
    tuple[float, ...], _list("Altitudes of the observer, in m.", 0, _HIGHEST)
]
_Output = Annotated[
    Path | None, _option("The CSV file to write; standard output without it.")
]
_Precise = Annotated[bool, _option("Calculate in double precision.")]
_File = Annotated[Path, _option("A scene file; see `atmos scene`.")]


@dataclasses.dataclass(frozen=True)
class World:
    """A ready-made world, as the options describe it."""

    world: Annotated[
        Literal["earth", "mars"] | None,
        _option("A ready-made world.  [default: earth]"),
    ] = None
    aerosol: Annotated[
        str | None,
        _option(
            "What floats in the air: an aerosol of OPAC (continental_clean, "
            "continental_average, continental_polluted, urban, desert, maritime_clean, "
            "maritime_polluted, maritime_tropical, arctic, antarctic), or none.  "
            "[default: continental_clean]"
        ),
    ] = None
    optical_depth: Annotated[
        float | None,
        _real(
            "Optical depth of the aerosol (on Mars: the dust) at 550 nm.", 0, 100, ""
        ),
    ] = None
    visibility: Annotated[
        float | None,
        _real("Visibility at the ground, instead of that.", 1, _HIGHEST, "METRES"),
    ] = None
    ozone: Annotated[
        float | None, _real("Column of ozone.  [default: 300]", 0, 10_000, "DOBSON")
    ] = None
    ground: Annotated[
        str | None,
        _option(
            "What the ground is: grass, soil, sand, snow, sea, asphalt, concrete, "
            "mars, or a number, its albedo.  [default: grass, or mars on Mars]"
        ),
    ] = None


@dataclasses.dataclass(frozen=True)
class SunPosition:
    """Where the sun stands: given by angles, or by date, time and place on Earth."""

    sun_elevation: Annotated[
        float | None,
        _real("Angle above the horizon.  [default: 15]", -90, 90, "DEGREES"),
    ] = None
    sun_azimuth: Annotated[
        float | None,
        _real("Clockwise from north.  [default: 40]", -360, 360, "DEGREES"),
    ] = None
    date: Annotated[
        datetime.datetime | None,
        _option(
            "Date and time (ISO 8601, UTC if it has no offset) instead of the angles. "
            "Without a scene file, it sets how far away the sun is, too.",
            converter=_moment,
            n_tokens=1,
        ),
    ] = None
    latitude: Annotated[
        float | None, _real("North, with --date.", -90, 90, "DEGREES")
    ] = None
    longitude: Annotated[
        float | None, _real("East, with --date.", -180, 360, "DEGREES")
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
                _refuse(alone[0], "needs a --date")
            if not given:
                return None
            elevation = 15.0 if self.sun_elevation is None else self.sun_elevation
            azimuth = 40.0 if self.sun_azimuth is None else self.sun_azimuth
            return 90.0 - elevation, azimuth, 1.0
        if extra := [x for x in given if x in angles]:
            _refuse(extra[0], "must not stand beside --date")
        if self.latitude is None or self.longitude is None:
            _refuse("--date", "needs --latitude and --longitude")
        from .light import ephemeris

        zenith, azimuth, distance = ephemeris(self.date, self.latitude, self.longitude)
        return math.degrees(zenith), math.degrees(azimuth), distance


@dataclasses.dataclass(frozen=True)
class View:
    """What the picture shows."""

    projection: Annotated[
        Literal["latlong", "fisheye", "perspective"], _option("Kind of picture.")
    ] = "latlong"
    height: Annotated[int, _whole("Rows of pixels.", 1, _MOST_PIXELS)] = 512
    width: Annotated[
        int | None,
        _whole(
            "Columns of pixels, in perspective.  [default: 3/2 of the height]",
            1,
            _MOST_PIXELS,
        ),
    ] = None
    altitude: Annotated[
        float, _real("Of the observer, above the ground.", 0, _HIGHEST, "METRES")
    ] = 2.0
    azimuth: Annotated[
        float,
        _real(
            "Clockwise from north: where the centre of the picture looks; in a fisheye "
            "its top.",
            -360,
            360,
            "DEGREES",
            name=("--azimuth", "--center-azimuth", "--centre-azimuth"),
        ),
    ] = 0.0
    elevation: Annotated[
        float | None,
        _real("Above level, in perspective.  [default: 15]", -90, 90, "DEGREES"),
    ] = None
    field_of_view: Annotated[
        float | None,
        _real(
            "From side to side: in perspective below 180  [default: 60], in a fisheye "
            "up to 360  [default: 180].",
            1e-3,
            360,
            "DEGREES",
        ),
    ] = None

    def camera(self) -> "AbstractCamera":
        """The camera that takes it."""
        import numpy as np

        from .camera import Fisheye, LatLong, Perspective
        from .quantity import deg

        only = {"--width": self.width, "--elevation": self.elevation}
        for name, value in only.items():
            if value is not None and self.projection != "perspective":
                _refuse(name, "is for --projection perspective alone")
        if self.field_of_view is not None and self.projection == "latlong":
            _refuse("--field-of-view", "is not for --projection latlong")
        position = np.array([0.0, 0.0, self.altitude])
        if self.projection == "latlong":
            return LatLong(position, self.height, self.azimuth * deg)
        if self.projection == "fisheye":
            angle = (self.field_of_view or 180.0) * deg
            return Fisheye(position, self.height, angle, self.azimuth * deg)
        angle = self.field_of_view or 60.0
        if angle >= 180.0:
            _refuse("--field-of-view", "must be below 180 in perspective", angle)
        return Perspective(
            position=position,
            azimuth=self.azimuth * deg,
            elevation=(15.0 if self.elevation is None else self.elevation) * deg,
            field_of_view=angle * deg,
            height=self.height,
            width=self.width or max(1, round(1.5 * self.height)),
        )


@dataclasses.dataclass(frozen=True)
class Files:
    """What is written, and how."""

    output: Annotated[Path, _option("The OpenEXR file.")] = Path("sky.exr")
    colour_space: Annotated[
        Literal["rec709", "acescg", "aces2065-1", "xyz", "spectral"],
        _option(
            "What the channels hold: linear colour, or spectral radiance.",
            name=("--colour-space", "--color-space"),
        ),
    ] = "rec709"
    wavelength: _Wavelengths = tuple(380.0 + 10.0 * i for i in range(41))
    half: Annotated[bool, _option("Write 16-bit floats, not 32.")] = False
    sun: Annotated[
        bool,
        Parameter(help="Draw the sun's disk, or leave it to a lamp."),
    ] = True
    preview: Annotated[
        Path | None, _option("The PNG file.  [default: beside the output]")
    ] = None
    no_preview: Annotated[bool, _option("Write no PNG file.")] = False
    exposure: Annotated[
        float | None,
        _option(
            "Exposure of the PNG, in EV at ISO 100 (15: full sun), or auto.",
            converter=_exposure,
            n_tokens=1,
            show_default=lambda _: "auto",
            metavar="EV",
            **_SIGNED,
        ),
    ] = None

    def check(self) -> Path | None:
        """The PNG file, if one is wanted. Refuses what could not be written."""
        _check_output("--output", self.output, ".exr")
        if self.no_preview:
            if self.preview is not None or self.exposure is not None:
                name = "--exposure" if self.preview is None else "--preview"
                _refuse(name, "must not stand beside --no-preview")
            return None
        preview = self.preview or self.output.with_suffix(".png")
        _check_output("--preview", preview, ".png")
        return preview


def _check_output(option: str, path: Path, suffix: str = "") -> None:
    folder = path.absolute().parent
    if suffix and path.suffix.lower() != suffix:
        _refuse(option, f"must be the name of a {suffix} file", path)
    if not folder.is_dir():
        _refuse(option, "must lie in a folder that exists", path)
    if path.exists() and not (path.is_file() and os.access(path, os.W_OK)):
        _refuse(option, "must be a file that one may replace", path)
    if not os.access(folder, os.W_OK):
        _refuse(option, "must lie in a folder that one may write to", path)


app = App(
    name="atmos",
    help="A physically based sky: pictures, radiances, optical depths.",
    version=lambda: importlib.metadata.version("atmos"),
    help_format="plaintext",
    result_action="return_value",
)


def _flat(group: Group) -> Parameter:
    return Parameter(name="*", group=group)


@app.command
def sky(
    scene: Annotated[Path | None, _option("A scene file instead of a world.")] = None,
    /,
    *,
    world: Annotated[World | None, _flat(_WORLD)] = None,
    sun: Annotated[SunPosition | None, _flat(_SUN)] = None,
    view: Annotated[View | None, _flat(_CAMERA)] = None,
    files: Annotated[Files | None, _flat(_OUTPUT)] = None,
) -> None:
    """Render the sky as an OpenEXR picture, and a PNG to look at.

    Values are radiances; the header of the file has their unit, and the scene.

    For example:

    atmos sky

    atmos sky --sun-elevation 3 --aerosol maritime_clean --output sea.exr

    atmos sky --date 2026-06-21T18:30+02:00 --latitude 48.1 --longitude 11.6

    atmos sky --world mars --projection perspective --azimuth 40 --output mars.exr

    atmos sky my.toml --no-sun --half --colour-space acescg
    """
    world, sun, view = world or World(), sun or SunPosition(), view or View()
    files = files or Files()
    preview = files.check()
    _start()
    import numpy as np

    wavelength = np.array(files.wavelength, np.float32)
    step = (wavelength[-1] - wavelength[0]) / max(1, wavelength.size - 1) or 10.0
    found = _scene(scene, world, sun, float(step))
    camera = view.camera()
    _render(found, scene, camera, wavelength, files, preview, _observed(sun, view))


@app.command
def radiance(
    scene: _File,
    /,
    *,
    solver: Annotated[Literal["single"], _option("How: scattered once.")] = "single",
    sun_zenith: Annotated[
        tuple[float, ...] | None,
        _list("Zenith angles of the sun, in degrees.", 0, 180),
    ] = None,
    altitude: _Altitudes = (0.0,),
    view_zenith: _Zeniths = (0.0,),
    azimuth: Annotated[
        tuple[float, ...],
        _list("View azimuths relative to the sun's, in degrees.", -360, 360),
    ] = (0.0,),
    wavelength: _Wavelengths = (450.0, 550.0, 650.0),
    output: _Output = None,
    float64: _Precise = False,
) -> None:
    """Spectral radiance of the sky, without the sun's disk, as a CSV table.

    All combinations of the numbers given; a view zenith beyond 90 looks down.

    sun_zenith, view_zenith, azimuth are in degrees, altitude in m, wavelength in
    nm, and radiance in W m^-2 sr^-1 nm^-1 if that is the scene's irradiance per sr.

    For example:

    atmos radiance my.toml --view-zenith 0:85:5,89 --azimuth 0,90,180
    """
    if output is not None:
        _check_output("--output", output)
    _start(float64)
    import equinox as eqx
    import numpy as np

    from .rays import angles, combinations, direction, padded, radiances

    found = _read(scene)
    if len(found.lights) != 1:
        _refuse("sun", "must be one alone", f"{len(found.lights)} in '{scene}'")
    own, towards = angles(np.asarray(found.lights[0].direction))
    suns = (own,) if sun_zenith is None else sun_zenith
    bands = padded(np.array(wavelength, np.float64 if float64 else np.float32))
    axes = [np.array(x) for x in (altitude, view_zenith, azimuth)]

    def blocks() -> Iterator[tuple[Sequence[Any], Any]]:
        for zenith in suns:
            light = direction(zenith, towards).astype(bands.dtype)
            lit = eqx.tree_at(lambda x: x.lights[0].direction, found, light)
            sky = _solve(lit, _solver(solver), bands, scene)
            for height, tilt, turn in combinations(sky, *axes):
                values = radiances(sky, height, direction(tilt, towards + turn))
                yield (np.full(height.shape, zenith), height, tilt, turn), values

    names = "sun_zenith,altitude,view_zenith,azimuth,wavelength,radiance"
    count = len(suns) * math.prod(x.size for x in axes)
    _write_table(output, names, wavelength, blocks(), count)


@app.command
def optical_depth(
    scene: _File,
    /,
    *,
    altitude: _Altitudes = (0.0,),
    view_zenith: _Zeniths = (0.0,),
    wavelength: _Wavelengths = (450.0, 550.0, 650.0),
    output: _Output = None,
    float64: _Precise = False,
) -> None:
    """Optical depth from the observer to the ground or the top of the air, as CSV.

    All combinations of the numbers given, looking towards north.

    altitude is in m, view_zenith in degrees, wavelength in nm.

    For example:

    atmos optical-depth my.toml --view-zenith 0,60,90 --wavelength 300:800:50
    """
    if output is not None:
        _check_output("--output", output)
    _start(float64)
    import numpy as np

    from .rays import combinations, direction, optical_depths, padded

    bands = padded(np.array(wavelength, np.float64 if float64 else np.float32))
    sky = _solve(_read(scene), _solver("single"), bands, scene)
    axes = [np.array(x) for x in (altitude, view_zenith)]

    def blocks() -> Iterator[tuple[Sequence[Any], Any]]:
        for height, tilt in combinations(sky, *axes):
            yield (height, tilt), optical_depths(sky, height, direction(tilt, 0.0))

    names = "altitude,view_zenith,wavelength,optical_depth"
    _write_table(output, names, wavelength, blocks(), math.prod(x.size for x in axes))


@app.command
def scene(
    *,
    world: Annotated[World | None, _flat(_WORLD)] = None,
    sun: Annotated[SunPosition | None, _flat(_SUN)] = None,
    output: Annotated[
        Path | None, _option("The scene file to write; standard output without it.")
    ] = None,
) -> None:
    """Write a scene file to start from: a ready-made world in numbers, with comments.

    For example:

    atmos scene --output my.toml

    atmos scene --world mars --optical-depth 1 --output dusty.toml
    """
    if output is not None:
        _check_output("--output", output, ".toml")
    _start()
    from .image import whole_file
    from .scenefile import dump, GUIDE

    world = world or World()
    found = _scene(None, world, sun or SunPosition(), 10.0)
    names = ["air", "dust"] if world.world == "mars" else ["air", "ozone", "aerosol"]
    text = f"{GUIDE}\n{dump(found, names)}"
    if output is None:
        sys.stdout.write(text)
        return
    with whole_file(output) as part:
        Path(part).write_text(text)
    print(f"wrote {output}")


# From strings to objects.


def _read(path: Path) -> "Scene":
    from .scenefile import load

    return load(path)


def _solver(name: str) -> "AbstractSolver":
    from .solver import SingleScattering

    return {"single": SingleScattering}[name]()


def _scene(
    path: Path | None, world: World, position: SunPosition, bandwidth: float
) -> "Scene":
    """The scene of a file, or a ready-made world, under the sun that is asked for."""
    import equinox as eqx

    from .light import SOLAR_RADIUS, Sun, sunlight
    from .rays import direction

    where = position.find()
    if path is not None:
        for name, value in vars(world).items():
            if value is not None:
                option = f"--{name.replace('_', '-')}"
                _refuse(option, "must not stand beside a scene file", path)
        found = _read(path)
        if where is None:
            return found
        if len(found.lights) != 1:
            _refuse("sun", "must be one alone to be moved", len(found.lights))
        towards = direction(*where[:2]).astype(found.lights[0].direction.dtype)
        return eqx.tree_at(lambda x: x.lights[0].direction, found, towards)
    zenith, azimuth, distance = where or (75.0, 40.0, 1.0)
    if world.world == "mars":
        if position.date is not None:
            _refuse("--date", "is for the Earth; give angles on Mars")
        distance = 1.524
    light = sunlight(bandwidth, distance)
    sun = Sun(direction(zenith, azimuth), light, SOLAR_RADIUS / distance)
    return _mars(world, sun) if world.world == "mars" else _earth(world, sun)


def _mars(world: World, sun: Any) -> "Scene":
    from .scene import mars

    for name in ("aerosol", "visibility", "ozone"):
        if getattr(world, name) is not None:
            _refuse(f"--{name}", "is not for --world mars")
    dust = 0.5 if world.optical_depth is None else world.optical_depth
    return mars(sun, dust, _ground(world.ground))


def _earth(world: World, sun: Any) -> "Scene":
    from .scene import earth
    from .scenefile import opac

    amounts = {
        "--optical-depth": world.optical_depth,
        "--visibility": world.visibility,
    }
    given = [name for name, x in amounts.items() if x is not None]
    column = 300.0 if world.ozone is None else world.ozone
    if world.aerosol == "none":
        if given:
            _refuse(given[0], "must not stand beside --aerosol none")
        clear = earth(sun, None, column, _ground(world.ground))
        return dataclasses.replace(clear, media=clear.media[:2])
    if len(given) > 1:
        _refuse("--visibility", "must not stand beside --optical-depth")
    name = (world.aerosol or "continental_clean").replace("-", "_")
    with _about({"name": "--aerosol", "visibility": "--visibility"}):
        aerosol = opac(name, world.optical_depth, world.visibility)
    return earth(sun, aerosol, column, _ground(world.ground))


def _ground(text: str | None) -> Any:
    from .particle.surface import albedo
    from .spectrum import Constant

    if text is None:
        return None
    try:
        value = float(text)
    except ValueError:
        with _about({"name": "--ground"}):
            return albedo(text)
    if not 0.0 <= value <= 1.0:
        _refuse("--ground", "must be a name, or a number from 0 to 1", text)
    return Constant(value)


@contextlib.contextmanager
def _about(options: dict[str, str]) -> Iterator[None]:
    """Errors about arguments become errors about options."""
    try:
        yield
    except ValueError as error:
        text = str(error)
        for argument, option in options.items():
            text = text.replace(f"`{argument}`", f"`{option}`")
        raise ValueError(text) from error


def _observed(sun: SunPosition, view: View) -> dict[str, str | float]:
    """What the header says of when and where."""
    found: dict[str, str | float] = {"altitude": view.altitude}
    if sun.date is not None and sun.latitude is not None and sun.longitude is not None:
        found["capDate"] = sun.date.strftime("%Y:%m:%d %H:%M:%S")
        ahead = sun.date.utcoffset() or datetime.timedelta()
        found["utcOffset"] = -ahead.total_seconds()
        found |= {"latitude": sun.latitude, "longitude": sun.longitude}
    return found


# The work.


def _start(double: bool = False) -> None:
    """Readies JAX: it keeps what it compiles, if there is a place to."""
    import jax

    from .reference import cache_folder

    folder = cache_folder() / "jax"
    with contextlib.suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
        if os.access(folder, os.W_OK):
            jax.config.update("jax_compilation_cache_dir", str(folder))
            jax.config.update("jax_persistent_cache_min_compile_time_secs", 0)
            jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)
    if double:
        jax.config.update("jax_enable_x64", True)


def _solve(
    scene: "Scene", solver: "AbstractSolver", bands: Any, path: Path | None
) -> "SolvedSky":
    from .solver import solve

    try:
        return solve(scene, solver, bands)
    except ValueError as error:
        if path is None:
            raise
        text = str(error)
        for ours, theirs in {
            "scene.media": "medium",
            "scene.lights[0]": "sun",
            "scene.lights": "sun",
            "scene.ground": "planet.ground_albedo",
        }.items():
            text = text.replace(ours, theirs)
        raise ValueError(f"{path}: {text}") from error


def _render(
    scene: "Scene",
    path: Path | None,
    camera: "AbstractCamera",
    wavelength: "np.ndarray",
    files: Files,
    preview: Path | None,
    observed: dict[str, str | float],
) -> None:
    import jax.numpy as jnp
    import numpy as np

    from . import colour, image
    from .disk import render_disks
    from .render import render
    from .solver import SingleScattering

    spectral = files.colour_space == "spectral"
    space = colour.COLOUR_SPACES["rec709" if spectral else files.colour_space]
    seen = not spectral or (
        wavelength.size > 1 and colour.has_colour(wavelength.astype(float))
    )
    bands = jnp.asarray(wavelength)
    weights = colour.response(bands) if seen else None
    response = None if spectral else space.from_xyz(weights)
    solver = SingleScattering(7, 6, 14)
    sky = _solve(scene, solver, bands, path)

    def lights():
        disks = render_disks(sky, camera, response) if files.sun else np.zeros(1)
        if files.half and np.max(disks) > _LARGEST_HALF:
            rule = "cannot hold the sun's disk; leave it to a lamp with --no-sun"
            _refuse("--half", rule, f"{np.max(disks):g}")
        return disks, [_lamp(sky, x, camera, space, weights) for x in sky.scene.lights]

    # Most of the time goes to compiling, of which a thread takes its share.
    with concurrent.futures.ThreadPoolExecutor(1) as other, _progress("sky") as tell:
        lit = other.submit(lights)
        if files.half:
            lit.result()
        picture = np.asarray(render(sky, camera, response, progress=tell))
        disks, lamps = lit.result()
    picture = picture + disks.astype(picture.dtype)

    header = _header(scene, solver, wavelength, lamps) | observed
    latlong = camera.width == 2 * camera.height and type(camera).__name__ == "LatLong"
    kind = {"half": files.half, "latlong": latlong, "attributes": header}
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


@dataclasses.dataclass(frozen=True)
class Lamp:
    """A light as the observer receives it, for a renderer that has directional lamps.

    Angles in degrees. On a plane that faces it: `power` in W m^-2 over the bands of all
    wavelengths (per nm if there is but one), `illuminance` in lux, and `colour` in the
    units of the picture times sr.
    """

    elevation: float
    azimuth: float
    power: float
    band: str
    illuminance: float | None
    colour: tuple[float, ...] | None

    def __str__(self) -> str:
        place = f"elevation {self.elevation:.3f}, azimuth {self.azimuth:.3f} degrees"
        text = f"sun: {place}\nlamp: {self.power:.5g} W/m2 {self.band}"
        if self.colour is None:
            return text
        values = ", ".join(f"{x:.5g}" for x in self.colour)
        return f"{text}, {self.illuminance:.5g} lux, colour ({values}) W/m2"

    def attributes(self, name: str) -> dict[str, Any]:
        """The same for the header of a file."""
        found = {
            "Elevation": self.elevation,
            "Azimuth": self.azimuth,
            "Irradiance": self.power,
            "Illuminance": self.illuminance,
            "Colour": self.colour,
        }
        return {f"{name}{key}": x for key, x in found.items() if x is not None}


def _lamp(sky: Any, light: Any, camera: "AbstractCamera", space: Any, weights: Any):
    import equinox as eqx
    import numpy as np

    from .rays import angles
    from .transport import direct_irradiance

    position = camera.position.astype(sky.wavelength.dtype)
    irradiance = eqx.filter_jit(direct_irradiance)
    found = irradiance(sky.scene, light, position, sky.wavelength)
    zenith, azimuth = angles(np.asarray(light.direction))
    values, bands = np.asarray(found, float), np.asarray(sky.wavelength, float)
    if bands.size == 1:
        power, band = float(values[0]), f"per nm at {bands[0]:g} nm"
    else:
        widths = np.gradient(bands)
        low, high = bands[0] - 0.5 * widths[0], bands[-1] + 0.5 * widths[-1]
        power, band = float(values @ widths), f"from {low:g} to {high:g} nm"
    if weights is None:
        return Lamp(90.0 - zenith, azimuth, power, band, None, None)
    xyz = found @ weights
    colour = tuple(float(x) for x in space.from_xyz(xyz))
    return Lamp(90.0 - zenith, azimuth, power, band, float(xyz[1]), colour)


def _header(
    scene: "Scene", solver: Any, wavelength: "np.ndarray", lamps: list[Lamp]
) -> dict[str, Any]:
    """What the picture shows and how it was made, for the header of the file."""
    from .scenefile import dump

    found = {
        "software": f"atmos {importlib.metadata.version('atmos')}",
        "scene": dump(scene),
        "solver": str(solver),
        "wavelengths": ",".join(f"{x:g}" for x in wavelength),
    }
    for i, lamp in enumerate(lamps):
        found |= lamp.attributes("sun" if i == 0 else f"sun{i + 1}")
    return found


def _write_table(
    output: Path | None,
    names: str,
    wavelength: Sequence[float],
    blocks: Iterator[tuple[Sequence[Any], Any]],
    count: int,
) -> None:
    """Writes rows as CSV, a line for each ray and wavelength."""
    import numpy as np

    from .image import whole_file

    bands = [f"{x:.10g}" for x in wavelength]

    def write(file):
        done = 0
        for columns, values in blocks:
            if done == 0:
                file.write(f"{names}\n")
            if not np.all(np.isfinite(values)):
                raise ValueError(f"`{names.split(',')[-1]}` is not finite somewhere.")
            digits = 17 if values.dtype == np.float64 else 9
            for *row, line in zip(*columns, values.tolist(), strict=True):
                start = ",".join(f"{x:.10g}" for x in row)
                for band, value in zip(bands, line, strict=False):
                    file.write(f"{start},{band},{value:.{digits}g}\n")
            done += len(values)
            tell(done / count)

    with _progress(names.split(",")[-1]) as tell:
        if output is None:
            write(sys.stdout)
            return
        with whole_file(output) as part, open(part, "w", newline="") as file:
            write(file)


@contextlib.contextmanager
def _progress(name: str) -> Iterator[Callable[[float], None]]:
    """A bar on the terminal, if there is one and the work takes more than a second."""
    if not sys.stderr.isatty():
        yield lambda done: None
        return
    from rich.console import Console
    from rich.progress import Progress

    bar = Progress(console=Console(stderr=True), transient=True)
    task = bar.add_task(name, total=1.0)
    late = threading.Timer(1.0, bar.start)
    late.start()
    try:
        yield lambda done: bar.update(task, completed=done)
    finally:
        late.cancel()
        late.join()
        if bar.live.is_started:
            bar.stop()


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line, and returns the exit code: 2 after bad input."""
    try:
        with warnings.catch_warnings():
            warnings.showwarning = _warn
            app(arguments, exit_on_error=False, print_error=False, verbose=False)
            sys.stdout.flush()
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:
        # Whoever read our output has enough; Python would complain when it closes it.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141
    except OSError as error:
        name = "" if error.filename is None else f"{error.filename}: "
        return _complain(f"{name}{error.strerror or error}")
    except (CycloptsError, ValueError) as error:
        return _complain(str(error))
    except MemoryError:
        return _complain("out of memory; ask for fewer pixels or wavelengths")
    return 0


def _complain(text: str) -> int:
    print(f"atmos: {' '.join(text.split())}", file=sys.stderr)
    return 2


def _warn(message: Any, *rest: Any) -> None:
    print(f"atmos: warning: {' '.join(str(message).split())}", file=sys.stderr)
