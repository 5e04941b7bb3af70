"""Light in clouds traced by null collisions, against tables and against Mitsuba.

The tables are of slabs with the lobes of Henyey and Greenstein: what is reflected and
transmitted over depth, albedo, asymmetry and sun (DISORT with 128 streams); a slab is a
box much wider than high here. A z-score is an error in standard errors. What leaves a
slab in the sun is found by looks, half of them drawn as light leaves a white surface,
half from the lobe about the sun, which is what thin slabs show. By reciprocity it is
also what is seen of the slab from the sun, above black ground in even light; there all
errors are small, and in the sun, for which looks are bounded, those of three fluxes in
four. First looks say how many it takes, and are then forgotten, lest luck decides.

Mitsuba's `volpath` (compiled by LLVM where that is installed, as that is its quickest)
renders the same cloud of 64 cubed cells, lit by one sun, with an albedo of 0.999 and an
asymmetry of 0.85; pixels are compared one by one. Then it and `volpathmis` take turns
with atmos at pictures of 64 x 64 pixels: efficiency is one over the time and the
variance, the sum of that of all pixels over the sum of their squares.

Marching is compared with itself, at many more steps and with shadows by rays, in smoke
on a grid of 256 cubed cells, of which a sixth holds some.

    python -m validation.volumes --truth DIR
"""

import argparse
import csv
import math
import os
import pathlib
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from atmos import render
from atmos.camera import Perspective
from atmos.geometry import Flat
from atmos.light import AbstractLight, Sun, Surrounding
from atmos.medium import Box, Grid, Medium, Puff, sampled
from atmos.phase import HenyeyGreenstein
from atmos.phase.henyey_greenstein import lobe, quantile
from atmos.rotation import around
from atmos.scene import Scene
from atmos.solver import (
    RayMarching,
    ShadowCache,
    ShadowRays,
    Skipping,
    solve,
    SolvedSky,
    VolumeTracing,
)

from .claim import Claim, main


MARCH, SMALL = RayMarching(Skipping(192), ShadowCache(144)), 64
WIDE = 1e5  # how much wider than high a slab is
LOOKS = 2**15  # directions that are looked into together
# Aimed at, of what enters a slab, in at most so many times as many looks.
ERROR, ROUNDS = 0.0018, 8
SIZE, LOOKS_A_PIXEL = 16, 256
# Pixels along an edge where time is taken; turns, and pictures at each.
FINE, TURNS, PICTURES = 64, 7, 12


def claims(arguments: argparse.Namespace) -> Iterator[Claim]:
    if arguments.truth is not None:
        table = arguments.truth / "slab_reflectance_transmittance_hg.csv"
        yield from of_slabs(table)
    grid = cloud()
    yield from of_marching()
    yield from of_mitsuba(grid)
    yield from of_efficiency(grid)


Look = Callable[[np.random.Generator], np.ndarray]


def mean(look: Look, seed: int) -> tuple[float, float]:
    """What looks find, and the standard error, after as many as it takes."""
    rng = np.random.default_rng(seed)

    def found(rounds):
        # Those of each kind on an axis of their own.
        many = np.concatenate([look(rng) for _ in range(rounds)], 1)
        spread = np.mean(np.var(many, 1, ddof=1))
        return float(np.mean(many)), float(np.sqrt(spread / many.size))

    wanted = math.ceil((found(1)[1] / ERROR) ** 2)
    return found(min(max(wanted, 1), ROUNDS))


def in_the_sun(row: dict[str, float], below: bool, seed: int) -> Look:
    """Samples of what leaves a slab to one side, of a flux of 1 that enters."""
    sun = Sun(towards(row), 1.0, 0.0)
    sky = slab(row, sun, seed)
    start = np.broadcast_to([0.0, 0.0, 0.5 if below else 2.5], (LOOKS, 3))

    def look(rng):
        looks, worth = drawn(row["g"], towards(row), below, rng)
        return np.reshape(glimpsed(sky, start, looks) * worth / row["mu0"], (2, -1))

    return look


def in_even_light(row: dict[str, float], below: bool, seed: int) -> Look:
    """Samples of how bright a slab is, seen from where the sun was or along its light.

    With what passes straight through.
    """
    sky = slab(row, Surrounding(np.ones((2, 4, 1)), [550.0]), seed)
    aim = towards(row) if below else -towards(row)

    def look(rng):
        # From here and there, as no two looks may be alike.
        start = rng.uniform(-100.0, 100.0, (LOOKS, 3))
        start[:, 2] = 0.5 if below else 2.5
        return glimpsed(sky, start, np.broadcast_to(aim, start.shape))[None]

    return look


def towards(row: dict[str, float]) -> np.ndarray:
    return np.array([np.sqrt(1.0 - row["mu0"] ** 2), 0.0, row["mu0"]])


def slab(row: dict[str, float], light: AbstractLight, seed: int) -> SolvedSky:
    tau, albedo = row["tau"], row["omega"]
    box = Box(np.array([-WIDE, -WIDE, 1.0]), np.array([WIDE, WIDE, 2.0]))
    parts = tau * albedo, tau * (1.0 - albedo)
    medium = Medium(box, *parts, HenyeyGreenstein(row["g"]))
    solver = VolumeTracing(jax.random.key(seed), walks=2, paths=1, cells=1)
    return solve(Scene(Flat(), 3.0, (medium,), (light,)), solver, jnp.array([550.0]))


def glimpsed(sky: SolvedSky, start: np.ndarray, looks: np.ndarray) -> np.ndarray:
    more = sky.prepared, sky.scene, sky.scene.lights[0], sky.wavelength
    start, looks = (jnp.asarray(x, jnp.float32) for x in (start, looks))
    return np.asarray(sky.solver.tally(*more, start, looks).mean, float)[:, 0]


def drawn(
    g: float, sun: np.ndarray, below: bool, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Looks at a slab, and their cosines over the density, per sr, of both kinds.

    The first half by the cosine, the second by the lobe, as far as it is on this side.
    """
    sign = 1.0 if below else -1.0
    turn = rng.uniform(0.0, 2.0 * np.pi, LOOKS // 2)
    up = np.sqrt(rng.uniform(size=LOOKS // 2))
    level = np.sqrt(1.0 - up * up)
    even = np.stack([level * np.cos(turn), level * np.sin(turn), sign * up], 1)
    # How much of the lobe is on this side: of rings about the sun, by midpoints.
    cosine = 1.0 - np.asarray(quantile((np.arange(2**16) + 0.5) / 2**16, g), float)
    ring = np.sqrt((1.0 - cosine**2) * (1.0 - sun[2] ** 2)) + 1e-12
    share = np.mean(np.arccos(np.clip(-sign * cosine * sun[2] / ring, -1, 1))) / np.pi
    many = 2 ** math.ceil(math.log2(1.2 * LOOKS / 2 / share + 1000.0))
    apart = quantile(rng.uniform(size=many), g)
    turn = rng.uniform(0.0, 2.0 * np.pi, many)
    axis = jnp.asarray(sun)
    ahead = np.asarray(jax.vmap(around, (None, 0, 0))(axis, apart, turn), float)
    ahead = ahead[sign * ahead[:, 2] > 0.0][: LOOKS // 2]
    looks = np.concatenate([even, ahead])
    up = sign * looks[:, 2]
    bright = np.asarray(lobe(1.0 - looks @ sun, np.float64(g)))
    return looks, up / (0.5 * up / np.pi + 0.5 * bright / share)


def of_slabs(path: pathlib.Path) -> Iterator[Claim]:
    with open(path) as file:
        lines = [x for x in file if not x.startswith("#")]
    rows = [{k: float(v) for k, v in x.items()} for x in csv.DictReader(lines)]
    above, below, straight = (
        np.array([x[key] for x in rows]) for key in ("R", "T_total", "T_direct")
    )
    diffuse, whole = (np.stack([above, x], 1) for x in (below - straight, below))
    start = time.perf_counter()
    yield from of_fluxes("slabs in the sun", in_the_sun, rows, diffuse)
    yield from of_fluxes("slabs in even light", in_even_light, rows, whole)
    print(f"slabs: {time.perf_counter() - start:.0f} s", file=sys.stderr)


def of_fluxes(
    name: str,
    kind: Callable[[dict[str, float], bool, int], Look],
    rows: list[dict[str, float]],
    due: np.ndarray,
) -> Iterator[Claim]:
    """How far what leaves slabs to either side is from what is due, where it is lit."""
    lit = np.argwhere(due > 1e-4)

    def each(at):
        seed = int(2 * at[0] + at[1])
        return mean(kind(rows[at[0]], bool(at[1]), seed), seed)

    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        found, error = np.array(list(pool.map(each, lit))).T
    due = due[due > 1e-4]
    scores = (found - due) / error
    source = f"{len(scores)} fluxes"
    say = lambda claim, bar, value: Claim(f"{name}: {claim}", source, bar, value)
    yield say("largest error in standard errors", 4.5, max(abs(scores)))
    yield say("errors beyond three of them", None, np.sum(abs(scores) > 3.0))
    bias = abs(np.mean(scores)) * np.sqrt(len(scores))
    yield say("mean z, in its standard errors", 3.0, bias)
    yield say("spread of z, 1 if errors are right", 1.1, np.std(scores))
    yield say("standard error of what enters, median", None, np.median(error))
    yield say("standard error, largest", None, np.max(error))
    yield say("errors of more than 0.2 % of what enters", None, np.sum(error > 0.002))
    yield say("standard error of the flux, median", None, np.median(error / due))
    yield say("standard error of the flux, largest", None, np.max(error / due))


def smoke(solver: RayMarching, size: int) -> tuple[SolvedSky, Perspective]:
    """A puff of smoke in the sun that fills a picture of so many pixels, squared."""
    lower, upper = np.array([-1.0, -1.0, 1.0]), np.array([1.0, 1.0, 3.0])
    puff = Puff(np.array([0.0, 0.0, 2.0]), 0.7, 0.6, octaves=5)
    grid = sampled(puff, lower, upper, (256,) * 3)
    medium = Medium(grid, 8.0, 1.0, HenyeyGreenstein(0.4))
    scene = Scene(Flat(), 10.0, (medium,), (Sun(SUN, 1.0, 0.0),))
    camera = Perspective(EYE, 0.0, 0.0, VIEW, size, size)
    return solve(scene, solver, jnp.array([550.0], jnp.float32)), camera


def of_marching() -> Iterator[Claim]:
    """What the steps and the cache of `validation.speed` cost in exactness."""
    slow = RayMarching(Skipping(2048), ShadowRays(128))
    due, found = (
        np.asarray(render(*smoke(x, SMALL)), float)[..., 0] for x in (slow, MARCH)
    )
    lit = due > 0.01 * np.max(due)
    error = np.abs(found - due)[lit]
    source = "more steps, shadow rays"
    share = np.sum(error) / np.sum(due[lit])
    yield Claim("smoke: marched quickly, mean error of a pixel", source, 0.01, share)
    worst = np.quantile(error / due[lit], 0.95)
    yield Claim("smoke: 95 % of pixels within", source, None, worst)
    share = abs(np.sum(found) / np.sum(due) - 1.0)
    yield Claim("smoke: the whole picture", source, 0.005, share)


def cloud() -> Grid:
    lower, upper = np.array([-1.0, -1.0, 1.0]), np.array([1.0, 1.0, 3.0])
    puff = Puff(np.array([0.0, 0.0, 2.0]), 0.55, 0.6, octaves=4)
    places = lower + (np.indices((64,) * 3).reshape(3, -1).T + 0.5) / 64 * 2.0
    look = jax.vmap(lambda x: puff.density(Flat().locate(x)))
    found = jax.jit(look)(jnp.asarray(places, jnp.float32))
    return Grid(np.asarray(found).reshape((64,) * 3), lower, upper)


SUN, EYE, VIEW = np.array([0.6, 0.0, 0.8]), np.array([0.0, -5.0, 2.0]), 0.5
DENSE, ALBEDO, ASYMMETRY = 12.0, 0.999, 0.85


def of_mitsuba(grid: Grid) -> Iterator[Claim]:
    start = time.perf_counter()
    other = mitsubas(grid)
    print(f"Mitsuba: {time.perf_counter() - start:.1f} s", file=sys.stderr)
    start = time.perf_counter()
    many = seen(traced(grid), SIZE, LOOKS_A_PIXEL, 1)
    ours = many.mean(-1), many.std(-1, ddof=1) / np.sqrt(LOOKS_A_PIXEL)
    print(f"atmos: {time.perf_counter() - start:.1f} s", file=sys.stderr)
    spread = np.sqrt(ours[1] ** 2 + other[1] ** 2)
    lit = spread > 0.0
    scores = (ours[0] - other[0])[lit] / spread[lit]
    source = f"Mitsuba, {np.sum(lit)} pixels"
    yield Claim(
        "cloud: largest error in standard errors", source, 4.5, max(abs(scores))
    )
    yield Claim(
        "cloud: spread of z, 1 if errors are right", source, 1.3, np.std(scores)
    )
    total = [np.sum(x[0]) for x in (ours, other)]
    error = [np.sqrt(np.sum(x[1] ** 2)) for x in (ours, other)]
    score = abs(total[0] - total[1]) / np.hypot(*error)
    yield Claim("cloud: whole picture, in standard errors", source, 3.0, score)
    error = np.hypot(*error) / total[1]
    yield Claim("cloud: standard error of the whole, relative", source, None, error)


def traced(grid: Grid) -> SolvedSky:
    parts = DENSE * ALBEDO, DENSE * (1.0 - ALBEDO)
    medium = Medium(grid, *parts, HenyeyGreenstein(ASYMMETRY))
    scene = Scene(Flat(), 10.0, (medium,), (Sun(SUN, 1.0, 0.0),))
    return solve(scene, VolumeTracing(walks=2, paths=8), jnp.array([550.0]))


def seen(sky: SolvedSky, size: int, each: int, seed: int) -> np.ndarray:
    """A picture, so many looks through each pixel on the last axis."""
    rng = np.random.default_rng(seed)
    y, x = np.indices((size, size))[..., None] + rng.uniform(size=(2, size, size, each))
    slope = np.tan(0.5 * VIEW)
    right, down = ((2.0 * a / size - 1.0) * slope for a in (x, y))
    looks = np.stack([right, np.ones_like(x), -down], -1)
    looks = looks / np.linalg.norm(looks, axis=-1, keepdims=True)
    looks = jnp.asarray(looks.reshape(-1, 3), jnp.float32)
    start = jnp.broadcast_to(jnp.asarray(EYE, jnp.float32), looks.shape)
    light = sky.scene.lights[0]
    more = sky.prepared, sky.scene, light, sky.wavelength, start, looks
    return np.asarray(sky.solver.tally(*more).mean, float).reshape(size, size, -1)


def of_efficiency(grid: Grid) -> Iterator[Claim]:
    """Ours and theirs in turns, as what else the computer does slows down both."""
    sky = traced(grid)
    solver = sky.solver
    assert isinstance(solver, VolumeTracing)
    each = solver.walks * solver.paths
    ours = lambda seed: seen(sky, FINE, 1, seed)[..., 0]
    ours(0)
    import mitsuba as mi

    kinds = {x: theirs(grid, FINE, each, x) for x in ("volpath", "volpathmis")}
    for kind in kinds.values():  # compiles it
        np.array(mi.render(kind, seed=0))
    pictures, seconds = {x: [] for x in ("atmos", *kinds)}, {}
    for turn in range(TURNS):
        seeds = range(1 + turn * PICTURES, 1 + (turn + 1) * PICTURES)
        for name, found in pictures.items():
            start = time.perf_counter()
            if name == "atmos":
                with ThreadPoolExecutor(os.cpu_count()) as pool:
                    found += pool.map(ours, seeds)
            else:
                render = lambda x, kind=kinds[name]: np.array(mi.render(kind, seed=x))
                found += [render(x)[..., 0].astype(float) for x in seeds]
            taken = (time.perf_counter() - start) / (PICTURES * each)
            seconds.setdefault(name, []).append(taken)
    variant = mi.variant()
    due = np.sum(np.mean([np.mean(x, 0) for x in pictures.values()], 0) ** 2)
    spread = {x: each * np.sum(np.var(y, 0, ddof=1)) / due for x, y in pictures.items()}
    for name, taken in seconds.items():
        quick = np.median(taken)
        print(f"{name}: {FINE * FINE / quick:.0f} paths/s", file=sys.stderr)
        yield Claim(f"cloud: {name}, variance of a path", "", None, spread[name])
        if name != "atmos":
            ratio = np.median(np.divide(seconds["atmos"], taken))
            worse = ratio * spread["atmos"] / spread[name]
            source = f"{name}, {variant}"
            yield Claim(f"cloud: efficiency of {name} over ours", source, 1.0, worse)


def mitsubas(grid: Grid, count: int = 32) -> tuple[np.ndarray, np.ndarray]:
    """Means of the pixels and their standard errors by so many of Mitsuba's."""
    import mitsuba as mi

    scene = theirs(grid, SIZE, 32, "volpath")
    many = [np.array(mi.render(scene, seed=i))[..., 0] for i in range(count)]
    return np.mean(many, 0), np.std(many, 0, ddof=1) / np.sqrt(count)


def quickest() -> str:
    """The quickest variant of Mitsuba that this computer has what it takes for."""
    import drjit
    import mitsuba as mi

    try:
        mi.set_variant("llvm_ad_mono")
        drjit.eval(drjit.arange(mi.Float, 2))
    except (ImportError, RuntimeError):
        return "scalar_rgb"
    return "llvm_ad_mono"


def theirs(grid: Grid, size: int, each: int, integrator: str) -> Any:
    """Mitsuba's cloud, seen by so many paths a pixel."""
    import mitsuba as mi

    mi.set_variant(quickest())
    # Its grids are counted from z to x, its boxes are from 0 to 1.
    values = np.ascontiguousarray(np.asarray(grid.values).transpose(2, 1, 0)[..., None])
    place = mi.ScalarTransform4f().translate([-1, -1, 1]).scale([2, 2, 2])
    box = mi.ScalarTransform4f().translate([0, 0, 2])
    toward = mi.ScalarTransform4f().look_at(EYE.tolist(), [0, 0, 2], [0, 0, 1])
    medium = {
        "type": "heterogeneous",
        "sigma_t": {
            "type": "gridvolume",
            "grid": mi.VolumeGrid(values.astype(np.float32)),
            "to_world": place,
        },
        "albedo": ALBEDO,
        "scale": DENSE,
        "phase": {"type": "hg", "g": ASYMMETRY},
    }
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": integrator, "max_depth": 100_000, "rr_depth": 1000},
            "cloud": {
                "type": "cube",
                "to_world": box,
                "bsdf": {"type": "null"},
                "interior": medium,
            },
            "sun": {
                "type": "directional",
                "direction": (-SUN).tolist(),
                "irradiance": {"type": "rgb", "value": 1.0},
            },
            "sensor": {
                "type": "perspective",
                "fov": float(np.degrees(VIEW)),
                "to_world": toward,
                "film": {
                    "type": "hdrfilm",
                    "width": size,
                    "height": size,
                    "rfilter": {"type": "box"},
                },
                "sampler": {"type": "independent", "sample_count": each},
            },
        }
    )


if __name__ == "__main__":
    sys.exit(main(__doc__, claims))
