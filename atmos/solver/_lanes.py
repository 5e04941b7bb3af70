"""Paths that are followed together: who has come to an end takes the next.

Which lane follows a path makes no difference to it.
"""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Integer

from ._trip import Trip


# So many lanes stay in the cache of a CPU and keep it busy; each serves so many paths,
# if there are enough. When the last are on their way, they go on in so many fewer.
_LANES, _EACH, _FEWER = 4096, 8, 8
# Steps that are taken before lanes that have come to an end go on.
_STEPS = 3

Start = Callable[[Integer[Array, ""]], Trip]
Onwards = Callable[[Trip], Trip]


class Lanes(eqx.Module):
    """Paths on their way, one in each lane, and which it is: `count`, if it has none.

    Of the paths until the `next`, `done` have come to an end: `which`, and what they
    `found`, one after the other. In arrays of paths lanes come last: so XLA on CPUs
    takes the least time.
    """

    trips: Trip
    whose: Integer[Array, "lane"]
    next: Integer[Array, ""]
    done: Integer[Array, ""]
    which: Integer[Array, "path"]
    found: Float[Array, "path wl"]


def followed(start: Start, onwards: Onwards, count: int) -> Float[Array, "path wl"]:
    """What so many paths find, each from its start to its end."""
    size = min(_LANES, -(-count // _EACH))
    trips = jax.vmap(start)(jnp.arange(size, dtype=jnp.int32))
    room = count + size
    found = jnp.zeros((room, *trips.total.shape[1:]), trips.total.dtype)
    zero, size_ = jnp.int32(0), jnp.int32(size)
    lanes = Lanes(
        _turned(trips, 0, -1),
        jnp.arange(size, dtype=jnp.int32),
        size_,
        zero,
        jnp.zeros(room, jnp.int32),
        found,
    )
    fewer = size // _FEWER if size == _LANES else 0
    more = lambda x: (x.next < count) | (jnp.sum(x.whose < count) > fewer)
    walk = lambda x: _walked(x, start, onwards, count)
    lanes = jax.lax.while_loop(more, walk, lanes)
    if fewer > 0:
        left = jnp.argsort(lanes.whose)[:fewer]
        trips = jax.tree.map(lambda x: x[..., left], lanes.trips)
        lanes = Lanes(
            trips, lanes.whose[left], lanes.next, lanes.done, lanes.which, lanes.found
        )
        lanes = jax.lax.while_loop(lambda x: jnp.any(x.whose < count), walk, lanes)
    return lanes.found[jnp.argsort(lanes.which[:count])]


def _walked(lanes: Lanes, start: Start, onwards: Onwards, count: int) -> Lanes:
    """Some steps on; then lanes whose paths have ended take others."""
    step = lambda _, trips: _turned(jax.vmap(onwards)(_turned(trips, -1, 0)), 0, -1)
    trips = jax.lax.fori_loop(0, _STEPS, step, lanes.trips)
    at_end = jax.vmap(lambda x: x.ended)(_turned(trips, -1, 0))
    ended = at_end & (lanes.whose < count)
    upto = jnp.cumsum(ended, dtype=jnp.int32)
    # Those that have ended, one after the other, and what comes after does not matter.
    places = jnp.arange(upto.shape[0], dtype=jnp.int32) + 1
    those = jnp.searchsorted(upto, places, method="scan_unrolled")
    those = jnp.minimum(those, places.shape[0] - 1)
    write = jax.lax.dynamic_update_slice_in_dim
    which = write(lanes.which, lanes.whose[those], lanes.done, 0)
    found = write(lanes.found, trips.total.T[those], lanes.done, 0)
    number = lanes.next + upto - 1
    new = ended & (number < count)
    fresh = _turned(jax.vmap(start)(jnp.minimum(number, count - 1)), 0, -1)
    return Lanes(
        trips=jax.tree.map(lambda a, b: jnp.where(_like(new, a), a, b), fresh, trips),
        whose=jnp.where(ended, jnp.where(new, number, count), lanes.whose),
        next=jnp.minimum(lanes.next + upto[-1], count),
        done=lanes.done + upto[-1],
        which=which,
        found=found,
    )


def _like(new: Bool[Array, "lane"], x: Array) -> Bool[Array, "*any lane"]:
    return jnp.broadcast_to(new, x.shape)


def _turned(trips: Trip, one: int, other: int) -> Trip:
    return jax.tree.map(lambda x: jnp.moveaxis(x, one, other), trips)
