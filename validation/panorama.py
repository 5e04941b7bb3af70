"""Pictures against marching every pixel: where does the table of the sky meet 1e-3?

A picture looks radiances up in a table of directions, which is made with few nodes a
ray, or with the default number from above 20 km. It is compared with the default solver
itself, in random directions: one half of them all over the sphere, the other crowded
from both sides at the horizon and, from space, at the limb of the air. Errors are
relative to the radiance, or to a thousandth of the brightest direction where that is
more. Domes are looked up by cubics, other pictures on a finer grid by straight lines.
The last column shows the largest error of the picture's solver alone, without a table.

    python -m validation.panorama
"""

import argparse
import concurrent.futures
import math
import sys
from collections.abc import Iterator

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import atmos
from atmos import deg, km, light, solver

from . import single_scattering as reference
from .claim import Claim, main


NM = np.array([400.0, 550.0, 700.0], np.float32)
SUNS = {
    "earth": [0.0, 30.0, 60.0, 80.0, 88.0, 90.0, 92.0, 94.0, 96.0],
    "reference": [0.0, 60.0, 80.0, 90.0, 94.0],
}
ALTITUDES = [2.0, 10 * km, 60 * km, 400 * km]
WORLDS = {
    "earth": lambda zenith: atmos.earth(
        light.Sun.at(zenith * deg, 0.0, light.sunlight())
    ),
    "reference": reference.world,
}
TRUE = solver.SingleScattering()
TIMES = {"day": 80.0, "low sun": 90.0, "twilight": 96.0}  # up to these suns
ROWS, COLUMNS = 40, 8


def directions(scene: atmos.Scene, altitude: float, rng: np.random.Generator):
    """Zenith angles of rows, azimuths of columns, and where the rows lie."""
    half = ROWS // 2
    heights = [0.0, float(scene.top)] if altitude > scene.top else [0.0]
    dips = [
        float(scene.geometry.dip(jnp.asarray(altitude), jnp.asarray(x)))
        for x in heights
    ]
    off = rng.choice([-1.0, 1.0], half) * 10.0 ** rng.uniform(-4.0, -1.0, half)
    near = 0.5 * math.pi + rng.choice(dips, half) + off
    zenith = np.concatenate([np.arccos(rng.uniform(-1.0, 1.0, half)), near])
    azimuth = rng.uniform(0.0, 2.0 * math.pi, COLUMNS)
    crowded = np.arange(ROWS) >= half
    below = zenith > 0.5 * math.pi + dips[0]
    where = {
        "anywhere": ~crowded,
        "just above the horizon": crowded & ~below,
        "just below the horizon": crowded & below,
    }
    angles = zenith[:, None].astype(np.float32), azimuth[None, :].astype(np.float32)
    return angles, where


@eqx.filter_jit
def look(panorama, zenith, azimuth):
    """As `render` does, for a dome and for other pictures."""
    pixels = jnp.broadcast_arrays(zenith, azimuth)
    return panorama.radiance(zenith, azimuth), panorama.finer().radiance(*pixels)


@eqx.filter_jit
def march(sky, position, zenith, azimuth):
    def ray(angles):
        zenith, azimuth = angles
        level = jnp.sin(zenith)
        towards = [level * jnp.sin(azimuth), level * jnp.cos(azimuth), jnp.cos(zenith)]
        return sky.radiance(position, jnp.stack(towards))

    angles = [x.ravel() for x in jnp.broadcast_arrays(zenith, azimuth)]
    radiance = jax.lax.map(ray, angles, batch_size=100)
    return radiance.reshape(ROWS, COLUMNS, -1)


def errors(world: str, zenith: float, altitude: float):
    """Of each way to make a picture, and of its solver alone; where the rows lie."""
    scene = WORLDS[world](zenith)
    rng = np.random.default_rng([int(zenith), int(altitude)])
    angles, where = directions(scene, altitude, rng)
    at = jnp.asarray([0.0, 0.0, altitude], jnp.float32)
    few = solver.QUICK if altitude < 20 * km else TRUE
    sky = atmos.solve(scene, few, NM)
    dome, other = look(sky.panorama(at), *angles)
    marched = march(sky, at, *angles)
    truth = np.asarray(march(atmos.solve(scene, TRUE, NM), at, *angles), float)
    scale = np.maximum(truth, 1e-3 * truth.max((0, 1)))
    # Where all is dark nothing may be seen.
    scale = np.where(scale > 0.0, scale, 1.0)
    found = {"dome": dome, "other": other, "marched": marched}
    return {
        k: np.abs(np.asarray(x, float) - truth) / scale for k, x in found.items()
    }, where


def measure(world: str) -> tuple[list[str], list[Claim]]:
    """The lines of the table, and the claims, of one world."""
    lines, claims = [], []
    for altitude in ALTITUDES:
        pooled = {}
        for zenith in SUNS[world]:
            found, where = errors(world, zenith, altitude)
            time = next(k for k, last in TIMES.items() if zenith <= last)
            figures = []
            for place, rows in where.items():
                x = found["dome"][rows]
                pooled.setdefault((time, place), []).append(x.ravel())
                figures += (
                    [np.percentile(x, 99.0), x.max()] if rows.any() else [0.0] * 2
                )
            x = found["dome"][where["anywhere"]]
            figures = [np.median(x), *figures]
            figures += [found["other"].max(), found["marched"].max()]
            said = "".join(f"{y:9.1e}" for y in figures)
            lines.append(f"{world:10}{altitude / km:7g}{zenith:5g}{said}")
        for (time, place), x in pooled.items():
            claim = f"{world}, {altitude / km:g} km, {time}, {place}: 99 %"
            figure = float(np.percentile(np.concatenate(x), 99.0))
            claims.append(Claim(claim, "marching every pixel", 1e-3, figure))
    return lines, claims


def claims(arguments: argparse.Namespace) -> Iterator[Claim]:
    del arguments
    # One world compiles while the other is worked on.
    with concurrent.futures.ThreadPoolExecutor() as pool:
        measured = list(pool.map(measure, WORLDS))
    places = [("anywhere", 27), ("above horizon", 18), ("below", 18)]
    over = "".join(f"{name:^{width}}" for name, width in places)
    print(f"{'':22}{over}{'other':>9}{'no':>9}")
    heads = ["median", *3 * ["99 %", "max"], "picture", "table"]
    print(f"{'world':10}{'eye km':>7}{'sun':>5}" + "".join(f"{x:>9}" for x in heads))
    for lines, _ in measured:
        print("\n".join(lines))
    print()
    for _, found in measured:
        yield from found


if __name__ == "__main__":
    sys.exit(main(__doc__, claims))
