"""Paths that are followed together: a lane whose path has ended takes the next.

Which lane follows a path makes no difference to it.
"""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Integer

from ._trip import Trip


# So many lanes keep a device busy, and on a CPU stay in its cache. Each serves so many
# paths, if there are enough; the last are gone on with in so many times fewer lanes.
_LANES, _LANES_ON_CPU, _EACH, _FEWER = 2**17, 2**12, 8, 8
# Steps that are taken before lanes whose paths have ended take others.
_STEPS = 3

Start = Callable[[Integer[Array, ""]], Trip]
Onwards = Callable[[Trip], Trip]


class Lanes(eqx.Module):
    """Paths on their way, one in each lane, and which it is: `count`, if it has none.

    Until the `next`, all are on their way or have come to an end: so many `done`,
    `which` ones and what they `found`, one after the other. `trips` have the axis of
    lanes last: so XLA on CPUs takes the least time.
    """

    trips: Trip
    whose: Integer[Array, "lane"]
    next: Integer[Array, ""]
    done: Integer[Array, ""]
    which: Integer[Array, "room"]
    found: Float[Array, "room number"]


def followed(start: Start, onwards: Onwards, count: int) -> Float[Array, "path number"]:
    """What so many paths find, each from its start to its end, and their `late`."""
    most = _LANES_ON_CPU if jax.default_backend() == "cpu" else _LANES
    size = min(most, -(-count // _EACH))
    fewer = size // _FEWER if size == most else 0
    whose = jnp.arange(size, dtype=jnp.int32)
    trips = jax.vmap(start)(whose)
    lanes = Lanes(
        trips=_turned(trips, 0, -1),
        whose=whose,
        next=jnp.int32(size),
        done=jnp.int32(0),
        which=jnp.zeros(count + size, jnp.int32),
        found=jnp.zeros_like(
            trips.total, shape=(count + size, trips.total.shape[1] + 1)
        ),
    )
    walk = lambda x: _walked(x, start, onwards, count)
    going = lambda x: (x.next < count) | (jnp.sum(x.whose < count) > fewer)
    lanes = jax.lax.while_loop(going, walk, lanes)
    if fewer > 0:
        left = jnp.argsort(lanes.whose)[:fewer]
        trips = jax.tree.map(lambda x: x[..., left], lanes.trips)
        where = lambda x: (x.trips, x.whose)
        lanes = eqx.tree_at(where, lanes, (trips, lanes.whose[left]))
        lanes = jax.lax.while_loop(lambda x: jnp.any(x.whose < count), walk, lanes)
    return lanes.found[jnp.argsort(lanes.which[:count])]


def _walked(lanes: Lanes, start: Start, onwards: Onwards, count: int) -> Lanes:
    """Some steps on; then lanes whose paths have ended take others."""
    step = lambda _, trips: _turned(jax.vmap(onwards)(_turned(trips, -1, 0)), 0, -1)
    trips = jax.lax.fori_loop(0, _STEPS, step, lanes.trips)
    stands = jax.vmap(lambda x: x.ended)(_turned(trips, -1, 0))
    ended = stands & (lanes.whose < count)
    upto = jnp.cumsum(ended, dtype=jnp.int32)

    # Those that have ended, one after the other; what comes after them is overwritten.
    places = jnp.arange(upto.shape[0], dtype=jnp.int32)
    those = jnp.searchsorted(upto, places + 1, method="scan_unrolled")
    those = jnp.minimum(those, places[-1])
    write = jax.lax.dynamic_update_slice_in_dim
    number = lanes.next + upto - 1
    new = ended & (number < count)
    fresh = _turned(jax.vmap(start)(jnp.minimum(number, count - 1)), 0, -1)
    choose = lambda a, b: jnp.where(jnp.broadcast_to(new, a.shape), a, b)
    found = jnp.concatenate([trips.total, trips.late[None]]).T
    return Lanes(
        trips=jax.tree.map(choose, fresh, trips),
        whose=jnp.where(ended, jnp.where(new, number, count), lanes.whose),
        next=jnp.minimum(lanes.next + upto[-1], count),
        done=lanes.done + upto[-1],
        which=write(lanes.which, lanes.whose[those], lanes.done, 0),
        found=write(lanes.found, found[those], lanes.done, 0),
    )


def _turned(trips: Trip, one: int, other: int) -> Trip:
    return jax.tree.map(lambda x: jnp.moveaxis(x, one, other), trips)
