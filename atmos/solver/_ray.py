"""A ray on its way through media: what each step of it passes and sees."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

from ..geometry import AbstractPath, Point
from ..quantity import Depth, Length, Radiance
from ..scene import Scene
from ..transport import densities
from ._flight import share
from ._settled import settled


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
    at the end, through all of it. `prepared` is what the steps have made ready.
    """

    scene: Scene
    path: AbstractPath
    cuts: Float[Array, "cut"]
    extinction: Float[Array, "medium wl"]
    source: Source
    weights: Float[Array, "part wl"]
    behind: Radiance
    prepared: PyTree[Any]

    def begin(self) -> Found:
        """Nothing yet."""
        passed = jnp.zeros_like(self.extinction[:, 0])
        return Found(passed, jnp.zeros_like(self.weights), jnp.zeros_like(self.behind))

    def on(
        self,
        found: Found,
        begins: Float[Array, "step"],
        ends: Float[Array, "step"],
        places: Float[Array, "step"],
    ) -> Found:
        """Some steps on, each as if all of it were like one of the places."""
        points = settled(jax.vmap(self.path.at)(places), self.scene.top[None])
        here = jax.vmap(lambda point: densities(self.scene, point))(points)
        here = settled(here, self.scene.top[None])
        length = (ends - begins)[:, None]
        amount = here * length
        before = found.passed[None] + jnp.cumsum(amount, 0) - amount
        depth, dimmed = (_totals(x, self.extinction) for x in (amount, before))
        seen = jnp.exp(-dimmed) * share(depth) * length
        source = jax.vmap(self.source)(places, points, here)
        source = settled(source, self.scene.top[None])
        light = found.light + added(source * seen[:, None])
        return Found(found.passed + added(amount), light, found.error)

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


_totals = jax.vmap(total, in_axes=(0, None))


def added(rows: Float[Array, "row *part wl"]) -> Float[Array, "*part wl"]:
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

    From where the first begins to where the last ends. Each medium takes its share of
    `count` steps, alike in each of its pieces.
    """
    edges, shares = [], []
    for x in scene.media:
        own = jnp.clip(x.profile.breaks(path), 0.0, far)
        if x.profile.box is None:
            own = jnp.concatenate([jnp.zeros_like(far)[None], own, far[None]])
        alive = (jnp.diff(own) > 0.0).astype(own.dtype)
        upto = jnp.concatenate([jnp.zeros_like(own[:1]), jnp.cumsum(alive)])
        shares.append((own, upto / jnp.maximum(upto[-1], 1.0)))
        edges.append(own)
    if not shares:
        return jnp.zeros_like(others, far.dtype)
    edges = jnp.concatenate(edges)
    others = jnp.clip(others, jnp.min(edges), jnp.max(edges))
    edges = jnp.sort(jnp.concatenate([edges, others]))
    share = added(jnp.stack([_between(edges, *x) for x in shares]))
    even = jnp.arange(1, count, dtype=far.dtype) / count * share[-1]
    return _merged(edges, _between(even, share, edges))


def _between(
    x: Float[Array, "n"], at: Float[Array, "place"], values: Float[Array, "place"]
) -> Float[Array, "n"]:
    """Values between places that rise: `jnp.interp`, without a search."""
    found = jnp.broadcast_to(values[0], x.shape)
    for i in range(at.shape[0] - 1):
        width = at[i + 1] - at[i]
        share = (x - at[i]) / jnp.where(width > 0.0, width, 1.0)
        beyond = (x > at[i]).astype(x.dtype)
        share = jnp.where(width > 0.0, jnp.clip(share, 0.0, 1.0), beyond)
        found = found + share * (values[i + 1] - values[i])
    return found


def _merged(few: Float[Array, "n"], many: Float[Array, "m"]) -> Float[Array, "n+m"]:
    """Two rising lists as one: one of them shifted by how many of the few precede it.

    Sorting them would take longer than all that is done in the steps between.
    """
    ends = jnp.full_like(few, jnp.inf)
    found = jnp.concatenate([many, ends])
    for i, x in enumerate(few):
        shifted = jnp.concatenate([ends[: i + 1], many, ends[i + 1 :]])
        shifted = shifted.at[: i + 1].set(-jnp.inf)
        found = jnp.minimum(found, jnp.maximum(x, shifted))
    return found
