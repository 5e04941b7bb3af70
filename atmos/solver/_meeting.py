"""What a path meets next: something that may turn it, or nothing."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..geometry import Point
from ..quantity import Number
from ..transport import densities
from ._majorants import cross, fly
from ._ray import total
from ._settled import settled
from ._strata import climb
from ._trip import Leg, Quest, Trip


class Meeting(eqx.Module):
    """Where what is met lies, or the way `ends`; or neither, on a long way.

    Of `bound`, the share `real` is there, and the share `scattering` turns light, by
    `mixture` in each medium. Layered air, where it is `airy`, is met apart from clouds.
    """

    leg: Leg
    point: Point
    met: Bool[Array, ""]
    ends: Bool[Array, ""]
    airy: Bool[Array, ""]
    bound: Number
    real: Float[Array, "wl"]
    scattering: Float[Array, "wl"]
    mixture: Float[Array, "medium wl"]
    shining: Float[Array, "wl"]


def meet(quest: Quest, trip: Trip, u: Float[Array, "2"]) -> Meeting:
    """The nearest of what is met in clouds and in layered air, where not on a beam."""
    leg, depth = trip.leg, -jnp.log1p(-u)
    path, at, bound = leg.path, leg.far, jnp.ones_like(leg.far)
    met, airy = jnp.array(False), jnp.array(False)
    cells, strata = quest.majorants.cells, quest.majorants.strata
    if cells is not None:
        ray = cross(cells, path.start.position, path.direction, leg.at, leg.far)
        ray, _, bound, met = fly(cells, ray, depth[0])
        at = jnp.where(met | ray.inside(cells), ray.at, leg.far)
    if strata is not None:
        lift = jnp.where(trip.order == 0, trip.lift, 1.0)
        near, _, most, airy = climb(strata, path, leg.at, at, depth[1] / lift)
        nearer = ~trip.beaming & (near < at)
        at, bound = jnp.where(nearer, near, at), jnp.where(nearer, most * lift, bound)
        airy = airy & nearer
        met = jnp.where(nearer, airy, met)
    at, bound, met, airy = settled((at, bound, met, airy), quest.wavelength)
    point = settled(path.at(at), quest.wavelength)
    own = jnp.array([x.profile.layered for x in quest.scene.media], bool) == airy
    here = jnp.where(own, densities(quest.scene, point), 0.0)
    mixture = here[:, None] * quest.scattering
    scattering = total(here, quest.scattering)
    return Meeting(
        leg=dataclasses.replace(leg, at=at),
        point=point,
        met=met,
        ends=~met & (at >= leg.far),
        airy=airy,
        bound=bound,
        real=jnp.clip(total(here, quest.extinction) / bound, 0.0, 1.0),
        scattering=scattering / bound,
        mixture=mixture / jnp.where(scattering > 0.0, scattering, 1.0)[None],
        shining=_shining(quest, point, here) / bound,
    )


def _shining(
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
