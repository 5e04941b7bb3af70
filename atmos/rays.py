"""Many rays at once, in blocks of one shape: one compilation, and little memory."""

import math
from collections.abc import Callable, Iterator

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .quantity import Direction, Position, Radiance
from .solver import SolvedSky
from .transport import optical_depth


_FEWEST = 16  # wavelengths that are worked on together
_TOGETHER = 2**11  # rays times wavelengths in a block: they fit into the cache

Table = Float[np.ndarray, "ray wl"]


def direction(zenith: ArrayLike, azimuth: ArrayLike) -> Float[np.ndarray, "*n 3"]:
    """The unit vector at a zenith angle and an azimuth from north, in degrees.

    In double precision: in single precision it would be off by 1e-7.
    """
    zenith, azimuth = np.radians(zenith), np.radians(azimuth)
    level = np.sin(zenith)
    parts = [level * np.sin(azimuth), level * np.cos(azimuth), np.cos(zenith)]
    return np.stack(np.broadcast_arrays(*parts), -1)


def angles(towards: Float[np.ndarray, "3"]) -> tuple[float, float]:
    """Zenith angle and azimuth of a direction, in degrees.

    With no more decimals than it takes to make the direction of them again.
    """
    east, north, up = (float(x) for x in towards)
    zenith = math.degrees(math.atan2(math.hypot(east, north), up))
    azimuth = math.degrees(math.atan2(east, north)) % 360.0
    shorter = lambda n: (round(zenith, n), round(azimuth, n))
    return shorter(decimals(lambda n: direction(*shorter(n)), towards))


def decimals(made: Callable[[int], ArrayLike], wanted: np.ndarray) -> int:
    """The fewest decimals of numbers of which is made what is wanted, to rounding."""
    near = np.finfo(wanted.dtype).eps * np.max(np.abs(wanted))
    for count in range(3, 17):
        if np.all(np.abs(made(count) - wanted) <= near):
            return count
    return 17


def padded(wavelength: Float[np.ndarray, "wl"]) -> Float[np.ndarray, "more"]:
    """The wavelengths, and the last one again up to a power of two, 16 or more.

    What is compiled for one number of wavelengths then serves others too.
    """
    size = max(_FEWEST, 2 ** math.ceil(math.log2(wavelength.size)))
    return np.pad(wavelength, (0, size - wavelength.size), mode="edge")


def combinations(sky: SolvedSky, *axes: np.ndarray) -> Iterator[tuple[np.ndarray, ...]]:
    """All combinations of numbers, the last axis fastest, as blocks of columns."""
    shape = tuple(axis.size for axis in axes)
    count, block = math.prod(shape), _block(sky)
    for first in range(0, count, block):
        places = np.unravel_index(np.arange(first, min(first + block, count)), shape)
        yield tuple(axis[i] for axis, i in zip(axes, places, strict=True))


def radiances(
    sky: SolvedSky,
    altitude: Float[np.ndarray, "ray"],
    direction: Float[np.ndarray, "ray 3"],
) -> Table:
    """What one sees straight above the origin, for one block of `combinations`.

    In W m^-2 sr^-1 nm^-1; altitudes in m.
    """
    found = _radiances(sky, *_filled(sky, altitude, direction))
    return np.asarray(found)[: altitude.size]


def polarised_radiances(
    sky: SolvedSky,
    altitude: Float[np.ndarray, "ray"],
    direction: Float[np.ndarray, "ray 3"],
) -> Float[np.ndarray, "ray wl 3"]:
    """I, Q and U of the same, in the frame of `atmos.polarisation`."""
    found = _stokes(sky, *_filled(sky, altitude, direction))
    return np.moveaxis(np.asarray(found), 1, 2)[: altitude.size]


def optical_depths(
    sky: SolvedSky,
    altitude: Float[np.ndarray, "ray"],
    direction: Float[np.ndarray, "ray 3"],
) -> Table:
    """The optical depths to the ground or the top of the air, for such a block."""
    found = _depths(sky, *_filled(sky, altitude, direction))
    return np.asarray(found)[: altitude.size]


def _block(sky: SolvedSky) -> int:
    return max(16, _TOGETHER // sky.wavelength.size)


def _filled(
    sky: SolvedSky,
    altitude: Float[np.ndarray, "ray"],
    direction: Float[np.ndarray, "ray 3"],
) -> tuple[Float[Array, "n 3"], Float[Array, "n 3"]]:
    """Positions and directions, the last ones again up to the size of a block."""
    missing = ((0, _block(sky) - altitude.size), (0, 0))
    position = altitude[:, None] * np.array([[0.0, 0.0, 1.0]])
    dtype = sky.wavelength.dtype
    return (
        jnp.asarray(np.pad(position, missing, mode="edge"), dtype),
        jnp.asarray(np.pad(direction, missing, mode="edge"), dtype),
    )


@eqx.filter_jit
def _radiances(
    sky: SolvedSky,
    position: Float[Array, "n 3"],
    direction: Float[Array, "n 3"],
) -> Float[Array, "n wl"]:
    return jax.vmap(sky.radiance)(position, direction)


@eqx.filter_jit
def _stokes(
    sky: SolvedSky,
    position: Float[Array, "n 3"],
    direction: Float[Array, "n 3"],
) -> Float[Array, "n 3 wl"]:
    return jax.vmap(sky.stokes)(position, direction)


@eqx.filter_jit
def _depths(
    sky: SolvedSky,
    position: Float[Array, "n 3"],
    direction: Float[Array, "n 3"],
) -> Float[Array, "n wl"]:
    def depth(position: Position, direction: Direction) -> Radiance:
        return optical_depth(sky.scene, position, direction, sky.wavelength)

    return jax.vmap(depth)(position, direction)
