"""Clouds in air, traced by null collisions, against tracing of layered air alone.

Paths by null collisions, in bounds of cells and of altitudes, against paths along which
the optical depth is worked out (`PathTracing`), whose air depends on altitude alone: in
clear air, and with a deck of cloud that is given as a layer, and as a box so wide that
nothing is seen of its ends. And white boxes in even light, of depths up to 100, which
must be white. A z-score is an error in standard errors.

    python -m validation.world
"""

import argparse
import itertools
import sys
from collections.abc import Iterator

import jax
import jax.numpy as jnp
import numpy as np

from atmos.geometry import Flat, Spherical
from atmos.light import Sun, Surrounding
from atmos.medium import (
    AbstractProfile,
    Box,
    Exponential,
    Medium,
    Product,
    Tent,
    Uniform,
)
from atmos.phase import HenyeyGreenstein, Rayleigh
from atmos.rays import direction
from atmos.scene import Scene
from atmos.solver import AbstractTracing, PathTracing, solve, VolumeTracing
from atmos.spectrum import PowerLaw

from .claim import Claim, main


NM = jnp.array([400.0, 550.0, 700.0], jnp.float32)
LOOKS = 64
FAR = 4e5
LAYER = Uniform(1e3, 2e3)
CLOUDS = {
    "layer": LAYER,
    "box": Product(
        LAYER, Box(np.array([-FAR, -FAR, -20e3]), np.array([FAR, FAR, 2e3]))
    ),
}
# The altitude of the eye, zenith angle and azimuth of the view.
VIEWS = [
    (0.0, 60.0, 20.0),
    (0.0, 20.0, 180.0),
    (1.5e3, 80.0, 90.0),
    (5e3, 150.0, 50.0),
    (400e3, 170.0, 10.0),
]
CLEAR = [
    # and first the zenith angle of the sun
    (30.0, 0.0, 80.0, 60.0),
    (88.0, 10e3, 93.0, 20.0),
    (60.0, 400e3, 160.0, 90.0),
    (91.0, 400e3, 109.2, 10.0),
]


def claims(arguments: argparse.Namespace) -> Iterator[Claim]:
    del arguments
    # Looks that shared their numbers would not be so many trials.
    keys = itertools.count(1)
    scores, errors = [], []
    for sun, *view in CLEAR:
        due = look(scene(Spherical(6360e3), None, sun), judge(next(keys)), *view)
        found = look(scene(Spherical(6360e3), None, sun), traced(next(keys)), *view)
        scores.append((found[0] - due[0]) / np.hypot(found[1], due[1]))
        errors.append(found[1] / found[0])
    yield from judged("clear air", scores, errors)
    for name, cloud in CLOUDS.items():
        scores, errors = [], []
        for geometry in (Flat(), Spherical(6360e3)):
            for view in VIEWS:
                due = look(scene(geometry, LAYER, 70.0), judge(next(keys)), *view)
                found = look(scene(geometry, cloud, 70.0), traced(next(keys)), *view)
                scores.append((found[0] - due[0]) / np.hypot(found[1], due[1]))
                errors.append(found[1] / found[0])
        yield from judged(f"cloud deck as a {name}", scores, errors)
    yield from of_furnace()


def of_furnace() -> Iterator[Claim]:
    """White boxes over white ground, in even light: what one sees is 1."""
    lower, upper = np.array([-1.0, -1.0, 1.0]), np.array([1.0, 1.0, 3.0])
    light = Surrounding(np.ones((4, 8, 1)), [550.0])
    scores, errors = [], []
    for depth in (0.1, 1.0, 10.0, 100.0):
        for g in (-0.9, 0.0, 0.95):
            phase = HenyeyGreenstein(g)
            white = Medium(Box(lower, upper), 0.5 * depth, phase=phase)
            world = Scene(Flat(), 10.0, (white,), (light,), 1.0)
            # Into it from below, slantwise, and from far above.
            for view in ((0.5, 20.0, 0.0), (2.0, 75.0, 30.0), (8.0, 175.0, 0.0)):
                key = jax.random.key(9 + len(scores))
                solver = VolumeTracing(key, walks=4, paths=8, cells=1)
                mean, error = look(world, solver, *view)
                scores.append((mean - 1.0) / error)
                errors.append(error)
    yield from judged("white furnace", scores, errors)


def judged(name: str, scores: list, errors: list) -> Iterator[Claim]:
    # Wavelengths share their paths: they are one trial.
    scores = np.array(scores)
    source = f"{len(scores)} looks"
    yield Claim(
        f"{name}: largest error in standard errors", source, 4.0, np.max(abs(scores))
    )
    mean = abs(np.mean(scores)) * np.sqrt(len(scores))
    yield Claim(f"{name}: mean z, in its standard errors", source, 3.0, mean)
    error = np.median(errors)
    yield Claim(f"{name}: median standard error, relative", source, None, error)


def judge(seed: int) -> PathTracing:
    return PathTracing(jax.random.key(seed), walks=4, paths=64, single=None)


def traced(seed: int) -> VolumeTracing:
    return VolumeTracing(jax.random.key(seed), walks=8, paths=32)


def scene(
    geometry: Flat | Spherical, cloud: AbstractProfile | None, sun: float
) -> Scene:
    air = Medium(Exponential(8e3), PowerLaw(1.2e-5, -4.0), 1e-6, Rayleigh(0.03))
    ozone = Medium(Tent(25e3, 15e3), absorption=2e-6)
    droplets = ()
    if cloud is not None:
        droplets = (Medium(cloud, 1e-3, 1e-5, HenyeyGreenstein(0.8)),)
    light = Sun(direction(sun, 0.0), 2.0, 0.0)
    return Scene(geometry, 60e3, (air, ozone, *droplets), (light,), 0.3)


def look(
    scene: Scene, solver: AbstractTracing, altitude: float, zenith: float, turn: float
) -> tuple[np.ndarray, np.ndarray]:
    """The mean of many looks that are all but alike, and its standard error."""
    sky = solve(scene, solver, NM)
    random = np.random.default_rng(0)
    start = np.array([0.0, 0.0, altitude]) + random.uniform(-1.0, 1.0, (LOOKS, 3))
    start[:, 2] = altitude
    towards = np.broadcast_to(direction(zenith, turn), (LOOKS, 3))
    rays = [jnp.asarray(x, jnp.float32) for x in (start, towards)]
    light = sky.scene.lights[0]
    found = solver.tally(sky.prepared, sky.scene, light, sky.wavelength, *rays)
    mean, error = (np.asarray(x, float) for x in (found.mean, found.standard_error))
    return mean.mean(0), np.sqrt(np.mean(error**2, 0) / LOOKS)


if __name__ == "__main__":
    sys.exit(main(__doc__, claims))
