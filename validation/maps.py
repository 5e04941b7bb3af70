"""Where methods go wrong: errors over the directions in which they are hard pressed.

Each map shows what 95 of 100 radiances keep within, relative, for some methods over two
numbers: the sun's elevation and the depth of the aerosol; altitude and the sun's
elevation (against `Shells`, itself judged by `validation.multiple_scattering`); optical
depth and single-scattering albedo, asymmetry and streams (against CDISORT with 128
streams, if nanodisort is installed); float32 and float64; steps and optical depth
(against the closed form). Cells that a method refuses are crossed out.

    python -m validation.maps --folder maps

The figures go to `maps.json`, the maps to `maps.png`.
"""

import argparse
import functools as ft
import importlib.util
import json
import math
import pathlib
import sys
from collections.abc import Callable, Iterator
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import atmos
from atmos import deg, geometry, km, light, medium, phase, spectrum
from atmos.solver import (
    AbstractSolver,
    Bruneton,
    Columns,
    Fixed,
    RayMarching,
    Shared,
    Shells,
    SingleScattering,
)

from . import columns, peers
from .multiple_scattering import vectors


NM = np.array([400.0, 550.0, 700.0])
ELEVATIONS = [60.0, 30.0, 15.0, 10.0, 5.0, 2.0, 0.0, -4.0]  # degrees
AEROSOLS = [0.0, 0.05, 0.1, 0.2, 0.5, 1.0]  # optical depth at 550 nm
ALTITUDES = [0.0, 1.0, 5.0, 12.0, 30.0, 400.0]  # km
DEPTHS = [0.01, 0.1, 1.0, 10.0, 100.0]
ALBEDOS = [0.5, 0.9, 0.99, 0.999999, 1.0]
ASYMMETRIES = [0.0, 0.5, 0.75, 0.85, 0.95]
STREAMS = [4, 8, 16, 32]
STEPS = [4, 16, 64, 256]
NODES = [4, 8, 12, 16]


class Map(NamedTuple):
    """Errors by method, [row, column]; what is not known is NaN."""

    name: str
    truth: str
    rows: tuple[str, list[float]]
    columns: tuple[str, list[float]]
    errors: dict[str, np.ndarray]


def world(aerosol: float, elevation: float) -> atmos.Scene:
    """Air, an aerosol of this depth at 550 nm, and ground."""
    air, dust = 8.0 * km, 1.2 * km
    media = (
        medium.Medium(
            medium.Exponential(air),
            scattering=spectrum.PowerLaw(0.0973 / air, -4.0, 550.0),
            phase=phase.Rayleigh(),
        ),
        medium.of_extinction(
            spectrum.PowerLaw(aerosol / dust, -1.0, 550.0),
            spectrum.Constant(0.95),
            medium.Exponential(dust),
            phase=phase.HenyeyGreenstein(0.7),
        ),
    )
    sun = light.Sun.at((90.0 - elevation) * deg, 0.0, spectrum.Constant(1.0), 0.0)
    return atmos.Scene(geometry.Spherical(6371.0 * km), 60.0 * km, media, (sun,), 0.2)


UP = [1.0, 15.0, 30.0, 45.0, 60.0, 70.0, 75.0, 80.0, 83.0, 85.0, 87.0, 88.0]
BOTH = [1.0, 30.0, 60.0, 75.0, 85.0, 88.0, 91.0, 93.0, 96.0, 110.0, 150.0, 179.0]
DOWN = [107.0, 108.0, 108.5, 109.0, 109.5, 110.0, 112.0, 115.0, 120.0, 130.0, 150.0]
DOWN += [179.0]  # from 400 km the horizon is at 109.8 degrees


def looks(altitude: float) -> np.ndarray:
    """Not level, from within the air; from above it at the limb and at the ground."""
    zeniths = DOWN if altitude > 60.0 else BOTH if altitude > 0.0 else UP
    turned = np.meshgrid(zeniths, [0.0, 20.0, 90.0, 180.0], indexing="ij")
    return vectors(*(x.ravel() for x in turned)).astype(float)


@eqx.filter_jit
def see(sky, altitude, elevation, directions):
    sun = light.Sun.at(0.5 * math.pi - elevation, 0.0, spectrum.Constant(1.0), 0.0)
    sun = jax.tree.map(lambda x: x.astype(altitude.dtype), sun)
    sky = eqx.tree_at(lambda x: x.scene.lights, sky, (sun,))
    place = jnp.zeros_like(directions[0]).at[2].set(altitude)
    return jax.vmap(sky.radiance, (None, 0))(place, directions)


@ft.lru_cache(maxsize=24)
def solved(aerosol, solver, elevation, dtype):
    return atmos.solve(world(aerosol, elevation), solver, NM.astype(dtype))


def lit(solver: AbstractSolver, aerosol, elevation, altitude, dtype=float):
    """Radiances; raises `ValueError` where the solver does."""
    scene = world(aerosol, elevation)
    every = not solver.baked(scene).lights  # what is worked out serves every sun
    sky = solved(aerosol, solver, ELEVATIONS[0] if every else elevation, dtype)
    numbers = jnp.asarray(altitude * km, dtype), jnp.asarray(elevation * deg, dtype)
    found = see(sky, *numbers, jnp.asarray(looks(altitude), dtype))
    return np.asarray(found, float)


def apart(found: np.ndarray, due: np.ndarray) -> float:
    """Of 100 radiances 95 differ less, relative."""
    kept = due > 1e-12
    if not np.all(np.isfinite(found)):
        return math.inf
    if not np.any(kept):
        return math.nan
    return float(np.percentile(np.abs(found[kept] / due[kept] - 1.0), 95.0))


def table(
    rows: list, across: list, figure: Callable[[float, float], float]
) -> np.ndarray:
    """A figure for each pair; NaN where that is refused."""
    found = np.full((len(rows), len(across)), math.nan)
    for i, x in enumerate(rows):
        for j, y in enumerate(across):
            try:
                found[i, j] = figure(x, y)
            except ValueError:
                continue
    return found


ORDERS = {
    "columns": Columns(),
    "shared": Shared(),
    "bruneton": Bruneton(),
    "single": SingleScattering(),
}


def clear_air() -> Iterator[Map]:
    truth, suns = Shells(), ELEVATIONS[:7]
    due = {(y, x): lit(truth, y, x, 0.0) for y in AEROSOLS for x in suns}
    yield Map(
        "sun and aerosol, from the ground",
        "shells",
        ("optical depth of the aerosol", AEROSOLS),
        ("sun's elevation, degrees", suns),
        {
            name: table(
                AEROSOLS, suns, lambda y, x, s=s: apart(lit(s, y, x, 0.0), due[y, x])
            )
            for name, s in ORDERS.items()
        },
    )
    due = {(h, x): lit(truth, 0.1, x, h) for h in ALTITUDES for x in ELEVATIONS}
    yield Map(
        "altitude and sun, aerosol 0.1",
        "shells",
        ("altitude, km", ALTITUDES),
        ("sun's elevation, degrees", ELEVATIONS),
        {
            name: table(
                ALTITUDES,
                ELEVATIONS,
                lambda h, x, s=s: apart(lit(s, 0.1, x, h), due[h, x]),
            )
            for name, s in ORDERS.items()
        },
    )


def precisions() -> Map:
    def figure(solver, h, x):
        single = lit(solver, 0.1, x, h, np.float32)
        return apart(single, lit(solver, 0.1, x, h))

    # What `Shared` looks up is made as that of columns.
    methods = {k: v for k, v in ORDERS.items() if k != "shared"} | {"shells": Shells()}
    return Map(
        "float32, altitude and sun",
        "float64",
        ("altitude, km", ALTITUDES),
        ("sun's elevation, degrees", ELEVATIONS),
        {
            name: table(ALTITUDES, ELEVATIONS, lambda h, x, s=s: figure(s, h, x))
            for name, s in methods.items()
        },
    )


SUN = 0.6  # cosine
COSINES = np.array([-1.0, -0.8, -0.5, -0.2, 0.2, 0.5, 0.8, 1.0])  # of looks, upwards
AROUND = np.array([0.0, 45.0, 90.0, 180.0])  # degrees


def slabs() -> Iterator[Map]:
    """Against CDISORT, a few degrees from the sun at least."""

    def due(depth, albedo, g):
        scene = columns.slab(depth, albedo, phase.HenyeyGreenstein(g), SUN, 1.0)
        top = columns.DEEP
        parts = []
        for altitude, kept in ((top, COSINES < 0.0), (0.0, COSINES > 0.0)):
            zeniths = np.degrees(np.arccos(COSINES[kept]))
            view = peers.View(altitude, zeniths, AROUND)
            look = peers.cdisort(128, 1)(scene, np.array([500.0]), view)
            parts.append(look()[..., 0])
        return np.concatenate(parts)

    def found(solver, depth, albedo, g):
        scene = columns.slab(depth, albedo, phase.HenyeyGreenstein(g), SUN, 1.0)
        turn = np.radians(AROUND)[None]
        level = np.sqrt(1.0 - COSINES**2)[:, None]
        up = np.broadcast_to(COSINES[:, None], (len(COSINES), len(AROUND)))
        views = np.stack([level * np.cos(turn), level * np.sin(turn), up], -1)
        places = np.array([[0.0, 0.0, columns.DEEP], [0.0, 0.0, 0.0]])
        seen, _ = columns.look(
            scene, solver, jnp.asarray(places), jnp.asarray(views.reshape(-1, 3))
        )
        seen = np.asarray(seen).reshape(2, *up.shape)
        return np.concatenate([seen[0][COSINES < 0.0], seen[1][COSINES > 0.0]])

    usual = Columns(streams=16)
    yield Map(
        "depth and albedo, g 0.75",
        "CDISORT, 128 streams",
        ("optical depth", DEPTHS),
        ("single-scattering albedo", ALBEDOS),
        {
            "columns, 16 streams": table(
                DEPTHS,
                ALBEDOS,
                lambda t, w: apart(found(usual, t, w, 0.75), due(t, w, 0.75)),
            )
        },
    )
    yield Map(
        "peaks and streams, depth 1",
        "CDISORT, 128 streams",
        ("asymmetry g", ASYMMETRIES),
        ("streams", STREAMS),
        {
            "columns": table(
                ASYMMETRIES,
                STREAMS,
                lambda g, n: apart(
                    found(Columns(streams=int(n)), 1.0, 1.0, g), due(1.0, 1.0, g)
                ),
            )
        },
    )


@eqx.filter_jit
def once(solver, depth, directions):
    scene = columns.slab(1.0, 1.0, phase.Isotropic(), SUN, 1.0)
    slab = scene.media[0]
    slab = medium.Medium(slab.profile, depth / columns.DEEP, 0.0, slab.phase)
    scene = eqx.tree_at(lambda x: x.media, scene, (slab,))
    sky = atmos.solve(scene, solver, jnp.array([500.0]))
    top = jnp.array([0.0, 0.0, columns.DEEP])
    return jax.vmap(sky.radiance, (None, 0))(top, directions)[:, 0]


def steps() -> Iterator[Map]:
    """Light that turned once in a slab, seen from above."""
    up = COSINES[COSINES > 0.0]
    views = np.stack([np.sqrt(1.0 - up**2), 0.0 * up, -up], -1)
    depths = [*DEPTHS, 1000.0]

    def due(depth):
        whole = -np.expm1(-depth * (1.0 / SUN + 1.0 / up))
        return SUN / (SUN + up) * whole / (4.0 * math.pi)

    methods = (
        ("ray marching", "steps", STEPS, lambda n: RayMarching(Fixed(n))),
        ("single", "nodes a piece", NODES, lambda n: SingleScattering(nodes=n)),
    )
    for name, which, counts, make in methods:

        def figure(n, depth, make=make):
            return apart(np.asarray(once(make(n), jnp.array(depth), views)), due(depth))

        yield Map(
            f"{which} and depth, light that turned once",
            "a closed form",
            (which, counts),
            ("optical depth", depths),
            {name: table(counts, depths, figure)},
        )


def maps() -> Iterator[Map]:
    yield from steps()
    if importlib.util.find_spec("nanodisort") is None:
        print("nanodisort is not installed: slabs are left out")
    else:
        yield from slabs()
    yield precisions()
    yield from clear_air()


def plain(x: Map) -> dict:
    """Of three digits; None where it is refused."""
    short = lambda v: float(f"{v:.3g}") if math.isfinite(v) else None
    errors = {k: [[short(v) for v in row] for row in e] for k, e in x.errors.items()}
    return x._asdict() | {"errors": errors}


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    here = pathlib.Path(__file__).parent
    parser.add_argument("--folder", type=pathlib.Path, default=here)
    arguments = parser.parse_args()
    arguments.folder.mkdir(parents=True, exist_ok=True)
    jax.config.update("jax_enable_x64", True)
    found = []
    for x in maps():
        found.append(x)
        print(f"{x.name}: done", flush=True)
        text = json.dumps([plain(x) for x in found], indent=None)
        text = text.replace('{"name"', '\n{"name"')
        (arguments.folder / "maps.json").write_text(text + "\n")
    if importlib.util.find_spec("matplotlib") is None:
        print("matplotlib is not installed: no picture")
        return 0
    from .drawing import draw_maps

    draw_maps(arguments.folder / "maps.png", found)
    return 0


if __name__ == "__main__":
    sys.exit(main())
