"""Cameras: which way each place of a picture looks.

Places are counted in pixels, x to the right and y down from the corner at the top left:
the centre of a pixel lies at half integers. Azimuths are clockwise from north. Pictures
show the world as one sees it, never mirrored: facing north, east is to the right.
"""

import abc
import math
import numbers
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, ArrayLike, Bool, Float

from .quantity import Angle, as_float, deg, Direction, Number, Position


class AbstractCamera(eqx.Module):
    """A place to look from, and a way of laying directions out in a picture."""

    position: eqx.AbstractVar[Position]
    height: eqx.AbstractVar[int]
    width: eqx.AbstractVar[int]

    @abc.abstractmethod
    def direction(self, x: Number, y: Number) -> Direction:
        """Where one place of the picture looks: x to the right, y down, in pixels."""

    @abc.abstractmethod
    def solid_angle(self, x: Number, y: Number) -> Number:
        """What a pixel with its centre there sees of the sphere, in sr."""

    @abc.abstractmethod
    def angles(
        self,
    ) -> tuple[Float[Array, "#height #width"], Float[Array, "#height #width"]]:
        """The zenith angles and the azimuths of all pixel centres, in rad.

        An axis along which an angle does not change has length 1.
        """

    @abc.abstractmethod
    def sees(self) -> Bool[Array, "#height #width"]:
        """Which pixels belong to the picture; the others are to be black."""


class LatLong(AbstractCamera):
    """All directions: zenith in the top row, nadir in the bottom row, twice as wide.

    The centre of the picture looks towards `centre_azimuth`, and azimuth grows to the
    right. Mitsuba, OpenEXR and USD put their axis +Z at the centre, +X a quarter from
    the left and +Y at the top; with the centre at north these are north, west and up.
    Blender puts +X at the centre and +Y a quarter from the left; with the centre at 90
    degrees these are east and north.

    Pixel centres lie half a pixel inside the edges on all sides. Blender reads pictures
    like that; Mitsuba takes the centres of the first and the last row to lie on the
    poles, and so shows everything up to half a pixel nearer to them.
    """

    position: Position = eqx.field(converter=as_float)
    height: int = eqx.field(static=True)
    width: int = eqx.field(static=True)
    centre_azimuth: Angle = eqx.field(converter=as_float)

    def __init__(
        self,
        position: ArrayLike,
        height: int,
        centre_azimuth: ArrayLike = 0.0,
    ):
        self.position = as_float(position)
        self.height = height
        self.width = 2 * height
        self.centre_azimuth = as_float(centre_azimuth)

    def __check_init__(self):
        _check_finite("position", self.position, (3,))
        _check_size("height", self.height)
        _check_finite("centre_azimuth", self.centre_azimuth, ())

    def direction(self, x: Number, y: Number) -> Direction:
        elevation = (0.5 * self.height - y) * (math.pi / self.height)
        azimuth = self._azimuth(x)
        level = jnp.cos(elevation)
        return jnp.stack(
            [level * jnp.sin(azimuth), level * jnp.cos(azimuth), jnp.sin(elevation)]
        )

    def solid_angle(self, x: Number, y: Number) -> Number:
        # Exact for the whole pixel, so that the picture adds to the sphere.
        del x
        side = math.pi / self.height
        return 2.0 * math.sin(0.5 * side) * side * jnp.sin(y * side)

    def angles(self) -> tuple[Float[Array, "height 1"], Float[Array, "1 width"]]:
        rows, columns = _rows(self), _columns(self)
        return rows * (math.pi / self.height), self._azimuth(columns)

    def sees(self) -> Bool[Array, "1 1"]:
        return jnp.ones((1, 1), bool)

    def _azimuth(self, x: Float[Array, "..."]) -> Float[Array, "..."]:
        return self.centre_azimuth + (x - self.height) * (math.pi / self.height)


class Fisheye(AbstractCamera):
    """The sky as one lies on one's back: a disk, equal angles from the zenith outward.

    The zenith is at the centre, `top_azimuth` (north) at the top, and what is clockwise
    from it (east) to the left. The rim of the disk is half of `angle_of_view` from the
    zenith: the horizon at 180 degrees, the nadir at 360. Nothing is seen outside it.
    """

    position: Position = eqx.field(converter=as_float)
    height: int = eqx.field(static=True)
    width: int = eqx.field(static=True)
    angle_of_view: Angle = eqx.field(converter=as_float)
    top_azimuth: Angle = eqx.field(converter=as_float)

    def __init__(
        self,
        position: ArrayLike,
        size: int,
        angle_of_view: ArrayLike = math.pi,
        top_azimuth: ArrayLike = 0.0,
    ):
        self.position = as_float(position)
        self.height = self.width = size
        self.angle_of_view = as_float(angle_of_view)
        self.top_azimuth = as_float(top_azimuth)

    def __check_init__(self):
        _check_finite("position", self.position, (3,))
        _check_size("size", self.height)
        _check_angle(
            "angle_of_view",
            self.angle_of_view,
            lambda angle: 0.0 < angle <= 360.0,
            "be above 0 and at most 360",
        )
        _check_finite("top_azimuth", self.top_azimuth, ())

    def direction(self, x: Number, y: Number) -> Direction:
        left, up = self._from_centre(x), self._from_centre(y)
        zenith = self._zenith(left, up)
        scale = 0.5 * self.angle_of_view * jnp.sinc(zenith / math.pi)
        north, east = jnp.cos(self.top_azimuth), jnp.sin(self.top_azimuth)
        return jnp.stack(
            [
                scale * (up * east + left * north),
                scale * (up * north - left * east),
                jnp.cos(zenith),
            ]
        )

    def solid_angle(self, x: Number, y: Number) -> Number:
        zenith = self._zenith(self._from_centre(x), self._from_centre(y))
        return (self.angle_of_view / self.width) ** 2 * jnp.sinc(zenith / math.pi)

    def angles(
        self,
    ) -> tuple[Float[Array, "height width"], Float[Array, "height width"]]:
        left, up = self._from_centre(_columns(self)), self._from_centre(_rows(self))
        return self._zenith(left, up), self.top_azimuth + jnp.arctan2(left, up)

    def sees(self) -> Bool[Array, "height width"]:
        left, up = self._from_centre(_columns(self)), self._from_centre(_rows(self))
        return left * left + up * up <= 1.0

    def _from_centre(self, x: Float[Array, "..."]) -> Float[Array, "..."]:
        return (0.5 * self.width - x) / (0.5 * self.width)

    def _zenith(
        self, left: Float[Array, "..."], up: Float[Array, "..."]
    ) -> Float[Array, "..."]:
        return 0.5 * self.angle_of_view * _length(left, up)


class Perspective(AbstractCamera):
    """A pinhole camera held level, looking towards `azimuth` and `elevation`.

    `field_of_view` is the horizontal one, from the left edge to the right edge. Pixels
    are square.
    """

    position: Position = eqx.field(converter=as_float)
    azimuth: Angle = eqx.field(converter=as_float)
    elevation: Angle = eqx.field(converter=as_float)
    field_of_view: Angle = eqx.field(converter=as_float)
    height: int = eqx.field(static=True)
    width: int = eqx.field(static=True)

    def __check_init__(self):
        _check_finite("position", self.position, (3,))
        _check_finite("azimuth", self.azimuth, ())
        _check_angle(
            "elevation",
            self.elevation,
            lambda angle: -90.0 <= angle <= 90.0,
            "lie between -90 and 90",
        )
        _check_angle(
            "field_of_view",
            self.field_of_view,
            lambda angle: 0.0 < angle < 180.0,
            "be above 0 and below 180",
        )
        _check_size("height", self.height)
        _check_size("width", self.width)

    def direction(self, x: Number, y: Number) -> Direction:
        right, down = self._slopes(x, y)
        north, east = jnp.cos(self.azimuth), jnp.sin(self.azimuth)
        level, rise = jnp.cos(self.elevation), jnp.sin(self.elevation)
        ahead = level + down * rise
        towards = jnp.stack(
            [
                ahead * east + right * north,
                ahead * north - right * east,
                rise - down * level,
            ]
        )
        return towards / jnp.sqrt(1.0 + right * right + down * down)

    def solid_angle(self, x: Number, y: Number) -> Number:
        right, down = self._slopes(x, y)
        stretch = 1.0 + right * right + down * down
        return self._pixel() ** 2 / (stretch * jnp.sqrt(stretch))

    def angles(
        self,
    ) -> tuple[Float[Array, "height width"], Float[Array, "height width"]]:
        across = jax.vmap(self.direction, (0, None))
        picture = jax.vmap(across, (None, 0))(_columns(self)[0, :], _rows(self)[:, 0])
        east, north, up = jnp.moveaxis(picture, -1, 0)
        level = _length(east, north)
        upright = level == 0.0
        azimuth = jnp.arctan2(east, jnp.where(upright, 1.0, north))
        return jnp.arctan2(level, up), azimuth

    def sees(self) -> Bool[Array, "1 1"]:
        return jnp.ones((1, 1), bool)

    def _pixel(self) -> Number:
        return jnp.tan(0.5 * self.field_of_view) / (0.5 * self.width)

    def _slopes(self, x: Number, y: Number) -> tuple[Number, Number]:
        pixel = self._pixel()
        return (x - 0.5 * self.width) * pixel, (y - 0.5 * self.height) * pixel


def _rows(camera: AbstractCamera) -> Float[Array, "height 1"]:
    return jnp.arange(camera.height, dtype=camera.position.dtype)[:, None] + 0.5


def _columns(camera: AbstractCamera) -> Float[Array, "1 width"]:
    return jnp.arange(camera.width, dtype=camera.position.dtype)[None, :] + 0.5


def _length(a: Float[Array, "..."], b: Float[Array, "..."]) -> Float[Array, "..."]:
    square = a * a + b * b
    some = square > 0.0
    return jnp.where(some, jnp.sqrt(jnp.where(some, square, 1.0)), 0.0)


def _check_size(name: str, value: int) -> None:
    whole = isinstance(value, numbers.Integral) and not isinstance(value, bool)
    if not (whole and value >= 1):
        raise ValueError(f"`{name}` must be a whole number, 1 or more; got {value!r}.")


def _check_finite(name: str, value: Array, shape: tuple[int, ...]) -> None:
    if value.shape != shape:
        raise ValueError(f"`{name}` must have the shape {shape}; got {value.shape}.")
    if not isinstance(value, Tracer) and not np.all(np.isfinite(value)):
        raise ValueError(f"`{name}` must be finite; got {value}.")


def _check_angle(
    name: str, value: Array, allows: Callable[[float], bool], rule: str
) -> None:
    _check_finite(name, value, ())
    if isinstance(value, Tracer):
        return
    degrees = round(float(value) / deg, 4)  # 90 * deg is above 90 in single precision
    if not allows(degrees):
        raise ValueError(f"`{name}` must {rule} degrees; got {degrees:g} degrees.")
