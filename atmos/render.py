"""From a sky to a picture: one radiance per pixel and wavelength, or colour."""

import operator
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, Integer

from .camera import AbstractCamera
from .sky import AbstractPanorama, AbstractSky


_BLOCK = 2**13  # pixels that are worked on together, so that they stay in the cache
_STRETCH = 2**20  # pixels between two reports of progress
_RAYS, _RAY_STRETCH = 2**9, 2**15  # the same where each pixel is a ray of its own
_TILE = 32  # pixels along an edge of what is looked at together
# One of each, so that what is compiled for a picture serves the next.
_RADIANCE, _STOKES = operator.attrgetter("radiance"), operator.attrgetter("stokes")

Response = Float[Array, "wl channel"]


def render(
    sky: AbstractSky,
    camera: AbstractCamera,
    response: Response | None = None,
    *,
    progress: Callable[[float], None] = lambda done: None,
) -> Float[Array, "height width channel"]:
    """Looks at the sky through the camera: everything but the disks of the lights.

    Spectral radiance in W m^-2 sr^-1 nm^-1, its last axis the wavelength; or, with a
    `response`, the sum over wavelengths of radiance times response, such as XYZ from
    `colour.response`. What the camera does not see is 0. `progress` is told now and
    then which share is done. Raises `ValueError` unless the camera stands straight
    above the origin, or the sky holds what depends on the place: then each pixel is
    looked at by itself.
    """
    if not sky.has_panorama:
        return _by_rays(sky, camera, response, progress, _RADIANCE)
    return _picture(sky, camera, response, progress, _radiance)


def render_stokes(
    sky: AbstractSky,
    camera: AbstractCamera,
    response: Response | None = None,
    *,
    progress: Callable[[float], None] = lambda done: None,
) -> Float[Array, "3 height width channel"]:
    """The same for polarised light: I as of `render`, and Q and U.

    In the frame of `atmos.polarisation`: Q counts what vibrates level, whichever way
    the camera is turned. Raises `ValueError` for a sky without polarisation, too.
    """
    if not sky.has_panorama:
        picture = _by_rays(sky, camera, response, progress, _STOKES)
    else:
        picture = _picture(sky, camera, response, progress, _stokes)
    return jnp.moveaxis(picture, 2, 0)


def _picture(
    sky: AbstractSky,
    camera: AbstractCamera,
    response: Response | None,
    progress: Callable[[float], None],
    look: Callable[..., Array],
) -> Float[Array, "height width *stokes channel"]:
    dtype = sky.wavelength.dtype
    camera = jax.tree.map(lambda x: x.astype(dtype), camera)
    response = None if response is None else response.astype(dtype)
    panorama = sky.panorama(camera.position)
    if response is not None and panorama.even:
        panorama, response = _weigh(panorama, response), None
    zenith, azimuth, sees = _directions(camera)
    if zenith.shape[1] > 1:
        panorama = _finer(panorama)
    # Stretches alike in size, so that they share one compilation.
    count = -(-camera.height * camera.width // _STRETCH)
    rows = -(-camera.height // count)
    parts = []
    for first in range(0, camera.height, rows):
        part = slice(first, first + rows)
        around = azimuth[part] if azimuth.shape[0] > 1 else azimuth
        parts.append(_stretch(panorama, zenith[part], around, response, look))
        progress(min(1.0, (first + rows) / camera.height))
    image = parts[0] if len(parts) == 1 else jnp.concatenate(parts)
    return _black(image, sees)


@eqx.filter_jit
def _directions(
    camera: AbstractCamera,
) -> tuple[
    Float[Array, "height #width"],
    Float[Array, "#height width"],
    Bool[Array, "#height #width"],
]:
    """Where pixels look, each or each row and column; which of them see."""
    zenith, azimuth = camera.angles()
    if zenith.shape[1] > 1:
        zenith, azimuth = jnp.broadcast_arrays(zenith, azimuth)
    return zenith, azimuth, camera.sees()


def _by_rays(
    sky: AbstractSky,
    camera: AbstractCamera,
    response: Response | None,
    progress: Callable[[float], None],
    looks: Callable[[Any], Callable[..., Array]],
) -> Float[Array, "height width *stokes channel"]:
    """Every pixel's centre by a ray of its own."""
    dtype = sky.wavelength.dtype
    camera = jax.tree.map(lambda x: x.astype(dtype), camera)
    response = None if response is None else response.astype(dtype)
    order = _in_tiles(camera.height, camera.width)
    stretch = min(_RAY_STRETCH, -(-order.size // _RAYS) * _RAYS)
    padded = np.pad(order, (0, -order.size % stretch), mode="edge")
    stretches = jnp.asarray(padded.reshape(-1, stretch))
    look = lambda pixels: _rays(sky, camera, pixels, response, looks)
    # The first compiles what the others, on as many cores as there are, use.
    parts = [look(stretches[0])]
    progress(1.0 / len(stretches))
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for part in pool.map(look, stretches[1:]):
            parts.append(jax.block_until_ready(part))
            progress(len(parts) / len(stretches))
    image = jnp.concatenate(parts)[np.argsort(order)]
    image = image.reshape(camera.height, camera.width, *image.shape[1:])
    return _black(image, camera.sees())


def _in_tiles(height: int, width: int) -> Integer[np.ndarray, "pixel"]:
    """Pixels in the order of tiles: rays that are worked on together see alike."""
    y, x = np.indices((height, width), np.int32).reshape(2, -1)
    return np.lexsort((x, y, x // _TILE, y // _TILE)).astype(np.int32)


@eqx.filter_jit
def _rays(
    sky: AbstractSky,
    camera: AbstractCamera,
    pixels: Int[Array, "ray"],
    response: Response | None,
    looks: Callable[[Any], Callable[..., Array]],
) -> Float[Array, "ray *stokes channel"]:
    def one(pixel):
        x, y = pixel % camera.width, pixel // camera.width
        x, y = (a.astype(sky.wavelength.dtype) + 0.5 for a in (x, y))
        radiance = looks(sky)(camera.position, camera.direction(x, y))
        if response is None:
            return radiance
        return jnp.matmul(radiance, response, precision="highest")

    return jax.lax.map(one, pixels, batch_size=_RAYS)


def _black(
    image: Float[Array, "height width *channel"], sees: Bool[Array, "#height #width"]
) -> Float[Array, "height width *channel"]:
    """The picture, black where the camera does not see."""
    if sees.size == 1:
        return image
    return jnp.where(jnp.expand_dims(sees, tuple(range(2, image.ndim))), image, 0.0)


def _radiance(panorama: AbstractPanorama, zenith: Array, azimuth: Array) -> Array:
    return panorama.radiance(zenith, azimuth)


def _stokes(panorama: AbstractPanorama, zenith: Array, azimuth: Array) -> Array:
    return panorama.stokes(zenith, azimuth)


@eqx.filter_jit
def _weigh(panorama: AbstractPanorama, response: Response) -> AbstractPanorama:
    return panorama.weigh(response)


@eqx.filter_jit
def _finer(panorama: AbstractPanorama) -> AbstractPanorama:
    return panorama.finer()


@eqx.filter_jit
def _stretch(
    panorama: AbstractPanorama,
    zenith: Float[Array, "height #width"],
    azimuth: Float[Array, "#height width"],
    response: Response | None,
    look: Callable[..., Array],
) -> Float[Array, "height width *stokes channel"]:
    def row(zenith, azimuth):
        radiance = look(panorama, zenith[None], azimuth[None])[0]
        if response is None:
            return radiance
        return jnp.matmul(radiance, response, precision="highest")

    height, width = zenith.shape[0], azimuth.shape[1]
    most = max(1, _BLOCK // width)
    together = max(x for x in range(1, min(most, height) + 1) if height % x == 0)
    if azimuth.shape[0] > 1:
        return jax.lax.map(lambda x: row(*x), (zenith, azimuth), batch_size=together)
    return jax.lax.map(lambda x: row(x, azimuth[0]), zenith, batch_size=together)
