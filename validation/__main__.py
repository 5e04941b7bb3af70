"""All claims of all validations, each in a process of its own, as one page.

    python -m validation --truth ../shared/truth --traced truth.npz

writes `report/report.html`: every claim with its source, what was expected and what
was measured, the chart of speed and accuracy and the maps of errors if there are any,
and what was left out for want of tables or programs. Exits with 1 where a claim fails.
Truth by path tracing that no file has is traced into the folder.
By default what takes minutes is left out; `--all` takes it in, `--part` chooses. Parts
that are done are kept in the folder: `--keep` goes on from there.
"""

import argparse
import base64
import html
import importlib.util
import json
import math
import pathlib
import subprocess
import sys
import time
from typing import NamedTuple


class Part(NamedTuple):
    """A module, and if it takes long or wants the published tables, or what is traced.

    What wants that wants the scenes it was traced for, too.
    """

    about: str
    long: bool = False
    tables: bool = False
    traced: bool = False
    more: tuple[str, ...] = ()


PARTS = {
    "single_scattering": Part("Light that turned once"),
    "columns": Part("Discrete ordinates in flat columns", True, True),
    "orders": Part("All orders in the round", True, traced=True),
    "fineness": Part("Finer shells", True),
    "derivatives": Part("Slopes of radiance", True),
    "multiple_scattering": Part(
        "Path tracing itself", True, True, more=("--slabs", "250")
    ),
    "polarisation": Part("Polarised light", True, True),
    "volumes": Part("Clouds and smoke", True, True),
    "world": Part("Clouds in round air, and even light", True),
    "film": Part("Pictures that grow", True),
    "gridfile": Part("OpenVDB files"),
    "fitted": Part("Fitted skies"),
    "panorama": Part("Tables of directions", True),
    "envmap": Part("Pictures as lights elsewhere"),
    "colour": Part("Colours"),
    "ratios": Part("Speed beside that of others", True, traced=True),
    "speed": Part("Speed", True, more=("--no-commands",)),
}
TRUTH = "truth.npz"
PEERS = [
    *("mitsuba", "nanodisort", "pvlib", "pyradiance", "PythonicDISORT", "sasktran2"),
    *("matplotlib",),
]


class Outcome(NamedTuple):
    """What a part said: its claims, its words, how it ended and how long it took."""

    claims: list[dict]
    said: str
    code: int
    seconds: float

    @property
    def failed(self) -> bool:
        return self.code != 0 or any(x["verdict"] == "FAILED" for x in self.claims)


def run(name: str, arguments: argparse.Namespace) -> Outcome:
    file = arguments.folder / f"{name}.json"
    command = [sys.executable, "-m", f"validation.{name}", *PARTS[name].more]
    command += ["--json", str(file)]
    if PARTS[name].tables:
        command += ["--truth", str(arguments.truth)]
    if PARTS[name].traced:
        command += ["--scenes", str(arguments.scenes)]
        command += ["--traced", str(arguments.traced or arguments.folder / TRUTH)]
    file.unlink(missing_ok=True)
    start = time.perf_counter()
    done = subprocess.run(command, capture_output=True, text=True)
    seconds = time.perf_counter() - start
    claims = json.loads(file.read_text()) if file.exists() else []
    if isinstance(claims, dict):  # of speed: bars in seconds
        claims = [
            {
                "claim": f"{x['name']}, seconds",
                "source": claims["machine"],
                "expected": x["bar"],
                "measured": x["later"],
                "verdict": "-" if x["bar"] is None
                else "ok" if x["later"] <= x["bar"] else "FAILED",
            }
            for x in claims["rows"]
        ]  # fmt: skip
    ended = done.returncode not in (0, 1) or "Traceback" in done.stderr
    said = done.stdout + (done.stderr[-4000:] if ended else "")
    return Outcome(claims, said, done.returncode, seconds)


def kept(name: str, arguments: argparse.Namespace) -> Outcome:
    """As it was found before, if that is asked for."""
    file = arguments.folder / f"{name}.outcome.json"
    if arguments.keep and file.exists():
        return Outcome(**json.loads(file.read_text()))
    outcome = run(name, arguments)
    file.write_text(json.dumps(outcome._asdict()))
    return outcome


def bar(claim: dict) -> str:
    """How the measured figure stands to the expected one, on three decades each way."""
    if not claim["expected"]:
        return ""
    share = max(claim["measured"], 1e-300) / claim["expected"]
    place = 50.0 + 50.0 * min(max(math.log10(share) / 3.0, -1.0), 1.0)
    kind = "bad" if share > 1.0 else "good"
    return f'<div class="bar"><i class="{kind}" style="width:{place:.1f}%"></i></div>'


def rows(outcome: Outcome) -> str:
    lines = []
    for x in outcome.claims:
        expected = "" if x["expected"] is None else f"{x['expected']:.2g}"
        cells = [x["claim"].replace("    ", "- "), x["source"], expected]
        cells += [f"{x['measured']:.3g}"]
        told = "".join(f"<td>{html.escape(y)}</td>" for y in cells)
        kind = "failed" if x["verdict"] == "FAILED" else ""
        lines.append(
            f'<tr class="{kind}">{told}<td>{bar(x)}</td><td>{x["verdict"]}</td></tr>'
        )
    return "\n".join(lines)


def figure(path: pathlib.Path, text: str) -> str:
    if not path.exists():
        return f"<p>{html.escape(text)}: there is no {html.escape(str(path))}.</p>"
    picture = base64.b64encode(path.read_bytes()).decode()
    source = f"data:image/png;base64,{picture}"
    return f'<h2>{html.escape(text)}</h2><img alt="{text}" src="{source}">'


STYLE = """
body { font: 15px/1.4 sans-serif; margin: 2em auto; max-width: 75em; padding: 0 1em }
table { border-collapse: collapse; width: 100% }
td, th { text-align: left; padding: 2px 8px; border-bottom: 1px solid #ddd }
.failed { background: #fdd } img { max-width: 100% }
.bar { width: 9em; height: .7em; background: linear-gradient(90deg, #eee 50%, #fcc 50%)}
.bar i { display: block; height: 100% } .good { background: #4a4 }
.bad { background: #c33 } pre { font-size: 12px; overflow-x: auto; background: #f6f6f6 }
"""


def overview(found: dict[str, Outcome]) -> str:
    """A line for each part, which leads to it."""
    lines = []
    for name, x in found.items():
        held = sum(y["verdict"] == "ok" for y in x.claims)
        failed = sum(y["verdict"] == "FAILED" for y in x.claims)
        state = "FAILED" if x.failed else "ok" if x.claims else "claims nothing"
        cells = [str(held), str(failed), f"{x.seconds:.0f} s", state]
        kind = "failed" if x.failed else ""
        link = f'<a href="#{name}">{html.escape(PARTS[name].about)}</a>'
        told = "".join(f"<td>{y}</td>" for y in (link, *cells))
        lines.append(f'<tr class="{kind}">{told}</tr>')
    names = ["", "claims that hold", "that fail", "time", ""]
    return table(names, "\n".join(lines))


def table(names: list[str], lines: str) -> str:
    head = "".join(f"<th>{x}</th>" for x in names)
    return f"<table><tr>{head}</tr>\n{lines}</table>"


def page(found: dict[str, Outcome], missing: list[str], chart, maps) -> str:
    every = [x for outcome in found.values() for x in outcome.claims]
    held = sum(x["verdict"] == "ok" for x in every)
    failed = [name for name, x in found.items() if x.failed]
    head = f"{held} claims hold"
    head += f"; failed: {', '.join(failed)}" if failed else "; none fails"
    parts = ['<!doctype html><html lang="en"><meta charset="utf-8">']
    parts += [f"<title>What atmos claims</title><style>{STYLE}</style>"]
    parts += ["<h1>What atmos claims, measured</h1>", f"<p><b>{head}.</b></p>"]
    parts += [overview(found), "<ul>"]
    parts += [f"<li>left out: {html.escape(x)}</li>" for x in missing]
    parts += ["</ul>", figure(chart, "Speed and accuracy")]
    parts += [figure(maps, "Where methods go wrong")]
    names = ["claim", "source", "expected at most", "measured"]
    names += ["of what is expected: a thousandth to thousandfold", ""]
    for name, x in found.items():
        parts.append(f'<h2 id="{name}">{PARTS[name].about}</h2>')
        ended = f"{x.seconds:.0f} s, exit {x.code}"
        parts.append(f"<p><code>python -m validation.{name}</code>, {ended}</p>")
        if x.claims:
            parts.append(table(names, rows(x)))
        said = html.escape(x.said)
        parts.append(f"<details><summary>in full</summary><pre>{said}</pre></details>")
    return "\n".join(parts)


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="python -m validation",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    shared = pathlib.Path("../shared")
    parser.add_argument("--truth", type=pathlib.Path, default=shared / "truth")
    parser.add_argument("--scenes", type=pathlib.Path, default=shared / "scenes")
    parser.add_argument("--traced", type=pathlib.Path, help="truth by path tracing")
    parser.add_argument("--part", nargs="*", choices=PARTS, help="these alone")
    parser.add_argument("--all", action="store_true", help="what takes minutes too")
    parser.add_argument(
        "--keep", action="store_true", help="what is done is not redone"
    )
    parser.add_argument("--folder", type=pathlib.Path, default=pathlib.Path("report"))
    parser.add_argument("--chart", type=pathlib.Path, default=pathlib.Path("chart"))
    arguments = parser.parse_args()
    arguments.folder.mkdir(parents=True, exist_ok=True)
    usual = [x for x in PARTS if arguments.all or not PARTS[x].long]
    wanted = list(arguments.part or usual)
    idle = [x for x in PARTS if x not in wanted]

    missing = [x for x in PEERS if importlib.util.find_spec(x) is None]
    missing = [f"what needs {x}, which is not installed" for x in missing]
    tables = arguments.truth.is_dir()
    if not tables:
        missing.append(f"what reads published tables: {arguments.truth} is no folder")
    missing += [f"not asked for: {', '.join(idle)}"] if idle else []
    found = {}
    for name in wanted:
        if PARTS[name].tables and not tables:
            missing.append(f"{name}, which reads published tables")
            continue
        if PARTS[name].traced and not arguments.scenes.is_dir():
            missing.append(f"{name}, whose scenes are not in {arguments.scenes}")
            continue
        found[name] = kept(name, arguments)
        x = found[name]
        state = "FAILED" if x.failed else "ok"
        words = x.said.strip().splitlines()
        if not x.claims and words:  # it claims nothing, and says why
            missing.append(f"{name}: {words[0]}")
        print(f"{name:20} {len(x.claims):4} claims {x.seconds:6.0f} s  {state}")
        for claim in x.claims:
            if claim["verdict"] == "FAILED":
                print(
                    f"    {claim['claim'].strip()}: {claim['measured']:.3g}, expected "
                    f"at most {claim['expected']:.3g} ({claim['source']})"
                )
        sys.stdout.flush()
    for text in missing:
        print(f"left out: {text}")
    maps = pathlib.Path(__file__).parent / "maps.png"
    report = arguments.folder / "report.html"
    report.write_text(page(found, missing, arguments.chart / "chart.png", maps))
    print(f"written: {report}")
    return 1 if any(x.failed for x in found.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
