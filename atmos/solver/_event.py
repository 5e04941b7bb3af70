"""One path of light in a world, followed backwards from one event to the next.

Of what was drawn by chance there is no gradient, nor of the chance: there is of what is
found for it. That is unbiased (detached sampling: Zeltner, Speierer, Georgiev and Jakob
2021).
"""

import dataclasses
import math

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.lax import stop_gradient
from jaxtyping import Array, Float

from ..geometry import FAR
from ..light import Shine
from ..quantity import dot, Number
from ..transport import columns
from ._bend import Bend, falls, turned
from ._chance import as_key
from ._flight import LIGHT_NODES
from ._meeting import meet, Meeting
from ._settled import settled
from ._trip import Leg, Quest, set_out, Trip
from ._walk import weigh


# Below this share of what it had, a path or a beam is given up by chance.
_FAINT = 0.1
# A beam to what lies beyond the world is always sent where a path turns first, and
# where so many times as much turns its way as if all ways were alike. Else it is sent
# in proportion, but never more seldom than this.
_OFTEN, _SELDOM = 4.0, 0.05
# The density, per sr, with which a smooth surface sends light on.
_SHARP = 1e15


def proceed(quest: Quest, trip: Trip) -> Trip:
    """On to the next collision, real or null, to the ground or out."""
    key, own = jax.random.split(jax.random.fold_in(as_key(trip.key), trip.step + 1))
    u = settled(
        jax.random.uniform(key, (11,), quest.wavelength.dtype), quest.wavelength
    )
    place = settled(meet(quest, trip, u[:2]), quest.wavelength)
    path = ~trip.beaming & ~trip.ended
    seen = _seen(quest, trip, place)
    found = trip.total + jnp.where(path, trip.weight * seen, 0.0)
    arrives = trip.beaming & place.ends & ~place.leg.blocked
    found += jnp.where(arrives, trip.beam, 0.0)

    shine = settled(_shine(quest, place, u[8:10]), quest.wavelength)
    bend, passed = settled(
        turned(quest, trip, place, path, shine, u[2:7], own), quest.wavelength
    )
    weight, ratio = weigh(trip.weight, trip.ratio, passed.seen, passed.chance)
    beam = settled(
        _light_up(quest, trip, bend, shine, weight, ratio, u[10]), quest.wavelength
    )
    beam = jnp.where(bend.turns, beam, _dim(trip, place, u[2]))
    aim = jnp.where(bend.smooth, _SHARP, jnp.mean(ratio * stop_gradient(bend.shares)))
    aim = jnp.where(bend.turns, aim, trip.aim)
    after = weigh(weight, ratio, bend.shares, stop_gradient(bend.chance))
    onwards = lambda a, b: jnp.where(bend.turns, a, b)
    weight, ratio = map(onwards, after, (weight, ratio))

    # Given up by chance: what is faint, and what has turned very often.
    order = trip.order + bend.turns.astype(jnp.int32)
    promise = stop_gradient(jnp.mean(weight) * bend.promise)
    stays = jnp.clip(promise / _FAINT, 0.05, 1.0)
    often = order > quest.turns
    now = bend.turns & (order == quest.turns)
    late = jnp.where(now, stop_gradient(jnp.mean(weight)), trip.late)
    stays = jnp.where(often, jnp.minimum(stays, 1.0 - 10.0 / quest.turns), stays)
    stays = jnp.where(bend.turns, stays, 1.0)
    weight = jnp.where(u[7] < stays, weight / stays, 0.0)
    weight = jnp.where(trip.beaming, trip.weight, weight)
    ratio = jnp.where(trip.beaming, trip.ratio, ratio)

    # A beam sets out where the path turns; the path sets out where the beam ends.
    sets_out = bend.turns & jnp.any(beam > 0.0)
    back = trip.beaming & (place.ends | ~jnp.any(beam > 0.0))
    beaming = sets_out | (trip.beaming & ~back)
    onward = jnp.where(bend.turns, bend.onward, trip.onward)
    choose = lambda which, x, y: jax.tree.map(lambda a, b: jnp.where(which, a, b), x, y)
    start = choose(bend.turns, bend.point, place.leg.path.start)
    towards = jnp.where(sets_out, shine.direction, onward)
    most = jnp.where(sets_out, shine.distance, FAR)
    leaves = jnp.where(bend.turns & ~place.met, place.leg.surface, -1)
    leaves = jnp.where(bend.turns, leaves, place.leg.leaves)
    start, towards, most, leaves = settled(
        (start, towards, most, leaves), quest.wavelength
    )
    leg = set_out(quest, start, towards, most, leaves)
    beam = jnp.where(sets_out, beam * _clear(quest, leg), beam)
    leg = choose(bend.turns | back, leg, place.leg)
    return dataclasses.replace(
        trip,
        step=trip.step + 1,
        leg=leg,
        beaming=beaming,
        onward=onward,
        aim=aim,
        order=order,
        weight=weight,
        ratio=ratio,
        beam=beam,
        bright=jnp.where(sets_out, jnp.max(beam, initial=0.0), trip.bright),
        total=found,
        late=late,
    )


def _seen(quest: Quest, trip: Trip, place: Meeting) -> Float[Array, "wl"]:
    """What shines where a path has come to."""
    leaves = place.ends & ~place.leg.blocked
    seen = jnp.where(place.met, place.shining, 0.0)
    if quest.light is None:
        return seen
    ahead = place.leg.path.direction
    beyond = quest.light.radiance(ahead, quest.wavelength)
    # What is also looked for by beams counts by its share of the chance to be found.
    apt = trip.aim * quest.light.solid_angle(ahead)
    first = 1.0 if quest.light.backdrop else 0.0
    return jnp.where(
        leaves, beyond * jnp.where(trip.order == 0, first, apt / (1.0 + apt)), seen
    )


def _shine(quest: Quest, place: Meeting, u: Float[Array, "2"]) -> Shine:
    """Where to look for the light from where one has come to."""
    if quest.light is not None:
        return quest.light.sample(place.point.position, u, quest.wavelength)
    far = jnp.full_like(place.leg.at, FAR)
    dark = jnp.zeros_like(quest.wavelength)
    return Shine(place.leg.path.direction, far, dark, jnp.zeros_like(far))


def _light_up(
    quest: Quest,
    trip: Trip,
    bend: Bend,
    shine: Shine,
    weight: Float[Array, "wl"],
    ratio: Float[Array, "wl"],
    u: Number,
) -> Float[Array, "wl"]:
    """What a beam from where a path turns to the light may add."""
    if quest.light is None:
        return jnp.zeros_like(quest.wavelength)
    share = falls(quest, bend, shine.direction)
    apt = jnp.mean(ratio * stop_gradient(share)) * shine.solid_angle
    beam = weight * share * shine.irradiance / (1.0 + apt)
    # Where little light turns this way beams are seldom sent, and weigh more.
    even = jnp.max(share) * (4.0 * math.pi / _OFTEN)
    sent = jnp.clip(stop_gradient(even), _SELDOM, 1.0)
    always = (shine.distance < FAR) | (trip.order == 0)
    sent = jnp.where(always, 1.0, sent)
    beam = jnp.where(u < sent, beam / sent, 0.0)
    # What a smooth surface shows is never found on purpose.
    return jnp.where(bend.smooth, 0.0, beam)


def _dim(trip: Trip, place: Meeting, u: Number) -> Float[Array, "wl"]:
    """A beam, by what it meets; where it is faint it is given up by chance."""
    beam = jnp.where(place.met, trip.beam * (1.0 - place.real), trip.beam)
    faint = jnp.max(beam, initial=0.0) < _FAINT * trip.bright
    beam = jnp.where(faint, jnp.where(u < 0.5, 2.0 * beam, 0.0), beam)
    return jnp.where(trip.beaming, beam, 0.0)


def _clear(quest: Quest, leg: Leg) -> Float[Array, "wl"]:
    """What layered air leaves of a beam; nothing of one that is blocked."""
    whole = jnp.where(leg.blocked, 0.0, jnp.ones_like(quest.wavelength))
    layered = [i for i, x in enumerate(quest.scene.media) if x.profile.layered]
    if not layered:
        return whole
    media = tuple(quest.scene.media[i] for i in layered)
    air = eqx.tree_at(lambda x: x.media, quest.scene, media)
    passed = columns(air, leg.path, leg.far, nodes=LIGHT_NODES)
    depth = dot(passed, quest.extinction[jnp.array(layered)])
    return whole * jnp.exp(-depth)
