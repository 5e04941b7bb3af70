"""Pictures that grow: is the variance that they hold the variance that they have?

The same volume is rendered again and again, each time with other random numbers but for
the places within pixels, which hardly matter in a picture so narrow. How much these
pictures differ is compared with what they say of themselves.

    python -m validation.film
"""

import argparse
import itertools
import sys
from collections.abc import Iterator

import jax
import jax.numpy as jnp
import numpy as np

from atmos import deg, Scene, solve
from atmos.camera import Perspective
from atmos.film import expose, Film
from atmos.geometry import Flat
from atmos.light import Sun
from atmos.medium import Box, Medium
from atmos.phase import HenyeyGreenstein
from atmos.solver import VolumeTracing

from .claim import Claim, main


NM = jnp.array([500.0, 600.0], jnp.float32)
LOOKS, PICTURES = 24, 80


def pictures() -> Iterator[Film]:
    box = Box(np.array([-1.0, -1.0, 1.0]), np.array([1.0, 1.0, 3.0]))
    smoke = Medium(box, 2.0, 0.1, HenyeyGreenstein(0.3))
    sun = Sun(np.array([0.0, 0.6, 0.8]), 1.0, 0.0)
    scene = Scene(Flat(), 10.0, (smoke,), (sun,), 0.5)
    eye = np.array([0.0, -4.0, 2.0])
    camera = Perspective(eye, 0.0, 0.0, 0.05 * deg, 8, 12)
    for seed in range(PICTURES):
        solver = VolumeTracing(jax.random.key(seed), walks=2, paths=8, cells=8)
        sky = solve(scene, solver, NM)
        blank = Film.blank(camera, sky)
        *_, film = itertools.islice(expose(blank, sky), LOOKS * len(blank.tallies))
        yield film


def claims(_: argparse.Namespace) -> Iterator[Claim]:
    means, variances = [], []
    for film in pictures():
        means.append(film.mean().astype(float))
        variances.append(film.variance().astype(float))
    seen = np.var(means, 0, ddof=1)
    off = abs(np.sum(variances) / PICTURES / np.sum(seen) - 1.0)
    # Pixels are independent; the two wavelengths of a path are not.
    error = np.sqrt(2.0 / (PICTURES - 1) / (seen.size / 2))
    name = "variance of a picture, standard errors from that among many"
    yield Claim(name, "80 pictures", 3.0, off / error)
    yield Claim("the same, relative", "80 pictures", None, off)


if __name__ == "__main__":
    sys.exit(main(__doc__, claims))
