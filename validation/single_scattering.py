"""Single scattering against sasktran2, and against quadrature where the two differ.

The world: air, an aerosol and ozone over a Lambertian ground, round, no refraction, cut
at 60 km; four wavelengths; suns from the zenith to 6 degrees below the horizon; eyes on
the ground, at 10 and 60 km and in space. sasktran2 takes its exact single scattering;
its extinction is linear between levels that crowd at the ground, and are made twice as
many twice to see it converge. The judge is `validation.quadrature`.

Errors are relative, of the worst direction and wavelength. What is dimmer than the
moonless night sky (2e-4 cd m^-2 under a sun of 1.3e5 lx, so 1.5e-9 sr^-1) is counted
apart, down to 1e-12 sr^-1: in double precision it shows how many orders of magnitude a
solver follows the light into the dark.

    python -m validation.single_scattering
"""

import argparse
import math
import sys
from collections.abc import Iterator

import equinox as eqx
import jax
import numpy as np

import atmos
from atmos import deg, geometry, km, light, medium, phase, spectrum

from . import quadrature as judge
from .claim import Claim, main


try:
    import sasktran2
except ImportError:
    sasktran2 = None


SUNS = [0.0, 30.0, 60.0, 80.0, 85.0, 88.0, 90.0, 92.0, 94.0, 96.0]
LEVELS = [100, 200, 400]
FINER = [800, 1600]  # for a few directions
NIGHT, DARK = 1.5e-9, 1e-12  # sr^-1
_MOMENTS = 96  # of the aerosol's lobe: the next is 4e-12


def world(zenith: float) -> atmos.Scene:
    """The world of the judge, in the words of atmos."""
    scale_heights = [medium.Exponential(x) for x in judge.SCALE_HEIGHTS]
    tent = medium.Tent(judge.OZONE[1], judge.OZONE[1] - judge.OZONE[0])
    media = (
        medium.Medium(
            scale_heights[0],
            scattering=spectrum.PowerLaw(1.24062e-6, -4.0, 1000.0),
            phase=phase.Rayleigh(),
        ),
        medium.of_extinction(
            spectrum.PowerLaw(4.1666666667e-5, -0.8, 550.0),
            spectrum.Constant(judge.SHARE),
            scale_heights[1],
            phase.HenyeyGreenstein(judge.ASYMMETRY),
        ),
        medium.Medium(
            tent,
            absorption=spectrum.Tabulated(judge.WAVELENGTH, judge.EXTINCTION[2]),
        ),
    )
    sun = light.Sun.at(zenith * deg, 0.0, spectrum.Constant(1.0), 0.0)
    shape = geometry.Spherical(judge.RADIUS)
    return atmos.Scene(shape, judge.TOP, media, (sun,), judge.ALBEDO)


def looks() -> dict[float, np.ndarray]:
    """By altitude, the zenith angles and azimuths that are looked at, in degrees."""
    limb = [
        180.0 - math.asin((judge.RADIUS + h) / (judge.RADIUS + 400 * km)) / deg
        for h in (1 * km, 5 * km, 15 * km, 30 * km, 50 * km)
    ]
    zeniths = {
        0.0: [0.0, 30.0, 60.0, 80.0, 85.0, 89.0, 89.9, 120.0],
        10 * km: [0.0, 60.0, 89.0, 91.0, 93.0, 95.0, 150.0],
        60 * km: [91.0, 95.0, 97.0, 100.0, 120.0, 180.0],
        400 * km: [180.0, 150.0, 120.0, *limb],
    }
    azimuths = [0.0, 40.0, 90.0, 180.0]
    return {
        altitude: np.array([(z, a) for z in rings for a in azimuths])
        for altitude, rings in zeniths.items()
    }


def vectors(zenith, azimuth) -> np.ndarray:
    zenith, azimuth = np.radians(zenith), np.radians(azimuth)
    level = np.sin(zenith)
    return np.stack(
        [level * np.sin(azimuth), level * np.cos(azimuth), np.cos(zenith)], -1
    )


@eqx.filter_jit
def march(sky, positions, directions):
    return jax.vmap(sky.radiance)(positions, directions)


def ours(zenith: float, eyes, angles, dtype) -> np.ndarray:
    with jax.enable_x64(dtype == np.float64):
        solver = atmos.solver.SingleScattering()
        sky = atmos.solve(world(zenith), solver, judge.WAVELENGTH.astype(dtype))
        positions = np.zeros((len(eyes), 3), dtype)
        positions[:, 2] = eyes
        directions = vectors(*angles.T).astype(dtype)
        return np.asarray(march(sky, positions, directions), float)


def peer(zenith: float, eyes, angles, levels: int) -> np.ndarray:
    """sasktran2's answer, from so many layers; the highest is 50 times the lowest."""
    config = sasktran2.Config()
    config.num_stokes, config.num_streams = 1, 2
    config.num_singlescatter_moments = _MOMENTS
    config.num_threads = 2
    config.single_scatter_source = sasktran2.SingleScatterSource.Exact
    config.multiple_scatter_source = sasktran2.MultipleScatterSource.NoSource
    grown = np.expm1(np.linspace(0.0, 4.0, levels + 1)) / np.expm1(4.0)
    altitude = np.unique(np.concatenate([judge.TOP * grown, judge.OZONE]))
    cosine = math.cos(zenith * deg)
    shape = sasktran2.Geometry1D(
        cosine,
        0.0,
        judge.RADIUS,
        altitude,
        sasktran2.InterpolationMethod.LinearInterpolation,
        sasktran2.GeometryType.Spherical,
    )
    rays = sasktran2.ViewingGeometry()
    for eye, (view, azimuth) in zip(eyes, angles, strict=True):
        rays.add_ray(
            sasktran2.SolarAnglesObserverLocation(
                cosine, azimuth * deg, math.cos(view * deg), eye
            )
        )
    air = sasktran2.Atmosphere(
        shape, config, wavelengths_nm=judge.WAVELENGTH, calculate_derivatives=False
    )
    l = np.arange(_MOMENTS)
    lobes = [
        (1.0, np.where(l == 0, 1.0, np.where(l == 2, 0.5, 0.0))),
        (judge.SHARE, (2.0 * l + 1.0) * judge.ASYMMETRY**l),
        (0.0, np.where(l == 0, 1.0, 0.0)),
    ]
    density = judge.densities(altitude)
    for i, (share, lobe) in enumerate(lobes):
        extinction = density[:, i, None] * judge.EXTINCTION[i]
        moments = np.broadcast_to(lobe[:, None, None], (_MOMENTS, *extinction.shape))
        air[f"medium {i}"] = sasktran2.constituent.Manual(
            extinction, np.full_like(extinction, share), moments.copy()
        )
    air["ground"] = sasktran2.constituent.LambertianSurface(judge.ALBEDO)
    engine = sasktran2.Engine(config, shape, rays)
    return engine.calculate_radiance(air).radiance.values[:, :, 0].T


def error(found: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Relative; 0 where it is dark."""
    seen = truth > DARK
    return np.where(seen, np.abs(found / np.where(seen, truth, 1.0) - 1.0), 0.0)


def extrapolated(theirs: np.ndarray) -> np.ndarray:
    """Their limit of ever more levels, of which they make errors of second order."""
    return theirs[-1] + (theirs[-1] - theirs[-2]) / 3.0


def against_quadrature(
    found: dict[str, np.ndarray], truth: np.ndarray, eyes: np.ndarray
) -> Iterator[Claim]:
    for name, radiance in found.items():
        errors = error(radiance, truth)
        for altitude in np.unique(eyes):
            here = (truth > NIGHT) & (eyes == altitude)[:, None]
            claim = f"{name}, eye at {altitude / km:g} km: largest error"
            yield Claim(claim, "adaptive quadrature", 1e-4, errors[here].max())
        claim = f"{name}, dimmer than the night sky: largest error"
        faint = errors[(truth > DARK) & (truth <= NIGHT)].max()
        yield Claim(claim, "adaptive quadrature", None, faint)


def against_peer(
    double: np.ndarray, theirs: dict[str, np.ndarray], truth: np.ndarray
) -> Iterator[Claim]:
    lit, own = truth > NIGHT, error(double, truth)
    black = lit & (theirs["limit"] == 0.0)
    claim = f"lit, and black in sasktran2 (of {lit.sum()})"
    yield Claim(claim, "adaptive quadrature", None, black.sum())
    lit &= ~black
    for name, radiance in theirs.items():
        errors = error(radiance, truth)
        claim = f"sasktran2, {name}: median error"
        yield Claim(claim, "adaptive quadrature", None, np.median(errors[lit]))
        yield Claim("    largest", "adaptive quadrature", None, errors[lit].max())
        apart = lit & (np.abs(radiance / np.where(lit, double, 1.0) - 1.0) > 1e-4)
        claim = f"    atmos differs by more than 1e-4 (of {lit.sum()})"
        yield Claim(claim, f"sasktran2, {name}", None, apart.sum())
        worse = np.sum(apart & (own >= errors))
        claim = "        and is the less exact"
        yield Claim(claim, "adaptive quadrature", 0.0, worse)
    claim = "float64 and sasktran2's limit differ: median"
    apart = np.abs(theirs["limit"] / np.where(lit, double, 1.0) - 1.0)
    yield Claim(claim, "sasktran2, limit", 1e-5, np.median(apart[lit]))


def print_errors(columns: dict[str, np.ndarray], truth, eyes) -> None:
    """The largest errors, sun by sun and eye by eye, where no answer is black."""
    lit = (truth > NIGHT) & np.all([x > 0.0 for x in columns.values()], 0)
    print(f"{'sun':>4}{'eye km':>8}" + "".join(f"{x:>12}" for x in columns))
    errors = {name: error(x, truth) for name, x in columns.items()}
    for i, zenith in enumerate(SUNS):
        for altitude in np.unique(eyes):
            here = lit[i] & (eyes == altitude)[:, None]
            if here.any():
                row = "".join(f"{x[i][here].max():12.1e}" for x in errors.values())
                print(f"{zenith:4g}{altitude / km:8g}{row}")


def print_worst(
    double: np.ndarray, theirs: dict[str, np.ndarray], truth, eyes, angles
) -> None:
    """How sasktran2 goes on converging where it and atmos differ most."""
    last = theirs[f"{LEVELS[-1]} levels"]
    apart = np.abs(last / np.where(truth > NIGHT, double, 1.0) - 1.0)
    apart = np.where((truth > NIGHT) & (last > 0.0), apart, 0.0)
    print("\nwhere they differ most: errors of atmos (float64), and of sasktran2 with")
    head = "".join(f"{n:>9}" for n in [*LEVELS, *FINER])
    print(
        f"{'sun':>4}{'eye km':>8}{'view':>8}{'azimuth':>8}{'nm':>5}{'sr^-1':>9}", end=""
    )
    print(f"{'atmos':>10}{head} levels")
    worst = np.argsort(apart.max(-1).ravel())[::-1][:8]
    for i, ray in zip(*np.unravel_index(worst, apart.shape[:2]), strict=True):
        w = int(np.argmax(apart[i, ray]))
        finer = [peer(SUNS[i], eyes[[ray]], angles[[ray]], n)[0, w] for n in FINER]
        found = [double[i, ray, w], *(theirs[f"{n} levels"][i, ray, w] for n in LEVELS)]
        errors = [error(x, truth[i, ray, w]) for x in [*found, *finer]]
        view, azimuth = angles[ray]
        print(f"{SUNS[i]:4g}{eyes[ray] / km:8g}{view:8.2f}{azimuth:8g}", end="")
        print(f"{judge.WAVELENGTH[w]:5g}{truth[i, ray, w]:9.1e} ", end="")
        print("".join(f"{x:9.1e}" for x in errors))
    print()


def claims(arguments: argparse.Namespace) -> Iterator[Claim]:
    del arguments
    seen = looks()
    eyes = np.concatenate([np.full(len(x), a) for a, x in seen.items()])
    angles = np.concatenate(list(seen.values()))
    views = vectors(*angles.T)
    suns = [np.broadcast_to(vectors(x, 0.0), views.shape) for x in SUNS]
    truth = np.stack([judge.radiance(eyes, views, sun) for sun in suns])
    found = {
        name: np.stack([ours(x, eyes, angles, dtype) for x in SUNS])
        for name, dtype in [("float32", np.float32), ("float64", np.float64)]
    }
    yield from against_quadrature(found, truth, eyes)
    if sasktran2 is None:
        print("sasktran2 is not installed: skipped.")
        return
    theirs = {
        f"{n} levels": np.stack([peer(x, eyes, angles, n) for x in SUNS])
        for n in LEVELS
    }
    *_, coarse, fine = theirs.values()
    # Errors are of second order in the distance of levels.
    theirs["limit"] = fine + (fine - coarse) / 3.0
    print_errors(found | theirs, truth, eyes)
    print_worst(found["float64"], theirs, truth, eyes, angles)
    yield from against_peer(found["float64"], theirs, truth)


if __name__ == "__main__":
    sys.exit(main(__doc__, claims))
