"""Error against time of all methods and peers, as figures and a picture.

    python -m validation.chart --quick --traced truth.npz

Per class of scene, every method at several settings renders the same spectral dome
(1024 x 512, 41 wavelengths), and its radiances are compared with the truth: path
tracing with its standard error (from the files `--traced`, as written by
`validation.multiple_scattering`; what they lack is traced into the folder), for clouds
DISORT run to convergence. Fitted skies take the turbidity that suits them best. Flat
and spherical programs of others are asked for 720 directions, as many as a table of
atmos has, at one and at four wavelengths, which is drawn out to 41, and the dome is
looked up in that; mitsuba's `sunsky` is asked for all of it. Times are medians of warm
runs; compilation is told apart.

`--folder` gets `chart.csv`, `chart.json` (with spread, compilation and machine) and
`chart.png`. What is in it already is kept as long as code, programs, machine and truth
are the same: an interrupted run goes on. `--anew` measures all again.
"""

import argparse
import csv
import importlib.util
import json
import os
import pathlib
import sys
import time

import jax
import numpy as np

from .contest import classes, CLOUDS, Problem, TRACED
from .entrants import AbstractEntrant, Effort, entrants, Refused, Result
from .speed import machine


COLUMNS = ["scene", "method", "setting", "time", "median_error", "p95_error", "delta_e"]
CLASSES = [*(name for name, _ in TRACED), CLOUDS]


class Kept:
    """Rows that were measured, in a file that is replaced whole after each."""

    def __init__(self, path: pathlib.Path, anew: bool):
        self.path = path
        self.rows = json.loads(path.read_text()) if path.exists() and not anew else []

    def get(self, stamp: str) -> list[dict]:
        return [x for x in self.rows if x["stamp"] == stamp]

    def put(self, rows: list[dict]) -> None:
        same = lambda a, b: all(a[k] == b[k] for k in ("scene", "method", "setting"))
        old = [x for x in self.rows if not any(same(x, y) for y in rows)]
        self.rows = old + rows
        part = self.path.with_suffix(".part")
        part.write_text(json.dumps(self.rows, indent=1))
        os.replace(part, self.path)


def row(name: str, entrant: AbstractEntrant, result: Result, stamp: str) -> dict:
    times, score = result.times, result.score
    return {
        "scene": name,
        "method": entrant.method,
        "setting": result.setting,
        "time": times.median,
        "median_error": score.median,
        "p95_error": score.p95,
        "delta_e": score.delta_e,
        "quickest": times.low,
        "slowest": times.high,
        "compiling": max(times.first - times.median, 0.0),
        "note": result.note,
        "machine": machine(),
        "stamp": stamp,
    }


def measure(
    name: str, problems: list[Problem], entrant: AbstractEntrant, arguments, kept: Kept
) -> list[dict]:
    """The rows of one entrant for one class: kept, or made; none where it refuses."""
    effort = Effort(3, 3.0) if arguments.quick else Effort(5, 10.0)
    marks = "".join(x.mark for x in problems)
    setting = entrant.setting
    stamp = f"{name}/{entrant.method}/{setting}/{entrant.edition}/{machine()}/"
    stamp += f"{marks}/{effort.runs}"
    found = kept.get(stamp)
    if found:
        return found
    start = time.perf_counter()
    try:
        made = [row(name, entrant, x, stamp) for x in entrant.results(problems, effort)]
    except Refused as why:
        print(f"{name:15}{entrant.method:16}{setting:24} refused: {why}"[:120])
        return []
    kept.put(made)
    for x in made:
        print(
            f"{name:15}{x['method']:16}{x['setting']:24}{x['time']:9.3f} s "
            f"{x['median_error']:9.3%}{x['p95_error']:9.3%}{x['delta_e']:7.2f}"
            f"  ({time.perf_counter() - start:.0f} s)",
            flush=True,
        )
    return made


def write(path: pathlib.Path, rows: list[dict]) -> None:
    with open(path, "w", newline="") as file:
        table = csv.DictWriter(file, COLUMNS, extrasaction="ignore")
        table.writeheader()
        for x in rows:
            figures = {k: f"{x[k]:.4g}" for k in COLUMNS[3:]}
            table.writerow(x | figures)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    shared = pathlib.Path("../shared")
    parser.add_argument("--quick", action="store_true", help="less of everything")
    parser.add_argument("--folder", type=pathlib.Path, default=pathlib.Path("chart"))
    parser.add_argument("--traced", type=pathlib.Path, nargs="*", default=[])
    parser.add_argument("--samples", type=int, help="paths a direction, where traced")
    parser.add_argument("--scenes", type=pathlib.Path, default=shared / "scenes")
    parser.add_argument("--truth", type=pathlib.Path, default=shared / "truth")
    parser.add_argument("--only", nargs="*", default=CLASSES, choices=CLASSES)
    parser.add_argument("--method", nargs="*", help="these alone")
    parser.add_argument("--anew", action="store_true", help="measure all again")
    arguments = parser.parse_args()
    arguments.samples = arguments.samples or (1024 if arguments.quick else 1536)
    arguments.folder.mkdir(parents=True, exist_ok=True)
    for path in arguments.traced:
        if not path.exists():
            parser.error(f"{path} does not exist.")

    taking, missing = entrants(arguments.quick)
    if missing:
        print(f"not installed, left out: {', '.join(missing)}")
    kept = Kept(arguments.folder / "chart.json", arguments.anew)
    found, wanted, rows = classes(arguments), arguments.method, []
    for entrant in taking:
        if wanted and entrant.method not in wanted:
            continue
        for name, problems in found.items():
            rows += measure(name, problems, entrant, arguments, kept)
        # A process may hold only so many programs: those of hours are too many.
        jax.clear_caches()
    rows.sort(key=lambda x: CLASSES.index(x["scene"]))
    write(arguments.folder / "chart.csv", rows)

    if importlib.util.find_spec("matplotlib") is None:
        print("matplotlib is not installed: no picture.")
        return 0
    from .drawing import draw

    noise = {name: uncertainty(x) for name, x in found.items()}
    notes = [machine(), f"median of warm runs{', quick' * arguments.quick}"]
    notes += ["other solvers: 720 directions, drawn out to 41 wavelengths"]
    if CLOUDS in found:
        notes += ["clouds: the truth is nanodisort's own code with 256 streams"]
    notes += [f"missing: {x}" for x in missing]
    draw(arguments.folder / "chart.png", rows, noise, notes)
    return 0


def uncertainty(problems: list[Problem]) -> float:
    """The median standard error of the truth, relative."""
    found = [(x.error / np.where(x.counts, x.truth, 1.0))[x.counts] for x in problems]
    return max(float(np.median(np.concatenate(found))), 1e-9)


if __name__ == "__main__":
    sys.exit(main())
