"""The suns for which diffuse light is worked out."""

import abc
import math

import equinox as eqx
import jax.numpy as jnp
from jax.lax import stop_gradient
from jaxtyping import Array, Float, Int

from ..geometry import Point
from ..light import Sun
from ..quantity import Angle, deg, Direction, dot


# The distance from a zenith angle within which others lie evenly.
CLOSE = 6.0 * deg


class AbstractSuns(eqx.Module):
    """The zenith angles of the sun for which the light is known."""

    @abc.abstractmethod
    def zeniths(self) -> Float[Array, "sun"]:
        """In rad."""

    @abc.abstractmethod
    def between(
        self, light: Sun, zenith: Float[Array, "*n"]
    ) -> tuple[Int[Array, "*n"], Float[Array, "*n k"]]:
        """The first of those to mix, and how much of each, where a light stands so."""

    def near(
        self, light: Sun, point: Point
    ) -> tuple[Int[Array, "k"], Float[Array, "k"]]:
        """Those to mix, and how much of each, where a place sees the light."""
        zenith = zenith_angle(point.up, light.direction)
        first, weights = self.between(light, zenith)
        return first + jnp.arange(len(weights), dtype=jnp.int32), weights


class FlatSuns(AbstractSuns):
    """In a flat world a light stands alike everywhere."""

    lights: Float[Array, "sun"]

    def zeniths(self) -> Float[Array, "sun"]:
        return self.lights

    def between(
        self, light: Sun, zenith: Float[Array, "*n"]
    ) -> tuple[Int[Array, "*n"], Float[Array, "*n 1"]]:
        which = jnp.broadcast_to(_nearest(self.lights, light), zenith.shape)
        return which, jnp.ones_like(zenith)[..., None]


class EverySun(AbstractSuns):
    """The zenith angles from 0 to `last`, for suns that stand anywhere.

    They crowd where the sun sets, and are joined by straight lines, which never fall
    below what they join.
    """

    last: Angle
    count: int = eqx.field(static=True)

    def _ends(self) -> tuple[float, Array]:
        high = jnp.arcsinh((self.last - 0.5 * math.pi) / CLOSE)
        return math.asinh(-0.5 * math.pi / CLOSE), high

    def zeniths(self) -> Float[Array, "sun"]:
        low, high = self._ends()
        t = jnp.linspace(0.0, 1.0, self.count, dtype=self.last.dtype)
        found = 0.5 * math.pi + CLOSE * jnp.sinh(low + (high - low) * t)
        return jnp.clip(found, 0.0, self.last)

    def between(
        self, light: Sun, zenith: Float[Array, "*n"]
    ) -> tuple[Int[Array, "*n"], Float[Array, "*n 2"]]:
        low, high = self._ends()
        t = jnp.arcsinh((jnp.minimum(zenith, self.last) - 0.5 * math.pi) / CLOSE)
        t = jnp.clip((t - low) / (high - low), 0.0, 1.0) * (self.count - 1)
        first = jnp.clip(jnp.floor(stop_gradient(t)), 0.0, self.count - 2.0)
        weights = jnp.stack([1.0 - (t - first), t - first], -1)
        return first.astype(jnp.int32), weights


class RoundSuns(AbstractSuns):
    """In a round world a light stands otherwise elsewhere, by a little nearby.

    For each light `count` zenith angles, from 0 to the `last` at which there is light,
    that crowd around the light's own, where those within `close` lie evenly; joined by
    cubics.
    """

    lights: Float[Array, "light"]
    last: Angle
    close: Angle
    count: int = eqx.field(static=True)

    def _ends(self) -> tuple[Array, Array, Array]:
        centre = jnp.clip(self.lights, 0.0, self.last)
        lowest = jnp.arcsinh(-centre / self.close)
        return centre, lowest, jnp.arcsinh((self.last - centre) / self.close)

    def zeniths(self) -> Float[Array, "sun"]:
        centre, low, high = (x[:, None] for x in self._ends())
        t = jnp.linspace(0.0, 1.0, self.count, dtype=self.last.dtype)[None]
        found = centre + self.close * jnp.sinh(low + (high - low) * t)
        return jnp.clip(found, 0.0, self.last).ravel()

    def between(
        self, light: Sun, zenith: Float[Array, "*n"]
    ) -> tuple[Int[Array, "*n"], Float[Array, "*n 4"]]:
        first, x = self.place(zenith, _nearest(self.lights, light))
        return first, cubic(x)

    def place(
        self, zenith: Float[Array, "*n"], which: Int[Array, ""] | int = 0
    ) -> tuple[Int[Array, "*n"], Float[Array, "*n"]]:
        """The first of the four to mix, and how many steps from it a light stands."""
        centre, low, high = (x[which] for x in self._ends())
        t = jnp.arcsinh((jnp.clip(zenith, 0.0, self.last) - centre) / self.close)
        t = (t - low) / (high - low) * (self.count - 1)
        first = self._first(t)
        return first.astype(jnp.int32) + which * self.count, t - first

    def place_lower(
        self, angle: Float[Array, "*n sun"]
    ) -> tuple[Int[Array, "*n sun"], Float[Array, "*n sun"]]:
        """The same for the suns of the first light, each lower by so much than it is.

        Exact where that is small, which the difference of two zenith angles is not.
        """
        _, low, high = (x[0] for x in self._ends())
        each = jnp.arange(self.count, dtype=angle.dtype)
        each = jnp.broadcast_to(each, angle.shape)
        here = jnp.sinh(low + (high - low) / (self.count - 1) * each)
        moves = angle / self.close
        there = here + moves
        # sinh a - sinh b = 2 sinh((a - b) / 2) cosh((a + b) / 2)
        even = jnp.sqrt((1.0 + here * here) * (1.0 + there * there))
        twice = jnp.sqrt(2.0 * (1.0 + even + here * there))
        step = 2.0 * jnp.arcsinh(moves / twice)
        step = step / (high - low) * (self.count - 1)
        first = self._first(each + step)
        x = jnp.clip(each - first + step, -first, self.count - 1.0 - first)
        return first.astype(jnp.int32), x

    def _first(self, t: Float[Array, "*n"]) -> Float[Array, "*n"]:
        return jnp.clip(jnp.floor(stop_gradient(t)) - 1.0, 0.0, self.count - 4.0)


def cubic(x: Float[Array, "*n"]) -> Float[Array, "*n 4"]:
    """Weights of the places 0 to 3 for a cubic through them."""
    a, b, c = x - 1.0, x - 2.0, x - 3.0
    weights = [-a * b * c / 6.0, x * b * c / 2.0, -x * a * c / 2.0, x * a * b / 6.0]
    return jnp.stack(weights, -1)


def straight(x: Float[Array, "*n"]) -> Float[Array, "*n 4"]:
    """Weights of the places 0 to 3 for straight lines between them."""
    near = [jnp.maximum(1.0 - jnp.abs(x - i), 0.0) for i in range(4)]
    return jnp.stack(near, -1)


def _nearest(lights: Float[Array, "light"], light: Sun) -> Int[Array, ""]:
    return jnp.argmin(jnp.abs(lights - light.zenith)).astype(jnp.int32)


def zenith_angle(up: Direction, direction: Direction) -> Angle:
    """The angle between a direction and straight up, from 0 to pi."""
    height = dot(up, direction)
    level = direction - height * up
    squared = dot(level, level)
    aside = squared > 0.0
    return jnp.arctan2(
        jnp.where(aside, jnp.sqrt(jnp.where(aside, squared, 1.0)), 0.0), height
    )
