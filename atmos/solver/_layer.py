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
_MOST = 32  # doublings: more than for an optical depth of 1e6
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
    # A loop whose length is known, so that it can be run backwards.
    doublings = primals[1]

    def maybe(state, i):
        twice = jax.checkpoint(_double)
        return jax.lax.cond(i < doublings, twice, lambda x: x, state), None

    steps = jnp.arange(_MOST, dtype=doublings.dtype)
    loop = lambda state: jax.lax.scan(maybe, state, steps)[0]
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


def product(a: Array, x: Array) -> Array:
    """Of matrices, with each other or with the vectors of every sun.

    Column by column, in a loop: what is unrolled the compiler would work out anew for
    every use of it.
    """

    def add(k, total):
        return total + a[:, k][:, None] * x[k][None]

    return jax.lax.fori_loop(0, a.shape[0], add, jnp.zeros_like(x))


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
    return inverse, -product(inverse, product(tangents[0], inverse))
