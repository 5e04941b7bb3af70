"""What the options say of the camera."""

import dataclasses
import math
from typing import Annotated, Any, Literal

import numpy as np

from ..camera import AbstractCamera, Fisheye, LatLong, Perspective
from ..quantity import deg
from ._app import HIGHEST, numbers_option, option, real, refuse, whole


# The largest picture is 32768 pixels high.
_MOST_PIXELS = 2**15


@dataclasses.dataclass(frozen=True)
class View:
    """What the picture shows; what is not said is as the scene file's camera has it."""

    projection: Annotated[
        Literal["latlong", "fisheye", "perspective"] | None,
        option(
            "Kind of picture.  [default: that of the scene file's camera, as "
            "everything here, or latlong]"
        ),
    ] = None
    height: Annotated[
        int | None, whole("Rows of pixels.  [default: 512]", 1, _MOST_PIXELS)
    ] = None
    width: Annotated[
        int | None,
        whole(
            "Columns of pixels, in perspective.  [default: 3/2 of the height]",
            1,
            _MOST_PIXELS,
        ),
    ] = None
    altitude: Annotated[
        float | None,
        real("Of the observer, above the ground.  [default: 2]", 0, HIGHEST, "METRES"),
    ] = None
    position: Annotated[
        tuple[float, ...] | None,
        numbers_option(
            "EAST,NORTH,UP of the observer in m from the origin, instead of that.",
            -HIGHEST,
            HIGHEST,
            "above the origin",
        ),
    ] = None
    azimuth: Annotated[
        float | None,
        real(
            "Clockwise from north: where the centre of the picture looks; in a fisheye "
            "its top.  [default: 0]",
            -360,
            360,
            "DEGREES",
            name=("--azimuth", "--center-azimuth", "--centre-azimuth"),
        ),
    ] = None
    elevation: Annotated[
        float | None,
        real("Above level, in perspective.  [default: 15]", -90, 90, "DEGREES"),
    ] = None
    field_of_view: Annotated[
        float | None,
        real(
            "From side to side: in perspective below 180  [default: 60], in a fisheye "
            "up to 360  [default: 180].",
            1e-3,
            360,
            "DEGREES",
        ),
    ] = None

    def camera(self, own: AbstractCamera | None = None) -> AbstractCamera:
        """The camera that takes it: `own`, but for what is asked for."""
        if self.altitude is not None and self.position is not None:
            refuse("--altitude", "must not stand beside --position")
        said = {name: x for name, x in vars(self).items() if x is not None}
        if own is None or not said:
            return own or self._camera()
        known = _known(own)
        if self.projection not in (None, known["projection"]):
            known = {"position": known["position"]}
        if self.height is not None and "width" in known:
            known["width"] = max(1, round(own.width / own.height * self.height))
        return View(**(known | said))._camera()

    def _camera(self) -> AbstractCamera:
        projection = self.projection or "latlong"
        for name, value in {
            "--width": self.width,
            "--elevation": self.elevation,
        }.items():
            if value is not None and projection != "perspective":
                refuse(name, "is for --projection perspective alone")
        if self.field_of_view is not None and projection == "latlong":
            refuse("--field-of-view", "is not for --projection latlong")
        place = np.array(self.position or (0.0, 0.0, 2.0))
        if place.size != 3:
            refuse("--position", "must be three numbers", place.tolist())
        if self.altitude is not None:
            place[2] = self.altitude
        height, azimuth = self.height or 512, (self.azimuth or 0.0) * deg
        if projection == "latlong":
            return LatLong(place, height, azimuth)
        if projection == "fisheye":
            return Fisheye(place, height, (self.field_of_view or 180.0) * deg, azimuth)
        angle = self.field_of_view or 60.0
        if angle >= 180.0:
            refuse("--field-of-view", "must be below 180 in perspective", angle)
        return Perspective(
            position=place,
            azimuth=azimuth,
            elevation=(15.0 if self.elevation is None else self.elevation) * deg,
            field_of_view=angle * deg,
            height=height,
            width=self.width or max(1, round(1.5 * height)),
        )


def _known(camera: AbstractCamera) -> dict[str, Any]:
    """A camera, as options would say it."""
    x, y, z = (float(x) for x in camera.position)
    found: dict[str, Any] = {"position": (x, y, z), "height": camera.height}
    degrees = lambda angle: math.degrees(float(angle))
    if isinstance(camera, LatLong):
        azimuth = degrees(camera.centre_azimuth)
        return found | {"projection": "latlong", "azimuth": azimuth}
    if isinstance(camera, Fisheye):
        return found | {
            "projection": "fisheye",
            "azimuth": degrees(camera.top_azimuth),
            "field_of_view": degrees(camera.angle_of_view),
        }
    assert isinstance(camera, Perspective)
    return found | {
        "projection": "perspective",
        "width": camera.width,
        "azimuth": degrees(camera.azimuth),
        "elevation": degrees(camera.elevation),
        "field_of_view": degrees(camera.field_of_view),
    }
