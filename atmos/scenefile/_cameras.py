from typing import Annotated

import msgspec
import numpy as np

from .. import camera
from ..quantity import deg
from ._base import degrees, Kind, Turn
from ._profiles import Place


# The largest picture is 32768 pixels high.
Pixels = Annotated[int, msgspec.Meta(ge=1, le=2**15)]


class LatLong(Kind, tag="latlong"):
    """All directions, twice as wide as high."""

    position: Place
    height: Pixels = 512
    centre_azimuth: Turn = 0.0

    def build(self) -> camera.LatLong:
        place = np.array(self.position, float)
        return camera.LatLong(place, self.height, self.centre_azimuth * deg)


class Fisheye(Kind, tag="fisheye"):
    """A disk around straight up."""

    position: Place
    height: Pixels = 512
    angle_of_view: Annotated[float, msgspec.Meta(gt=0, le=360)] = 180.0
    top_azimuth: Turn = 0.0

    def build(self) -> camera.Fisheye:
        place = np.array(self.position, float)
        angles = self.angle_of_view * deg, self.top_azimuth * deg
        return camera.Fisheye(place, self.height, *angles)


class Perspective(Kind, tag="perspective"):
    """As one sees it; without a `width`, half as wide again as high."""

    position: Place
    azimuth: Turn = 0.0
    elevation: Annotated[float, msgspec.Meta(ge=-90, le=90)] = 0.0
    field_of_view: Annotated[float, msgspec.Meta(gt=0, lt=180)] = 60.0
    height: Pixels = 512
    width: Pixels | None = None

    def build(self) -> camera.Perspective:
        return camera.Perspective(
            position=np.array(self.position, float),
            azimuth=self.azimuth * deg,
            elevation=self.elevation * deg,
            field_of_view=self.field_of_view * deg,
            height=self.height,
            width=self.width or max(1, round(1.5 * self.height)),
        )


Camera = LatLong | Fisheye | Perspective


def written(value: camera.AbstractCamera) -> Camera:
    """The table of a camera; raises `ValueError` for one without words."""
    x, y, z = np.asarray(value.position)
    place = float(x), float(y), float(z)
    if isinstance(value, camera.LatLong):
        return LatLong(place, value.height, degrees(value.centre_azimuth))
    if isinstance(value, camera.Fisheye):
        angle, top = map(degrees, (value.angle_of_view, value.top_azimuth))
        return Fisheye(place, value.height, angle, top)
    if isinstance(value, camera.Perspective):
        return Perspective(
            place,
            azimuth=degrees(value.azimuth),
            elevation=degrees(value.elevation),
            field_of_view=degrees(value.field_of_view),
            height=value.height,
            width=value.width,
        )
    raise ValueError(f"`camera` must be one that a scene file knows; got {value!r}.")
