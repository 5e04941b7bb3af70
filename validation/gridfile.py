"""Files that OpenVDB writes, read by atmos: is every voxel what OpenVDB says it is?

Needs an interpreter that has OpenVDB's Python module (Debian: python3-openvdb), by
default /usr/bin/python3, else what OPENVDB_PYTHON names; skipped without. Random clouds
of cells and tiles, also in half precision and as vectors, compared cell by cell.

    python -m validation.gridfile
"""

import argparse
import os
import pathlib
import subprocess
import sys
import tempfile
from collections.abc import Iterator

import numpy as np

from atmos.gridfile._load import _volumes
from atmos.gridfile._volume import Volume

from .claim import Claim, main


FIRST = (-9, 100, 3)
WRITER = f"""
import sys
import numpy as np
import pyopenvdb
rng = np.random.default_rng(0)
for size in [(70, 50, 33), (5, 6, 7), (129, 9, 9)]:
    values = rng.uniform(0.0, 1.0, size).astype(np.float32)
    values[rng.uniform(size=size) < 0.7] = 0.0
    values[: size[0] // 3] = 0.0
    values[-size[0] // 4 :, : size[1] // 2] = 0.5
    for kind in ("FloatGrid", "Vec3SGrid"):
        array = np.stack([values] * 3, -1) if kind == "Vec3SGrid" else values
        for half in (False, True):
            grid = getattr(pyopenvdb, kind)()
            grid.copyFromArray(array, ijk={FIRST})
            if kind == "FloatGrid":
                grid.prune()
            grid.name, grid.saveFloatAsHalf = "density", half
            name = sys.argv[1] + "/" + f"{{size}} {{kind}} {{'half' if half else ''}}"
            pyopenvdb.write(name + ".vdb", grids=[grid])
            due = np.zeros_like(array)
            pyopenvdb.read(name + ".vdb", "density").copyToArray(due, ijk={FIRST})
            np.save(name, due)
"""


def claims(arguments: argparse.Namespace) -> Iterator[Claim]:
    interpreter = os.environ.get("OPENVDB_PYTHON", "/usr/bin/python3")
    with tempfile.TemporaryDirectory() as folder:
        try:
            command = [interpreter, "-c", WRITER, folder]
            subprocess.run(command, check=True, capture_output=True)
        except (OSError, subprocess.CalledProcessError):
            print(f"{interpreter} has no OpenVDB: skipped.")
            return
        for path in sorted(pathlib.Path(folder).glob("*.vdb")):
            due = np.load(path.with_suffix(".npy"))
            found = inside(_volumes(str(path), ["density"])[0], due.shape)
            error = float(np.max(np.abs(found - due)))
            yield Claim(f"cells of {path.stem}", "OpenVDB", 0.0, error)


def inside(found: Volume, shape: tuple[int, ...]) -> np.ndarray:
    """The values that lie in a block of cells."""
    whole = np.zeros(shape, np.float32)
    apart = np.array(found.first) - FIRST
    low = np.maximum(apart, 0)
    high = np.minimum(apart + found.values.shape[:3], shape[:3])
    there = tuple(map(slice, low, high))
    whole[there] = found.values[tuple(map(slice, low - apart, high - apart))]
    return whole


if __name__ == "__main__":
    sys.exit(main(__doc__, claims))
