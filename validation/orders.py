"""Solvers of all orders of scattering against path tracing in the round.

Errors beyond two standard errors of the truth, relative, of 456 directions from the
ground down to a degree above the horizon, in five colours; means over the directions.
The truth is a file that `validation.multiple_scattering --out` wrote. What it lacks is
traced into it, by 2048 paths a direction unless `--samples` says otherwise, in twilight
by eight times as many: to half a percent by day, in forty minutes of processor time.
With so few the noise hides what is less than itself; `--samples 262144` on a GPU leaves
a thousandth.

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
    "Shells": dict.fromkeys((30, 60, 80, 88, 92), 5e-4) | {96: 2e-3, 102: 5e-3},
    "Bruneton": {30: 2e-3, 60: 2e-3, 80: 2e-3, 88: 6e-3, 92: 0.03, 96: 0.05},
    "Columns": {30: 0.007, 60: 0.007, 80: 0.014},
    "Shared": {30: 0.04, 60: 0.04, 80: 0.05, 88: 0.09, 92: 0.09},
}


SCENES = ["r", "rao"]
SUNS = sorted({float(x) for bars in PROMISED.values() for x in bars})
WALKS = 16  # at once, a direction: a block of a thousand paths
# So many times as many paths where the sun is far down: few of them meet its light, and
# what is made of these few is not spread as its standard error says.
TWILIGHT = 8


def options(parser: argparse.ArgumentParser) -> None:
    shared = pathlib.Path("../shared")
    own = pathlib.Path("truth.npz")
    parser.add_argument("--traced", type=pathlib.Path, default=own, help="the truth")
    parser.add_argument("--scenes", type=pathlib.Path, default=shared / "scenes")
    parser.add_argument("--samples", type=int, default=2048, help="paths a direction")


def complete(truth: traced.Truth, arguments: argparse.Namespace) -> None:
    """Traces what the file lacks: cases, or paths of them."""
    walks = int(truth.arrays.get("--walks", WALKS))
    for scene in SCENES:
        for sun in SUNS:
            samples = arguments.samples * (TWILIGHT if sun > 92.0 else 1)
            if truth.paths(traced.Case(scene, sun, 0.0)) >= samples:
                continue
            wanted = {"scene": [scene], "suns": [sun], "altitudes": [0.0], "error": 0.0}
            given = vars(arguments) | wanted | {"walks": walks, "samples": samples}
            traced.make(truth, argparse.Namespace(**given))


def claims(arguments: argparse.Namespace) -> Iterator[Claim]:
    truth = traced.Truth(arguments.traced)
    complete(truth, arguments)
    for scene_name in SCENES:
        scene = scenefile.parse(traced.described(arguments.scenes, scene_name))
        for name, bars in PROMISED.items():
            sky = solver.solve(scene, getattr(solver, name)(), traced.WAVELENGTH)
            for zenith, bar in bars.items():
                case = traced.Case(scene_name, float(zenith), 0.0)
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
                # What it has too little of, all directions taken together.
                lacks = np.mean(right / found, 0) - 1.0
                worst = np.argmax(np.abs(lacks))
                spread = np.sqrt(np.sum((error / found) ** 2, 0)) / len(found)
                source = f"paths, to {spread[worst]:.2g}"
                text = "    what all directions lack, in the worst of five colours"
                yield Claim(text, source, None, lacks[worst])


if __name__ == "__main__":
    sys.exit(main(__doc__, claims, options))
