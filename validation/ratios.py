"""How many times as quick as the programs of others, at no larger error.

    python -m validation.ratios --traced truth.npz

All look from the ground along the same 2048 directions, down to a degree above the
horizon, at the same 41 wavelengths, at the air of `reference_rao` under a sun of 60
degrees. Flat programs see it made flat; the truth there is nanodisort with 64 streams
and 240 layers at four of the wavelengths. Round ones are judged in the round, by path
tracing (a file as written by `validation.chart`): by their mean error beyond two
standard errors of the truth, in its own directions. To reach an error means to be below
it in all directions, and in the round in the mean.
"""

import argparse
import dataclasses
import pathlib
import sys
import warnings
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

import atmos
from atmos.geometry import Flat
from atmos.solver import AbstractSolver, Columns, QUICK

from . import multiple_scattering as traced, peers
from .claim import Claim, main
from .contest import NM, Problem, problem_of, scene_of
from .entrants import among, Effort, looked, timed
from .peers import View


VIEW = View(0.0, np.linspace(0.0, 89.0, 64), np.linspace(0.0, 180.0, 32))
KNOWN = np.array([380.0, 450.0, 550.0, 650.0], np.float32)
CASE = traced.Case("rao", 60.0, 0.0)
# How many times quicker atmos is at least; in a flat world until each of these errors
# is reached, in the round until that of the peer is, at each of its settings.
FLAT = {
    "PythonicDISORT": (100.0, [0.1, 0.05, 0.03]),
    "nanodisort": (30.0, [1e-2, 1e-3, 5e-4]),
}
ROUND = {"sasktran2": 20.0}


class Run(NamedTuple):
    """A method at one setting, the seconds it takes, and its error."""

    method: str
    setting: str
    seconds: float
    error: float


def ours() -> Iterator[tuple[str, AbstractSolver]]:
    """From the quickest to the finest."""
    quick = {"pieces": 8, "nodes": 2, "single": QUICK}
    yield "8 streams, 30 layers", Columns(streams=8, layers=30, suns=8, **quick)
    yield "12 streams, 30 layers", Columns(streams=12, layers=30, suns=8, **quick)
    yield "12 streams, 60 layers", Columns(streams=12)
    yield "14 streams, 60 layers", Columns(streams=14)
    yield "16 streams, 60 layers", Columns()


def flat_peers() -> Iterator[tuple[str, str, peers.Look]]:
    if "nanodisort" not in peers.missing():
        for layers in (30, 60):
            for streams in (8, 16, 24, 32):
                look = peers.cdisort(streams, layers)
                yield "nanodisort", f"{streams} streams, {layers} layers", look
    if "PythonicDISORT" not in peers.missing():
        for streams, layers in ((16, 30), (32, 30), (32, 60), (48, 60), (64, 60)):
            look = peers.pythonic(streams, layers)
            yield "PythonicDISORT", f"{streams} streams, {layers} layers", look


def run(method: str, setting: str, look: Callable, error: Callable, effort) -> Run:
    """The first look, which compiles, goes before."""
    found, times = timed(look, effort)
    made = Run(method, setting, times.median, error(found))
    print(f"{method:16}{setting:28}{made.seconds:9.3f} s{made.error:11.2e}", flush=True)
    return made


def flat(scene: atmos.Scene) -> Iterator[Run]:
    """All in a flat world, by their largest errors."""
    scene = dataclasses.replace(scene, geometry=Flat())
    truth = peers.cdisort(64, 240)(scene, KNOWN.astype(float), VIEW)()

    def error(found):
        return float(np.max(np.abs(found[..., among(KNOWN)] / truth - 1.0)))

    print("in a flat world, largest error")
    for name, solver in ours():
        sky = lambda solver=solver: atmos.solve(scene, solver, NM)
        look = lambda sky=sky: looked(sky(), VIEW, 0.0)
        yield run("Columns", name, look, error, Effort(9, 10.0))
    for method, setting, look in flat_peers():
        look = look(scene, NM.astype(float), VIEW)
        yield run(method, setting, look, error, Effort(1, 0.0))


def in_the_round(problem: Problem) -> Iterator[Run]:
    """All in a round world, by their mean errors beyond what is not known."""
    scene, known = problem.scene, problem.wavelength

    def error(found):
        off = np.abs(found - problem.truth) - 2.0 * problem.error
        return float(np.mean(np.maximum(off, 0.0) / problem.truth))

    print("in the round, mean error beyond two standard errors")
    for name, solver in ours():
        seen = atmos.solve(scene, solver, NM)
        right = looked(seen, problem.view, 0.0)[..., among(known)]
        look = lambda solver=solver: looked(atmos.solve(scene, solver, NM), VIEW, 0.0)
        yield run("Columns", name, look, lambda _, x=right: error(x), Effort(9, 10.0))
    for peer in peers.peers():
        if peer.flat or peer.setting == "single":
            continue
        right = peer.look(scene, known.astype(float), problem.view)()
        look = peer.look(scene, NM.astype(float), VIEW)
        judge = lambda _, x=right: error(x)
        yield run(peer.method, peer.setting, look, judge, Effort(1, 0.0))


def ratio(runs: list[Run], peer: str, most: float, bar: float) -> Iterator[Claim]:
    """How long the quickest of ours takes of what the quickest of a peer's takes."""
    reached = [x for x in runs if x.error <= most]
    mine = [x for x in reached if x.method == "Columns"]
    theirs = [x for x in reached if x.method == peer]
    if mine and theirs:
        a, b = (min(x, key=lambda x: x.seconds) for x in (mine, theirs))
        text = f"to {most:.2g}: {a.seconds:.2f} s, {a.setting}; {b.seconds:.2f} s"
        yield Claim(text, f"{peer}, {b.setting}", 1.0 / bar, a.seconds / b.seconds)


def claims(arguments: argparse.Namespace) -> Iterator[Claim]:
    warnings.simplefilter("ignore")  # of albedos next to 1
    runs = list(flat(scene_of(CASE, arguments.scenes)))
    for peer, (bar, errors) in FLAT.items():
        for most in errors:
            yield from ratio(runs, peer, most, bar)
    truth = traced.Truth(arguments.traced)
    if f"{CASE.name} many" not in truth.arrays:
        print(f"{arguments.traced} has no {CASE.name}: nothing in the round.")
        return
    runs = list(in_the_round(problem_of(CASE, [truth], arguments.scenes)))
    for x in runs:
        if x.method in ROUND:
            yield from ratio(runs, x.method, x.error, ROUND[x.method])


def options(parser: argparse.ArgumentParser) -> None:
    shared = pathlib.Path("../shared")
    parser.add_argument("--scenes", type=pathlib.Path, default=shared / "scenes")
    parser.add_argument(
        "--traced", type=pathlib.Path, default=pathlib.Path("chart/truth.npz")
    )


if __name__ == "__main__":
    sys.exit(main(__doc__, claims, options))
