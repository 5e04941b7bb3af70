"""Classes of scenes that methods are judged on, and what is true of each.

Clear and hazy air in the round: path tracing with its standard error, of
`validation.multiple_scattering`. Thick clouds in a flat world: DISORT run to
convergence.
"""

import argparse
import json
import pathlib
import zlib
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np

import atmos
from atmos import colour, km, light, scenefile

from . import columns, multiple_scattering as traced
from .peers import View


# What a spectral dome is made of; those of the truth are among them.
NM = np.linspace(380.0, 780.0, 41).astype(np.float32)
TRACED = [
    ("high sun", [("rao", 60, 0), ("rao", 30, 0), ("ra", 60, 0)]),
    ("low sun", [("rao", 80, 0), ("ra", 80, 0)]),
    ("setting sun", [("rao", 88, 0), ("ra", 88, 0)]),
    ("twilight", [("rao", 92, 0), ("rao", 96, 0)]),
    ("hazy", [("hazy", 60, 0)]),
    ("high altitude", [("rao", 60, 10), ("rao", 60, 35), ("rao", 60, 400)]),
]
CLOUDS = "thick cloud"


class Problem(NamedTuple):
    """What is seen of a scene: the truth, and its error, [zenith, azimuth, wl].

    `wavelength` are those that the truth is known at. Without light there, the truth is
    not to be compared with: `counts` is False.
    """

    name: str
    world: str
    scene: atmos.Scene
    wavelength: np.ndarray
    view: View
    truth: np.ndarray
    error: np.ndarray

    @property
    def counts(self) -> np.ndarray:
        return self.truth > 1e-10

    @property
    def mark(self) -> str:
        """A number that changes when the truth does."""
        return f"{zlib.crc32(self.truth.tobytes()):08x}"


class Score(NamedTuple):
    """Errors of a method, of all problems of a class taken together.

    Relative radiances: the median and what 95 of 100 keep within; the median distance
    of colours, CIEDE2000.
    """

    median: float
    p95: float
    delta_e: float


def score(
    problems: list[Problem], found: list[np.ndarray], known=lambda nm: nm > 0.0
) -> Score:
    """`known` are the wavelengths that the method holds for."""
    apart, colours = [], []
    for problem, seen in zip(problems, found, strict=True):
        due = np.where(problem.counts, problem.truth, 1.0)
        off = np.abs(seen / due - 1.0)[..., known(problem.wavelength)]
        apart.append(off[problem.counts[..., known(problem.wavelength)]])
        lit = np.all(problem.counts, -1)
        pair = xyz(seen[lit], problem), xyz(problem.truth[lit], problem)
        colours.append(difference(*pair))
    apart = np.concatenate(apart)
    if not np.all(np.isfinite(apart)):
        return Score(np.inf, np.inf, np.inf)
    figures = np.median(apart), np.percentile(apart, 95.0)
    return Score(
        *(float(x) for x in figures), float(np.median(np.concatenate(colours)))
    )


def xyz(radiance: np.ndarray, problem: Problem) -> np.ndarray:
    """The colours of spectra under a sun of irradiance 1, in the light of the sun.

    Of one wavelength there is but grey.
    """
    nm = problem.wavelength
    if len(nm) == 1:
        return radiance * np.array([0.9505, 1.0, 1.089])
    sun = np.asarray(light.sunlight(10.0).evaluate(jnp.asarray(nm)), float)
    return (radiance * sun) @ np.asarray(colour.response(jnp.asarray(nm)), float)


def difference(found: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """CIEDE2000, each pair exposed so that the truth is half as bright as white."""
    import colour as science

    exposed = 0.5 / truth[..., 1:2]
    white = np.array(colour.D65)
    lab = [
        science.XYZ_to_Lab(np.maximum(x, 0.0) * exposed, white) for x in (found, truth)
    ]
    return np.asarray(science.delta_E(*lab, method="CIE 2000"))


def classes(arguments: argparse.Namespace) -> dict[str, list[Problem]]:
    """By name; of a quick chart fewer problems of each."""
    wanted = [x for x, _ in TRACED if x in arguments.only]
    cases = {
        name: [traced.Case(s, float(z), h * km) for s, z, h in of]
        for name, of in TRACED
        if name in wanted
    }
    if arguments.quick:
        cases = {k: x[:1] for k, x in cases.items()}
    truths = [traced.Truth(x) for x in arguments.traced]
    own = traced.Truth(arguments.folder / "truth.npz")
    for each in cases.values():
        for case in each:
            known = any(f"{case.name} many" in x.arrays for x in truths)
            if not known and own.paths(case) < arguments.samples:
                _trace(own, case, arguments)
    truths.append(own)
    found = {
        name: [problem_of(x, truths, arguments.scenes) for x in each]
        for name, each in cases.items()
    }
    table = arguments.truth / "disort_converged_nanodisort.json"
    if CLOUDS in arguments.only and table.exists():
        found[CLOUDS] = _clouds(json.loads(table.read_text()), arguments.quick)
    elif CLOUDS in arguments.only:
        print(f"{table} is missing: no thick clouds.")
    return found


def _trace(own: traced.Truth, case: traced.Case, arguments) -> None:
    """What no file has is traced; it is kept, and gone on with if more is asked for."""
    print(f"{case.name}: in no file of truths, is traced", flush=True)
    given = {
        "scene": [case.scene],
        "suns": [case.sun],
        "altitudes": [case.altitude / km],
        "scenes": arguments.scenes,
        "samples": arguments.samples,
        "error": 0.0,
        "walks": 16,
    }
    traced.make(own, argparse.Namespace(**given))


def scene_of(case: traced.Case, scenes: pathlib.Path) -> atmos.Scene:
    """The scene of a case, under its sun."""
    scene = scenefile.parse(traced.described(scenes, case.scene))
    sun = jnp.asarray(traced.vectors(case.sun, 0.0))
    return eqx.tree_at(lambda x: x.lights[0].direction, scene, sun)


def problem_of(
    case: traced.Case, truths: list[traced.Truth], scenes: pathlib.Path
) -> Problem:
    """What is seen of a case, as the first file that has it tells."""
    truth = next(x for x in truths if f"{case.name} many" in x.arrays)
    scene = scene_of(case, scenes)
    angles = truth.arrays[f"{case.name} angles"]
    azimuths = np.unique(angles[:, 1])
    zeniths = angles[:: len(azimuths), 0]
    shape = len(zeniths), len(azimuths), len(traced.WAVELENGTH)
    of = lambda x: np.broadcast_to(x, (len(angles), shape[2])).reshape(shape)
    return Problem(
        case.name,
        case.scene,
        scene,
        traced.WAVELENGTH,
        View(case.altitude, zeniths, azimuths),
        of(truth.radiance(case)).astype(float),
        of(truth.get(case)[1]).astype(float),
    )


def _clouds(table: dict, quick: bool) -> list[Problem]:
    """Isotropic of depth 32, Henyey and Greenstein's of 8, and a real cloud's of 64."""
    truth = {x["case"]: x for x in table["cases"]}
    known = [x[0] for x in columns.cases()]
    wanted = ["5a" if "5a" in known else "3b"] if quick else ["1e", "3b", "5a", "5b"]
    problems = []
    for case in columns.cases():
        name, depth, albedo, lobe, cosine, irradiance, depths, mus, azimuths = case
        if name not in wanted:
            continue
        inner = [x for x in depths if 0.0 < x < depth]
        scene = columns.slab(depth, albedo, lobe, cosine, irradiance, inner)
        right = np.array(truth[name]["values"]["uu"])
        apart = np.array(truth[name]["abs_change_from_nstr"]["uu"])
        # What travels upwards is seen by looking down.
        zeniths = np.degrees(np.arccos(-np.array(mus)))
        for i, tau in enumerate(depths):
            view = View(columns.DEEP * (1.0 - tau / depth), zeniths, np.array(azimuths))
            at = lambda x, i=i: np.swapaxes(x[:, i], 0, 1)[..., None]
            problems.append(
                Problem(
                    f"{name} {tau:g}",
                    name,
                    scene,
                    np.array([500.0], np.float32),
                    view,
                    at(right),
                    at(apart),
                )
            )
    return problems
