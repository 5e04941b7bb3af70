"""The physical quantities of atmos, each with its unit, each named once.

Lengths are metres, wavelengths nanometres, angles radians. Spectral quantities put the
wavelength axis `wl` last; `#wl` may be 1 where the wavelength makes no difference.
"""

import math
from typing import TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float


Number: TypeAlias = Float[Array, ""]  # 1
Length: TypeAlias = Float[Array, ""]  # m
Angle: TypeAlias = Float[Array, ""]  # rad
Cosine: TypeAlias = Float[Array, ""]  # 1
Versine: TypeAlias = Float[Array, ""]  # 1, one minus the cosine
Position: TypeAlias = Float[Array, "3"]  # m, origin on the ground, z up
Direction: TypeAlias = Float[Array, "3"]  # 1, unit length
Wavelength: TypeAlias = Float[Array, "wl"]  # nm
Spectral: TypeAlias = Float[Array, "#wl"]  # a function of wavelength, unit by context
PhaseValue: TypeAlias = Float[Array, "#wl"]  # sr^-1
Fraction: TypeAlias = Float[Array, "wl"]  # 1
Depth: TypeAlias = Float[Array, "wl"]  # 1, optical depth
Irradiance: TypeAlias = Float[Array, "wl"]  # W m^-2 nm^-1
Radiance: TypeAlias = Float[Array, "wl"]  # W m^-2 sr^-1 nm^-1
Stokes: TypeAlias = Float[Array, "3 wl"]  # I, Q and U, W m^-2 sr^-1 nm^-1

m = 1.0
km = 1000.0 * m
nm = 1.0
deg = math.pi / 180.0


def as_float(x: ArrayLike) -> Array:
    """The converter of every field that one might fit: always a floating array."""
    if isinstance(x, float | int | np.ndarray | np.generic):
        # What has its final precision JAX need not compile a program to convert.
        x = np.asarray(x)
        dtype = jax.dtypes.canonicalize_dtype(_floating(x.dtype))
        return jnp.asarray(x.astype(dtype), dtype)
    x = jnp.asarray(x)
    return x.astype(_floating(x.dtype))


def _floating(dtype: np.dtype) -> np.dtype:
    return dtype if jnp.issubdtype(dtype, jnp.floating) else np.dtype(float)


def versine(a: Direction, b: Direction) -> Versine:
    """One minus the cosine of the angle between two directions.

    Half the squared chord: it keeps its digits at small angles, where the cosine of a
    single-precision number is 1 all over the solar disk.
    """
    apart = a - b
    return 0.5 * inner(apart, apart)


def dot(a: Array, b: Array) -> Array:
    """A product of vectors and matrices, in full precision.

    Left to themselves GPUs round its factors to 10 bits.
    """
    return jnp.dot(a, b, precision="highest")


def inner(a: Float[Array, "3"], b: Float[Array, "3"]) -> Number:
    """The scalar product, term by term: so it takes least time in large batches."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
