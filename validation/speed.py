"""How long things take: `python -m validation.speed [--json FILE]`.

Medians of several runs after a warm-up; the first run, which compiles, is said apart.
Exits with 1 where a bar is missed.
"""

import argparse
import dataclasses
import json
import os
import pathlib
import platform
import resource
import statistics
import subprocess
import sys
import tempfile
import time

import jax
import jax.numpy as jnp

import atmos
from atmos import camera, colour, deg, light, render, render_disks, solver
from atmos.geometry import Flat

from .volumes import MARCH, smoke


NM = jnp.linspace(380.0, 780.0, 41)


def measure(work, runs=5):
    """Seconds of the first run, and of the median of those that follow."""
    times = []
    for _ in range(runs + 1):
        start = time.perf_counter()
        jax.block_until_ready(work())
        times.append(time.perf_counter() - start)
    return times[0], statistics.median(times[1:])


def pictures():
    """Rows of name, first run and later runs in seconds, and the bar for the latter."""
    at = jnp.array([0.0, 0.0, 2.0])
    sun = light.Sun.at(60 * deg, 0.0, light.sunlight())
    sky = atmos.solve(atmos.earth(sun), solver.QUICK, NM)
    xyz = colour.response(NM)
    dome, large = camera.LatLong(at, 512), camera.LatLong(at, 2048)

    def whole():
        return render(sky, large, xyz) + render_disks(sky, large, xyz)

    tasks = [
        ("table of the sky", lambda: sky.panorama(at), None),
        ("1024 x 512 x 41 dome, spectral", lambda: render(sky, dome), 0.4),
        ("1024 x 512 dome, XYZ", lambda: render(sky, dome, xyz), None),
        ("4096 x 2048 dome, XYZ, with the sun", whole, 3.0),
        (
            "512 x 512 fisheye, XYZ",
            lambda: render(sky, camera.Fisheye(at, 512), xyz),
            None,
        ),
    ]
    for name, work, bar in tasks:
        yield name, *measure(work), bar


def solutions():
    """The same of solvers that find all orders of scattering."""
    at = jnp.array([0.0, 0.0, 2.0])
    earth = atmos.earth(light.Sun.at(60 * deg, 0.0, light.sunlight()))
    flat = dataclasses.replace(earth, geometry=Flat())
    dome = camera.LatLong(at, 512)
    quick = {"single": solver.QUICK}
    columns, shells = solver.Columns(**quick), solver.Shells(**quick)
    shared = solver.Shared(**quick)
    work = lambda world, method: atmos.solve(world, method, NM).prepared
    whole = lambda method: render(atmos.solve(earth, method, NM), dome)
    yield "Columns, flat: solution", *measure(lambda: work(flat, columns)), 0.25
    yield "Columns: solution and dome", *measure(lambda: whole(columns)), 0.6
    yield "Shared: solution and dome", *measure(lambda: whole(shared)), None
    yield "Shells: solution", *measure(lambda: work(earth, shells), 2), 30.0
    sky = atmos.solve(earth, shells, NM)
    yield "Shells: dome from it", *measure(lambda: render(sky, dome)), 0.6


def marched():
    """The same of smoke on a grid of 256 cubed cells, with its shadows, at 1024 x 1024.

    It cannot take less than looking up the smoke and its shadow in the steps that lie
    in it, some 13 million, 5 ns each for the eight cells around a place, and
    exponentials of them: a fifth of a second of one core.
    """
    sky, view = smoke(MARCH, 1024)
    scene, nm = sky.scene, sky.wavelength
    work = lambda: render(atmos.solve(scene, MARCH, nm), view)
    yield "smoke, 256 cubed, marched at 1024 x 1024", *measure(work), 2.0


def commands():
    """The first `atmos sky` of a machine, and the next, by default and by `single`."""
    for more, later in ([], 8.0), (["--solver", "single"], 7.0):
        with tempfile.TemporaryDirectory() as folder:
            environment = os.environ | {"ATMOS_CACHE": os.path.join(folder, "cache")}
            command = [os.path.join(os.path.dirname(sys.executable), "atmos"), "sky"]
            command += ["--output", os.path.join(folder, "sky.exr"), *more]
            times = []
            for _ in range(4):
                start = time.perf_counter()
                subprocess.run(
                    command, env=environment, check=True, capture_output=True
                )
                times.append(time.perf_counter() - start)
        name = " ".join(["atmos sky", *more])
        yield f"{name}, first on a machine", None, times[0], 20.0
        yield f"{name}, later", None, statistics.median(times[1:]), later


def machine():
    """What it ran on."""
    device = jax.devices()[0]
    if device.platform != "cpu":
        return f"{device.device_kind}, JAX {jax.__version__}"
    name = platform.processor() or platform.machine()
    lines = pathlib.Path("/proc/cpuinfo")
    if lines.exists():
        named = [x for x in lines.read_text().splitlines() if "model name" in x]
        name = named[0].split(": ")[1] if named else name
    return f"{name}, {os.cpu_count()} cores, JAX {jax.__version__}"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=pathlib.Path, help="write the figures there")
    parser.add_argument("--no-commands", action="store_true", help="pictures only")
    arguments = parser.parse_args()
    rows = [*pictures(), *solutions(), *marched()]
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    rows += [] if arguments.no_commands else list(commands())

    print(machine())
    print(f"{'':40}{'first run':>10}{'later':>10}{'bar':>8}")
    for name, first, later, bar in rows:
        first = "" if first is None else f"{first:.2f} s"
        said = "" if bar is None else f"{bar:g} s"
        print(f"{name:40}{first:>10}{later:>8.3f} s{said:>8}")
    print(f"peak memory of all pictures: {memory:.2f} GB")
    if arguments.json:
        named = [
            dict(zip(("name", "first", "later", "bar"), row, strict=True))
            for row in rows
        ]
        result = {"machine": machine(), "peak_memory_gb": memory, "rows": named}
        arguments.json.write_text(json.dumps(result, indent=1))
    missed = [row for row in rows if row[3] is not None and row[2] > row[3]]
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
