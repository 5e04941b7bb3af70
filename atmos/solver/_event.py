"""One path of light in any media, followed backwards by null collisions."""

import math

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import Point
from ..quantity import versine
from ..transport import densities
from ._collision import phase, turn
from ._directions import basis
from ._majorants import Crossing, fly
from ._ray import total
from ._trip import Quest, set_out, Trip
from ._walk import weigh


# From this order on paths are given up by chance even where nothing is absorbed.
_LONG, _STAYS = 1000, 0.99
# Below this share of what it had, a path or a beam is given up by chance.
_FAINT = 0.1


def proceed(quest: Quest, trip: Trip) -> Trip:
    """On to the next collision, real or null, to the ground or out."""
    scene, nm, hero = quest.scene, quest.wavelength, trip.hero
    key, own = jax.random.split(jax.random.fold_in(trip.key, trip.step + 1))
    u = jax.random.uniform(key, (6,), nm.dtype)
    ray, bound, met = fly(quest.cells, trip.ray, -jnp.log1p(-u[0]))
    place = ray.start + ray.at * ray.direction
    point = scene.geometry.locate(place)
    here = densities(scene, point)
    extinction = total(here, quest.extinction)
    bound = jnp.where(met, bound, 1.0)
    real = jnp.clip(extinction / bound, 0.0, 1.0)

    # A beam is dimmed by what it meets, and counts where nothing more is met.
    beam = jnp.where(met, trip.beam * (1.0 - real), trip.beam)
    faint = jnp.max(beam, initial=0.0) < _FAINT * trip.bright
    beam = jnp.where(faint, jnp.where(u[1] < 0.5, 2.0 * beam, 0.0), beam)
    arrives = trip.beaming & ~met & ~trip.grounded
    found = trip.total + jnp.where(arrives, trip.beam, 0.0)

    path = ~trip.beaming & (trip.left > 0)
    found += jnp.where(path & met, trip.weight * _shines(quest, point, here) / bound, 0)
    turns = path & met & (u[1] < real[hero])
    lands = path & ~met & trip.grounded
    mixture = here[:, None] * quest.scattering
    scattering = total(here, quest.scattering)
    mixture = mixture / jnp.where(scattering > 0.0, scattering, 1.0)[None]
    ground = jnp.broadcast_to(scene.ground.evaluate(nm), nm.shape)
    seen = jnp.where(turns, scattering / bound, 1.0 - real)
    seen = jnp.where(met, seen, jnp.where(trip.grounded, ground, 0.0))
    chance = jnp.where(turns, real, 1.0 - real)
    weight, ratio = weigh(trip.weight, trip.ratio, seen, jnp.where(met, chance, 1.0))

    # Where it goes on to, and what comes there from the sun.
    foot = scene.geometry.path(scene.geometry.locate(ray.start), ray.direction).at(
        _ground(quest, ray)
    )
    lies = jnp.where(lands, foot.position, place)
    up = foot.up
    apart = turn(scene, nm, mixture, hero, u[2], own)
    cosine = jnp.where(lands, jnp.sqrt(u[3]), 1.0 - apart)
    sine = jnp.where(lands, 1.0 - u[3], apart * (2.0 - apart))
    axis = jnp.where(lands, up, ray.direction)
    one, other = basis(axis)
    angle = 2.0 * math.pi * u[4]
    across = jnp.cos(angle) * one + jnp.sin(angle) * other
    onward = cosine * axis + jnp.sqrt(jnp.maximum(sine, 0.0)) * across
    onward = onward / jnp.sqrt(jnp.sum(onward * onward))
    shares = phase(scene, nm, mixture, versine(ray.direction, onward))
    shares = jnp.where(lands, 1.0, shares)
    bent = turns | lands
    sun = onward if quest.light is None else quest.light.direction
    falls = phase(scene, nm, mixture, versine(ray.direction, sun))
    falls = jnp.where(lands, jnp.maximum(jnp.dot(up, sun), 0.0) / math.pi, falls)
    beam = jnp.where(bent, weight * falls, jnp.where(trip.beaming, beam, 0.0))
    after = weigh(weight, ratio, shares, shares)
    weight, ratio = (
        jnp.where(bent, a, b) for a, b in zip(after, (weight, ratio), strict=True)
    )

    # Given up by chance: what is faint, and what has turned very often.
    order = trip.order + bent.astype(jnp.int32)
    stays = jnp.clip(jnp.mean(weight) / _FAINT, 0.05, 1.0)
    stays = jnp.where(order > _LONG, jnp.minimum(stays, _STAYS), stays)
    stays = jnp.where(bent, stays, 1.0)
    weight = jnp.where(u[5] < stays, weight / stays, 0.0)

    # A beam sets out where the path turns; the path sets out where the beam ends.
    shines = quest.light is not None
    sets_out = bent & shines & jnp.any(beam > 0.0)
    back = trip.beaming & (~met | ~jnp.any(beam > 0.0))
    weight = jnp.where(
        trip.beaming, trip.weight, jnp.where(path & ~met & ~lands, 0.0, weight)
    )
    ratio = jnp.where(trip.beaming, trip.ratio, ratio)
    beaming = sets_out | (trip.beaming & ~back)
    onward = jnp.where(bent, onward, trip.onward)
    ended = ~beaming & ~jnp.any(weight > 0.0)
    origin = jnp.where(bent, lies, ray.start)
    towards = jnp.where(sets_out, sun, onward)
    origin = jnp.where(ended, trip.position, origin)
    towards = jnp.where(ended, trip.outward, towards)
    anew = bent | back | ended
    fresh, grounded = set_out(quest, origin, towards)
    choose = lambda x, y: jax.tree.map(lambda a, b: jnp.where(anew, a, b), x, y)
    one = jnp.ones_like(weight)
    count = max(nm.shape[0], 1)
    return Trip(
        position=trip.position,
        outward=trip.outward,
        key=trip.key,
        step=trip.step + 1,
        left=trip.left - (ended & (trip.left > 0)).astype(jnp.int32),
        ray=choose(fresh, ray),
        grounded=jnp.where(anew, grounded, trip.grounded),
        beaming=beaming,
        onward=onward,
        order=jnp.where(ended, 0, order),
        hero=jnp.where(ended, (hero + 1) % count, hero),
        weight=jnp.where(ended, one, weight),
        ratio=jnp.where(ended, one, ratio),
        beam=beam,
        bright=jnp.where(bent, jnp.max(beam, initial=0.0), trip.bright),
        total=found,
    )


def _ground(quest: Quest, ray: Crossing) -> Float[Array, ""]:
    """How far the ground or the top of the air is."""
    geometry = quest.scene.geometry
    path = geometry.path(geometry.locate(ray.start), ray.direction)
    return path.span(quest.scene.top).far


def _shines(
    quest: Quest, point: Point, here: Float[Array, "medium"]
) -> Float[Array, "wl"]:
    """What a metre adds of itself."""
    total = jnp.zeros_like(quest.wavelength)
    if quest.light is None:
        for density, x in zip(here, quest.scene.media, strict=True):
            if x.emission is not None:
                absorption = x.absorption.evaluate(quest.wavelength)
                found = x.emission.evaluate(point, absorption, quest.wavelength)
                total += density * found
    return total
