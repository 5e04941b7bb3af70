import json
from collections.abc import Sequence
from typing import Any

import msgspec
import numpy as np

from .. import light, medium, spectrum, surface
from ..camera import AbstractCamera
from ..geometry import Flat, Spherical
from ..rays import angles
from ..scene import Scene
from ._base import degrees
from ._cameras import written
from ._errors import under
from ._lights import Spot, Sun
from ._scene import Medium, Planet
from ._surfaces import Surface
from ._words import albedo_written, alike, number, table


def dump(
    scene: Scene, names: Sequence[str] = (), camera: AbstractCamera | None = None
) -> str:
    """The text of a scene file, of which `parse` makes the same scene.

    Numbers have as many digits as their precision holds. `names` are for the media, in
    order. `parse_camera` makes the `camera` of it again. Raises `ValueError` for what
    a scene file has no words for. Suns come before other lights in a file.
    """
    shape = scene.geometry
    if not isinstance(shape, Spherical | Flat):
        raise ValueError(f"`geometry` must be spherical or flat; got {shape!r}.")
    planet = Planet(
        shape="spherical" if isinstance(shape, Spherical) else "flat",
        radius=number(shape.radius) if isinstance(shape, Spherical) else None,
        top=number(scene.top),
        ground_albedo=_described("planet.ground_albedo", scene.ground, albedo_written),
    )
    found = [_described(f"lights[{i}]", x, _light) for i, x in enumerate(scene.lights)]
    suns = [x for x in found if isinstance(x, Sun)]
    media = [_described(f"media[{i}]", x, _medium) for i, x in enumerate(scene.media)]
    for x, name in zip(media, names, strict=False):
        x.name = name
    solid = enumerate(scene.surfaces)
    parts = {
        "camera": [] if camera is None else [written(camera)],
        "planet": [planet],
        "sun": suns,
        "light": [x for x in found if not isinstance(x, Sun)],
        "surface": [_described(f"surfaces[{i}]", x, _surface) for i, x in solid],
        "medium": media,
    }
    text = "" if found else "sun = []\n\n"
    for name, tables in parts.items():
        listed = name in ("light", "surface", "medium") or len(tables) > 1
        for one in tables:
            text += f"[[{name}]]\n" if listed else f"[{name}]\n"
            for key, value in msgspec.to_builtins(one).items():
                if value is not None:
                    text += f"{key} = {_toml(value)}\n"
            text += "\n"
    return text


def _described(key: str, value: Any, how: Any) -> Any:
    with under(key):
        return how(value)


def _light(value: light.AbstractLight) -> Any:
    if isinstance(value, light.Sun):
        return _sun(value)
    if isinstance(value, light.Spot):
        return _spot(value)
    if isinstance(value, light.Surrounding):
        raise ValueError(
            "must be a sun, a lamp or a spot: what lies all around is read from a "
            "file, and which one is not known any more; got Surrounding."
        )
    return table(value)


def _sun(sun: light.Sun) -> Sun:
    zenith, azimuth = angles(np.asarray(sun.direction))
    return Sun(
        zenith=zenith,
        azimuth=azimuth,
        irradiance=_described("irradiance", sun.irradiance, table),
        angular_radius=degrees(sun.angular_radius),
    )


def _spot(spot: light.Spot) -> Spot:
    return Spot(
        position=number(spot.position),
        direction=number(spot.direction),
        intensity=_described("intensity", spot.intensity, table),
        inner=degrees(spot.inner),
        outer=degrees(spot.outer),
    )


def _surface(value: surface.Surface) -> Surface:
    return Surface(
        shape=_described("shape", value.shape, table),
        material=_described("material", value.material, table),
    )


def _medium(value: medium.Medium) -> Medium:
    found = _passive(value)
    if value.emission is not None:
        found.emission = _described("emission", value.emission, table)
    return found


def _passive(value: medium.Medium) -> Medium:
    profile = _described("profile", value.profile, table)
    if value.scattering is None:
        absorption = _described("absorption", value.absorption, table)
        return Medium(absorption=absorption, profile=profile)
    shape = _described("phase", value.phase, table)
    taken, rest = value.scattering, value.absorption
    if isinstance(taken, spectrum.Product) and alike(
        rest, spectrum.Product(taken.one, spectrum.Complement(taken.other))
    ):
        return Medium(
            extinction=_described("scattering", taken.one, table),
            single_scattering_albedo=_described("scattering", taken.other, table),
            profile=profile,
            phase=shape,
        )
    absorbs = not alike(rest, spectrum.Constant(0.0))
    return Medium(
        scattering=_described("scattering", taken, table),
        absorption=_described("absorption", rest, table) if absorbs else None,
        profile=profile,
        phase=shape,
    )


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        pairs = [f"{k} = {_toml(x)}" for k, x in value.items() if x is not None]
        return f"{{ {', '.join(pairs)} }}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_toml, value))}]"
    return json.dumps(value) if isinstance(value, str) else repr(value)
