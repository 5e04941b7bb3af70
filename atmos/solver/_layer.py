"""What one layer does to light, and the small matrices that say so.

They lie along the first axes, and all that is alike for many along the last: of the
arithmetic of a few numbers a processor makes much only where it is done on many.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array


# The largest half thickness of a slice, along the lowest ordinate or the beam, for
# which the ratio of polynomials below is good to 1e-10.
START = 0.5
# Doublings: more than for an optical depth of 1e6; and how many of them in a block.
_MOST, _BLOCK = 32, 4
_PADE = (1.0, 1.0 / 2.0, 1.0 / 9.0, 1.0 / 72.0, 1.0 / 1008.0, 1.0 / 30240.0)


def respond(a, b, p, q, fall, doublings):
    """Y and Z of a layer, and what its own beam adds to them, from those of a slice."""
    one = identity(a)
    x = product(a, b)
    square = product(x, x)
    even = one + _PADE[2] * x + _PADE[4] * square
    odd = _PADE[1] * one + _PADE[3] * x + _PADE[5] * square
    inverse = inverse_of(even)
    ratio = product(inverse, odd)
    y, z = product(b, ratio), product(ratio, a)

    # Hermite's two-point formula for a source that falls as an exponential.
    end = jnp.exp(-fall)
    s = d = jnp.zeros_like(p)
    for i in range(4, -1, -1):
        terms = [
            _PADE[k] * (-fall) ** (k - 1 - i) * ((-1.0) ** k * end - 1.0)
            for k in range(i + 1, 6)
        ]
        weight = sum(terms[1:], start=terms[0])
        s, d = product(a, d) + weight * q, product(b, s) + weight * p
    p, r = product(_transposed(inverse), d), product(inverse, s)

    return _doubled((y, z, p, r, fall), doublings)[:4]


@jax.custom_jvp
def _doubled(state, doublings):
    """What twice as thick a slice does, so many times over."""
    return jax.lax.fori_loop(0, doublings, lambda _, x: _double(x), state)


@_doubled.defjvp
def _(primals, tangents):
    # Loops whose lengths are known, so that they can be run backwards: blocks of them,
    # most of which are passed by, so that few states are kept.
    doublings = primals[1]

    def maybe(function):
        def step(state, i):
            twice = jax.checkpoint(lambda x: function(x, i))
            return jax.lax.cond(i < doublings, twice, lambda x: x, state), None

        return step

    def block(state, first):
        steps = first + jnp.arange(_BLOCK, dtype=doublings.dtype)
        return jax.lax.scan(maybe(lambda x, _: _double(x)), state, steps)[0]

    steps = jnp.arange(0, _MOST, _BLOCK, dtype=doublings.dtype)
    loop = lambda state: jax.lax.scan(maybe(block), state, steps)[0]
    return jax.jvp(loop, primals[:1], tangents[:1])


def _double(state):
    y, z, p, r, fall = state
    solved = inverse_of(identity(y) + product(z, y))
    both, loss = 1.0 + jnp.exp(-fall), -jnp.expm1(-fall)
    p, r = (
        product(_transposed(solved), both * p + loss * product(y, r)),
        product(solved, both * r + loss * product(z, p)),
    )
    y, z = 2.0 * product(y, solved), 2.0 * product(solved, z)
    return y, z, p, r, 2.0 * fall


def identity(a: Array) -> Array:
    """As many as there are of `a`."""
    eye = jnp.eye(a.shape[0], dtype=a.dtype)
    return jnp.broadcast_to(eye.reshape(eye.shape + (1,) * (a.ndim - 2)), a.shape)


@jax.custom_jvp
def product(a: Array, x: Array) -> Array:
    """Of matrices, with each other or with the vectors of every sun.

    Column by column, in a loop: what is unrolled the compiler would work out anew for
    every use of it.
    """

    def add(k, total):
        return total + a[:, k][:, None] * x[k][None]

    return jax.lax.fori_loop(0, a.shape[0], add, jnp.zeros_like(x))


@product.defjvp
def _(primals, tangents):
    # In one operation: backwards, a loop would keep and add up all of its steps.
    a, x = primals
    more, other = tangents
    return product(a, x), _at_once(more, x) + _at_once(a, other)


def _at_once(a: Array, x: Array) -> Array:
    return jnp.einsum("ik...,kc...->ic...", a, x, precision="highest")


def _transposed(a: Array) -> Array:
    return jnp.swapaxes(a, 0, 1)


@jax.custom_jvp
def inverse_of(a: Array) -> Array:
    """By elimination without pivots: all that are asked for exceed the identity."""
    one = identity(a)

    def eliminate(k, a):
        unit = one[k]
        column, row = a[:, k], a[k]
        row = jnp.where(unit > 0.0, unit, row) / row[k][None]
        kept = jnp.where(unit[None] > 0.0, one[:, k][:, None], a)
        return kept - (column - unit)[:, None] * row[None]

    return jax.lax.fori_loop(0, a.shape[0], eliminate, a)


@inverse_of.defjvp
def _(primals, tangents):
    inverse = inverse_of(*primals)
    return inverse, -_at_once(inverse, _at_once(tangents[0], inverse))
