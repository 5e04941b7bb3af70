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


class Map(NamedTuple):
    """Errors by method, [row, column]; what is not known is NaN."""

    name: str
    truth: str
    rows: tuple[str, list[float]]
    columns: tuple[str, list[float]]
    errors: dict[str, np.ndarray]


def world(aerosol) -> atmos.Scene:
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
            phase.HenyeyGreenstein(0.7),
        ),
    )
    sun = light.Sun.at(0.5, 0.0, spectrum.Constant(1.0), 0.0)
    return atmos.Scene(geometry.Spherical(6371.0 * km), 60.0 * km, media, (sun,), 0.2)


def looks(altitude: float) -> np.ndarray:
    """From within the air up to 2 degrees from level, from above it downwards."""
    low = [91.0, 93.0, 96.0, 110.0, 150.0, 179.0]
    if altitude > 60.0:  # at the limb and at the ground
        low = [109.5, 109.0, 108.0, 130.0, 150.0, 179.0]
    zeniths = [1.0, 30.0, 60.0, 75.0, 85.0, 88.0] if altitude < 60.0 else low
    zeniths += low if 0.0 < altitude < 60.0 else []
    turned = np.meshgrid(zeniths, [0.0, 20.0, 90.0, 180.0], indexing="ij")
    return vectors(*(x.ravel() for x in turned)).astype(float)


@eqx.filter_jit
def see(sky, altitude, elevation, directions):
    sun = light.Sun.at(0.5 * math.pi - elevation, 0.0, spectrum.Constant(1.0), 0.0)
    sun = jax.tree.map(lambda x: x.astype(altitude.dtype), sun)
    sky = eqx.tree_at(lambda x: x.scene.lights, sky, (sun,))
    place = jnp.zeros_like(directions[0]).at[2].set(altitude)
    return jax.vmap(sky.radiance, (None, 0))(place, directions)


def lit(scene, solver: AbstractSolver, elevation, altitude, dtype=float) -> np.ndarray:
    """Radiances; raises `ValueError` where the solver does."""
    sun = light.Sun.at((90.0 - elevation) * deg, 0.0, spectrum.Constant(1.0), 0.0)
    scene = eqx.tree_at(lambda x: x.lights, scene, (sun,))
    sky = atmos.solve(scene, solver, NM.astype(dtype))
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


ORDERS = {"columns": Columns(), "shared": Shared(), "single": SingleScattering()}


def clear_air() -> Iterator[Map]:
    # What is solved for all suns serves all cells of a row.
    truth = Shells(layers=32, suns=48, degrees=12, azimuths=10)
    due = {
        (x, y): lit(world(y), truth, x, 0.0) for y in AEROSOLS for x in ELEVATIONS[:7]
    }
    yield Map(
        "sun and aerosol, from the ground",
        "shells",
        ("sun's elevation, degrees", ELEVATIONS[:7]),
        ("optical depth of the aerosol", AEROSOLS),
        {
            name: table(
                ELEVATIONS[:7],
                AEROSOLS,
                lambda x, y, s=s: apart(lit(world(y), s, x, 0.0), due[x, y]),
            )
            for name, s in ORDERS.items()
        },
    )
    scene = world(0.1)
    due = {(h, x): lit(scene, truth, x, h) for h in ALTITUDES for x in ELEVATIONS}
    yield Map(
        "altitude and sun",
        "shells",
        ("altitude, km", ALTITUDES),
        ("sun's elevation, degrees", ELEVATIONS),
        {
            name: table(
                ALTITUDES,
                ELEVATIONS,
                lambda h, x, s=s: apart(lit(scene, s, x, h), due[h, x]),
            )
            for name, s in ORDERS.items()
        },
    )


def precisions() -> Iterator[Map]:
    scene, found = world(0.1), {}
    solvers = {"single": SingleScattering(), "shells": Shells(layers=24, suns=48)}
    for name, solver in (solvers | {"columns": Columns()}).items():

        def figure(h, x, solver=solver):
            single = lit(scene, solver, x, h, np.float32)
            return apart(single, lit(scene, solver, x, h))

        found[name] = table(ALTITUDES, ELEVATIONS, figure)
    yield Map(
        "float32",
        "float64",
        ("altitude, km", ALTITUDES),
        ("sun's elevation, degrees", ELEVATIONS),
        found,
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
        "depth and albedo, a slab of g 0.75",
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
        "peaks and streams, a slab of depth 1",
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


def steps() -> Map:
    """Light that turned once in a slab, seen from above."""
    up = COSINES[COSINES > 0.0]
    views = np.stack([np.sqrt(1.0 - up**2), 0.0 * up, -up], -1)

    def due(depth):
        whole = -np.expm1(-depth * (1.0 / SUN + 1.0 / up))
        return SUN / (SUN + up) * whole / (4.0 * math.pi)

    depths = [*DEPTHS, 1000.0]
    methods = {
        "ray marching, fixed steps": lambda n: RayMarching(Fixed(int(n))),
        "single scattering, nodes": lambda n: SingleScattering(
            nodes=int(math.log2(n) * 2), light_nodes=8
        ),
    }
    return Map(
        "steps and depth, light that turned once",
        "closed form",
        ("steps (nodes: 4, 8, 12, 16)", STEPS),
        ("optical depth", depths),
        {
            name: table(
                STEPS,
                depths,
                lambda n, t, make=make: apart(
                    np.asarray(once(make(n), jnp.array(t), views)), due(t)
                ),
            )
            for name, make in methods.items()
        },
    )


def maps() -> Iterator[Map]:
    yield steps()
    if importlib.util.find_spec("nanodisort") is None:
        print("nanodisort is not installed: slabs are left out")
    else:
        yield from slabs()
    yield from precisions()
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
