"""Solvers of all orders of scattering against path tracing in the round.

Errors beyond two standard errors of the truth, relative, of 456 directions from the
ground down to a degree above the horizon, in five colours; means over the directions.
The truth is a file that `validation.multiple_scattering --out` wrote.

    python -m validation.orders --traced truth.npz
"""

import argparse
import pathlib
import sys
from collections.abc import Iterator

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from atmos import scenefile, solver

from . import multiple_scattering as traced
from .claim import Claim, main


# Suns, in degrees from the zenith, and the mean error that is promised for them.
PROMISED = {
    "Shells": {30: 5e-4, 60: 5e-4, 80: 5e-4, 88: 5e-4, 92: 5e-4, 96: 2e-3},
    "Bruneton": {30: 2e-3, 60: 2e-3, 80: 2e-3, 88: 6e-3, 92: 0.03, 96: 0.05},
    "Columns": {30: 0.007, 60: 0.007, 80: 0.014},
    "Shared": {30: 0.04, 60: 0.04, 80: 0.05, 88: 0.09, 92: 0.09},
}


def options(parser: argparse.ArgumentParser) -> None:
    shared = pathlib.Path("../shared")
    parser.add_argument("--traced", type=pathlib.Path, help="file of the truth")
    parser.add_argument("--scenes", type=pathlib.Path, default=shared / "scenes")


def claims(arguments: argparse.Namespace) -> Iterator[Claim]:
    if arguments.traced is None or not arguments.traced.exists():
        print("`--traced` is not a file: skipped.")
        return
    truth = traced.Truth(arguments.traced)
    for scene_name in ("r", "rao"):
        scene = scenefile.parse(traced.described(arguments.scenes, scene_name))
        for name, bars in PROMISED.items():
            sky = solver.solve(scene, getattr(solver, name)(), traced.WAVELENGTH)
            for zenith, bar in bars.items():
                case = traced.Case(scene_name, float(zenith), 0.0)
                if f"{case.name} many" not in truth.arrays:
                    print(f"{case.name} is not in the file: skipped.")
                    continue
                angles = truth.arrays[f"{case.name} angles"]
                directions = jnp.asarray(traced.vectors(*angles.T))
                positions = jnp.zeros_like(directions)
                sun = jnp.asarray(traced.vectors(zenith, 0.0))
                if name == "Columns":  # it serves one sun
                    lamps = (traced.facing(scene, sun),)
                    turned = eqx.tree_at(lambda x: x.lights, scene, lamps)
                    sky = solver.solve(turned, solver.Columns(), traced.WAVELENGTH)
                found = np.asarray(traced.march(sky, sun, positions, directions), float)
                right, error = truth.radiance(case), truth.get(case)[1]
                off = np.maximum(np.abs(found - right) - 2.0 * error, 0.0) / right
                source = f"paths, to {np.median(error / right):.2g}"
                text = f"{name}, {scene_name}, sun {zenith}: mean beyond noise"
                yield Claim(text, source, bar, off.mean())
                yield Claim("    largest", source, None, off.max())


if __name__ == "__main__":
    sys.exit(main(__doc__, claims, options))
