"""Random numbers that take little time to make: one short hash makes four of them.

JAX's own (Threefry) take longer than all else that a path does at a collision.
"""

import math

import jax
import jax.numpy as jnp
from jax.extend.random import define_prng_impl
from jaxtyping import Array, Integer, PRNGKeyArray, UInt, UInt32


Word = UInt32[Array, ""]
Words = UInt32[Array, "2"]
# What the hash is used for is part of what it is of.
_KEY, _NUMBERS = 1, 2


def stirred(*words: Word) -> tuple[Word, Word, Word, Word]:
    """Four words, each of which hangs on all of four others.

    `pcg4d` of Jarzynski and Olano (2020), Hash Functions for GPU Rendering.
    """

    def mixed(x, y, z, w):
        x = x + y * w
        y = y + z * x
        z = z + x * y
        return x, y, z, w + y * z

    once = mixed(*(x * jnp.uint32(1664525) + jnp.uint32(1013904223) for x in words))
    return mixed(*(x ^ (x >> jnp.uint32(16)) for x in once))


def _seed(seed: Integer[Array, ""]) -> Words:
    return _fold_in(jnp.zeros(2, jnp.uint32), seed.astype(jnp.uint32))


def _fold_in(key: Words, word: Word | int) -> Words:
    return jnp.stack(stirred(key[0], key[1], jnp.uint32(word), jnp.uint32(_KEY))[:2])


def _split(key: Words, shape: tuple[int, ...]) -> UInt32[Array, "*n 2"]:
    index = jnp.arange(math.prod(shape), dtype=jnp.uint32)
    return jax.vmap(_fold_in, (None, 0))(key, index).reshape(*shape, 2)


def _bits(key: Words, width: int, shape: tuple[int, ...]) -> UInt[Array, "*n"]:
    count, words = math.prod(shape), []
    for i in range(-(-count * (width // 32) // 4)):
        words += stirred(key[0], key[1], jnp.uint32(i), jnp.uint32(_NUMBERS))
    if width == 64:
        wide = [x.astype(jnp.uint64) for x in words]
        pairs = zip(wide[::2], wide[1::2], strict=True)
        words = [(a << jnp.uint64(32)) | b for a, b in pairs]
    return jnp.stack(words[:count]).reshape(shape)


_QUICK = define_prng_impl(
    key_shape=(2,), seed=_seed, split=_split, random_bits=_bits, fold_in=_fold_in
)


def quick(key: PRNGKeyArray) -> PRNGKeyArray:
    """A key of these numbers, decided by one of JAX's own."""
    return as_key(jax.random.bits(key, (2,), jnp.uint32))


def as_key(words: Words) -> PRNGKeyArray:
    """The key that two words stand for."""
    return jax.random.wrap_key_data(words, impl=_QUICK)
