"""How a blue sky is polarised, and where it is not: python examples/polarisation.py"""

import dataclasses
import pathlib
import sys

import jax
import jax.numpy as jnp

from atmos import deg, earth, image, polarisation, solve
from atmos.camera import Fisheye
from atmos.light import Sun, sunlight
from atmos.render import render_stokes
from atmos.solver import Shells


WAVELENGTH = jnp.array([450.0, 550.0, 650.0], jnp.float32)
# Beyond this share of polarised light the picture is white.
FULL = 0.8


def patterns(size, zeniths, solver):
    """I, Q and U of skies at 550 nm, the sun at the top: [3, size, size] each."""
    camera = Fisheye(jnp.array([0.0, 0.0, 2.0]), size)
    sky = solve(under(zeniths[0]), solver, WAVELENGTH)
    # One solution serves all suns.
    scenes = [jax.tree.map(lambda x: x.astype(jnp.float32), under(x)) for x in zeniths]
    skies = [dataclasses.replace(sky, scene=x) for x in scenes]
    return [render_stokes(x, camera)[..., 1] for x in skies]


def under(zenith):
    return earth(Sun.at(zenith, 0.0, sunlight(10.0)))


def shades(stokes):
    """The degree of polarisation as a grey, and the angle of vibration as a hue."""
    degree = jnp.clip(polarisation.degree(stokes) / FULL, 0.0, 1.0)
    # Neutral points are small: a root makes their surroundings stand out.
    grey = jnp.repeat(jnp.sqrt(degree)[..., None], 3, -1)
    angle = 2.0 * polarisation.angle(stokes)
    hue = [0.5 + 0.5 * jnp.cos(angle - i * 120 * deg) for i in range(3)]
    return grey, jnp.stack(hue, -1) * grey


def main(folder, size, solver):
    """Writes the picture for three suns, and returns what is in it."""
    found = patterns(size, [60 * deg, 75 * deg, 85 * deg], solver)
    rows = [jnp.concatenate(x, 1) for x in zip(*map(shades, found), strict=True)]
    picture = jnp.round(255.0 * jnp.concatenate(rows)).astype(jnp.uint8)
    image.write_png(folder / "polarisation.png", picture)
    return found


if __name__ == "__main__":
    folder = pathlib.Path(sys.argv[1] if sys.argv[1:] else ".")
    main(folder, 320, Shells(stokes=3))
