"""The disks of lights in a picture, with all their energy at any number of pixels."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from .camera import AbstractCamera
from .light import Sun
from .quantity import Angle, as_float, Number
from .render import Response
from .sky import AbstractSky


_MET = 25_000  # samples that meet a disk, at least, if it is small
_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
_STRIPS = 33  # zenith angles at which the air in front of a disk is known
_TOGETHER = 2**16  # samples that are worked on together


def render_disks(
    sky: AbstractSky, camera: AbstractCamera, response: Response | None = None
) -> Float[np.ndarray, "height width channel"]:
    """The disks of the lights alone, through the air: to be added to what `render` saw.

    Each pixel is the mean over its area, so that the picture holds the irradiance of a
    light, to 1e-3 or better from 256 rows on. Shape and unit are those of `render`.
    """
    dtype = sky.wavelength.dtype
    camera = jax.tree.map(lambda x: x.astype(dtype), camera)
    if response is None:
        response = as_float(np.eye(sky.wavelength.size, dtype=dtype))
    image = np.zeros((camera.height, camera.width, response.shape[1]), dtype)
    for light in sky.lights:
        radius = float(light.angular_radius)
        if radius <= 0.0:
            continue
        near, largest = _near(camera, light)
        rows, columns = np.nonzero(np.asarray(near))
        if not rows.size:
            continue
        samples = _samples(float(largest), radius, rows.size)
        together = _TOGETHER // samples
        depths = _depths(sky, camera, light)
        for i in range(0, rows.size, together):
            part = slice(i, i + together)
            pixels = np.stack([columns[part], rows[part]], -1).astype(dtype)
            filled = np.pad(pixels, ((0, together - len(pixels)), (0, 0)), mode="edge")
            filled = as_float(filled)
            seen = _pixels(sky, camera, light, depths, filled, response, samples)
            image[rows[part], columns[part]] += np.asarray(seen)[: len(pixels)]
    return image


@eqx.filter_jit
def _near(
    camera: AbstractCamera, light: Sun
) -> tuple[Bool[Array, "height width"], Number]:
    """The pixels that may see a light, and the largest solid angle of any of them."""
    zenith, azimuth = camera.angles()
    apart = jnp.sin(0.5 * (zenith - light.zenith))
    aside = jnp.sin(0.5 * (azimuth - light.azimuth))
    level = jnp.sin(zenith) * jnp.sin(light.zenith)
    reach = light.angular_radius + _extent(camera)
    near = apart * apart + level * aside * aside <= (0.5 * reach) ** 2
    near = jnp.broadcast_to(near & camera.sees(), (camera.height, camera.width))
    dtype = camera.position.dtype
    x, y = (jnp.arange(n, dtype=dtype) + 0.5 for n in (camera.width, camera.height))
    across = jax.vmap(camera.solid_angle, (0, None))
    areas = jax.vmap(across, (None, 0))(x, y)
    return near, jnp.max(areas, where=near, initial=0.0)


def _samples(largest: float, radius: float, count: int) -> int:
    """How many samples a pixel takes, so that a disk meets `_MET` or more in all."""
    share = largest / (math.pi * radius**2)
    fewest = 8 if count < 2**15 else 4
    return 2 ** min(max(math.ceil(math.log2(share * _MET)), fewest), 16)


def _extent(camera: AbstractCamera) -> Angle:
    """The largest angle from the centre of a pixel to a corner, or somewhat more."""
    steps = jnp.linspace(0.5, 8.5, 9, dtype=camera.position.dtype) / 9.0
    y, x = (
        z.ravel() for z in jnp.meshgrid(steps * camera.height, steps * camera.width)
    )
    centre = jax.vmap(camera.direction)(x, y)
    corners = [jax.vmap(camera.direction)(x + 0.5, y + dy) for dy in (-0.5, 0.5)]
    chords = [jnp.sqrt(jnp.sum((corner - centre) ** 2, -1)) for corner in corners]
    return 1.2 * jnp.max(jnp.stack(chords))


def _strips(sky: AbstractSky, camera: AbstractCamera, light: Sun):
    """The zenith angles of the upper and the lower limb, and that of the horizon."""
    altitude = camera.position[2]
    radius = light.angular_radius
    horizon = 0.5 * math.pi + sky.dip(altitude)
    return light.zenith - radius, light.zenith + radius, horizon


@eqx.filter_jit
def _depths(
    sky: AbstractSky, camera: AbstractCamera, light: Sun
) -> Float[Array, "strip wl"]:
    """The optical depth in front of a disk, strip by strip downwards."""
    top, bottom, horizon = _strips(sky, camera, light)
    east, north = light.horizontal

    def strip(zenith):
        level = jnp.sin(zenith)
        direction = jnp.stack([level * east, level * north, jnp.cos(zenith)])
        return sky.depth(camera.position, direction)

    zeniths = jnp.linspace(top, bottom, _STRIPS, dtype=top.dtype)
    return jax.vmap(strip)(jnp.minimum(zeniths, horizon - 1e-6))


@eqx.filter_jit
def _pixels(
    sky: AbstractSky,
    camera: AbstractCamera,
    light: Sun,
    depths: Float[Array, "strip wl"],
    pixels: Float[Array, "pixel 2"],
    response: Response,
    samples: int,
) -> Float[Array, "pixel channel"]:
    """What one sees of a disk in some pixels, given by column and row."""
    top, bottom, horizon = _strips(sky, camera, light)
    # A lattice in which no two samples share a row or a column: an edge that runs along
    # them is met as finely as any other.
    down = (jnp.arange(samples, dtype=pixels.dtype) + 0.5) / samples
    across = jnp.asarray(np.arange(samples) * _GOLDEN % 1.0, pixels.dtype)

    def look(x, y):
        direction = camera.direction(x, y)
        east, north, up = direction
        zenith = jnp.arctan2(jnp.sqrt(east * east + north * north), up)
        at = (zenith - top) / (bottom - top) * (_STRIPS - 1.0)
        strip = jnp.clip(jnp.floor(at), 0.0, _STRIPS - 2.0)
        i = strip.astype(int)
        depth = depths[i] + (at - strip) * (depths[i + 1] - depths[i])
        radiance = light.radiance(direction, sky.wavelength) * jnp.exp(-depth)
        area = camera.solid_angle(x, y)
        return jnp.where(zenith < horizon, radiance, 0.0) * area, area

    def pixel(corner):
        energy, area = jax.vmap(look)(corner[0] + across, corner[1] + down)
        return jnp.sum(energy, 0) / jnp.sum(area)

    seen = jax.lax.map(pixel, pixels, batch_size=max(1, 4096 // samples))
    return jnp.matmul(seen, response, precision="highest")
