"""A beam of light in smoke, fire, and a cloud at sunset: python examples/volumes.py"""

import pathlib
import sys

import jax
import jax.numpy as jnp
import numpy as np

from atmos import colour, deg, image, render, Scene, solve
from atmos.camera import Perspective
from atmos.geometry import Flat
from atmos.light import Sun, sunlight
from atmos.medium import (
    AbstractProfile,
    Box,
    Grid,
    Medium,
    Noise,
    Product,
    Puff,
    Thermal,
)
from atmos.phase import HenyeyGreenstein
from atmos.solver import Fixed, RayMarching, ShadowCache, ShadowRays


WAVELENGTH = jnp.linspace(400.0, 700.0, 7, dtype=jnp.float32)


def sampled(profile: AbstractProfile, lower, upper, cells: int, times=1.0) -> Grid:
    """A profile in the middles of cells: cheaper to march through than noise."""
    lower, upper = np.asarray(lower), np.asarray(upper)
    places = (np.indices((cells,) * 3).reshape(3, -1).T + 0.5) / cells
    places = jnp.asarray(lower + places * (upper - lower), jnp.float32)
    density = jax.jit(lambda x: profile.density(Flat().locate(x)))
    found = jax.lax.map(density, places, batch_size=4096).reshape((cells,) * 3)
    return Grid(times * found, lower, upper)


def beam(cells):
    """Sunlight falls through a hole in a roof into smoke."""
    low, high, hole = -3.0, 3.0, 0.5
    sheets = [
        ([low, low, 4.0], [high, -hole, 4.1]),
        ([low, hole, 4.0], [high, high, 4.1]),
        ([low, -hole, 4.0], [-hole, hole, 4.1]),
        ([hole, -hole, 4.0], [high, hole, 4.1]),
    ]
    roof = [Medium(Box(np.array(a), np.array(b)), absorption=1e4) for a, b in sheets]
    air = Product(
        Noise(1.2, -0.6, 1.2, 5), Box(np.array([low, low, 0.0]), np.array([high] * 3))
    )
    smoke = sampled(air, [low, low, 0.0], [high, high, 3.9], cells)
    smoke = Medium(smoke, 0.12, 0.01, HenyeyGreenstein(0.3))
    sun = Sun.at(28 * deg, 90 * deg, sunlight(40.0))
    camera = lambda size: Perspective(
        np.array([0.0, -7.5, 1.4]), 0.0, 7 * deg, 50 * deg, size, size
    )
    return Scene(Flat(), 10.0, (smoke, *roof), (sun,), 0.3), camera


def fire(cells):
    """Hot where it is dense, cooler above; what has cooled down is smoke."""
    lower, upper = np.array([-1.0, -1.0, 0.0]), np.array([1.0, 1.0, 4.0])
    flame = Puff(np.array([0.0, 0.0, 0.9]), 0.6, 0.7, 0.9, 0.5, 5, 4)
    soot = sampled(flame, lower, upper, cells)
    x, y, z = (np.indices((cells,) * 3) + 0.5) / cells * 2.0
    cool = np.exp(-((x - 1) ** 2 + (y - 1) ** 2) * 4.0 - (z - 0.25) ** 2 * 2.5)
    heat = Grid(1000.0 + 900.0 * cool * np.asarray(soot.values), lower, upper)
    burning = Medium(soot, 0.4, 6.0, emission=Thermal(heat))
    plume = Puff(np.array([0.1, 0.0, 2.6]), 0.8, 0.7, 0.9, 0.6, 5, 8)
    smoke = Medium(sampled(plume, lower, upper, cells), 1.2, 0.8)
    sun = Sun.at(60 * deg, 240 * deg, sunlight(40.0))
    camera = lambda size: Perspective(
        np.array([0.0, -6.0, 1.6]), 0.0, 3 * deg, 40 * deg, size, size
    )
    return Scene(Flat(), 10.0, (burning, smoke), (sun,), 0.1), camera


def main(folder, size, cells=128):
    """Writes the pictures, and both in one, into a folder, and returns their XYZ."""
    response = colour.response(WAVELENGTH)
    pictures, shown = {}, []
    for name, make, shadows in [
        ("beam", beam, ShadowRays(24)),
        ("fire", fire, ShadowCache(cells // 2)),
    ]:
        scene, camera = make(cells)
        sky = solve(scene, RayMarching(Fixed(cells), shadows), WAVELENGTH)
        xyz = pictures[name] = render(sky, camera(size), response)
        shown.append(colour.preview(xyz, colour.automatic_exposure(xyz)))
        image.write_png(folder / f"{name}.png", shown[-1])
    image.write_png(folder / "volumes.png", jnp.concatenate(shown, 1))
    return pictures


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1] if sys.argv[1:] else "."), 320)
