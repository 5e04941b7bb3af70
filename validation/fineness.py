"""What finer `Shells` would change, in the Earth's air: more layers, more suns.

Largest relative changes in five colours: seen from the ground, in every seventh
direction of the truth's, down to a degree above the horizon, and from 400 km down and
at the limb, there of what is brighter than a share of the brightest. It says how far
the solver has converged; how right it is, `validation.orders` says.

    python -m validation.fineness
"""

import argparse
import sys
from collections.abc import Iterator

import jax
import jax.numpy as jnp
import numpy as np

from atmos import deg, earth, km, light
from atmos.solver import Shells, solve

from . import multiple_scattering as traced
from .claim import Claim, main


FINER = {"100 layers": Shells(layers=100), "128 suns": Shells(suns=128)}
# Suns, in degrees from the zenith, and the change that is promised to be less.
GROUND = {30: 2e-3, 60: 2e-3, 80: 2e-3, 88: 2e-3, 92: 5e-3, 96: 5e-3, 102: 2e-2}
# The same from space, of what is brighter than a share of the brightest.
LIMB = {30: 1e-3, 60: 1e-3, 80: 1e-3, 88: 5e-3, 92: 5e-3, 96: 5e-3, 102: 5e-3}
SHARES = 1e-4, 1e-6


def claims(arguments: argparse.Namespace) -> Iterator[Claim]:
    del arguments
    scene = earth(light.Sun.at(60 * deg, 0.0, 1.0))
    radius = float(scene.geometry.radius)
    places = []
    for altitude, every in [(0.0, 7), (400 * km, 1)]:
        angles = traced.looks(altitude, radius)[::every]
        directions = jnp.asarray(traced.vectors(*angles.T))
        positions = jnp.zeros_like(directions).at[:, 2].set(altitude)
        places.append((positions, directions))

    def seen(solver: Shells) -> list[list[np.ndarray]]:
        jax.clear_caches()
        sky = solve(scene, solver, traced.WAVELENGTH)
        look = lambda zenith, place: np.asarray(
            traced.march(sky, jnp.asarray(traced.vectors(zenith, 0.0)), *place), float
        )
        suns = GROUND, LIMB
        return [
            [look(float(zenith), place) for zenith in bars]
            for bars, place in zip(suns, places, strict=True)
        ]

    coarse = seen(Shells())
    for name, solver in FINER.items():
        fine = seen(solver)
        for (zenith, bar), x, y in zip(GROUND.items(), coarse[0], fine[0], strict=True):
            text = f"Shells, from the ground, sun {zenith}"
            yield Claim(text, name, bar, np.max(np.abs(x / y - 1.0)))
        for (zenith, bar), x, y in zip(LIMB.items(), coarse[1], fine[1], strict=True):
            for share in SHARES:
                off = np.abs(x / y - 1.0)[y > share * y.max()]
                text = f"Shells, from 400 km, sun {zenith}, down to {share:.0e}"
                yield Claim(text, name, bar if share == SHARES[0] else None, off.max())


if __name__ == "__main__":
    sys.exit(main(__doc__, claims))
