"""Where a flight of light ends, and where it turns to."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Integer, PRNGKeyArray

from ..geometry import Point
from ..light import Sun
from ..quantity import Direction, dot, Number, Versine, versine, Wavelength
from ..scene import Scene
from ..transport import densities, gauss_legendre
from . import _directions as directions
from ._flight import cell, Flight, Layers, NODES, share


# The shares of flights to where it is guessed to be bright, and of turns towards where
# light is guessed to come from. The rest are as if all air were equally bright: a poor
# guess makes no path much rarer than that.
_FLIGHTS, _TURNS = 0.8, 0.8
# So many orders are led. Small faults of the guess would else pile up to large weights.
_LED = 8


class Task(eqx.Module):
    """What is looked for: the light of one sun, from a place in one direction.

    Light that turned fewer than `first` times is left out.
    """

    scene: Scene
    layers: Layers
    light: Sun
    wavelength: Wavelength
    first: int = eqx.field(static=True)


class Place(eqx.Module):
    """Where a flight ends: what is `seen` of it, and the `chance` of it, by wavelength.

    `mixture` says which share of the light that turns here does so in which medium.
    """

    point: Point
    grounded: Bool[Array, ""]
    piece: Integer[Array, ""]
    seen: Float[Array, "wl"]
    chance: Float[Array, "wl"]
    mixture: Float[Array, "medium wl"]


def land(
    task: Task,
    flight: Flight,
    even: Float[Array, "place wl"],
    guessed: Float[Array, "place wl"],
    hero: Integer[Array, ""],
    order: Integer[Array, ""],
    u: Float[Array, "2"],
) -> Place:
    """Draws where a ray ends, given two random numbers from 0 to 1."""
    layers = task.layers
    even = _normal(even)
    led = jnp.where(order < _LED, _FLIGHTS, 0.0)
    shares = even + led * (_normal(guessed) - even)
    upto = jnp.cumsum(shares[:, hero])
    piece = jnp.sum(upto <= u[0] * upto[-1])
    ground = flight.begin.shape[0]
    piece = jnp.minimum(piece, ground)
    grounded = piece == ground
    i = jnp.minimum(piece, ground - 1)

    # Within a piece by the exponential that its ends suggest, for each wavelength.
    depth = dot(flight.passed[i + 1] - flight.passed[i], layers.extinction)
    x, w = (jnp.asarray(a, depth.dtype) for a in gauss_legendre(NODES))
    ends = dot(flight.density[i][jnp.array([0, -1])], layers.scattering)
    known = jnp.all(ends > 0.0, 0)
    ends = jnp.where(known[None], ends, 1.0)
    rate = depth + jnp.clip(jnp.log(ends[0] / ends[1]) / (x[-1] - x[0]), -8.0, 8.0)
    part = _quantile(u[1], rate[hero])
    length = jnp.where(flight.length[i] > 0.0, flight.length[i], 1.0)
    density = jnp.exp(-rate * part) / (share(rate) * length)

    along = part * flight.length[i]
    within = jax.vmap(lambda s: densities(task.scene, flight.path.at(s)))(
        flight.begin[i] + along * x
    )
    passed = flight.passed[i] + along * jnp.sum(within * w[:, None], 0)
    passed = jnp.where(grounded, flight.passed[-1], passed)
    here = flight.path.at(jnp.where(grounded, flight.far, flight.begin[i] + along))
    altitude = jnp.where(grounded, 0.0, jnp.maximum(here.altitude, 0.0))
    here = Point(here.position, altitude, here.up)
    mixture = layers.scattering * densities(task.scene, here)[:, None]
    total = jnp.sum(mixture, 0)
    turns = jnp.where(grounded, layers.ground, total)
    chance = shares[piece] * jnp.where(grounded, 1.0, density)
    # Where the hero sees nothing it has no place to go to.
    turns = jnp.where(chance[hero] > 0.0, turns, 0.0)
    return Place(
        point=here,
        grounded=grounded,
        piece=piece,
        seen=jnp.exp(-dot(passed, layers.extinction)) * turns,
        chance=chance,
        mixture=mixture / jnp.where(total > 0.0, total, 1.0)[None],
    )


def _normal(brightness: Float[Array, "place wl"]) -> Float[Array, "place wl"]:
    total = jnp.sum(brightness, 0, keepdims=True)
    return brightness / jnp.where(total > 0.0, total, 1.0)


def _quantile(u: Number, rate: Number) -> Number:
    """Where on the way from 0 to 1 an exponential density has left u of it behind."""
    small = jnp.abs(rate) < 1e-4
    safe = jnp.where(small, 1.0, rate)
    found = -jnp.log1p(u * jnp.expm1(-safe)) / safe
    return jnp.where(small, u * (1.0 - 0.5 * rate * (1.0 - u)), jnp.clip(found, 0, 1))


def phase(
    scene: Scene,
    wavelength: Wavelength,
    mixture: Float[Array, "medium wl"],
    apart: Versine,
) -> Float[Array, "wl"]:
    """How much of what turns goes this way, per steradian."""
    total = jnp.zeros_like(wavelength)
    for part, x in zip(mixture, scene.media, strict=True):
        if x.scattering is not None:
            total += part * x.phase.evaluate(apart, wavelength)
    return total


def turn(
    scene: Scene,
    wavelength: Wavelength,
    mixture: Float[Array, "medium wl"],
    hero: Integer[Array, ""],
    u: Number,
    key: PRNGKeyArray,
) -> Versine:
    """An angle drawn as the hero's wavelength turns."""
    upto = jnp.cumsum(mixture[:, hero])
    found, below = jnp.zeros_like(u), jnp.zeros_like(u)
    for i, x in enumerate(scene.media):
        if x.scattering is None:
            continue
        draw = lambda wavelength, x=x: x.phase.sample(key, wavelength[None])
        value = jax.eval_shape(x.phase.evaluate, u, wavelength)
        if value.shape[0] == 1:
            drawn = draw(wavelength[0])
        else:
            drawn = jax.vmap(draw)(wavelength)[hero]
        mine = (u * upto[-1] >= below) & (u * upto[-1] < upto[i])
        found, below = jnp.where(mine, drawn, found), upto[i]
    return found


def depart(
    task: Task,
    place: Place,
    along: Direction,
    hero: Integer[Array, ""],
    order: Integer[Array, ""],
    u: Float[Array, "4"],
    key: PRNGKeyArray,
) -> tuple[Direction, Float[Array, "wl"]]:
    """Where the path goes on to, and with which density.

    From the ground in proportion to the cosine; in the air as light turns there, or to
    where the light is guessed to come from.
    """
    up, sun = place.point.up, task.light.direction
    layers = task.layers
    whence = layers.whence[layers.shell(place.piece), cell(dot(up, sun))]
    where = task.scene, task.wavelength
    apart = turn(*where, place.mixture, hero, u[0], key)
    cosine = jnp.where(place.grounded, jnp.sqrt(u[1]), 1.0 - apart)
    sine = jnp.where(place.grounded, 1.0 - u[1], apart * (2.0 - apart))
    axis = jnp.where(place.grounded, up, along)
    one, other = directions.basis(axis)
    angle = 2.0 * math.pi * u[2]
    across = jnp.cos(angle) * one + jnp.sin(angle) * other
    turned = cosine * axis + jnp.sqrt(sine) * across
    turned = turned / jnp.sqrt(dot(turned, turned))

    upto = jnp.cumsum(whence[:, hero])
    chosen = jnp.sum(upto <= u[0] * upto[-1])
    chosen = jnp.minimum(chosen, whence.shape[0] - 1)
    # What turns little goes where the guess points too seldom to be led there.
    spread = 1.0 - jnp.sum(place.mixture * layers.forward, 0)
    led = jnp.where(order < _LED, _TURNS * spread * spread, 0.0)
    guided = ~place.grounded & (u[3] < led[hero])
    direction = jnp.where(guided, directions.draw(chosen, u[1:3], up, sun), turned)
    turns = phase(*where, place.mixture, versine(along, direction))
    ahead = directions.sort(direction, up, sun)
    known = whence[ahead] / directions.solid_angle(ahead, up.dtype)
    chance = turns + led * (known - turns)
    falls = jnp.maximum(dot(up, direction), 0.0) / math.pi
    return direction, jnp.where(place.grounded, falls, chance)
