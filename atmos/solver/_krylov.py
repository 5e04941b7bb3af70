"""Linear equations whose operator one can only apply."""

import functools as ft
import operator
from collections.abc import Callable
from typing import Any, TypeVar

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree


T = TypeVar("T", bound=PyTree[Any])

# Directions that a new one is made orthogonal to.
_KEPT = 5


def fixed_point(
    carry: Callable[[T], T], first: T, tolerance: float, most: int
) -> tuple[T, Float[Array, "wl"]]:
    """What is `first` more than what `carry`, a linear function, makes of it.

    With its relative error at each wavelength, the last axis of all arrays, which
    `carry` must not mix. Found in no more than `most` steps, by generalised conjugate
    residuals without the oldest directions (Orthomin; Eisenstat, Elman and Schultz
    1983, SIAM Journal on Numerical Analysis 20(2)). Differentiable at no more than the
    price of another solution. Of a wavelength at which `first` holds what is not a
    number nothing is a number.
    """
    less = lambda x: jax.tree.map(operator.sub, x, carry(x))
    solve = lambda apply, b: _conjugate_residuals(apply, b, tolerance, most)
    return jax.lax.custom_linear_solve(less, first, solve, solve, has_aux=True)


def _conjugate_residuals(
    apply: Callable[[T], T], first: T, tolerance: float, most: int
) -> tuple[T, Float[Array, "wl"]]:
    size = jnp.sqrt(_product(first, first))
    whole = jnp.where(size > 0.0, size, 1.0)
    error = lambda residual: jnp.sqrt(_product(residual, residual)) / whole

    def goes_on(state):
        step, _, residual, *_ = state
        return (step < most) & jnp.any(error(residual) > tolerance)

    def advance(state):
        step, x, residual, ways, images = state
        image = apply(residual)
        along = jax.vmap(_product, (0, None))(images, image)
        way, image = _less(residual, along, ways), _less(image, along, images)
        length = jnp.sqrt(_product(image, image))
        some = length > 0.0
        scale = jnp.where(some, 1.0 / jnp.where(some, length, 1.0), 0.0)
        way, image = jax.tree.map(lambda y: _scaled(y, scale), (way, image))
        share = _product(image, residual)
        x = jax.tree.map(lambda y, z: y + _scaled(z, share), x, way)
        residual = jax.tree.map(lambda y, z: y - _scaled(z, share), residual, image)
        put = ft.partial(jax.tree.map, lambda all, one: all.at[step % _KEPT].set(one))
        return step + 1, x, residual, put(ways, way), put(images, image)

    zeros = jax.tree.map(jnp.zeros_like, first)
    none = jax.tree.map(lambda x: jnp.zeros((_KEPT, *x.shape), x.dtype), first)
    start = jnp.zeros((), jnp.int32), zeros, first, none, none
    _, x, residual, _, _ = jax.lax.while_loop(goes_on, advance, start)
    missing = error(residual)
    # No step was taken for what is not a number; nothing would pass for its slope.
    known = jnp.where(jnp.isnan(missing), missing, 1.0)
    return jax.tree.map(lambda y: _scaled(y, known), x), missing


def _product(x: T, y: T) -> Float[Array, "wl"]:
    over = lambda a, b: jnp.sum(a * b, tuple(range(a.ndim - 1)))
    return ft.reduce(operator.add, jax.tree.leaves(jax.tree.map(over, x, y)))


def _scaled(x: Array, scale: Float[Array, "wl"]) -> Array:
    return x * scale.reshape((1,) * (x.ndim - 1) + scale.shape)


def _less(x: T, along: Float[Array, "kept wl"], ways: T) -> T:
    """What of `x` does not lie along others."""
    lies = lambda y: sum(_scaled(y[i], along[i]) for i in range(_KEPT))
    return jax.tree.map(lambda x, y: x - lies(y), x, ways)
