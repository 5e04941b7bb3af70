"""What a validation says: claims, what was expected, what was measured."""

import argparse
import json
import pathlib
from collections.abc import Callable, Iterable
from typing import NamedTuple


class Claim(NamedTuple):
    """A figure that may be at most `expected`; with None it is only reported."""

    claim: str
    source: str
    expected: float | None
    measured: float

    @property
    def verdict(self) -> str:
        if self.expected is None:
            return "-"
        return "ok" if self.measured <= self.expected else "FAILED"


def main(
    description: str | None,
    claims: Callable[[argparse.Namespace], Iterable[Claim]],
    options: Callable[[argparse.ArgumentParser], None] = lambda parser: None,
) -> int:
    """Prints claims as a table; returns 1 if one of them fails, 0 otherwise.

    `--truth` is where a validation finds published tables, if it reads any; `--json` is
    a file that the claims are written to as well. `options` adds others.
    """
    parser = argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--truth", type=pathlib.Path, help="folder of published tables")
    parser.add_argument("--json", type=pathlib.Path, help="write the figures there")
    options(parser)
    arguments = parser.parse_args()
    found = list(claims(arguments))
    if found:
        print(f"{'claim':60} {'source':28} {'expected':>9} {'measured':>9}  verdict")
    for x in found:
        bar = "" if x.expected is None else f"{x.expected:.2g}"
        print(f"{x.claim:60} {x.source:28} {bar:>9} {x.measured:9.4g}  {x.verdict}")
    if arguments.json:
        rows = [
            x._asdict() | {"measured": float(x.measured), "verdict": x.verdict}
            for x in found
        ]
        arguments.json.write_text(json.dumps(rows, indent=1))
    return 1 if any(x.verdict == "FAILED" for x in found) else 0
