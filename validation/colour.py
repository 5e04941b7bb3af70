"""Colours of real pictures at the default wavelengths against integration at 1 nm.

The Earth with the sun at 60, 5 and 0 degrees above the horizon is rendered at 380, 390,
..., 780 nm (sunlight averaged over 10 nm), and at 360, 361, ..., 830 nm (over 1 nm) by
the same solver. The first becomes XYZ as pictures do, the second by colour-science's
CIE 1931 observer. So does the light of the sun's disk itself.

Differences are CIEDE2000 under D65, each colour exposed so that it has half of the
luminance of white: as for a patch of it alone, however dim.

    python -m validation.colour
"""

import argparse
import sys
import warnings
from collections.abc import Iterator

import equinox as eqx
import jax.numpy as jnp
import numpy as np

import atmos
from atmos import camera, colour as ours, deg, light, solver, transport

from .claim import Claim, main


NM = np.arange(380.0, 781.0, 10.0, np.float32)
EACH = np.arange(360.0, 831.0, 1.0, np.float32)
ELEVATIONS = [60.0, 5.0, 0.0]
SPACES = {"rec709": ours.REC709, "acescg": ours.ACESCG}
HEIGHT = 64
AT = jnp.array([0.0, 0.0, 2.0], jnp.float32)


def world(elevation: float, bandwidth: float) -> atmos.Scene:
    sunlight = light.sunlight(bandwidth)
    return atmos.earth(light.Sun.at((90.0 - elevation) * deg, 0.0, sunlight))


@eqx.filter_jit
def disk(sky):
    scene = sky.scene
    return transport.direct_irradiance(scene, scene.lights[0], AT, sky.wavelength)


def places(elevation: float) -> dict[str, tuple[int, int]]:
    """Rows and columns of the dome, whose centre looks towards the sun."""
    row = lambda degrees: int((90.0 - degrees) / 180.0 * HEIGHT)
    return {
        "zenith": (0, HEIGHT),
        "horizon, below the sun": (row(1.0), HEIGHT),
        "horizon, aside": (row(1.0), HEIGHT // 2),
        "horizon, opposite": (row(1.0), 0),
        "near the sun": (row(elevation + 3.0), HEIGHT),
    }


def observed(spectra: np.ndarray) -> np.ndarray:
    """XYZ of radiances at `EACH`, summed by the observer of colour-science."""
    import colour

    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    assert np.array_equal(observer.wavelengths, EACH)
    return 683.0 * spectra @ observer.values


def difference(found: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """CIEDE2000."""
    import colour

    white = np.array(ours.D65)
    exposed = 0.5 / truth[..., 1:2]
    lab = [colour.XYZ_to_Lab(x * exposed, white) for x in (found, truth)]
    return colour.delta_E(*lab, method="CIE 2000")


def claims(arguments: argparse.Namespace) -> Iterator[Claim]:
    del arguments
    response = ours.response(jnp.asarray(NM))
    dome, half = camera.LatLong(AT, HEIGHT), HEIGHT // 2
    source = "1 nm, CIE 1931, CIEDE2000"
    for elevation in ELEVATIONS:
        few = atmos.solve(world(elevation, 10.0), solver.QUICK, NM)
        many = atmos.solve(world(elevation, 1.0), solver.QUICK, EACH)
        picture = atmos.render(few, dome, response)
        bright = ours.to_xyz(disk(few), few.wavelength)
        spectra = np.asarray(atmos.render(many, dome), float)
        apart = difference(np.asarray(picture, float), observed(spectra))
        direct = observed(np.asarray(disk(many), float))
        name = f"sun at {elevation:g} deg"
        figures = {place: apart[at] for place, at in places(elevation).items()}
        figures["whole sky, largest"] = apart[:half].max()
        figures["whole ground, largest"] = apart[half:].max()
        figures["direct sun"] = difference(np.asarray(bright, float), direct)
        for place, figure in figures.items():
            yield Claim(f"{name}, {place}", source, 0.5, figure)
        for space, values in SPACES.items():
            seen, sun = values.from_xyz(picture), values.from_xyz(bright)
            claim = f"{name}, {space}: values below 0, of {picture.size}"
            yield Claim(claim, "-", None, jnp.sum(seen < 0.0))
            claim = f"{name}, {space}: direct sun, least over greatest"
            yield Claim(claim, "-", None, jnp.min(sun) / jnp.max(sun))


if __name__ == "__main__":
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of colour-science, about matplotlib
        code = main(__doc__, claims)
    sys.exit(code)
