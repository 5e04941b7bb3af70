"""A ray on its way through media: what each step of it passes and sees."""

from collections.abc import Callable

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import AbstractPath, Point
from ..quantity import Depth, Length, Radiance
from ..scene import Scene
from ..transport import densities
from ._flight import share


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
