"""A path of light in any media, followed backwards: what is kept of it."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Integer, PRNGKeyArray

from ..light import Sun
from ..quantity import Direction, Number, Position, Wavelength
from ..scene import Scene
from ._majorants import cross, Crossing, Majorants


class Quest(eqx.Module):
    """What is looked for: the light of a sun, or with None of media that shine."""

    scene: Scene
    cells: Majorants
    light: Sun | None
    wavelength: Wavelength
    extinction: Float[Array, "medium wl"]
    scattering: Float[Array, "medium wl"]


class Trip(eqx.Module):
    """A path on its way, or the beam from where it turned last to the sun.

    `weight` and `ratio` are those of `Walk`; `beam` is what the beam will add, of the
    brightness `bright` to begin with, and `onward` where the path goes on to after it.
    """

    position: Position
    outward: Direction
    key: PRNGKeyArray
    step: Integer[Array, ""]
    left: Integer[Array, ""]
    ray: Crossing
    grounded: Bool[Array, ""]
    beaming: Bool[Array, ""]
    onward: Direction
    order: Integer[Array, ""]
    hero: Integer[Array, ""]
    weight: Float[Array, "wl"]
    ratio: Float[Array, "wl"]
    beam: Float[Array, "wl"]
    bright: Number
    total: Float[Array, "wl"]


def begin(
    quest: Quest,
    position: Position,
    direction: Direction,
    key: PRNGKeyArray,
    paths: Integer[Array, ""] | int,
) -> Trip:
    """The first of so many paths."""
    one = jnp.ones_like(quest.wavelength)
    ray, grounded = set_out(quest, position, direction)
    count = max(quest.wavelength.shape[0], 1)
    return Trip(
        position=position,
        outward=direction,
        key=key,
        step=jnp.int32(0),
        left=jnp.int32(paths),
        ray=ray,
        grounded=grounded,
        beaming=jnp.array(False),
        onward=direction,
        order=jnp.int32(0),
        hero=jax.random.randint(jax.random.fold_in(key, 0), (), 0, count),
        weight=one,
        ratio=one,
        beam=0.0 * one,
        bright=jnp.zeros_like(ray.at),
        total=0.0 * one,
    )


def set_out(
    quest: Quest, position: Position, direction: Direction
) -> tuple[Crossing, Bool[Array, ""]]:
    """A ray through the cells, no farther than to the ground."""
    geometry = quest.scene.geometry
    span = geometry.path(geometry.locate(position), direction).span(quest.scene.top)
    ray = cross(quest.cells, position, direction, span.far)
    return ray, span.grounded
