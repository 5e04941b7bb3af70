"""Fitted skies against the programs of others.

Hosek and Wilkie against mitsuba's `sunsky`, spectral and RGB, at random suns,
turbidities, albedos, directions and wavelengths; where mitsuba's radiance is negative,
which is reported, atmos is black. Its sun is a uniform disk of the irradiance that the
sun of 2013 has, from a table of 30 elevations: so the irradiance is compared, for suns
from 15 degrees up. Perez against Radiance's `gendaylit`, which the package `pyradiance`
brings: the five coefficients, as it prints them, and the illuminance of the sun; its
sky's brightness hangs on a sum over 145 directions, too few for the sun's glow.
Daylight's components, and the chromaticity of D65, against `colour-science`. Preetham
against the coefficients of the authors' own program, which have more digits.

    python -m validation.fitted
"""

import argparse
import importlib.util
import math
import pathlib
import re
import subprocess
import sys
import warnings
from collections.abc import Iterator

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from atmos import data, deg
from atmos.quantity import versine
from atmos.sky import Hosek, HosekRGB, Perez, Preetham

from .claim import Claim, main


HERE = jnp.zeros(3)
NM = np.array([320.5, 347.0, 400.0, 444.0, 500.0, 555.0, 640.0, 719.5])
CASES, RAYS = 150, 20
# What mitsuba divides red, green and blue by: the sum of the CIE's y.
WHITE = 106.7502593994140625


def toward(zenith, azimuth) -> np.ndarray:
    level = np.sin(zenith)
    parts = [level * np.sin(azimuth), level * np.cos(azimuth), np.cos(zenith)]
    return np.stack(np.broadcast_arrays(*parts), -1)


@eqx.filter_jit
def look(sky, rays):
    return jax.vmap(lambda x: sky.radiance(HERE, x))(rays)


@eqx.filter_jit
def colours(sky, rays, sun):
    return jax.vmap(lambda x: sky.colour(x[2], versine(x, sun)))(rays)


@eqx.filter_jit
def beam(sky):
    return sky.beam(sky.lights[0], HERE)


def sunsky(variant: str, rays: np.ndarray, **given) -> np.ndarray:
    """What mitsuba's emitter radiates from each direction."""
    import drjit
    import mitsuba

    mitsuba.set_variant(variant)
    emitter = mitsuba.load_dict({"type": "sunsky"} | given)
    found = []
    for ray in rays:
        seen = drjit.zeros(mitsuba.SurfaceInteraction3f)
        seen.wi = mitsuba.Vector3f(*(-ray).tolist())
        if "rgb" in variant:
            found.append(np.array(emitter.eval(seen)).ravel())
            continue
        bands = []
        for four in NM.reshape(-1, 4):
            seen.wavelengths = four.tolist()
            bands.append(np.array(emitter.eval(seen)).ravel())
        found.append(np.concatenate(bands))
    return np.array(found)


def relative(ours: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    """To the value, or a thousandth of the brightest direction where that is more."""
    return np.abs(ours - theirs) / np.maximum(np.abs(theirs), 1e-3 * theirs.max(0))


def hosek() -> Iterator[Claim]:
    rng = np.random.default_rng(2012)
    errors, tinted, negative, total = [], [], 0, 0
    for _ in range(CASES):
        turbidity, albedo = rng.uniform(1.0, 10.0), rng.uniform(0.0, 1.0)
        zenith = rng.uniform(0.0, 90.0) * deg
        sun = toward(zenith, 0.0)
        up = rng.uniform(0.0, 1.0, RAYS) ** 4  # most of them low
        rays = toward(np.arccos(up), rng.uniform(0.0, 6.28, RAYS))
        given = {
            "turbidity": turbidity,
            "albedo": albedo,
            "sun_direction": sun.tolist(),
        }
        theirs = sunsky("scalar_spectral", rays, sun_scale=0.0, **given)
        ours = np.asarray(look(Hosek(zenith, 0.0, turbidity, NM, albedo), rays))
        dark = theirs <= 0.0
        negative, total = negative + np.count_nonzero(dark), total + dark.size
        errors.append(relative(ours, theirs)[~dark])
        assert np.all(ours[dark] == 0.0)
        theirs = WHITE * sunsky("scalar_rgb", rays, sun_scale=0.0, **given)
        model = HosekRGB(zenith, 0.0, turbidity, np.arange(380.0, 781.0, 20.0), albedo)
        ours = np.asarray(colours(model, rays, jnp.asarray(sun)))
        lit = theirs > 0.0
        tinted.append(relative(ours, theirs)[lit])
    source = "mitsuba sunsky"
    largest = float(np.concatenate(errors).max())
    yield Claim("Hosek, spectral: largest difference", source, 1e-3, largest)
    largest = float(np.concatenate(tinted).max())
    yield Claim("Hosek, RGB: largest difference", source, 1e-3, largest)
    share = negative / total
    yield Claim("share of radiances that are not positive there", source, None, share)
    yield from _hosek_sun(rng)


def _hosek_sun(rng: np.random.Generator) -> Iterator[Claim]:
    area = 2.0 * math.pi * (1.0 - math.cos(0.5 * 0.5358 * deg))
    ours_area = math.pi * math.sin(0.26656 * deg) ** 2
    apart = []
    for _ in range(CASES):
        turbidity, zenith = rng.uniform(1.0, 10.0), rng.uniform(0.0, 75.0) * deg
        sun = toward(zenith, 0.0)
        given = {"turbidity": turbidity, "sun_direction": sun.tolist()}
        theirs = sunsky("scalar_spectral", sun[None], sky_scale=0.0, **given)[0] * area
        ours = np.asarray(beam(Hosek(zenith, 0.0, turbidity, NM))) * (area / ours_area)
        apart.append(np.abs(ours / theirs - 1.0)[NM >= 400.0])
    figures = np.concatenate(apart)
    claim = "Hosek's sun, one disk for both, from 400 nm:"
    median = float(np.median(figures))
    yield Claim(f"{claim} median", "mitsuba sunsky", 0.01, median)
    yield Claim(f"{claim} largest", "mitsuba sunsky", 0.03, float(figures.max()))


def gendaylit(program: pathlib.Path, elevation: float, *given: str):
    """Scale, a to e, and the radiance of the sun; None where it refuses."""
    command = [program, "-ang", f"{elevation:.5f}", "0", *given, "-O", "2"]
    text = subprocess.run(command, capture_output=True, text=True).stdout
    numbers = [float(x) for x in text.split("perezlum.cal")[-1].split()]
    sun = re.search(r"light solar\s+0\s+0\s+3 (\S+)", text)
    if len(numbers) < 11 or numbers[2] == 0.0 or sun is None:
        return None
    return numbers[2], np.array(numbers[4:9]), float(sun[1])


def perez(program: pathlib.Path) -> Iterator[Claim]:
    # Its sun stands as far away as on the first days of a year.
    distance = 1.0350198**-0.5
    disk = 2.0 * math.pi * (1.0 - math.cos(0.2665 * deg))
    rng = np.random.default_rng(1993)
    found = []
    nm = np.arange(380.0, 781.0, 50.0)

    @eqx.filter_jit
    def inspect(sky):
        beside = jnp.asarray(0.7), jnp.asarray(1e-3)  # the sun, where it is bright
        scale = sky.parts(*beside)[0] / sky.relative(*beside)
        return sky.coefficients, sky.illuminances[0], scale

    for _ in range(4 * CASES):
        elevation = round(rng.uniform(2.0, 87.0), 5)
        clear = round(rng.choice([rng.uniform(1.0, 1.5), rng.uniform(1.0, 11.0)]), 6)
        bright = round(rng.uniform(0.02, 0.55), 6)
        theirs = gendaylit(program, elevation, "-P", f"{clear}", f"{bright}")
        if theirs is None:
            continue
        zenith = (90.0 - elevation) * deg
        try:
            sky = Perez(zenith, 0.0, clear, bright, nm, distance=distance)
        except ValueError:
            continue
        coefficients, sun, scale = (np.asarray(x) for x in inspect(sky))
        rounding = 1e-6 + 1e-5 * np.abs(coefficients)
        off = np.max(np.abs(coefficients - theirs[1]) / rounding)
        lamp = theirs[2] * disk
        found.append((off, abs(sun - lamp) / max(lamp, 100.0), scale / theirs[0] - 1.0))
    off, lamps, scales = np.array(found).T
    source = "Radiance gendaylit"
    yield Claim("Perez: skies compared", source, None, len(found))
    claim = "a to e, in 1e-6 (as printed) + 1e-5"
    yield Claim(f"Perez: {claim}", source, 2.0, float(off.max()))
    yield Claim("Perez: illuminance of the sun", source, 1e-3, float(lamps.max()))
    scale = float(np.median(np.abs(scales)))
    yield Claim("Perez: scale, which it sums over 145 places", source, 0.03, scale)
    worst = float(np.abs(scales).max())
    yield Claim("Perez: the same, largest", source, None, worst)


def daylight() -> Iterator[Claim]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from colour.colorimetry import SDS_BASIS_FUNCTIONS_CIE_ILLUMINANT_D_SERIES

    table = SDS_BASIS_FUNCTIONS_CIE_ILLUMINANT_D_SERIES
    ours = data.read("daylight")
    at, values = ours["wavelength"], [ours[f"s{i}"] for i in range(3)]
    apart = [
        np.max(np.abs(table[f"S{i}"][at.astype(float)] - values[i])) for i in range(3)
    ]
    source = "colour-science"
    yield Claim("daylight: S0, S1, S2", source, 1e-9, float(np.max(apart)))


def preetham() -> Iterator[Claim]:
    """The luminance and chromaticity of the sky, by the program's coefficients."""
    rows = {
        0: [(0.17872, -1.46303), (-0.35540, 0.42749), (-0.02266, 5.32505)]
        + [(0.12064, -2.57705), (-0.06696, 0.37027)],
        1: [(-0.01925, -0.25922), (-0.06651, 0.00081), (-0.00041, 0.21247)]
        + [(-0.06409, -0.89887), (-0.00325, 0.04517)],
        2: [(-0.01669, -0.26078), (-0.09495, 0.00921), (-0.00792, 0.21023)]
        + [(-0.04405, -1.65369), (-0.01092, 0.05291)],
    }
    rng = np.random.default_rng(1999)
    apart = []
    for _ in range(CASES):
        t, zenith = rng.uniform(2.0, 6.0), rng.uniform(0.0, 85.0) * deg
        up = rng.uniform(0.02, 1.0, RAYS)
        rays = toward(np.arccos(up), rng.uniform(0.0, 6.28, RAYS))
        sun = toward(zenith, 0.0)
        gamma = np.arccos(np.clip(rays @ sun, -1.0, 1.0))
        sky = Preetham(zenith, 0.0, t, np.array([400.0, 500.0]))
        ours = np.asarray(colours(sky, rays, jnp.asarray(sun)))
        for i, coefficients in rows.items():
            a, b, c, d, e = (x * t + y for x, y in coefficients)
            shape = lambda up, angle, a=a, b=b, c=c, d=d, e=e: (
                (1 + a * np.exp(b / up))
                * (1 + c * np.exp(d * angle) + e * np.cos(angle) ** 2)
            )
            theirs = float(sky.zenith[i]) * shape(up, gamma) / shape(1.0, zenith)
            apart.append(np.max(np.abs(ours[:, i] / theirs - 1.0)))
    source = "the authors' program"
    claim = "Preetham: rounding of the paper's coefficients"
    yield Claim(claim, source, 5e-3, float(np.max(apart)))


def claims(arguments: argparse.Namespace) -> Iterator[Claim]:
    del arguments
    jax.config.update("jax_enable_x64", True)
    yield from preetham()
    yield from daylight()
    if importlib.util.find_spec("mitsuba") is None:
        print("mitsuba is not installed: Hosek and Wilkie are left out")
    else:
        yield from hosek()
    found = importlib.util.find_spec("pyradiance")
    if found is None or found.origin is None:
        print("pyradiance is not installed: Perez is left out")
    else:
        yield from perez(pathlib.Path(found.origin).parent / "bin" / "gendaylit")


if __name__ == "__main__":
    sys.exit(main(__doc__, claims))
