"""Where a path turns: by media, on the ground, or on a surface."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.lax import stop_gradient
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from ..geometry import Point
from ..light import Shine
from ..quantity import Direction, inner, Number, versine
from ..rotation import around
from ._collision import phase, turn
from ._meeting import Meeting
from ._trip import Quest, Trip


# In a medium a path turns so often, the more seldom the more it has turned before, to
# where most of the light that is looked for is turned on. A narrow lobe is a thousand
# times as bright as what is beside it, so that few are enough; all others weigh a
# little more for it, after a hundred turns not yet twice as much.
_LED, _LESS = 0.05, 0.1


class Passed(eqx.Module):
    """What a path takes along from where it came to, and the chance that it did."""

    seen: Float[Array, "wl"]
    chance: Float[Array, "wl"]


class Bend(eqx.Module):
    """Where a path turns, if it does, what by, and where to.

    At something solid, `normal` stands on the side that light falls on. `shares` is how
    much of the light turns there, per sr, and `chance` the density with which the path
    does. What it then turns of the light is `promise` times an even share, or 1.
    """

    turns: Bool[Array, ""]
    solid: Bool[Array, ""]
    smooth: Bool[Array, ""]
    point: Point
    inward: Direction
    normal: Direction
    mixture: Float[Array, "medium wl"]
    onward: Direction
    shares: Float[Array, "wl"]
    chance: Float[Array, "wl"]
    promise: Number


def turned(
    quest: Quest,
    trip: Trip,
    place: Meeting,
    path: Bool[Array, ""],
    shine: Shine,
    u: Float[Array, "5"],
    key: PRNGKeyArray,
) -> tuple[Bend, Passed]:
    """Whether a path turns where it has come to, and how, drawn by chance."""
    nm, hero, met = quest.wavelength, trip.hero, place.met
    first = place.airy & (trip.order == 0) & jnp.any(place.scattering > 0.0)
    real = stop_gradient(place.real)
    real = jnp.where(first, jnp.maximum(real, trip.least), real)
    turns = path & met & (u[0] < real[hero])
    solid = path & place.ends & place.leg.blocked
    inward = place.leg.path.direction
    apart = turn(quest.scene, nm, place.mixture, hero, u[1], key)
    # Where the light is looked for is drawn apart from this: any place there is right.
    seldom = 1.0 + _LESS * trip.order.astype(nm.dtype)
    led = 0.0 if quest.light is None else _LED / seldom
    axis = jnp.where(u[4] < led, shine.direction, inward)
    onward = stop_gradient(around(axis, apart, 2.0 * math.pi * u[3]))
    wall = _wall(quest, place, u[1:4])
    bend = Bend(
        turns=turns | solid,
        solid=solid,
        smooth=solid & wall.smooth,
        point=jax.tree.map(
            lambda a, b: jnp.where(solid, a, b), wall.point, place.point
        ),
        inward=inward,
        normal=wall.normal,
        mixture=place.mixture,
        onward=jnp.where(solid, wall.onward, onward),
        shares=jnp.ones_like(nm),
        chance=jnp.ones_like(nm),
        promise=jnp.ones_like(u[0]),
    )
    shares = jnp.where(bend.smooth, 1.0, falls(quest, bend, bend.onward))
    apart = versine(onward, shine.direction)
    bright = phase(quest.scene, nm, place.mixture, apart)
    led = jnp.where(solid, 0.0, led)
    promise = jnp.maximum(4.0 * math.pi * jnp.mean(bright), 1.0)
    choice = shares, shares + led * (bright - shares), jnp.where(solid, 1.0, promise)
    where = lambda x: (x.shares, x.chance, x.promise)
    bend = eqx.tree_at(where, bend, choice)
    seen = jnp.where(turns, place.scattering, 1.0 - place.real)
    going = jnp.where(place.ends, 0.0, 1.0)
    passed = Passed(
        seen=jnp.where(met, seen, jnp.where(solid, wall.share, going)),
        chance=jnp.where(met, jnp.where(turns, real, 1.0 - real), 1.0),
    )
    return bend, passed


class Wall(eqx.Module):
    """Something solid that a way ends on: what share it sends on, and where to."""

    point: Point
    normal: Direction
    onward: Direction
    smooth: Bool[Array, ""]
    share: Float[Array, "wl"]


def _wall(quest: Quest, place: Meeting, u: Float[Array, "3"]) -> Wall:
    scene, nm, point = quest.scene, quest.wavelength, place.point
    ground = point.up
    found = Wall(
        point=Point(point.position, jnp.zeros_like(point.altitude), ground),
        normal=ground,
        onward=around(ground, 1.0 - jnp.sqrt(u[1]), 2.0 * math.pi * u[2]),
        smooth=jnp.array(False),
        share=jnp.broadcast_to(scene.ground.evaluate(nm), nm.shape),
    )
    inward = place.leg.path.direction
    for i, x in enumerate(scene.surfaces):
        normal = x.shape.normal(point.position)
        behind = inner(inward, normal) > 0.0
        wall = Wall(
            point=point,
            normal=jnp.where(behind, -normal, normal),
            onward=stop_gradient(x.material.turn(inward, normal, u)),
            smooth=jnp.array(x.material.smooth),
            share=jnp.broadcast_to(x.material.share(nm), nm.shape),
        )
        mine = place.leg.surface == i
        found = jax.tree.map(lambda a, b, m=mine: jnp.where(m, a, b), wall, found)
    return found


def falls(quest: Quest, bend: Bend, direction: Direction) -> Float[Array, "wl"]:
    """How much of the light that turns here comes from a direction, per sr."""
    apart = versine(bend.inward, direction)
    found = phase(quest.scene, quest.wavelength, bend.mixture, apart)
    level = jnp.maximum(inner(bend.normal, direction), 0.0) / math.pi
    return jnp.where(bend.solid, level, found)
