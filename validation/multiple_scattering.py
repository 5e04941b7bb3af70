"""All orders of scattering: the truth by path tracing, and solvers against it.

The truth is traced for the scenes `reference_r`, `_ra` and `_rao` in five colours (and,
if asked for, `hazy`: `_rao` with eight times the aerosol): from the ground at 24 zenith
angles to 89 degrees and 19 azimuths, for suns from 30 to 102 degrees; and from 10, 35
and 400 km looking down and at the limb. It is kept in a file,
which a later run goes on from: blocks of paths are added to each case until it has
`--samples` a direction, or everywhere a relative standard error of `--error`.

Path tracing itself is judged by tables of the fluxes of slabs, and of DISORT's
radiances, if `--truth` has them: by z-scores, which are to be a standard normal's.

    python -m validation.multiple_scattering --out truth.npz --samples 1048576
    python -m validation.multiple_scattering --out truth.npz --solver SingleScattering
    python -m validation.multiple_scattering --truth ../shared/truth --slabs 20000
"""

import argparse
import csv
import json
import math
import os
import pathlib
import sys
import time
from collections.abc import Iterator
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import atmos
from atmos import geometry, km, light, medium, phase, scenefile, spectrum
from atmos.solver import PathTracing, SingleScattering, solve

from .claim import Claim, main


WAVELENGTH = np.array([380.0, 450.0, 550.0, 650.0, 770.0], np.float32)
SCENES = ["r", "ra", "rao"]
HAZY = "hazy"
THIN, THICK = "value = 4.1666666667e-5", "value = 33.3333333336e-5"
SUNS = [30.0, 60.0, 80.0, 88.0, 92.0, 96.0, 102.0]
# More of the lowest: that is where methods differ.
ZENITHS = np.concatenate([np.arange(0.0, 75.0, 7.5), np.linspace(75.0, 89.0, 14)])
AZIMUTHS = np.linspace(0.0, 180.0, 19)
HIGH = [10 * km, 35 * km, 400 * km]
PATHS = 64  # a walk


class Case(NamedTuple):
    scene: str
    sun: float
    altitude: float

    @property
    def name(self) -> str:
        return f"{self.scene} {self.sun:g} {self.altitude / km:g}"


def described(folder: pathlib.Path, scene: str) -> str:
    """What the file of a scene says."""
    if scene == HAZY:
        return described(folder, "rao").replace(THIN, THICK)
    return (folder / f"reference_{scene}.toml").read_text()


def cases() -> Iterator[Case]:
    for scene in [*SCENES, HAZY]:
        for sun in SUNS:
            for altitude in [0.0, *HIGH]:
                yield Case(scene, sun, altitude)


def looks(altitude: float, radius: float) -> np.ndarray:
    """Zenith angles and azimuths, in degrees."""
    if altitude == 0.0:
        zeniths, azimuths = ZENITHS, AZIMUTHS
    else:
        tangents = np.array([1.0, 5.0, 15.0, 30.0, 50.0]) * km
        tangents = tangents[tangents < altitude]
        limb = 180.0 - np.degrees(np.arcsin((radius + tangents) / (radius + altitude)))
        zeniths = np.concatenate([[180.0, 150.0, 120.0], limb])
        azimuths = np.arange(0.0, 181.0, 30.0)
    return np.stack(np.meshgrid(zeniths, azimuths, indexing="ij"), -1).reshape(-1, 2)


def vectors(zenith, azimuth) -> np.ndarray:
    zenith, azimuth = np.radians(zenith), np.radians(azimuth)
    level = np.sin(zenith)
    found = [level * np.sin(azimuth), level * np.cos(azimuth), np.cos(zenith)]
    return np.stack(found, -1).astype(np.float32)


@eqx.filter_jit
def trace(sky, sun, positions, directions, block):
    world = sky.prepared, sky.scene, facing(sky.scene, sun), sky.wavelength
    tally = sky.solver.tally(*world, positions, directions, block)
    return tally.mean, tally.standard_error


@eqx.filter_jit
def march(sky, sun, positions, directions):
    sky = eqx.tree_at(lambda x: x.scene.lights[0], sky, facing(sky.scene, sun))
    look = lambda x: sky.radiance(*x)
    return jax.lax.map(look, (positions, directions), batch_size=32)


def facing(scene, sun):
    return eqx.tree_at(lambda x: x.direction, scene.lights[0], sun)


class Truth:
    """Means and standard errors of all cases, in a file that is replaced whole."""

    def __init__(self, path: pathlib.Path):
        self.path = path
        self.arrays = dict(np.load(path)) if path.exists() else {}

    def get(self, case: Case) -> tuple[np.ndarray, np.ndarray, int]:
        """What paths found without light that turned once, its error, and blocks."""
        if f"{case.name} many" not in self.arrays:
            return np.zeros(1), np.full(1, np.inf), 0
        parts = [self.arrays[f"{case.name} {x}"] for x in ("many", "error", "blocks")]
        return parts[0], parts[1], int(parts[2])

    def paths(self, case: Case) -> int:
        """How many a direction there are."""
        walks = int(self.arrays.get("--walks", 0))
        return self.get(case)[2] * walks * PATHS

    def radiance(self, case: Case) -> np.ndarray:
        return self.arrays[f"{case.name} many"] + self.arrays[f"{case.name} once"]

    def check(self, **made: str | int) -> None:
        """Refuses to go on with a file that was made otherwise, with `ValueError`."""
        for name, value in made.items():
            if self.arrays.setdefault(name, np.asarray(value)) != value:
                raise ValueError(f"`--out` was made with another {name}.")

    def put(self, case: Case, **arrays: np.ndarray | int) -> None:
        for name, value in arrays.items():
            self.arrays[f"{case.name} {name}"] = np.asarray(value)
        part = self.path.with_suffix(".part.npz")
        np.savez(part, **self.arrays)
        os.replace(part, self.path)


def make(truth: Truth, arguments: argparse.Namespace) -> None:
    """Traces what the file lacks."""
    started, traced = time.perf_counter(), 0
    for scene_name in arguments.scene:
        text = described(arguments.scenes, scene_name)
        scene = scenefile.parse(text)
        truth.check(**{f"scene {scene_name}": text, "--walks": arguments.walks})
        # All that is drawn is of the key and of the block, which the file counts.
        solver = PathTracing(jax.random.key(20), 1, arguments.walks, PATHS)
        sky = solve(scene, solver, WAVELENGTH)
        fine = SingleScattering(nodes=16, light_nodes=16)
        once_sky = solve(scene, fine, WAVELENGTH)
        for case in cases():
            if case.scene != scene_name or case.sun not in arguments.suns:
                continue
            if case.altitude / km not in arguments.altitudes:
                continue
            angles = looks(case.altitude, float(scene.geometry.radius))
            directions = jnp.asarray(vectors(*angles.T))
            positions = jnp.zeros_like(directions).at[:, 2].set(case.altitude)
            sun = jnp.asarray(vectors(case.sun, 0.0))
            mean, error, blocks = truth.get(case)
            squares = (error * blocks) ** 2 if blocks else np.zeros(1)
            mean = mean * blocks
            begun, once = (
                blocks,
                np.asarray(march(once_sky, sun, positions, directions), float),
            )
            block_samples = arguments.walks * PATHS

            def relative(total, squares, n, once=once):
                error = np.sqrt(squares) / n
                return np.sqrt(np.mean((error / (total / n + once)) ** 2))

            while blocks * block_samples < arguments.samples and (
                blocks < 2 or relative(mean, squares, blocks) > arguments.error
            ):
                value, error = trace(sky, sun, positions, directions, jnp.int32(blocks))
                mean = mean + np.asarray(value, float)
                squares = squares + np.asarray(error, float) ** 2
                blocks += 1
                traced += block_samples * len(angles)
            if blocks > begun:
                truth.put(
                    case,
                    many=mean / blocks,
                    error=np.sqrt(squares) / blocks,
                    blocks=blocks,
                    once=once,
                    angles=angles,
                )
                share = relative(mean, squares, blocks)
                speed = traced / (time.perf_counter() - started)
                print(
                    f"{case.name:14} {blocks * block_samples:9} paths a direction, "
                    f"rms standard error {share:.3%}, {speed:.3g} paths/s in all",
                    flush=True,
                )


def compare(truth: Truth, name: str, arguments: argparse.Namespace) -> None:
    """Mean and largest error of a solver beyond two standard errors, in per cent."""
    print(f"\n{name}: mean / largest relative error beyond two standard errors, %")
    for scene_name in arguments.scene:
        scene = scenefile.parse(described(arguments.scenes, scene_name))
        sky = solve(scene, getattr(atmos.solver, name)(), WAVELENGTH)
        print(
            f"{scene_name:6}" + "".join(f"{x:>9g} km      " for x in [0, 10, 35, 400])
        )
        for zenith in arguments.suns:
            row = f"{zenith:6g}"
            for altitude in [0.0, *HIGH]:
                case = Case(scene_name, zenith, altitude)
                if f"{case.name} many" not in truth.arrays:
                    row += " " * 18
                    continue
                angles = truth.arrays[f"{case.name} angles"]
                directions = jnp.asarray(vectors(*angles.T))
                positions = jnp.zeros_like(directions).at[:, 2].set(altitude)
                sun = jnp.asarray(vectors(zenith, 0.0))
                found = np.asarray(march(sky, sun, positions, directions), float)
                right, error = truth.radiance(case), truth.get(case)[1]
                off = np.maximum(np.abs(found - right) - 2.0 * error, 0.0) / right
                row += f"{off.mean():9.3%} /{off.max():7.2%}"
            print(row, flush=True)


def slab(depth, albedos, phase_function, cosine) -> atmos.Scene:
    """A slab one metre thick; each colour has an albedo of its own."""
    matter = medium.of_extinction(
        spectrum.Constant(depth),
        spectrum.Tabulated(400.0 + np.arange(len(albedos)), np.asarray(albedos, float)),
        medium.Uniform(0.0, 1.0),
        phase_function,
    )
    sun = np.array([math.sqrt(1.0 - cosine * cosine), 0.0, cosine])
    lamp = light.Sun(sun, spectrum.Constant(1.0), 0.0)
    return atmos.Scene(geometry.Flat(), 1.0, (matter,), (lamp,), 0.0)


@eqx.filter_jit
def across_slab(scene, wavelength, altitudes, directions):
    """The mean of rays that stand each for a part of what is asked for."""
    solver = PathTracing(jax.random.key(7), 1, 2, 16, None)
    sky = solve(scene, solver, wavelength)
    positions = jnp.zeros_like(directions).at[:, 2].set(altitudes)
    world = sky.prepared, scene, scene.lights[0], sky.wavelength
    return sky.solver.tally(*world, positions, directions).mean


def rays(cosines, azimuths) -> np.ndarray:
    level = np.sqrt(1.0 - cosines**2)
    found = [level * np.cos(azimuths), level * np.sin(azimuths), cosines]
    return np.stack(found, -1).astype(np.float32)


# Rays of a flux are spread evenly in each of so many sets, which tell its error. They
# are as many near the horizon, where the light is that few rays would find.
SETS = 25


def slab_fluxes(folder: pathlib.Path, count: int) -> Iterator[tuple[float, float]]:
    """z-scores and relative standard errors of reflected and transmitted fluxes."""
    lines = (folder / "slab_reflectance_transmittance_hg.csv").read_text().splitlines()
    rows = list(csv.DictReader(x for x in lines if not x.startswith("#")))
    truth = {}
    for row in rows:
        depth, albedo, g, cosine = (float(row[x]) for x in ("tau", "omega", "g", "mu0"))
        through = float(row["T_total"]) - float(row["T_direct"])
        truth.setdefault((depth, g, cosine), {})[albedo] = float(row["R"]), through
    random = np.random.default_rng(3)
    each = max(count // SETS, 1)
    for (depth, g, cosine), values in truth.items():
        albedos = sorted(values)
        wavelength = (400.0 + np.arange(len(albedos))).astype(np.float32)
        # Roberts' sequence, shifted by chance.
        shifts = random.uniform(size=(2, SETS, 1, 2))
        places = (shifts + np.arange(each)[:, None] * [0.7548776662, 0.5698402910]) % 1
        rise, turns = places.reshape(2, -1, 2).transpose(2, 0, 1)
        directions = rays(rise * [[-1.0], [1.0]], 2.0 * math.pi * turns)
        altitudes = np.repeat([1.0, 0.0], SETS * each).astype(np.float32)
        scene = slab(depth, albedos, phase.HenyeyGreenstein(g), cosine)
        found = across_slab(
            scene,
            wavelength,
            jnp.asarray(altitudes),
            jnp.asarray(directions.reshape(-1, 3)),
        )
        found = np.asarray(found, float).reshape(2, SETS * each, -1)
        found = found * (2.0 * math.pi / cosine * rise[:, :, None])
        found = found.reshape(2, SETS, each, -1).mean(2)
        error = found.std(1, ddof=1) / math.sqrt(SETS)
        right = np.array([values[x] for x in albedos]).T
        # Less than a millionth comes through so rarely that no error is to be had.
        kept = right > 1e-6
        yield from zip(
            ((found.mean(1) - right) / error)[kept],
            (error / right)[kept],
            strict=True,
        )


# DISORT's own test problems (Stamnes et al. 2000): depth, albedo, phase function,
# cosine of the sun's zenith angle, irradiance; then the cosines that are looked along.
PROBLEMS = {
    "1a": (0.03125, 0.2, phase.Isotropic(), 0.1, math.pi / 0.1),
    "1b": (0.03125, 1.0, phase.Isotropic(), 0.1, math.pi / 0.1),
    "1d": (32.0, 0.2, phase.Isotropic(), 0.1, math.pi / 0.1),
    "1e": (32.0, 1.0, phase.Isotropic(), 0.1, math.pi / 0.1),
    "2a": (0.2, 0.5, phase.Rayleigh(), 0.080442, math.pi),
    "2b": (0.2, 1.0, phase.Rayleigh(), 0.080442, math.pi),
    "2c": (5.0, 0.5, phase.Rayleigh(), 0.080442, math.pi),
    "2d": (5.0, 1.0, phase.Rayleigh(), 0.080442, math.pi),
    "3a": (1.0, 1.0, phase.HenyeyGreenstein(0.75), 1.0, math.pi),
    "3b": (8.0, 1.0, phase.HenyeyGreenstein(0.75), 1.0, math.pi),
}
COSINES = {
    "1": [-1.0, -0.5, -0.1, 0.1, 0.5, 1.0],
    "2": [-0.981986, -0.538263, -0.018014, 0.018014, 0.538263, 0.981986],
    "3": [-1.0, -0.5, -0.1, 0.1, 0.5, 1.0],
}


def disort_radiances(folder: pathlib.Path, count: int) -> Iterator[tuple[float, float]]:
    """z-scores and relative standard errors, where DISORT's light is not next to 0."""
    table = json.loads((folder / "disort_converged_nanodisort.json").read_text())
    for case in table["cases"]:
        if case["case"] not in PROBLEMS:
            continue
        depth, albedo, function, cosine, irradiance = PROBLEMS[case["case"]]
        travels = np.array(COSINES[case["case"][0]])
        right = np.array(case["values"]["uu"])[0]
        # Light that travels up, and away from the sun, is seen by one who looks down
        # and towards it.
        altitudes = np.repeat([1.0, 0.0], 6)
        looks = rays(-np.tile(travels, 2), np.zeros(12))
        keep = (right.ravel() > 1e-9) & (
            np.repeat([1, -1], 6) * np.tile(travels, 2) > 0
        )
        places = np.repeat(altitudes[keep], count).astype(np.float32)
        scene = slab(depth, [albedo, albedo], function, cosine)
        found = across_slab(
            scene,
            np.array([400.0, 401.0], np.float32),
            jnp.asarray(places),
            jnp.asarray(np.repeat(looks[keep], count, 0)),
        )
        found = irradiance * np.asarray(found, float)[:, 0].reshape(-1, count)
        error = found.std(1, ddof=1) / math.sqrt(count)
        right = right.ravel()[keep]
        # What DISORT made of more streams and fewer differs by up to that.
        apart = np.array(case["abs_change_from_nstr"]["uu"])[0].ravel()[keep]
        z = (found.mean(1) - right) / np.hypot(error, apart)
        yield from zip(z, error / right, strict=True)


def judge(folder: pathlib.Path, count: int) -> Iterator[Claim]:
    """Are the z-scores of path tracing a standard normal's?"""
    for name, scores in [("slabs", slab_fluxes), ("DISORT", disort_radiances)]:
        z, errors = np.array(list(scores(folder, count))).T
        source = f"{len(z)} values of {name}"
        bar = 3.0 / math.sqrt(len(z)) + 0.05
        yield Claim(f"{name}: mean of z-scores", source, bar, abs(z.mean()))
        apart = max(z.std(), 1.0 / z.std())
        text = "    standard deviation, or one over it"
        yield Claim(text, source, 1.25, apart)
        outside = np.mean(np.abs(z) > 3.0)
        yield Claim("    share beyond three", source, 0.02, outside)
        yield Claim("    largest", source, None, np.abs(z).max())
        text = "    standard errors, relative: median"
        yield Claim(text, source, None, np.median(errors))


def claims(arguments: argparse.Namespace) -> Iterator[Claim]:
    """Of path tracing; traces truth and compares solvers with it first, if asked."""
    if arguments.out:
        truth = Truth(arguments.out)
        make(truth, arguments)
        for name in arguments.solver:
            compare(truth, name, arguments)
    if arguments.slabs:
        yield from judge(arguments.truth, arguments.slabs)


def options(parser: argparse.ArgumentParser) -> None:
    shared = pathlib.Path("../shared")
    parser.set_defaults(truth=shared / "truth")
    parser.add_argument("--scenes", type=pathlib.Path, default=shared / "scenes")
    parser.add_argument("--out", type=pathlib.Path, help="file of the truth")
    parser.add_argument("--samples", type=int, default=0, help="most, a direction")
    parser.add_argument("--error", type=float, default=0.0, help="that is enough")
    parser.add_argument("--walks", type=int, default=256, help="at once, a direction")
    known = [*SCENES, HAZY]
    parser.add_argument("--scene", nargs="*", default=SCENES, choices=known)
    parser.add_argument("--suns", nargs="*", type=float, default=SUNS)
    heights = [0.0, *(x / km for x in HIGH)]
    parser.add_argument("--altitudes", nargs="*", type=float, default=heights)
    parser.add_argument("--solver", nargs="*", default=[], help="to compare, by name")
    parser.add_argument("--slabs", type=int, default=0, help="rays a flux, if wanted")


if __name__ == "__main__":
    sys.exit(main(__doc__, claims, options))
