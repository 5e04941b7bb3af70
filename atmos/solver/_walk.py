"""One path of light, followed backwards from collision to collision."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Integer, PRNGKeyArray

from ..geometry import Point
from ..quantity import Direction, dot, versine
from ._collision import depart, land, phase, Task
from ._flight import brightness, cell, fly, to_sun


# A path is given up by chance where it promises less than this of what is seen, but
# never with more than the other probability.
_PROMISE, _LEAST = 0.1, 0.2


class Walk(eqx.Module):
    """A path on its way, and what the paths before it have found.

    Places are drawn with the densities that one wavelength, `hero`, asks for, and count
    as if drawn by chance by any of them (Veach's balance heuristic): `weight` is the
    share of light that comes this way over the mean of the densities, and `ratio` the
    density of each over the same.
    """

    start: Point
    outward: Direction
    key: PRNGKeyArray
    left: Integer[Array, ""]
    step: Integer[Array, ""]
    shift: Float[Array, "2"]
    point: Point
    direction: Direction
    order: Integer[Array, ""]
    hero: Integer[Array, ""]
    weight: Float[Array, "wl"]
    ratio: Float[Array, "wl"]
    bright: Float[Array, "wl"]
    total: Float[Array, "wl"]


def begin(
    task: Task, start: Point, direction: Direction, key: PRNGKeyArray, paths: int
) -> Walk:
    """The first of so many paths."""
    count, dtype = task.wavelength.shape[0], task.wavelength.dtype
    one = jnp.ones(count, dtype)
    key, where = jax.random.split(key)
    return Walk(
        start=start,
        outward=direction,
        key=key,
        left=jnp.int32(paths),
        step=jnp.int32(0),
        shift=jax.random.uniform(where, (2,), dtype),
        point=start,
        direction=direction,
        order=jnp.int32(0),
        hero=jax.random.randint(jax.random.fold_in(where, 1), (), 0, max(count, 1)),
        weight=one,
        ratio=one,
        bright=one,
        total=0.0 * one,
    )


def advance(task: Task, walk: Walk) -> Walk:
    """One flight, and what is seen of the sun from where it ends."""
    layers, sun = task.layers, task.light.direction
    key, turn = jax.random.split(jax.random.fold_in(walk.key, walk.step))
    u = jax.random.uniform(key, (7,), task.wavelength.dtype)
    first = walk.order == 0
    u = u.at[:2].set(jnp.where(first, _spread(walk.shift, walk.left), u[:2]))

    flight = fly(task.scene, layers, walk.point, walk.direction)
    even, guessed = brightness(layers, flight, sun)
    bright = jnp.where(first, jnp.sum(guessed, 0), walk.bright)
    hero, order = walk.hero, walk.order
    place = land(task, flight, even, guessed, hero, order, u[:2])
    grounded, here = place.grounded, place.point
    weight, ratio = weigh(walk.weight, walk.ratio, place.seen, place.chance)

    turned = versine(walk.direction, sun)
    falls = jnp.maximum(dot(here.up, sun), 0.0) / math.pi
    where = task.scene, task.wavelength
    falls = jnp.where(grounded, falls, phase(*where, place.mixture, turned))
    passed, lit = to_sun(task.scene, here, sun)
    arrives = jnp.exp(-dot(passed, layers.extinction))
    counts = (walk.left > 0) & lit & (walk.order + 1 >= task.first)
    total = walk.total + jnp.where(counts, weight * falls * arrives, 0.0)

    which = dot(here.up, sun)
    promise = weight * layers.diffuse[layers.shell(place.piece), cell(which)]
    promise = jnp.mean(promise / jnp.maximum(bright, 1e-30))
    stays = jnp.clip(promise / _PROMISE, _LEAST, 1.0)
    weight = jnp.where(u[2] < stays, weight / stays, 0.0)

    direction, chance = depart(task, place, walk.direction, hero, order, u[3:], turn)
    turned = phase(*where, place.mixture, versine(walk.direction, direction))
    falls = jnp.maximum(dot(here.up, direction), 0.0) / math.pi
    weight, ratio = weigh(weight, ratio, jnp.where(grounded, falls, turned), chance)

    ended = ~jnp.any(weight > 0.0)
    fresh = begin(task, walk.start, walk.outward, walk.key, 0)
    choose = lambda x, y: jax.tree.map(lambda a, b: jnp.where(ended, a, b), x, y)
    return Walk(
        start=walk.start,
        outward=walk.outward,
        key=walk.key,
        left=walk.left - ended.astype(jnp.int32),
        step=walk.step + 1,
        shift=walk.shift,
        point=choose(walk.start, here),
        direction=choose(walk.outward, direction),
        order=jnp.where(ended, 0, walk.order + 1),
        hero=jnp.where(ended, (walk.hero + 1) % walk.weight.shape[0], walk.hero),
        weight=choose(fresh.weight, weight),
        ratio=choose(fresh.ratio, ratio),
        bright=bright,
        total=total,
    )


def weigh(
    weight: Float[Array, "wl"],
    ratio: Float[Array, "wl"],
    seen: Float[Array, "#wl"],
    chance: Float[Array, "#wl"],
) -> tuple[Float[Array, "wl"], Float[Array, "wl"]]:
    """Both after one more choice, over the mean of the densities as it then is."""
    ratio = ratio * chance
    mean = jnp.mean(ratio)
    possible = mean > 0.0
    mean = jnp.where(possible, mean, 1.0)
    return jnp.where(possible, weight * seen / mean, 0.0), ratio / mean


def _spread(shift: Float[Array, "2"], index: Integer[Array, ""]) -> Float[Array, "2"]:
    """Evenly spread over a square: Roberts' sequence, by a shift that is random."""
    steps = jnp.array([3242174889, 2447445414], jnp.uint32)
    turns = steps * index.astype(jnp.uint32)
    found = turns.astype(shift.dtype) * 2.0**-32 + shift
    return jnp.where(found >= 1.0, found - 1.0, found)
