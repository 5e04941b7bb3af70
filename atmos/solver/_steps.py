"""How a ray is marched along: by how many steps, where, and how exactly."""

import abc
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from equinox.internal import while_loop
from jaxtyping import Array, PRNGKeyArray, PyTree

from ..quantity import as_float, Number, Radiance, Wavelength
from ..scene import Scene
from ._look import of_look
from ._ray import added, Found, Ray


# So many steps are worked on at once.
TOGETHER = 16
# Beyond this optical depth nothing is seen: 2e-9 of what comes from nearer.
OPAQUE = 20.0
# Adaptive steps are no shorter than this share of what lies between two cuts.
_SHORTEST = 2.0**-7


class AbstractSteps(eqx.Module):
    """How many steps, and where. Each medium takes its share of `count` of them.

    A step goes no farther than to where a medium begins or ends.
    """

    count: eqx.AbstractVar[int]

    @property
    def pieces(self) -> int:
        """Into how many a ray is cut before it is marched along."""
        return self.count

    def prepare(self, scene: Scene, wavelength: Wavelength) -> PyTree[Any]:
        """What can be worked out before the first look; None if nothing."""
        return None

    @abc.abstractmethod
    def march(self, ray: Ray) -> Found:
        """What is found to the end of the ray."""


def _march(ray: Ray, at: Callable[[Array, Array, Array], Array]) -> Found:
    count = ray.cuts.shape[0] - 1
    rounds = -(-count // TOGETHER)
    more = jnp.broadcast_to(ray.cuts[-1], rounds * TOGETHER - count)
    cuts = jnp.concatenate([ray.cuts, more])
    begins, ends = (x.reshape(-1, TOGETHER) for x in (cuts[:-1], cuts[1:]))
    each = jnp.arange(TOGETHER, dtype=jnp.int32)

    def goes_on(state):
        i, found = state
        return (begins[i, 0] < cuts[-1]) & jnp.any(ray.depth(found) < OPAQUE)

    def step(state):
        i, found = state
        places = at(i * TOGETHER + each, begins[i], ends[i])
        return i + 1, ray.on(found, begins[i], ends[i], places)

    start = jnp.int32(0), ray.begin()
    return while_loop(goes_on, step, start, max_steps=rounds, kind="checkpointed")[1]


class Fixed(AbstractSteps):
    """Looks at the middle of each step."""

    count: int = eqx.field(static=True, default=128)

    def __check_init__(self):
        check_count(self.count)

    def march(self, ray: Ray) -> Found:
        return _march(ray, lambda i, begin, end: 0.5 * (begin + end))


class Jittered(AbstractSteps):
    """Looks at a random place in each step: what is missed becomes noise, not bands.

    All is decided by `key` and the ray.
    """

    count: int = eqx.field(static=True, default=128)
    key: PRNGKeyArray = eqx.field(default_factory=lambda: jax.random.key(0))

    def __check_init__(self):
        check_count(self.count)

    def march(self, ray: Ray) -> Found:
        key = of_look(self.key, ray.path.start.position, ray.path.direction)

        def at(i, begin, end):
            u = jax.vmap(
                lambda i: jax.random.uniform(
                    jax.random.fold_in(key, i), (), begin.dtype
                )
            )(i)
            return begin + u * (end - begin)

        return _march(ray, at)


class Adaptive(AbstractSteps):
    """Halves steps until their errors add up to no more than a share `tolerance`.

    It is that of the brightest wavelength's radiance, relative, and estimated by how
    much two half steps differ from a whole one. What lies between two places that it
    looks at is not seen: `count` are the steps to begin with. Where 1/128 of them is
    still too long, the error is above the tolerance, and says so.
    """

    tolerance: Number = eqx.field(converter=as_float, default=1e-3)
    count: int = eqx.field(static=True, default=48)

    def __check_init__(self):
        check_count(self.count)

    def march(self, ray: Ray) -> Found:
        bright = ray.radiance(Fixed(self.count).march(ray))
        bright = jax.lax.stop_gradient(bright)
        # An error is counted against what is seen, or a millionth of the brightest.
        bright = jnp.maximum(bright, 1e-6 * jnp.max(bright, initial=0.0))
        bright = jnp.where(bright > 0.0, bright, 1.0)
        cuts = ray.cuts
        last = cuts.shape[0] - 1
        pieces = jnp.sum(jnp.diff(cuts) > 0.0).astype(cuts.dtype)
        allowed = self.tolerance / jnp.maximum(pieces, 1.0)

        def goes_on(state):
            i, done, _, found = state
            more = cuts[jnp.minimum(i, last)] < cuts[last]
            return more & jnp.any(ray.depth(found) < OPAQUE)

        def step(state):
            i, done, part, found = state
            begin, whole = cuts[i], cuts[i + 1] - cuts[i]
            part = jnp.minimum(part, 1.0 - done)
            places = begin + whole * (done + part * jnp.array(_QUARTERS, cuts.dtype))
            one = ray.on(found, places[:1], places[4:], places[2:3])
            two = ray.on(found, places[:4:2], places[2::2], places[1::2])
            error = jax.lax.stop_gradient(_difference(ray, found, one, two, bright))
            worst = jnp.max(error / bright, initial=0.0)
            good = (worst <= allowed * part) | (part <= _SHORTEST)
            error = jnp.where(good, found.error + error, found.error)
            two = Found(two.passed, two.light, error)
            found = jax.tree.map(lambda a, b: jnp.where(good, a, b), two, found)
            ends = good & (done + part >= 1.0)
            done = jnp.where(ends, 0.0, jnp.where(good, done + part, done))
            longer = jnp.where(worst <= 0.2 * allowed * part, 2.0 * part, part)
            part = jnp.where(good, jnp.minimum(longer, 1.0), 0.5 * part)
            return i + ends.astype(jnp.int32), done, part, found

        zero = jnp.zeros_like(cuts[0])
        start = jnp.int32(0), zero, zero + 1.0, ray.begin()
        most = last * int(2.0 / _SHORTEST + 8.0)
        return while_loop(goes_on, step, start, max_steps=most, kind="checkpointed")[3]


_QUARTERS = [0.0, 0.25, 0.5, 0.75, 1.0]


def _difference(
    ray: Ray, found: Found, one: Found, two: Found, bright: Radiance
) -> Radiance:
    """How much two ways of going on differ, in what they see and what they hide."""
    own = jnp.abs(added(ray.weights * (one.light - two.light)))
    seen = added(ray.weights * found.light)
    hides = jnp.abs(jnp.expm1(ray.depth(two) - ray.depth(one)))
    return own + jnp.minimum(hides, 1.0) * jnp.maximum(bright - seen, 0.0)


def check_count(count: int) -> None:
    """Raises `ValueError` if there is no step."""
    if count < 1:
        raise ValueError(f"`count` must be at least 1; got {count}.")
