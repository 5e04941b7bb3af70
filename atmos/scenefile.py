"""A scene as a TOML file, read strictly, and written so that it reads back the same.

Lengths are in m, wavelengths in nm, coefficients in m^-1, angles in degrees. What the
tables may hold is what the classes below say; the words are those of `atmos.medium`,
`atmos.phase` and `atmos.spectrum`, and so is their meaning.
"""

import contextlib
import dataclasses
import json
import math
import os
import re
import tomllib
from collections.abc import Iterator, Sequence
from typing import Annotated, Any, ClassVar, Literal, NoReturn

import equinox as eqx
import jax
import msgspec
import numpy as np

from . import light, medium, particle, phase, spectrum
from .geometry import AbstractGeometry, Flat, Spherical
from .medium import Medium
from .particle import aerosol as particles, ozone as ozone_layer, surface
from .phase._check import check_between
from .quantity import deg
from .rays import direction
from .reference import solar_irradiance
from .scene import air, haze, ozone, Scene


# More than this, in size, single precision cannot hold.
_LARGEST = 3.4e38

_Above0 = Annotated[float, msgspec.Meta(gt=0)]
_AtLeast0 = Annotated[float, msgspec.Meta(ge=0)]
_Wavelength = Annotated[float, msgspec.Meta(ge=100, le=1e5)]


class _Table(msgspec.Struct, forbid_unknown_fields=True):
    """A table of the file, its keys in the order of the fields of what it makes."""

    makes: ClassVar[type | None] = None

    def build(self) -> Any:
        assert self.makes is not None
        parts = [_build(name, getattr(self, name)) for name in self.__struct_fields__]
        with _renamed(self.makes, type(self)):
            return self.makes(*parts)


class _Kind(_Table, tag_field="kind"):
    """A table that says in `kind` what it is."""


class _Constant(_Kind, tag="constant"):
    makes = spectrum.Constant
    value: float


class _PowerLaw(_Kind, tag="power_law"):
    makes = spectrum.PowerLaw
    value: float
    exponent: float
    at: _Wavelength = 550.0


class _Tabulated(_Kind, tag="table"):
    """Beyond the table one of `outside`, or the numbers `below` and `above`.

    With a `bandwidth` it is averaged over so many nm around each wavelength.
    """

    wavelength: list[_Wavelength]
    value: list[float]
    outside: Literal["refuse", "zero", "hold"] | None = None
    below: float | None = None
    above: float | None = None
    bandwidth: _Above0 | None = None

    def build(self) -> spectrum.AbstractSpectrum:
        ends = self.below, self.above
        beyond = self.outside is not None or ends != (None, None)
        if self.outside is not None and ends != (None, None):
            _refuse("outside", "must not stand beside `below` and `above`")
        if self.bandwidth is not None and beyond:
            _refuse("bandwidth", "must not stand beside what is `outside`")
        if self.outside == "zero":
            ends = 0.0, 0.0
        elif self.outside == "hold" and self.value:
            ends = self.value[0], self.value[-1]
        knots, values = np.array(self.wavelength), np.array(self.value)
        with _renamed(spectrum.Tabulated, _Tabulated):
            if self.bandwidth is not None:
                return spectrum.BandAverage(knots, values, self.bandwidth)
            return spectrum.Tabulated(knots, values, *ends)


class _Solar(_Kind, tag="solar"):
    """The sun's spectrum (ASTM G173-03) at a distance in astronomical units."""

    bandwidth: _Above0 = 10.0
    distance: _Above0 = 1.0

    def build(self) -> spectrum.BandAverage:
        return light.sunlight(self.bandwidth, self.distance)


def _gas(name: str, co2: float | None) -> particle.AbstractGas:
    if name == "air":
        return particle.Air() if co2 is None else particle.Air(co2)
    if co2 is not None:
        _refuse("co2", "is the share of it in air; leave it out here", co2)
    return particle.CarbonDioxide()


class _Molecules(_Kind, tag="molecules"):
    """What `number_density` molecules in a cubic metre scatter."""

    gas: Literal["air", "carbon_dioxide"]
    number_density: _AtLeast0 = particle.gas.STANDARD_DENSITY
    co2: float | None = None

    def build(self) -> particle.Scattering:
        return particle.Scattering(_gas(self.gas, self.co2), self.number_density)


class _MoleculesDepolarise(_Kind, tag="molecules"):
    """How they depolarise the light."""

    gas: Literal["air", "carbon_dioxide"]
    co2: float | None = None

    def build(self) -> particle.Depolarisation:
        return particle.Depolarisation(_gas(self.gas, self.co2))


class _Ozone(_Kind, tag="ozone"):
    """What `number_density` molecules of ozone in a cubic metre absorb."""

    number_density: _AtLeast0

    def build(self) -> spectrum.Product:
        most = spectrum.Constant(self.number_density)
        return spectrum.Product(most, ozone_layer.cross_section())


_Spectrum = float | _Constant | _PowerLaw | _Tabulated


class _Exponential(_Kind, tag="exponential"):
    makes = medium.Exponential
    scale_height: _Above0


class _Tent(_Kind, tag="tent"):
    makes = medium.Tent
    centre: float
    half_width: _Above0


class _Uniform(_Kind, tag="uniform"):
    makes = medium.Uniform
    bottom: float
    top: float


class _Levels(_Kind, tag="table"):
    makes = medium.Tabulated
    altitude: list[float]
    value: list[_AtLeast0]


class _StandardAtmosphere(_Kind, tag="standard_atmosphere"):
    makes = medium.StandardAtmosphere


class _Ball(_Kind, tag="ball"):
    makes = medium.Ball
    centre: tuple[float, float, float]
    radius: _Above0


class _Grid(_Kind, tag="grid"):
    makes = medium.Grid
    values: list[list[list[_AtLeast0]]]
    lower: tuple[float, float, float]
    upper: tuple[float, float, float]


_Profile = (
    _Exponential | _Tent | _Uniform | _Levels | _StandardAtmosphere | _Ball | _Grid
)


class _Isotropic(_Kind, tag="isotropic"):
    makes = phase.Isotropic


class _Rayleigh(_Kind, tag="rayleigh"):
    makes = phase.Rayleigh
    depolarisation: _Spectrum | _MoleculesDepolarise = 0.0


class _HenyeyGreenstein(_Kind, tag="henyey_greenstein"):
    makes = phase.HenyeyGreenstein
    g: _Spectrum


class _DoubleHenyeyGreenstein(_Kind, tag="double_henyey_greenstein"):
    makes = phase.DoubleHenyeyGreenstein
    forward: _Spectrum
    backward: _Spectrum
    weight: _Spectrum


class _Draine(_Kind, tag="draine"):
    makes = phase.Draine
    g: _Spectrum
    alpha: _Spectrum


class _CornetteShanks(_Kind, tag="cornette_shanks"):
    g: _Spectrum

    def build(self) -> phase.Draine:
        return _Draine(self.g, 1.0).build()


class _EmpiricalMie(_Kind, tag="empirical_mie"):
    makes = phase.EmpiricalMie
    z: _Spectrum


class _Angles(_Kind, tag="table"):
    """A row of `value` for each cosine: a number, or one for each wavelength."""

    cosine: list[float]
    value: list[float | list[float]]
    wavelength: list[_Wavelength] | None = None

    def build(self) -> phase.Tabulated:
        try:
            value = np.array(self.value, float)
        except ValueError:
            _refuse("value", "must have rows that are alike in length")
        return phase.Tabulated(np.array(self.cosine), value, self.wavelength)


_Phase = (
    _Isotropic
    | _Rayleigh
    | _HenyeyGreenstein
    | _DoubleHenyeyGreenstein
    | _Draine
    | _CornetteShanks
    | _EmpiricalMie
    | _Angles
)


class _Planet(_Table, kw_only=True):
    shape: Literal["spherical", "flat"]
    radius: _Above0 | None = None
    top: _Above0
    ground_albedo: float | str | _Constant | _PowerLaw | _Tabulated = 0.0

    def geometry(self) -> AbstractGeometry:
        if self.shape == "flat":
            return Flat()
        if self.radius is None:
            _refuse("radius", "is missing; a spherical planet needs one, in m")
        if self.radius < self.top:
            _refuse("radius", f"must be above `top`, {self.top} m", self.radius)
        return Spherical(self.radius)

    def ground(self) -> spectrum.AbstractSpectrum:
        if not isinstance(self.ground_albedo, str):
            return _within("ground_albedo", self.ground_albedo, 0.0, 1.0)
        if self.ground_albedo not in surface.NAMES:
            names = ", ".join(surface.NAMES)
            _refuse("ground_albedo", f"must be one of {names}", self.ground_albedo)
        return surface.albedo(self.ground_albedo)


class _Sun(_Table, kw_only=True):
    zenith: Annotated[float, msgspec.Meta(ge=0, le=180)]
    azimuth: float = 0.0
    irradiance: _Spectrum | _Solar
    angular_radius: Annotated[float, msgspec.Meta(ge=0, lt=90)] = (
        light.SOLAR_RADIUS / deg
    )

    def build(self) -> light.Sun:
        irradiance = _within("irradiance", self.irradiance, 0.0)
        towards = direction(self.zenith, self.azimuth)
        return light.Sun(towards, irradiance, self.angular_radius * deg)


class _Medium(_Table):
    """Either a `preset`, or a profile, coefficients where it is 1, and a phase."""

    name: str | None = None
    scattering: _Spectrum | _Molecules | None = None
    absorption: _Spectrum | _Ozone | None = None
    extinction: _Spectrum | None = None
    single_scattering_albedo: _Spectrum | None = None
    profile: _Profile | None = None
    phase: _Phase | None = None
    preset: str | None = None
    column: _AtLeast0 | None = None
    optical_depth: _AtLeast0 | None = None
    visibility: _Above0 | None = None

    def build(self) -> Medium:
        if self.preset is not None:
            return self._ready_made(self.preset)
        self._alone("column", "optical_depth", "visibility", beside="no `preset`")
        if self.profile is None:
            _refuse("profile", "is missing")
        profile = _build("profile", self.profile)
        shape = None if self.phase is None else _build("phase", self.phase)
        scatters = self.scattering is not None or self.extinction is not None
        if scatters and shape is None:
            _refuse("phase", "is missing; whatever scatters needs one")
        if self.extinction is not None:
            self._alone("scattering", "absorption", beside="`extinction`")
            albedo = self.single_scattering_albedo
            if albedo is None:
                _refuse("single_scattering_albedo", "is missing beside `extinction`")
            albedo = _within("single_scattering_albedo", albedo, 0.0, 1.0)
            extinction = _within("extinction", self.extinction, 0.0)
            assert shape is not None
            return medium.of_extinction(extinction, albedo, profile, shape)
        self._alone("single_scattering_albedo", beside="no `extinction`")
        parts = {
            name: _within(name, value, 0.0)
            for name in ("scattering", "absorption")
            if (value := getattr(self, name)) is not None
        }
        if not parts:
            _refuse("scattering", "is missing, and so are `absorption`, `extinction`")
        return Medium(profile, **parts, phase=shape or phase.Isotropic())

    def _ready_made(self, preset: str) -> Medium:
        own = {"air": (), "ozone": ("column",)}
        own = own.get(preset, ("optical_depth", "visibility"))
        free = {"name", "preset", *own}
        others = [x for x in self.__struct_fields__ if x not in free]
        self._alone(*others, beside=f'`preset = "{preset}"`')
        if preset == "air":
            return air()
        if preset == "ozone":
            return ozone(300.0 if self.column is None else self.column)
        if preset not in particles.NAMES:
            names = ", ".join(["air", "ozone", *particles.NAMES])
            _refuse("preset", f"must be one of {names}", preset)
        return haze(opac(preset, self.optical_depth, self.visibility))

    def _alone(self, *names: str, beside: str) -> None:
        for name in names:
            if getattr(self, name) is not None:
                _refuse(name, f"must not stand beside {beside}")


class _File(_Table):
    planet: _Planet
    sun: _Sun | list[_Sun]
    medium: list[_Medium] = []

    def build(self) -> Scene:
        suns = {"sun": self.sun}
        if isinstance(self.sun, list):
            suns = {f"sun[{i}]": x for i, x in enumerate(self.sun)}
        media = {f"medium[{i}]": x for i, x in enumerate(self.medium)}
        with _under("planet"):
            geometry, ground = self.planet.geometry(), self.planet.ground()
        return Scene(
            geometry,
            self.planet.top,
            tuple(_build(key, x) for key, x in media.items()),
            tuple(_build(key, x) for key, x in suns.items()),
            ground,
        )


def load(path: str | os.PathLike[str]) -> Scene:
    """Reads a scene file.

    Raises `ValueError` naming the file, the key, the rule and the value where it is not
    TOML, or not a scene; `OSError` where it cannot be read.
    """
    with open(path, "rb") as file:
        raw = file.read()
    with _of_file(os.fspath(path)):
        return parse(raw.decode())


def parse(text: str) -> Scene:
    """The scene that the text of a scene file describes.

    Raises `ValueError` naming the key, the rule and the value.
    """
    try:
        raw = tomllib.loads(text)
        _check_finite(raw, "")
        tables = msgspec.convert(raw, _File)
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"must be TOML: {error}") from error
    except msgspec.ValidationError as error:
        raise ValueError(_explained(str(error), raw)) from error
    except RecursionError as error:
        raise ValueError("must be TOML without deep nesting") from error
    return tables.build()


def dump(scene: Scene, names: Sequence[str] = ()) -> str:
    """The text of a scene file, of which `parse` makes the same scene.

    Numbers have as many digits as their precision holds. `names` are for the media, in
    order. Raises `ValueError` for what a scene file has no words for.
    """
    round_ = isinstance(scene.geometry, Spherical)
    planet = _Planet(
        shape="spherical" if round_ else "flat",
        radius=_number(scene.geometry.radius) if round_ else None,
        top=_number(scene.top),
        ground_albedo=_described("planet.ground_albedo", scene.ground, _ground),
    )
    suns = [_described(f"lights[{i}]", sun, _sun) for i, sun in enumerate(scene.lights)]
    media = []
    for i, x in enumerate(scene.media):
        media.append(_described(f"media[{i}]", x, _medium))
        media[-1].name = names[i] if i < len(names) else None
    tables = [("planet", planet), *(("sun", x) for x in suns)]
    many = [] if len(suns) == 1 else ["sun"]
    text = "" if suns else "sun = []\n\n"
    for name, table in [*tables, *(("medium", x) for x in media)]:
        listed = name == "medium" or name in many
        text += f"[[{name}]]\n" if listed else f"[{name}]\n"
        for key, value in msgspec.to_builtins(table).items():
            if value is not None:
                text += f"{key} = {_toml(value)}\n"
        text += "\n"
    return text


def opac(
    name: str, optical_depth: float | None = None, visibility: float | None = None
) -> particle.Aerosol:
    """An aerosol of OPAC, of which there is as much as one of the two says.

    The optical depth is that at 550 nm, the visibility is in m. Raises `ValueError` for
    an unknown name, for both, and for an amount out of range.
    """
    found = particles.opac(name)
    if optical_depth is not None and visibility is not None:
        _refuse("visibility", "must not stand beside `optical_depth`")
    if visibility is not None:
        amount = particles.optical_depth(visibility, found.scale_height)
    elif optical_depth is not None:
        amount = optical_depth
    else:
        return found
    return dataclasses.replace(found, optical_depth=amount)


# Reading: every error begins with the key that it is about.


def _refuse(key: str, rule: str, value: object = None) -> NoReturn:
    got = "" if value is None else f"; got {_short(value)}"
    raise ValueError(f"`{key}` {rule}{got}.")


def _build(key: str, value: Any) -> Any:
    with _under(key):
        return value.build() if isinstance(value, _Table) else _array(value)


def _array(value: Any) -> Any:
    return np.array(value) if isinstance(value, list | tuple) else value


def _within(
    key: str, value: Any, low: float, high: float = math.inf
) -> spectrum.AbstractSpectrum:
    found = spectrum.as_spectrum(_build(key, value))
    leading = found
    if isinstance(found, spectrum.PowerLaw):
        leading, high = spectrum.Constant(found.value), math.inf
    elif isinstance(found, spectrum.BandAverage):
        leading = spectrum.Tabulated(found.knots, found.values)
    check_between(key, leading, low, high)
    return found


@contextlib.contextmanager
def _under(key: str) -> Iterator[None]:
    try:
        yield
    except ValueError as error:
        text = str(error)
        inner = text[1:] if text.startswith("`") else f"`: {text}"
        dot = "." if text.startswith("`") else ""
        raise ValueError(f"`{key}{dot}{inner}") from error


@contextlib.contextmanager
def _renamed(makes: type, table: type[_Table]) -> Iterator[None]:
    """Errors about the fields of an object become errors about the keys of a table."""
    theirs = [x.name for x in dataclasses.fields(makes)]
    names = dict(zip(theirs, table.__struct_fields__, strict=False))
    try:
        yield
    except ValueError as error:
        swap = lambda found: f"`{names.get(found[1], found[1])}`"
        raise ValueError(re.sub(r"`(\w+)`", swap, str(error))) from error


@contextlib.contextmanager
def _of_file(name: str) -> Iterator[None]:
    try:
        yield
    except UnicodeDecodeError as error:
        raise ValueError(f"{name}: must be text in UTF-8; {error}.") from error
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from error


def _check_finite(value: Any, key: str) -> None:
    if isinstance(value, dict):
        for name, x in value.items():
            _check_finite(x, f"{key}.{name}" if key else name)
    elif isinstance(value, list):
        for i, x in enumerate(value):
            _check_finite(x, f"{key}[{i}]")
    elif isinstance(value, int | float) and not abs(value) <= _LARGEST:
        _refuse(key, "must be a finite number", value)


def _explained(message: str, raw: dict[str, Any]) -> str:
    """What msgspec found wrong, as key, rule and value."""
    rule, _, path = message.partition(" - at `$")
    key = path.rstrip("`").removeprefix(".")
    node, value = _find(msgspec.inspect.type_info(_File), raw, key)
    own = re.search(r"`(.*)`", rule)
    full = ".".join(x for x in [key, own[1] if own else ""] if x)
    if "unknown field" in rule:
        known = ", ".join(x.encode_name for x in node.fields)
        return f"`{full}` is not known; known there: {known}."
    if "missing required field" in rule:
        return f"`{full}` is missing."
    choices = list(getattr(node, "values", ()))
    if key.endswith("kind"):
        choices = [x.tag for x in _structs(node)]
    if choices:
        return f"`{key}` must be one of {', '.join(map(str, choices))}; got {value!r}."
    rule = rule.removeprefix("Expected ").split(", got")[0].replace("`", "")
    for theirs, ours in _WORDS.items():
        rule = re.sub(theirs, ours, rule)
    return f"`{key}` must be {rule}; got {_short(value)}."


_WORDS = {
    r" \| null": "",
    r" \| ": " or ",
    r"\bfloat\b": "a number",
    r"\bstr\b": "a text",
    r"\bobject\b": "a table",
    r"\barray\b": "a list",
    r" > ": " above ",
    r" < ": " below ",
    r" >= (\S+)": r" of \1 or more",
    r" <= (\S+)": r" of \1 or less",
    r"(\d)\.0\b": r"\1",
}


def _find(node: Any, value: Any, key: str) -> tuple[Any, Any]:
    """What a key may be, and what it is."""
    for step in re.findall(r"[^.\[\]]+", key):
        fields = {x.encode_name: x.type for x in getattr(node, "fields", ())}
        if step == "kind":
            return node, value.get("kind")
        if isinstance(value, dict):
            node, value = fields[step], value[step]
        else:
            node, value = getattr(node, "item_type", node), value[int(step)]
        if isinstance(value, dict):
            fits = [x for x in _structs(node) if x.tag in (None, value.get("kind"))]
            node = fits[0] if fits else node
        elif isinstance(value, list):
            lists = [x for x in getattr(node, "types", ()) if hasattr(x, "item_type")]
            node = lists[0] if lists else node
    return node, value


def _structs(node: Any) -> list[Any]:
    return [x for x in getattr(node, "types", [node]) if hasattr(x, "fields")]


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) < 80 else f"{text[:77]}..."


# Writing.


def _described(key: str, value: Any, how: Any) -> Any:
    with _under(key):
        return how(value)


def _number(value: Any) -> Any:
    """Nested lists of the shortest numbers that are these in their own precision."""
    array = np.asarray(value)
    if array.ndim:
        return [_number(x) for x in array]
    return float(str(array[()]))


_WRITTEN: dict[type, type[_Kind]] = {
    x.makes: x for x in _Kind.__subclasses__() if x.makes is not None
}


def _table(value: Any) -> Any:
    """A profile, a phase function or a spectrum as a table, or as a number."""
    if isinstance(value, spectrum.Constant):
        return _number(value.value)
    if isinstance(value, eqx.Module) and type(value) in _WRITTEN:
        fields = [getattr(value, x.name) for x in dataclasses.fields(value)]
        return _WRITTEN[type(value)](*map(_table, fields))
    if isinstance(value, spectrum.Tabulated):
        knots, values = _number(value.knots), _number(value.values)
        below, above = (
            None if x is None else _number(x) for x in (value.below, value.above)
        )
        if below == values[0] and above == values[-1]:
            return _Tabulated(knots, values, outside="hold")
        return _Tabulated(knots, values, below=below, above=above)
    if isinstance(value, spectrum.BandAverage):
        return _solar(value) or _Tabulated(
            *map(_number, (value.knots, value.values)),
            bandwidth=_number(value.bandwidth),
        )
    if isinstance(value, particle.Scattering):
        gas, co2 = _of_gas(value.gas)
        return _Molecules(gas, _number(value.number_density), co2)
    if isinstance(value, particle.Depolarisation):
        return _MoleculesDepolarise(*_of_gas(value.gas))
    if isinstance(value, phase.Tabulated):
        cosine = (1.0 - np.asarray(value.versine, float))[::-1]
        rows = np.asarray(value.value)[::-1]
        if value.wavelength is None:
            return _Angles(_number(cosine), _number(rows[:, 0]))
        return _Angles(_number(cosine), _number(rows), _number(value.wavelength))
    if isinstance(value, spectrum.Product):
        return _product(value)
    if isinstance(value, jax.Array | np.ndarray):
        return _number(value)
    raise ValueError(f"must be what a scene file has words for; got {value!r}")


def _of_gas(gas: particle.AbstractGas) -> tuple[Any, float | None]:
    if isinstance(gas, particle.Air):
        return "air", _number(gas.co2)
    if isinstance(gas, particle.CarbonDioxide):
        return "carbon_dioxide", None
    raise ValueError(f"`gas` must be one that a scene file knows; got {gas!r}")


def _product(value: spectrum.Product) -> Any:
    factor, other = value.one, value.other
    if isinstance(other, spectrum.Constant):
        factor, other = other, factor
    if isinstance(factor, spectrum.Constant):
        times = lambda x: None if x is None else factor.value * x
        if _alike(other, ozone_layer.cross_section()):
            return _Ozone(_number(factor.value))
        if isinstance(other, spectrum.Constant):
            return _number(times(other.value))
        if isinstance(other, spectrum.PowerLaw):
            return _table(dataclasses.replace(other, value=times(other.value)))
        if isinstance(other, spectrum.Tabulated):
            return _table(
                spectrum.Tabulated(
                    other.knots,
                    times(other.values),
                    *map(times, (other.below, other.above)),
                )
            )
    raise ValueError(f"must be what a scene file has words for; got {value!r}")


def _solar(value: spectrum.BandAverage) -> _Solar | None:
    """The sun's spectrum, if it is that."""
    knots, irradiance = solar_irradiance()
    if value.knots.shape != knots.shape:
        return None
    bandwidth = _number(value.bandwidth)
    distance = float(
        np.sqrt(np.sum(irradiance) / np.sum(np.asarray(value.values, float)))
    )
    for digits in range(3, 10):
        found = _Solar(bandwidth, round(distance, digits))
        if found.distance > 0.0 and _alike(value, found.build()):
            return found
    return None


def _ground(value: spectrum.AbstractSpectrum) -> Any:
    for name in surface.NAMES:
        if _alike(value, surface.albedo(name)):
            return name
    return _table(value)


def _sun(sun: light.Sun) -> _Sun:
    towards = np.asarray(sun.direction)
    x, y, z = (float(a) for a in towards)
    zenith = math.degrees(math.atan2(math.hypot(x, y), z))
    azimuth = math.degrees(math.atan2(x, y)) % 360.0
    digits = _digits(lambda n: direction(round(zenith, n), round(azimuth, n)), towards)
    radius = np.asarray(sun.angular_radius)
    degrees = math.degrees(float(radius))
    return _Sun(
        zenith=round(zenith, digits),
        azimuth=round(azimuth, digits),
        irradiance=_described("irradiance", sun.irradiance, _table),
        angular_radius=round(
            degrees, _digits(lambda n: round(degrees, n) * deg, radius)
        ),
    )


def _digits(made: Any, wanted: np.ndarray) -> int:
    """The fewest decimals that make what is wanted, to rounding."""
    near = np.finfo(wanted.dtype).eps * np.max(np.abs(wanted))
    for digits in range(3, 17):
        if np.all(np.abs(made(digits) - wanted) <= near):
            return digits
    return 17


def _medium(value: Medium) -> _Medium:
    profile = _described("profile", value.profile, _table)
    if value.scattering is None:
        absorption = _described("absorption", value.absorption, _table)
        return _Medium(absorption=absorption, profile=profile)
    shape = _described("phase", value.phase, _table)
    taken, rest = value.scattering, value.absorption
    if isinstance(taken, spectrum.Product) and _alike(
        rest, spectrum.Product(taken.one, spectrum.Complement(taken.other))
    ):
        return _Medium(
            extinction=_described("scattering", taken.one, _table),
            single_scattering_albedo=_described("scattering", taken.other, _table),
            profile=profile,
            phase=shape,
        )
    absorbs = not _alike(rest, spectrum.Constant(0.0))
    return _Medium(
        scattering=_described("scattering", taken, _table),
        absorption=_described("absorption", rest, _table) if absorbs else None,
        profile=profile,
        phase=shape,
    )


def _alike(a: Any, b: Any) -> bool:
    """Whether these are the same, but for the rounding of numbers."""
    if jax.tree.structure(a) != jax.tree.structure(b):
        return False
    for x, y in zip(jax.tree.leaves(a), jax.tree.leaves(b), strict=True):
        near = 4.0 * float(max(np.finfo(x.dtype).eps, np.finfo(y.dtype).eps))
        x, y = np.asarray(x, float), np.asarray(y, float)
        if x.shape != y.shape or not np.allclose(x, y, rtol=near, atol=0.0):
            return False
    return True


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        pairs = [f"{k} = {_toml(x)}" for k, x in value.items() if x is not None]
        return f"{{ {', '.join(pairs)} }}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_toml, value))}]"
    return json.dumps(value) if isinstance(value, str) else repr(value)
