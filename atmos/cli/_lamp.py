"""The sun as a lamp for other renderers; what the header of a picture says."""

import contextlib
import dataclasses
import importlib.metadata
from typing import Any

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Array, Float

from ..camera import AbstractCamera
from ..light import Sun
from ..quantity import Irradiance, Position
from ..rays import angles
from ..scene import Scene
from ..scenefile import dump
from ..sky import AbstractSky


_MOST_NUMBERS = 100_000  # in the header of a picture


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


def measure_lamp(
    sky: AbstractSky,
    light: Sun,
    camera: AbstractCamera,
    weights: Float[Array, "wl 3"] | None,
    response: Float[Array, "wl 3"] | None,
) -> Lamp:
    """What a light gives the observer.

    Where known, `weights` are those of XYZ, and `response` those of the picture.
    """
    position = camera.position.astype(sky.wavelength.dtype)
    found = _beam(sky, light, position)
    zenith, azimuth = angles(np.asarray(light.direction))
    values, bands = np.asarray(found, float), np.asarray(sky.wavelength, float)
    if bands.size == 1:
        power, band = float(values[0]), f"per nm at {bands[0]:g} nm"
    else:
        widths = np.gradient(bands)
        low, high = bands[0] - 0.5 * widths[0], bands[-1] + 0.5 * widths[-1]
        power, band = float(values @ widths), f"from {low:g} to {high:g} nm"
    if weights is None or response is None:
        return Lamp(90.0 - zenith, azimuth, power, band, None, None)
    illuminance = float(values @ np.asarray(weights)[:, 1])
    colour = tuple((values @ np.asarray(response)).tolist())
    return Lamp(90.0 - zenith, azimuth, power, band, illuminance, colour)


@eqx.filter_jit
def _beam(sky: AbstractSky, light: Sun, position: Position) -> Irradiance:
    return sky.beam(light, position)


def described(scene: Scene, camera: AbstractCamera) -> dict[str, str]:
    """What the header says of a scene: a scene file."""
    # A cloud of millions of cells is no text; some things have no words.
    if sum(x.size for x in jax.tree.leaves(scene)) <= _MOST_NUMBERS:
        with contextlib.suppress(ValueError):
            return {"scene": dump(scene, camera=camera)}
    return {}


def header(wavelength: np.ndarray, lamps: list[Lamp]) -> dict[str, Any]:
    """What all pictures say of how they were made, for the header of the file."""

    found: dict[str, Any] = {
        "software": f"atmos {importlib.metadata.version('atmos')}",
        "wavelengths": ",".join(f"{x:g}" for x in wavelength),
    }
    for i, lamp in enumerate(lamps):
        found |= lamp.attributes("sun" if i == 0 else f"sun{i + 1}")
    return found
