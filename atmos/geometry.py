"""The shape of the world: how high a point is, where up is, and what a ray crosses.

State is altitude, never distance from the planet's centre: in single precision the
difference of two radii has lost what matters near the ground and the horizon.
"""

import abc

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from .quantity import Angle, as_float, Direction, dot, Length, Number, Position, versine


# A distance beyond every world, yet with a square that single precision can hold.
FAR = 1e18
_TINY = 1e-12


class Point(eqx.Module):
    """A place in the world."""

    position: Position
    altitude: Length
    up: Direction


class Span(eqx.Module):
    """The part of a ray from `near` to `far` that lies in the air.

    `grounded` where it ends on the ground; near = far where it misses the air.
    """

    near: Length
    far: Length
    grounded: Bool[Array, ""]


class AbstractPath(eqx.Module):
    """A straight ray, and how its altitude changes along it."""

    start: eqx.AbstractVar[Point]
    direction: eqx.AbstractVar[Direction]

    @abc.abstractmethod
    def enter(self, top: Length) -> "AbstractPath":
        """The same ray from where it comes down to `top`; all of it, if it never does.

        It then starts exactly at `top`, from however far away it came.
        """

    @abc.abstractmethod
    def at(self, distance: Length) -> Point:
        """The place at this distance from the start."""

    @abc.abstractmethod
    def lowest(self) -> Length:
        """The distance at which altitude stops falling; negative if it never falls."""

    @abc.abstractmethod
    def crossings(self, altitude: Length) -> Float[Array, "2"]:
        """The distances, rising, at which the ray passes this altitude.

        If it never does, both are at the lowest place.
        """

    @abc.abstractmethod
    def span(self, top: Length) -> Span:
        """The part that lies between the ground and `top`, from the start onwards."""

    @abc.abstractmethod
    def shadow(self, sun: Direction, altitude: Length) -> Float[Array, "2"]:
        """The distances between which light from the sun has passed below `altitude`.

        With altitude 0: between which the world itself hides a point-like sun.
        """


class AbstractGeometry(eqx.Module):
    """The shape of the ground."""

    @abc.abstractmethod
    def locate(self, position: Position) -> Point:
        """Where is this position, seen from the ground?"""

    @abc.abstractmethod
    def path(self, start: Point, direction: Direction) -> AbstractPath:
        """The ray that leaves a point in a direction."""

    @abc.abstractmethod
    def dip(self, altitude: Length, height: Length) -> Angle:
        """How far below level one sees the edge of what lies at `height`; 0 from below.

        At height 0 that is the horizon.
        """


class Flat(AbstractGeometry):
    """Flat ground without end."""

    def locate(self, position: Position) -> Point:
        return Point(position, position[2], jnp.zeros_like(position).at[2].set(1.0))

    def path(self, start: Point, direction: Direction) -> "FlatPath":
        return FlatPath(start, direction)

    def dip(self, altitude: Length, height: Length) -> Angle:
        return jnp.zeros_like(altitude)


class FlatPath(AbstractPath):
    """A ray over flat ground."""

    start: Point
    direction: Direction

    @property
    def _slope(self) -> Number:
        # A level ray would never leave the air; this one does after a million depths.
        slope = self.direction[2]
        return jnp.where(
            jnp.abs(slope) < 1e-6, jnp.where(slope < 0, -1e-6, 1e-6), slope
        )

    def enter(self, top: Length) -> "FlatPath":
        start = self.start
        above = (start.altitude > top) & (self._slope < 0.0)
        near = jnp.where(above, self.crossings(top)[0], 0.0)
        altitude = jnp.where(above, top, start.altitude)
        position = start.position + near * self.direction
        return FlatPath(Point(position, altitude, start.up), self.direction)

    def at(self, distance: Length) -> Point:
        position = self.start.position + distance * self.direction
        altitude = self.start.altitude + distance * self._slope
        return Point(position, altitude, self.start.up)

    def lowest(self) -> Length:
        return jnp.where(self._slope < 0.0, FAR, -FAR)

    def crossings(self, altitude: Length) -> Float[Array, "2"]:
        distance = (altitude - self.start.altitude) / self._slope
        return jnp.stack([distance, distance])

    def span(self, top: Length) -> Span:
        ends = jnp.stack(
            [self.crossings(jnp.zeros_like(top))[0], self.crossings(top)[0]]
        )
        near = jnp.maximum(jnp.min(ends), 0.0)
        far = jnp.maximum(jnp.max(ends), near)
        return Span(near, far, self.direction[2] < 0.0)

    def shadow(self, sun: Direction, altitude: Length) -> Float[Array, "2"]:
        begins = jnp.where(sun[2] > 0.0, FAR, -FAR)
        return jnp.stack([begins, jnp.full_like(begins, FAR)])


class Spherical(AbstractGeometry):
    """A round planet; the origin is on the ground, the centre at `(0, 0, -radius)`."""

    radius: Length = eqx.field(converter=as_float)

    def locate(self, position: Position) -> Point:
        x, y, z = position
        from_centre = position.at[2].add(self.radius)
        distance = jnp.sqrt(x * x + y * y + from_centre[2] * from_centre[2])
        # |p - c| - radius, without the cancellation, and z itself above the origin.
        w = from_centre[2]
        altitude = jnp.where(w >= 0.0, z, -z - 2.0 * self.radius) + (x * x + y * y) / (
            distance + jnp.abs(w)
        )
        return Point(position, altitude, from_centre / distance)

    def path(self, start: Point, direction: Direction) -> "SphericalPath":
        rise = (self.radius + start.altitude) * dot(start.up, direction)
        return SphericalPath(start, direction, self.radius, rise)

    def dip(self, altitude: Length, height: Length) -> Angle:
        squared = (altitude - height) * (altitude + height + 2.0 * self.radius)
        above = squared > 0.0
        tangent = jnp.where(above, jnp.sqrt(jnp.where(above, squared, 1.0)), 0.0)
        return jnp.arctan2(tangent, self.radius + height)


class SphericalPath(AbstractPath):
    """A ray over a round planet.

    `rise` is the distance from the place nearest to the planet's centre to the start.
    """

    start: Point
    direction: Direction
    radius: Length
    rise: Length

    @property
    def _from_centre(self) -> Length:
        return self.radius + self.start.altitude

    def enter(self, top: Length) -> "SphericalPath":
        start, r = self.start, self._from_centre
        # How low it will come, from the sine and the cosine at the start: from space
        # the sine has digits that one minus the square of the cosine has lost.
        across = jnp.cross(start.up, self.direction)
        squared = dot(across, across)
        aside = squared > 0.0
        sine = jnp.where(aside, jnp.sqrt(jnp.where(aside, squared, 1.0)), 0.0)
        cosine = self.rise / r
        low = start.altitude * sine - self.radius * cosine * cosine / (1.0 + sine)
        chord = (top - low) * (top + low + 2.0 * self.radius)
        enters = (start.altitude > top) & (self.rise < 0.0) & (chord > 0.0)
        half = jnp.where(enters, jnp.sqrt(jnp.where(enters, chord, 1.0)), 0.0)
        position = start.position + jnp.maximum(-half - self.rise, 0.0) * self.direction
        from_centre = position.at[2].add(self.radius)
        up = from_centre / jnp.sqrt(dot(from_centre, from_centre))
        inner = Point(position, top, up), -half
        outer = self.start, self.rise
        start, rise = jax.tree.map(lambda x, y: jnp.where(enters, x, y), inner, outer)
        return SphericalPath(start, self.direction, self.radius, rise)

    def at(self, distance: Length) -> Point:
        r = self._from_centre
        q = distance * (distance + 2.0 * self.rise)
        altitude = self.start.altitude + q / (jnp.sqrt(r * r + q) + r)
        position = self.start.position + distance * self.direction
        up = position.at[2].add(self.radius) / (self.radius + altitude)
        return Point(position, altitude, up)

    def lowest(self) -> Length:
        return -self.rise

    def crossings(self, altitude: Length) -> Float[Array, "2"]:
        return self._meet(altitude)[0]

    def _meet(self, altitude: Length) -> tuple[Float[Array, "2"], Bool[Array, ""]]:
        b, h = self.rise, self.start.altitude
        c = (h - altitude) * (h + altitude + 2.0 * self.radius)
        discriminant = b * b - c
        hit = discriminant > 0.0
        root = jnp.where(hit, jnp.sqrt(jnp.where(hit, discriminant, 1.0)), 0.0)
        roots = _roots(b, c, root, jnp.ones_like(b))
        return jnp.where(hit, roots, -b), hit

    def span(self, top: Length) -> Span:
        (enter, leave), crosses = self._meet(top)
        (ground, _), hits = self._meet(jnp.zeros_like(top))
        grounded = hits & (self.rise < 0.0)
        near = jnp.maximum(jnp.where(crosses, enter, 0.0), 0.0)
        far = jnp.where(grounded, ground, jnp.where(crosses, leave, near))
        return Span(near, jnp.maximum(far, near), grounded)

    def shadow(self, sun: Direction, altitude: Length) -> Float[Array, "2"]:
        # The shadow is a cylinder of the planet's radius that starts at its centre.
        apart = versine(self.direction, sun)
        along = 1.0 - apart
        ahead = self._from_centre * dot(self.start.up, sun)
        h = self.start.altitude
        a = jnp.maximum(apart * (2.0 - apart), _TINY)
        b = self.rise - ahead * along
        c = (h - altitude) * (h + altitude + 2.0 * self.radius) - ahead * ahead
        discriminant = b * b - a * c
        inside = discriminant > 0.0
        root = jnp.where(inside, jnp.sqrt(jnp.where(inside, discriminant, 1.0)), 0.0)
        enter, leave = _roots(b, c, root, a)
        steep = jnp.where(
            jnp.abs(along) < _TINY, jnp.where(along < 0, -_TINY, _TINY), along
        )
        half = -ahead / steep
        begins = jnp.where(steep < 0.0, jnp.maximum(enter, half), enter)
        ends = jnp.where(steep < 0.0, leave, jnp.minimum(leave, half))
        lit = ~inside | (begins >= ends)
        return jnp.where(lit, FAR, jnp.stack([begins, ends]))


def _roots(b: Length, c: Number, root: Length, a: Number) -> Float[Array, "2"]:
    """The rising roots of `a x^2 + 2 b x + c`, given `root = sqrt(b^2 - a c)`."""
    q = -b - jnp.where(b >= 0.0, root, -root)
    zero = q == 0.0
    one = q / a
    other = jnp.where(zero, 0.0, c / jnp.where(zero, 1.0, q))
    return jnp.stack([jnp.minimum(one, other), jnp.maximum(one, other)])
