"""How a ray is marched along: by how many steps, where, and how exactly."""

import abc
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
from equinox.internal import while_loop
from jaxtyping import Array, Float, PRNGKeyArray

from ..geometry import AbstractPath, Point
from ..quantity import as_float, Depth, Length, Number, Radiance
from ..scene import Scene
from ..transport import densities
from ._flight import share
from ._look import of_look


# Beyond this optical depth nothing is seen: 2e-9 of what comes from nearer.
_OPAQUE = 20.0
# Adaptive steps are no shorter than this share of what lies between two cuts.
_SHORTEST = 2.0**-7


# Of a place, given by its distance too, and of how much of each medium there is.
Source = Callable[[Length, Point, Float[Array, "medium"]], Float[Array, "part wl"]]


class Found(eqx.Module):
    """How much of each medium was passed, what was seen, and how far that may be off.

    `light` is in parts, each yet to be multiplied by the `weights` of the ray.
    """

    passed: Float[Array, "medium"]
    light: Float[Array, "part wl"]
    error: Radiance


class Ray(eqx.Module):
    """A ray, cut where it has to be, and what each metre of it adds.

    `source` is what a metre there adds. `behind` is seen
    at the end, through all of it.
    """

    scene: Scene
    path: AbstractPath
    cuts: Float[Array, "cut"]
    extinction: Float[Array, "medium wl"]
    source: Source
    weights: Float[Array, "part wl"]
    behind: Radiance

    def begin(self) -> Found:
        """Nothing yet."""
        passed = jnp.zeros_like(self.extinction[:, 0])
        return Found(passed, jnp.zeros_like(self.weights), jnp.zeros_like(self.behind))

    def step(self, found: Found, begin: Length, end: Length, at: Length) -> Found:
        """One step on, as if all of it were like the place `at`."""
        point = self.path.at(at)
        here = densities(self.scene, point)
        length = end - begin
        depth = total(here * length, self.extinction)
        seen = jnp.exp(-self.depth(found)) * share(depth) * length
        light = found.light + self.source(at, point, here) * seen[None]
        return Found(found.passed + here * length, light, found.error)

    def depth(self, found: Found) -> Depth:
        """The optical depth that was passed."""
        return total(found.passed, self.extinction)

    def radiance(self, found: Found) -> Radiance:
        """What is seen in all, of what was passed and of what is behind."""
        own = added(self.weights * found.light)
        return own + jnp.exp(-self.depth(found)) * self.behind


class AbstractSteps(eqx.Module):
    """How many steps, and where. Each medium takes its share of `count` of them.

    A step goes no farther than to where a medium begins or ends.
    """

    count: eqx.AbstractVar[int]

    @abc.abstractmethod
    def march(self, ray: Ray) -> Found:
        """What is found to the end of the ray."""


def _march(ray: Ray, at: Callable[[Array, Length, Length], Length]) -> Found:
    def step(found, piece):
        i, begin, end = piece
        return ray.step(found, begin, end, at(i, begin, end)), None

    pieces = jnp.arange(ray.cuts.shape[0] - 1), ray.cuts[:-1], ray.cuts[1:]
    # A gradient would else keep what was worked out in every step.
    return jax.lax.scan(jax.checkpoint(step), ray.begin(), pieces)[0]


class Fixed(AbstractSteps):
    """Looks at the middle of each step."""

    count: int = eqx.field(static=True, default=128)

    def __check_init__(self):
        _check_count(self.count)

    def march(self, ray: Ray) -> Found:
        return _march(ray, lambda i, begin, end: 0.5 * (begin + end))


class Jittered(AbstractSteps):
    """Looks at a random place in each step: what is missed becomes noise, not bands.

    All is decided by `key` and the ray.
    """

    count: int = eqx.field(static=True, default=128)
    key: PRNGKeyArray = eqx.field(default_factory=lambda: jax.random.key(0))

    def __check_init__(self):
        _check_count(self.count)

    def march(self, ray: Ray) -> Found:
        key = of_look(self.key, ray.path.start.position, ray.path.direction)

        def at(i, begin, end):
            u = jax.random.uniform(jax.random.fold_in(key, i), (), begin.dtype)
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
        _check_count(self.count)

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
            return more & jnp.any(ray.depth(found) < _OPAQUE)

        def step(state):
            i, done, part, found = state
            begin, whole = cuts[i], cuts[i + 1] - cuts[i]
            part = jnp.minimum(part, 1.0 - done)
            places = begin + whole * (done + part * jnp.array(_QUARTERS, cuts.dtype))
            one = ray.step(found, places[0], places[4], places[2])
            two = ray.step(found, places[0], places[2], places[1])
            two = ray.step(two, places[2], places[4], places[3])
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


def total(
    amount: Float[Array, "medium"], each: Float[Array, "medium wl"]
) -> Float[Array, "wl"]:
    """What so much of each medium does: a product with a matrix, medium by medium.

    As a product it would be a step of its own in every step; and as a sum over an axis,
    in batches of thousands, XLA's compiler for CPUs (JAX 0.10.2) gets it wrong.
    """
    return added(amount[:, None] * each)


def added(rows: Float[Array, "row wl"]) -> Float[Array, "wl"]:
    """The sum of some rows, one after the other."""
    found = jnp.zeros_like(rows, shape=rows.shape[1:])
    for row in rows:
        found = found + row
    return found


def _check_count(count: int) -> None:
    if count < 1:
        raise ValueError(f"`count` must be at least 1; got {count}.")


def cut(
    scene: Scene,
    path: AbstractPath,
    far: Length,
    others: Float[Array, "other"],
    count: int,
) -> Float[Array, "cut"]:
    """Cuts a ray where media begin or end, at `others`, and into steps between.

    Each medium takes its share of `count` steps, alike in each of its pieces.
    """
    edges, shares = [jnp.clip(others, 0.0, far)], []
    for x in scene.media:
        own = jnp.clip(x.profile.breaks(path), 0.0, far)
        if x.profile.box is None:
            own = jnp.concatenate([jnp.zeros_like(far)[None], own, far[None]])
        alive = (jnp.diff(own) > 0.0).astype(own.dtype)
        upto = jnp.concatenate([jnp.zeros_like(own[:1]), jnp.cumsum(alive)])
        shares.append((own, upto / jnp.maximum(upto[-1], 1.0)))
        edges.append(own)
    edges = jnp.sort(jnp.concatenate(edges))
    if not shares or edges.shape[0] < 2:
        return edges
    share = jnp.sum(jnp.stack([jnp.interp(edges, *x) for x in shares]), 0)
    even = jnp.arange(1, count, dtype=far.dtype) / count * share[-1]
    return jnp.sort(jnp.concatenate([edges, jnp.interp(even, share, edges)]))
