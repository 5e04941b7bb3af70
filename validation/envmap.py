"""Pictures of atmos read by another renderer: what looks where? Is nothing mirrored?

A dome is written in which the colour of each pixel is the direction that it looks in,
(east, north, up) -> (R, G, B), and Mitsuba lights a scene with it. Three questions:

1. Does its `envmap` see the colour of direction d when it looks along d, with north on
   its axis +Z, west on +X and up on +Y?
2. Does its pinhole camera take the same picture as `Perspective`?
3. Do the same light's Rec.709 and XYZ files give the same radiance?

Mitsuba puts pixel centres at half integers along the rows, as atmos does, but the
centres of the first and the last row at the poles: what it sees is shifted vertically
by up to half a pixel there, and by nothing at the horizon.

    python -m validation.envmap
"""

import argparse
import math
import pathlib
import sys
import tempfile
from collections.abc import Iterator

import jax
import jax.numpy as jnp
import numpy as np

from atmos.camera import AbstractCamera, LatLong, Perspective
from atmos.colour import REC709, XYZ
from atmos.image import write_exr
from atmos.quantity import deg

from .claim import Claim, main


try:
    import mitsuba as mi
except ImportError:
    mi = None
else:
    mi.set_variant("scalar_rgb")

HERE = np.array([0.0, 0.0, 2.0])
# Mitsuba's X, Y and Z: west, up and north.
AXES = np.array([[-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])


def directions(camera: AbstractCamera) -> np.ndarray:
    across = jax.vmap(camera.direction, (0, None))
    x, y = jnp.arange(camera.width) + 0.5, jnp.arange(camera.height) + 0.5
    return np.asarray(jax.vmap(across, (None, 0))(x, y))


def lit_by(path: pathlib.Path, image: np.ndarray, space=REC709):
    write_exr(path, image, space, latlong=True)
    dome = {"type": "envmap", "filename": str(path)}
    return mi.load_dict(
        {"type": "scene", "integrator": {"type": "direct"}, "dome": dome}
    )


def radiance(scene, towards: np.ndarray) -> np.ndarray:
    ray = mi.RayDifferential3f([0.0, 0.0, 0.0], (AXES @ towards).tolist())
    return np.array(scene.environment().eval(scene.ray_intersect(ray)))


def places(coded: np.ndarray, camera: LatLong) -> tuple[np.ndarray, np.ndarray]:
    """The x and y of a dome whose centre is north that have these directions."""
    unit = coded / np.linalg.norm(coded, axis=-1, keepdims=True)
    x = 0.5 + np.arctan2(unit[..., 0], unit[..., 1]) / (2.0 * math.pi)
    y = 0.5 - np.arcsin(unit[..., 2]) / math.pi
    return x * camera.width, y * camera.height


def look_around(path: pathlib.Path):
    """Errors of what Mitsuba sees, in pixels: along rows, columns, and unexplained."""
    camera = LatLong(HERE, 256)
    scene = lit_by(path, 0.5 + 0.5 * directions(camera))
    rng = np.random.default_rng(0)
    towards = rng.normal(size=(4000, 3))
    towards[:200, 0] *= 1e-3  # near north, and near the seam in the south
    towards[200:400, 2] *= 1e-3  # near the horizon
    towards[400:500, :2] *= 0.02  # near the poles
    towards /= np.linalg.norm(towards, axis=-1, keepdims=True)
    towards = towards[np.abs(towards[:, 2]) < math.cos(math.pi / camera.height)]
    seen = np.array([2.0 * radiance(scene, d) - 1.0 for d in towards])
    x, y = places(towards, camera)
    u, v = places(seen, camera)
    across = (u - x + camera.height) % camera.width - camera.height
    across *= np.hypot(towards[:, 0], towards[:, 1])
    known = 0.5 - y / camera.height
    return np.abs(across).max(), np.abs(v - y).max(), np.abs(v - y - known).max()


def look_ahead(path: pathlib.Path) -> float:
    """How far apart `Perspective` and Mitsuba's pinhole look, in pixels, at worst."""
    scene = lit_by(path, 0.5 + 0.5 * directions(LatLong(HERE, 1024)))
    camera = Perspective(HERE, 50.0 * deg, 25.0 * deg, 70.0 * deg, 48, 64)
    axis = np.asarray(camera.direction(jnp.asarray(32.0), jnp.asarray(24.0)))
    pinhole = {
        "type": "perspective",
        "fov": 70.0,
        "fov_axis": "x",
        "to_world": mi.ScalarTransform4f().look_at(
            [0.0, 0.0, 0.0], (AXES @ axis).tolist(), [0.0, 1.0, 0.0]
        ),
        "film": {
            "type": "hdrfilm",
            "width": camera.width,
            "height": camera.height,
            "rfilter": {"type": "box"},
        },
        "sampler": {"type": "stratified", "sample_count": 64},
    }
    picture = mi.render(scene, sensor=mi.load_dict(pinhole))
    coded = 2.0 * np.array(picture)[..., :3] - 1.0
    coded /= np.linalg.norm(coded, axis=-1, keepdims=True)
    apart = np.linalg.norm(coded - directions(camera), axis=-1)
    return float(apart.max() / (2.0 * math.tan(35.0 * deg) / camera.width))


def look_at_colour(path: pathlib.Path) -> float:
    """How far apart the radiances of a Rec.709 and an XYZ file are, relatively."""
    light = jnp.broadcast_to(jnp.asarray([0.9, 0.5, 0.2]), (8, 16, 3))
    north = np.array([0.0, 1.0, 0.0])
    rgb = radiance(lit_by(path, np.asarray(light)), north)
    values = np.asarray(XYZ.from_xyz(REC709.to_xyz(light)))
    return float(np.abs(radiance(lit_by(path, values, XYZ), north) / rgb - 1.0).max())


def claims(_: argparse.Namespace) -> Iterator[Claim]:
    if mi is None:
        print("mitsuba is not installed: skipped.")
        return
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "dome.exr"
        across, down, unexplained = look_around(path)
        of_map, of_camera = "Mitsuba's envmap", "Mitsuba's perspective"
        yield Claim("directions along the rows, pixels", of_map, 0.01, across)
        yield Claim("directions along the columns, pixels", of_map, 0.5, down)
        text = "    but for Mitsuba's placing of rows"
        yield Claim(text, of_map, 0.01, unexplained)
        text = "Perspective against a pinhole, pixels"
        yield Claim(text, of_camera, 0.1, look_ahead(path))
        text = "XYZ file against Rec.709 file, relative"
        yield Claim(text, of_map, 1e-3, look_at_colour(path))


if __name__ == "__main__":
    sys.exit(main(__doc__, claims))
