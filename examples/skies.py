"""Noon, sunset, dusk, Mars, the Earth from orbit: python examples/skies.py"""

import dataclasses
import pathlib
import sys

import jax
import jax.numpy as jnp

from atmos import colour, deg, earth, image, km, mars, render, render_disks, solve
from atmos.camera import LatLong, Perspective
from atmos.light import SOLAR_RADIUS, Sun, sunlight
from atmos.solver import Shells


WAVELENGTH = jnp.linspace(380.0, 780.0, 41, dtype=jnp.float32)
MARS = 1.524  # distance from the sun in au


def skies(size):
    """Names, scenes and cameras of pictures that are `size` pixels high."""
    ground, orbit = jnp.array([0.0, 0.0, 2.0]), jnp.array([0.0, 0.0, 400 * km])
    wide = lambda at, up, view: Perspective(at, 0.0, up, view, size, 2 * size)

    def under(world, zenith, distance=1.0):
        spectrum = sunlight(10.0, distance)
        return world(Sun.at(zenith, 0.0, spectrum, SOLAR_RADIUS / distance))

    whole = LatLong(ground, size)
    return [
        ("noon", under(earth, 35 * deg), whole),
        ("sunset", under(earth, 88.5 * deg), wide(ground, 12 * deg, 70 * deg)),
        ("dusk 4", under(earth, 94 * deg), whole),
        ("dusk 8", under(earth, 98 * deg), whole),
        ("dusk 12", under(earth, 102 * deg), whole),
        ("mars", under(mars, 86 * deg, MARS), wide(ground, 10 * deg, 60 * deg)),
        ("orbit", under(earth, 62 * deg), wide(orbit, -19 * deg, 60 * deg)),
        ("terminator", under(earth, 89 * deg), wide(orbit, -19 * deg, 60 * deg)),
    ]


def main(folder, wanted, solver):
    """Writes the pictures, and all in one, into a folder, and returns their XYZ."""
    response = colour.response(WAVELENGTH)
    pictures, shown, solved = {}, [], {}
    for name, scene, camera in wanted:
        # One solution serves all suns of a planet.
        planet = float(scene.geometry.radius)
        if planet not in solved:
            solved[planet] = solve(scene, solver, WAVELENGTH)
        scene = jax.tree.map(lambda x: x.astype(WAVELENGTH.dtype), scene)
        sky = dataclasses.replace(solved[planet], scene=scene)
        air = render(sky, camera, response)
        xyz = pictures[name] = air + render_disks(sky, camera, response)
        shown.append(colour.preview(xyz, colour.automatic_exposure(air)))
        image.write_png(folder / f"{name}.png", shown[-1])
    rows = [jnp.concatenate(shown[i : i + 2], 1) for i in range(0, len(shown), 2)]
    image.write_png(folder / "skies.png", jnp.concatenate(rows))
    return pictures


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1] if sys.argv[1:] else "."), skies(320), Shells())
