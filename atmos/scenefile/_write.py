import dataclasses
import json
import math
from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import msgspec
import numpy as np

from .. import light, medium, particle, phase, spectrum
from ..camera import AbstractCamera
from ..geometry import Flat, Spherical
from ..particle import ozone, surface
from ..quantity import deg
from ..rays import angles, decimals
from ..reference import solar_irradiance
from ..scene import Scene
from ._base import Kind
from ._cameras import written
from ._errors import short, under
from ._phases import Angles
from ._scene import Medium, Planet, Sun
from ._spectra import Molecules, MoleculesDepolarise, Ozone, Solar, Tabulated


GUIDE = """\
# A scene for atmos. Lengths are in m, wavelengths in nm, coefficients in 1/m, angles in
# degrees. Nothing is left of a medium above `top`.
#
# [planet]   shape = "spherical" (with a `radius`) or "flat". ground_albedo: a spectrum,
#            or "grass", "soil", "sand", "snow", "sea", "asphalt", "concrete", "mars".
# [sun]      zenith: the angle from straight up; azimuth: clockwise from north.
#            irradiance: a spectrum, in W m^-2 nm^-1 on a plane that faces the sun, or
#            { kind = "solar", bandwidth, distance }: the real one, averaged over bands
#            of so many nm, at a distance in astronomical units. With angular_radius 0
#            it is a point. Several suns: [[sun]] instead, one after the other.
# [[medium]] Any number of them. `scattering`, `absorption` or both; or `extinction` and
#            `single_scattering_albedo`. They are spectra, where the profile is 1.
#   profile  { kind = "exponential", scale_height }
#            { kind = "tent", centre, half_width }
#            { kind = "uniform", bottom, top }
#            { kind = "table", altitude, value }: straight lines, and nothing outside
#            { kind = "standard_atmosphere" }: the air of 1976, 1 at the ground
#            { kind = "height_fog", top, scale_height }: 1 up to the top
#            { kind = "everywhere" }
#            { kind = "ball", centre, radius }
#            { kind = "box", lower, upper }
#            { kind = "grid", values, lower, upper }: values[x][y][z] in a box
#            { kind = "file", file, grid, factor }: a grid by its name in an OpenVDB
#            file (.vdb) or a NumPy archive (.npz, with arrays `lower` and `upper`)
#            { kind = "noise", size, level, softness, octaves, seed }: clouds, 0 to 1
#            { kind = "puff", centre, radius, size, roughness, softness, octaves, seed }
#            { kind = "transformed", of, matrix, offset }: `of` is a profile, `matrix`
#            has three rows of three numbers
#            { kind = "product", one, other }: of two profiles, to bound noise by a box
#            { kind = "sampled", of, lower, upper, cells }: a grid, of so many cells
#            along x, y and z of a box, of a profile: quicker than noise
#   phase    { kind = "isotropic" }
#            { kind = "rayleigh", depolarisation }
#            { kind = "henyey_greenstein", g }
#            { kind = "double_henyey_greenstein", forward, backward, weight }
#            { kind = "cornette_shanks", g }
#            { kind = "draine", g, alpha }
#            { kind = "empirical_mie", z }
#            { kind = "table", cosine, value }: relative, cosines from -1 to 1; with a
#            list `wavelength`, each `value` is a list, a number for each of these
# Spectra    A number; { kind = "power_law", value, exponent, at }; or
#            { kind = "table", wavelength, value, outside }: straight lines, and beyond
#            them outside = "refuse", "zero" or "hold", or numbers, `below` and `above`.
#            { kind = "molecules", gas = "air" or "carbon_dioxide", number_density } is
#            a `scattering`, and without number_density (1/m^3) a `depolarisation`.
#            { kind = "ozone", number_density } is an `absorption`.
# Emission   A medium with an `emission` shines: a spectrum, in W m^-2 sr^-1 nm^-1 per m
#            where the profile is 1; or { kind = "blackbody", temperature }: a profile
#            in K; it shines as it absorbs.
# Colour     A medium with an `extinction` and a profile of kind "file" may have a
#            `colour`: the name of a grid of red, green and blue in the same file, the
#            share that scatters.
# Camera     [camera] says what pictures show, if there is one; options may change it.
#            { kind = "perspective", position, azimuth, elevation, field_of_view,
#            height, width }: from side to side, in degrees, and pixels;
#            { kind = "latlong", position, height, centre_azimuth }: all directions;
#            { kind = "fisheye", position, height, angle_of_view, top_azimuth }
# Presets    A medium may be as short as this: preset = "air"; preset = "ozone", with a
#            `column` in Dobson units; preset = "continental_clean" or another aerosol
#            (see `atmos sky --help`), with an `optical_depth` or a `visibility`.
"""


def dump(
    scene: Scene, names: Sequence[str] = (), camera: AbstractCamera | None = None
) -> str:
    """The text of a scene file, of which `parse` makes the same scene.

    Numbers have as many digits as their precision holds. `names` are for the media, in
    order. `parse_camera` makes the `camera` of it again. Raises `ValueError` for what
    a scene file has no words for.
    """
    shape = scene.geometry
    if not isinstance(shape, Spherical | Flat):
        raise ValueError(f"`geometry` must be spherical or flat; got {shape!r}.")
    planet = Planet(
        shape="spherical" if isinstance(shape, Spherical) else "flat",
        radius=_number(shape.radius) if isinstance(shape, Spherical) else None,
        top=_number(scene.top),
        ground_albedo=_described("planet.ground_albedo", scene.ground, _ground),
    )
    suns = [_described(f"lights[{i}]", sun, _sun) for i, sun in enumerate(scene.lights)]
    media = []
    for i, x in enumerate(scene.media):
        media.append(_described(f"media[{i}]", x, _medium))
        media[-1].name = names[i] if i < len(names) else None
    tables: list[tuple[str, Any]] = [("planet", planet), *(("sun", x) for x in suns)]
    if camera is not None:
        tables.insert(0, ("camera", written(camera)))
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


def _described(key: str, value: Any, how: Any) -> Any:
    with under(key):
        return how(value)


def _number(value: Any) -> Any:
    """Nested lists of the shortest numbers that are these in their own precision."""
    array = np.asarray(value)
    if array.ndim:
        return [_number(x) for x in array]
    number: Any = array[()]
    return float(np.format_float_scientific(number))


_WRITTEN: dict[type, type[Kind]] = {
    x.makes: x for x in Kind.__subclasses__() if x.makes is not None
}


def _table(value: Any) -> Any:
    """A profile, a phase function or a spectrum as a table, or as a number."""
    if isinstance(value, spectrum.Constant):
        return _number(value.value)
    if isinstance(value, int):
        return value
    if isinstance(value, medium.Glow):
        return _table(value.spectrum)
    if isinstance(value, eqx.Module) and type(value) in _WRITTEN:
        fields = [getattr(value, x.name) for x in dataclasses.fields(value)]
        return _WRITTEN[type(value)](*map(_table, fields))
    if isinstance(value, spectrum.Tabulated):
        knots, values = _number(value.knots), _number(value.values)
        below, above = (
            None if x is None else _number(x) for x in (value.below, value.above)
        )
        if below == values[0] and above == values[-1]:
            return Tabulated(knots, values, outside="hold")
        return Tabulated(knots, values, below=below, above=above)
    if isinstance(value, spectrum.BandAverage):
        return _solar(value) or Tabulated(
            *map(_number, (value.knots, value.values)),
            bandwidth=_number(value.bandwidth),
        )
    if isinstance(value, particle.Scattering):
        gas, co2 = _of_gas(value.gas)
        return Molecules(gas, _number(value.number_density), co2)
    if isinstance(value, particle.Depolarisation):
        return MoleculesDepolarise(*_of_gas(value.gas))
    if isinstance(value, phase.Tabulated):
        cosine = (1.0 - np.asarray(value.versine, float))[::-1]
        rows = np.asarray(value.value)[::-1]
        if value.wavelength is None:
            return Angles(_number(cosine), _number(rows[:, 0]))
        return Angles(_number(cosine), _number(rows), _number(value.wavelength))
    if isinstance(value, spectrum.Product):
        return _product(value)
    if isinstance(value, jax.Array | np.ndarray):
        return _number(value)
    raise ValueError(
        f"must be something that a scene file has words for; got {short(value)}."
    )


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
        times: Any = lambda x: None if x is None else factor.value * x
        if _alike(other, ozone.cross_section()):
            return Ozone(_number(factor.value))
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
    raise ValueError(
        f"must be something that a scene file has words for; got {short(value)}."
    )


def _solar(value: spectrum.BandAverage) -> Solar | None:
    """The sun's spectrum, if it is that."""
    knots, irradiance = solar_irradiance()
    if value.knots.shape != knots.shape:
        return None
    bandwidth, total = _number(value.bandwidth), np.sum(np.asarray(value.values, float))
    distance = math.sqrt(np.sum(irradiance) / total) if total > 0.0 else 0.0
    for digits in range(3, 10):
        found = Solar(bandwidth, round(distance, digits))
        if found.distance > 0.0 and _alike(value, found.build()):
            return found
    return None


def _ground(value: spectrum.AbstractSpectrum) -> Any:
    for name in surface.NAMES:
        if _alike(value, surface.albedo(name)):
            return name
    return _table(value)


def _sun(sun: light.Sun) -> Sun:
    zenith, azimuth = angles(np.asarray(sun.direction))
    radius = np.asarray(sun.angular_radius)
    degrees = math.degrees(float(radius))
    shorter = lambda n: round(degrees, n)
    return Sun(
        zenith=zenith,
        azimuth=azimuth,
        irradiance=_described("irradiance", sun.irradiance, _table),
        angular_radius=shorter(decimals(lambda n: shorter(n) * deg, radius)),
    )


def _medium(value: medium.Medium) -> Medium:
    found = _passive(value)
    if value.emission is not None:
        found.emission = _described("emission", value.emission, _table)
    return found


def _passive(value: medium.Medium) -> Medium:
    profile = _described("profile", value.profile, _table)
    if value.scattering is None:
        absorption = _described("absorption", value.absorption, _table)
        return Medium(absorption=absorption, profile=profile)
    shape = _described("phase", value.phase, _table)
    taken, rest = value.scattering, value.absorption
    if isinstance(taken, spectrum.Product) and _alike(
        rest, spectrum.Product(taken.one, spectrum.Complement(taken.other))
    ):
        return Medium(
            extinction=_described("scattering", taken.one, _table),
            single_scattering_albedo=_described("scattering", taken.other, _table),
            profile=profile,
            phase=shape,
        )
    absorbs = not _alike(rest, spectrum.Constant(0.0))
    return Medium(
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
