"""A path of light in a world, followed backwards: what is kept of it."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Integer, PRNGKeyArray

from ..geometry import AbstractPath, FAR, Point
from ..light import AbstractLight
from ..quantity import Direction, Length, Number, Position, Wavelength
from ..scene import Scene
from ._chance import Words
from ._majorants import Cells, cross
from ._strata import Strata


# Thin air is met so often on the first leg, at least, and turns so often. Where there
# is something behind it, or in it, which is seen by those paths alone that it does not
# turn, it turns half as often; more seldom where it is so thin that it is dark beside
# that. What it turns more than it does weighs less.
_MEETS, _TURNS = 4.0, 2.0


class Majorants(eqx.Module):
    """Bounds of the extinction of media in boxes, and of layered air; None if none."""

    cells: Cells | None
    strata: Strata | None


class Quest(eqx.Module):
    """What is looked for: the light of one light, or with None of media that shine.

    After so many `turns` paths are given up by chance even where nothing is absorbed.
    """

    scene: Scene
    majorants: Majorants
    light: AbstractLight | None
    wavelength: Wavelength
    extinction: Float[Array, "medium wl"]
    scattering: Float[Array, "medium wl"]
    turns: int = eqx.field(static=True)


class Leg(eqx.Module):
    """A straight way through the world, and how far along it one has come.

    It goes to `far`, where it is `blocked` unless it leads out or to a light. The
    surface that blocks it is counted from 0, as is the one that it `leaves`, if any;
    the ground is the one after the last.
    """

    path: AbstractPath
    at: Length
    far: Length
    blocked: Bool[Array, ""]
    surface: Integer[Array, ""]
    leaves: Integer[Array, ""]


class Trip(eqx.Module):
    """A path on its way, or the beam from where it turned last to a light.

    `weight` and `ratio` are those of `Walk`; `beam` is what the beam will add, of the
    brightness `bright` to begin with, and `onward` where the path goes on to after it.
    `aim` is the density, per sr, with which it was sent there. On the first leg layered
    air is met `lift` times as often as it has to be, and turns no less than `least`.
    `late` is what it weighed when it had turned as often as is gone on with for sure.
    """

    lift: Number
    least: Number
    key: Words
    step: Integer[Array, ""]
    leg: Leg
    beaming: Bool[Array, ""]
    onward: Direction
    aim: Number
    order: Integer[Array, ""]
    hero: Integer[Array, ""]
    weight: Float[Array, "wl"]
    ratio: Float[Array, "wl"]
    beam: Float[Array, "wl"]
    bright: Number
    total: Float[Array, "wl"]
    late: Number

    @property
    def ended(self) -> Bool[Array, ""]:
        """Whether there is nothing more to come of it."""
        return ~self.beaming & ~jnp.any(self.weight > 0.0)


def begin(
    quest: Quest,
    position: Position,
    direction: Direction,
    key: PRNGKeyArray,
    hero: Integer[Array, ""],
) -> Trip:
    """A path from the eye; its places are drawn as one wavelength asks for."""
    geometry = quest.scene.geometry
    path = geometry.path(geometry.locate(position), direction).enter(quest.scene.top)
    one = jnp.ones_like(quest.wavelength)
    far = jnp.full_like(path.start.altitude, FAR)
    leg = set_out(quest, path.start, direction, far, jnp.int32(-1))
    strata = quest.majorants.strata
    depth = leg.far * 0.0 if strata is None else strata.depth(leg.path, leg.far)
    lift = jnp.maximum(_MEETS / jnp.where(depth > 0.0, depth, _MEETS), 1.0)
    behind = leg.blocked | (quest.light is not None and quest.light.backdrop)
    if (cells := quest.majorants.cells) is not None:
        way = path.start.position, direction, leg.at, leg.far
        behind = behind | cross(cells, *way).inside(cells)
    dark = jnp.sqrt(jax.lax.stop_gradient(jnp.minimum(depth, 1.0)))
    share = jnp.where(behind, 0.5 * dark, 1.0)
    return Trip(
        lift=lift,
        least=share * _TURNS / jnp.maximum(depth, _MEETS),
        key=jax.random.key_data(key),
        step=jnp.int32(0),
        leg=leg,
        beaming=jnp.array(False),
        onward=direction,
        aim=jnp.zeros_like(leg.at),
        order=jnp.int32(0),
        hero=hero,
        weight=one,
        ratio=one,
        beam=0.0 * one,
        bright=jnp.zeros_like(leg.at),
        total=0.0 * one,
        late=jnp.zeros_like(leg.at),
    )


def set_out(
    quest: Quest,
    start: Point,
    direction: Direction,
    most: Length,
    leaves: Integer[Array, ""],
) -> Leg:
    """A way through the air, no farther than to something solid, or than `most`."""
    path = quest.scene.geometry.path(start, direction)
    span = path.span(quest.scene.top)
    # What grazes the top, and by rounding has not entered, is out.
    far, solid = jnp.where(span.near > 0.0, 0.0, span.far), span.grounded
    surface = jnp.int32(len(quest.scene.surfaces))
    for i, x in enumerate(quest.scene.surfaces):
        ahead = x.shape.meet(start.position, direction, leaves == i)
        nearer = ahead < far
        surface = jnp.where(nearer, i, surface)
        far, solid = jnp.where(nearer, ahead, far), solid | nearer
    blocked = solid & (far <= most)
    at, far = jnp.zeros_like(far), jnp.minimum(far, most)
    return Leg(path, at, far, blocked, surface, leaves)
