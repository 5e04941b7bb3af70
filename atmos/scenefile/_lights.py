from typing import Annotated

import msgspec
import numpy as np

from .. import light
from ..quantity import deg
from ..rays import direction
from ..surroundings import of_exr
from ._base import Kind, Table, Turn, unit, within
from ._errors import refuse, spelt, under
from ._profiles import located, Place
from ._spectra import Solar, Spectrum


Half = Annotated[float, msgspec.Meta(ge=0, le=180)]


class Sun(Table, kw_only=True):
    zenith: Half
    azimuth: float = 0.0
    irradiance: Spectrum | Solar
    angular_radius: Annotated[float, msgspec.Meta(ge=0, lt=90)] = (
        light.SOLAR_RADIUS / deg
    )

    def build(self) -> light.Sun:
        irradiance = within("irradiance", self.irradiance, 0.0)
        towards = direction(self.zenith, self.azimuth)
        return light.Sun(towards, irradiance, self.angular_radius * deg)


class Lamp(Kind, tag="lamp"):
    makes = light.Lamp
    position: Place
    intensity: Spectrum | Solar

    def build(self) -> light.Lamp:
        place = np.array(self.position)
        return light.Lamp(place, within("intensity", self.intensity, 0.0))


class Spot(Kind, tag="spot"):
    """Shines in a `direction` of any length; `inner` and `outer` count from there."""

    position: Place
    direction: Place
    intensity: Spectrum | Solar
    inner: Half
    outer: Half

    def build(self) -> light.Spot:
        if self.outer <= self.inner:
            refuse("outer", f"must be above `inner`, {self.inner} degrees", self.outer)
        return light.Spot(
            np.array(self.position),
            unit("direction", self.direction),
            within("intensity", self.intensity, 0.0),
            self.inner * deg,
            self.outer * deg,
        )


class Surrounding(Kind, tag="surrounding"):
    """A spectral OpenEXR picture of all directions; its centre is at an azimuth."""

    file: str
    centre_azimuth: Turn = 0.0

    def build(self) -> light.Surrounding:
        names = {"file.path": "file", "file.picture": "file", "file.knots": "file"}
        with spelt(names), under("file"), located(self.file) as path:
            return of_exr(path, self.centre_azimuth * deg)


Light = Lamp | Spot | Surrounding
