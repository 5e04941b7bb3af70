"""A beam of light in smoke, fire, and a white cloud: python examples/volumes.py

The noise of the cloud is taken out with `pip install 'atmos[denoise]'`.
"""

import pathlib
import sys

import jax.numpy as jnp
import numpy as np

from atmos import colour, deg, image, render, Scene, solve
from atmos.camera import Perspective
from atmos.denoise import denoise, denoiser
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
    sampled,
    Thermal,
)
from atmos.phase import HenyeyGreenstein
from atmos.solver import Fixed, RayMarching, ShadowCache, ShadowRays, VolumeTracing
from atmos.spectrum import Constant


WAVELENGTH = jnp.linspace(400.0, 700.0, 7, dtype=jnp.float32)


def grid(profile: AbstractProfile, lower, upper, cells: int, times=1.0) -> Grid:
    """A profile in the middles of cells: cheaper to march through than noise."""
    found = sampled(profile, lower, upper, (cells,) * 3)
    return Grid(times * found.values, lower, upper)


def beam(cells):
    """Sunlight falls through a hole in a roof into smoke."""
    far, hole = 2000.0, 0.5
    sheets = [
        ([-far, -far], [far, -hole]),
        ([-far, hole], [far, far]),
        ([-far, -hole], [-hole, hole]),
        ([hole, -hole], [far, hole]),
    ]
    roof = [
        Medium(Box(np.array([*a, 4.0]), np.array([*b, 4.1])), absorption=1e4)
        for a, b in sheets
    ]
    low, high = np.array([-4.0, -4.0, 0.0]), np.array([4.0, 4.0, 3.9])
    smoke = grid(Noise(1.5, -0.5, 1.0, 5), low, high, cells)
    smoke = Medium(smoke, 0.12, 0.01, HenyeyGreenstein(0.3))
    sun = Sun.at(28 * deg, 90 * deg, sunlight(40.0))
    eye = np.array([-0.8, -7.0, 1.5])
    camera = lambda size: Perspective(eye, 0.0, 6 * deg, 50 * deg, size, size)
    solver = RayMarching(Fixed(3 * cells), ShadowRays(24))
    return Scene(Flat(), 10.0, (smoke, *roof), (sun,), 0.3), solver, camera


def fire(cells):
    """What is hot shines, what has cooled down is smoke in the last light of day."""
    low, high = np.array([-1.2, -1.2, 0.0]), np.array([1.2, 1.2, 4.0])
    flame = Puff(np.array([0.0, 0.0, 1.0]), 0.75, 0.6, 0.9, 0.4, 5, 4)
    soot = grid(flame, low, high, cells)
    x, y, z = (np.indices((cells,) * 3) + 0.5) / cells
    aside = ((x - 0.5) ** 2 + (y - 0.5) ** 2) * 5.76
    cool = np.exp(-3.0 * aside - 0.9 * np.maximum(4.0 * z - 0.5, 0.0))
    heat = Grid(900.0 + 1100.0 * cool * np.asarray(soot.values), low, high)
    burning = Medium(soot, 0.4, 3.0, emission=Thermal(heat))
    plume = Puff(np.array([0.15, 0.0, 2.7]), 0.75, 0.6, 0.9, 0.6, 5, 8)
    smoke = Medium(grid(plume, low, high, cells), 1.2, 0.8)
    sun = Sun.at(80 * deg, 230 * deg, Constant(0.4))
    eye = np.array([0.0, -6.0, 1.7])
    camera = lambda size: Perspective(eye, 0.0, 2 * deg, 42 * deg, size, size)
    solver = RayMarching(Fixed(cells), ShadowCache(cells // 2))
    return Scene(Flat(), 10.0, (burning, smoke), (sun,), 0.1), solver, camera


def cloud(cells):
    """A white cloud and its shadow, by paths of hundreds of turns."""
    low, high = np.array([-900.0, -900.0, 500.0]), np.array([900.0, 900.0, 1700.0])
    flat = Box(low, high)
    puffs = [
        ((0.0, 0.0, 850.0), 420.0),
        ((-350.0, 80.0, 700.0), 300.0),
        ((380.0, -60.0, 680.0), 280.0),
        ((80.0, 50.0, 1200.0), 260.0),
    ]
    parts = [
        grid(
            Product(Puff(np.array(x), r, 350.0, 0.7, 0.15, 6, i), flat),
            low,
            high,
            cells,
            0.03,
        )
        for i, (x, r) in enumerate(puffs)
    ]
    droplets = Grid(np.max([x.values for x in parts], 0), low, high)
    white = Medium(droplets, 1.0, 0.0, HenyeyGreenstein(0.8))
    sun = Sun.at(50 * deg, 250 * deg, sunlight(40.0))
    eye = np.array([0.0, -3200.0, 300.0])
    camera = lambda size: Perspective(eye, 0.0, 12 * deg, 45 * deg, size, size)
    solver = VolumeTracing(walks=4, paths=cells // 4, cells=32)
    return Scene(Flat(), 3000.0, (white,), (sun,), 0.15), solver, camera


PICTURES = {"beam": beam, "fire": fire, "cloud": cloud}


def main(folder, size, cells=128):
    """Writes the pictures, and all in one, into a folder, and returns their XYZ.

    What is traced is shown without its noise.
    """
    denoiser()  # or an error, before the work is done
    response = colour.response(WAVELENGTH)
    pictures, shown = {}, []
    for name, make in PICTURES.items():
        scene, solver, camera = make(cells)
        sky = solve(scene, solver, WAVELENGTH)
        xyz = pictures[name] = render(sky, camera(size), response)
        if isinstance(solver, VolumeTracing):
            xyz = jnp.asarray(denoise(np.asarray(xyz), colour.COLOUR_SPACES["xyz"]))
        shown.append(colour.preview(xyz, colour.automatic_exposure(xyz)))
        image.write_png(folder / f"{name}.png", shown[-1])
    image.write_png(folder / "volumes.png", jnp.concatenate(shown, 1))
    return pictures


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1] if sys.argv[1:] else "."), 320)
