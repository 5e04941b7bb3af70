import functools as ft
import math
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from atmos.camera import Fisheye, LatLong, Perspective
from atmos.quantity import deg


HERE = np.array([0.0, 0.0, 2.0])
CAMERAS = {
    "dome": LatLong(HERE, 16),
    "turned dome": LatLong(HERE, 15, centre_azimuth=135 * deg),
    "fisheye": Fisheye(HERE, 33),
    "turned fisheye": Fisheye(HERE, 32, angle_of_view=100 * deg, top_azimuth=0.7),
    "all round": Fisheye(HERE, 33, angle_of_view=360 * deg),
    "level": Perspective(HERE, 0.0, 0.0, 60 * deg, 9, 16),
    "tilted": Perspective(HERE, 220 * deg, 40 * deg, 100 * deg, 20, 15),
    "straight up": Perspective(HERE, 30 * deg, 90 * deg, 90 * deg, 15, 15),
    "straight down": Perspective(HERE, 0.0, -90 * deg, 90 * deg, 15, 15),
}
every_camera = pytest.mark.parametrize("name", CAMERAS)
FRACTIONS = np.array([0.0, 0.02, 0.3, 0.5, 0.77, 1.0])


class Answers(NamedTuple):
    """What a camera says of its pixels, and of some places up to its very corners."""

    pixels: np.ndarray
    zenith: np.ndarray
    azimuth: np.ndarray
    sees: np.ndarray
    towards: np.ndarray
    right: np.ndarray
    down: np.ndarray
    area: np.ndarray


@ft.cache
def answers(name):
    @eqx.filter_jit
    def ask(camera, x, y):
        zenith, azimuth = camera.angles()
        rows = jnp.arange(0.5, camera.height)
        columns = jnp.arange(0.5, camera.width)
        across = jax.vmap(camera.direction, (0, None))
        return Answers(
            jax.vmap(across, (None, 0))(columns, rows),
            zenith,
            azimuth,
            camera.sees(),
            jax.vmap(camera.direction)(x, y),
            jax.vmap(jax.jacfwd(camera.direction, 0))(x, y),
            jax.vmap(jax.jacfwd(camera.direction, 1))(x, y),
            jax.vmap(camera.solid_angle)(x, y),
        )

    camera = CAMERAS[name]
    return jax.tree.map(np.asarray, ask(camera, *places(camera)))


def places(camera):
    x, y = np.meshgrid(FRACTIONS * camera.width, FRACTIONS * camera.height)
    return jnp.asarray(x.ravel()), jnp.asarray(y.ravel())


def looks(camera, x, y):
    return np.asarray(camera.direction(jnp.asarray(float(x)), jnp.asarray(float(y))))


def add(camera):
    """The solid angles of all pixels together."""
    x, y = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    areas = jax.vmap(camera.solid_angle)(jnp.asarray(x.ravel()), jnp.asarray(y.ravel()))
    sees = np.broadcast_to(camera.sees(), x.shape)
    return np.asarray(areas)[sees.ravel()].sum()


def single(camera):
    return jax.tree.map(lambda x: x.astype(jnp.float32), camera)


@every_camera
def test_directions_are_unit(name):
    for directions in answers(name).pixels, answers(name).towards:
        lengths = np.linalg.norm(directions, axis=-1)
        np.testing.assert_allclose(lengths, 1.0, rtol=1e-14)


@every_camera
def test_angles_are_those_of_the_directions(name):
    zenith, azimuth = answers(name).zenith, answers(name).azimuth
    east, north = np.sin(zenith) * np.sin(azimuth), np.sin(zenith) * np.cos(azimuth)
    expected = np.stack([east, north, np.cos(zenith) + 0.0 * azimuth], -1)
    np.testing.assert_allclose(answers(name).pixels, expected, atol=2e-15)


@every_camera
def test_nothing_is_mirrored(name):
    # To the right, crossed with down, is away from the observer.
    _, _, _, _, towards, right, down, _ = answers(name)
    away = np.sum(np.cross(right, down) * towards, -1)
    seen = inside(name)
    assert np.count_nonzero(seen) > 10 and np.all(away[seen] > 0.0)


@every_camera
def test_the_solid_angle_is_the_jacobian_of_the_direction(name):
    _, _, _, _, towards, right, down, area = answers(name)
    expected = np.sum(np.cross(right, down) * towards, -1)
    if name.endswith("dome"):  # whole pixels: the mean of a sine over a pixel
        half = 0.5 * math.pi / CAMERAS[name].height
        expected = expected * math.sin(half) / half
    seen = inside(name)
    np.testing.assert_allclose(area[seen], expected[seen], rtol=1e-12)


def inside(name):
    """The places inside the picture's rim, poles and seams of a map left out."""
    x, y = np.meshgrid(FRACTIONS, FRACTIONS)
    if name.endswith("dome"):
        return ((y > 0.0) & (y < 1.0)).ravel()
    if "fisheye" in name or name == "all round":
        return (np.hypot(x - 0.5, y - 0.5) < 0.499).ravel()
    return np.ones(x.size, bool)


@pytest.mark.parametrize("height", [1, 2, 15, 64])
def test_the_pixels_of_a_dome_add_to_the_sphere(height):
    camera = LatLong(HERE, height)
    total = add(camera)
    np.testing.assert_allclose(total, 4.0 * math.pi, rtol=1e-14)


@pytest.mark.parametrize(("view", "sphere"), [(180, 2.0), (360, 4.0), (120, 1.0)])
def test_the_pixels_of_a_fisheye_add_to_its_cap(view, sphere):
    camera = Fisheye(HERE, 512, angle_of_view=view * deg)
    # A pixel at the rim is in or out as a whole.
    np.testing.assert_allclose(add(camera), sphere * math.pi, rtol=2e-4)


def test_the_pixels_of_a_pinhole_add_to_its_pyramid():
    camera = Perspective(HERE, 1.0, 0.5, 90 * deg, 200, 300)
    a, b = 1.0, 2.0 / 3.0  # half sides at distance 1
    pyramid = 4.0 * math.atan(a * b / math.sqrt(1.0 + a * a + b * b))
    total = add(camera)
    np.testing.assert_allclose(total, pyramid, rtol=1e-5)


@pytest.mark.parametrize(
    ("x", "y", "east", "north", "up"),
    [
        (16, 8, 0, 1, 0),  # the centre: north, on the horizon
        (24, 8, 1, 0, 0),  # to the right: east
        (8, 8, -1, 0, 0),
        (0, 8, 0, -1, 0),  # both sides: south
        (32, 8, 0, -1, 0),
        (16, 0, 0, 0, 1),
        (5, 16, 0, 0, -1),
        (20, 4, 0.5, 0.5, math.sqrt(0.5)),  # north-east, 45 degrees up
    ],
)
def test_a_dome_faces_north(x, y, east, north, up):
    np.testing.assert_allclose(
        looks(LatLong(HERE, 16), x, y), [east, north, up], atol=1e-15
    )


def test_a_dome_can_face_east():
    camera = LatLong(HERE, 16, centre_azimuth=90 * deg)
    np.testing.assert_allclose(looks(camera, 16, 8), [1, 0, 0], atol=1e-15)
    np.testing.assert_allclose(looks(camera, 8, 8), [0, 1, 0], atol=1e-15)


def test_the_first_pixel_of_a_dome_is_half_a_pixel_off_the_pole():
    zenith, azimuth = CAMERAS["dome"].angles()
    assert zenith.shape == (16, 1) and azimuth.shape == (1, 32)
    np.testing.assert_allclose(zenith[0, 0], math.pi / 32, rtol=1e-15)
    np.testing.assert_allclose(zenith[-1, 0], math.pi * 31 / 32, rtol=1e-15)
    np.testing.assert_allclose(azimuth[0, 0], -math.pi * 31 / 32, rtol=1e-15)


def test_a_fisheye_is_the_sky_as_one_lies_on_ones_back():
    camera = CAMERAS["fisheye"]
    np.testing.assert_allclose(looks(camera, 16.5, 16.5), [0, 0, 1], atol=1e-15)
    np.testing.assert_allclose(looks(camera, 16.5, 0), [0, 1, 0], atol=1e-15)
    np.testing.assert_allclose(looks(camera, 0, 16.5), [1, 0, 0], atol=1e-15)
    halfway = math.sqrt(0.5)  # equal angles: 45 degrees at half the radius
    np.testing.assert_allclose(
        looks(camera, 16.5, 24.75), [0, -halfway, halfway], atol=1e-15
    )


def test_the_top_of_a_fisheye_can_be_turned():
    camera = Fisheye(HERE, 10, top_azimuth=90 * deg)
    np.testing.assert_allclose(looks(camera, 5, 0), [1, 0, 0], atol=1e-15)
    np.testing.assert_allclose(looks(camera, 0, 5), [0, -1, 0], atol=1e-15)


def test_a_fisheye_sees_a_disk():
    sees = np.asarray(Fisheye(HERE, 4).sees())
    corners = np.zeros((4, 4), bool)
    corners[::3, ::3] = True
    np.testing.assert_array_equal(sees, ~corners)
    assert Fisheye(HERE, 1).sees()[0, 0]


@pytest.mark.parametrize("azimuth", [0.0, 75.0, 300.0])
@pytest.mark.parametrize("elevation", [-90.0, -20.0, 0.0, 60.0, 90.0])
def test_a_pinhole_looks_along_its_axis(azimuth, elevation):
    camera = Perspective(HERE, azimuth * deg, elevation * deg, 50 * deg, 6, 8)
    a, e = azimuth * deg, elevation * deg
    axis = [math.cos(e) * math.sin(a), math.cos(e) * math.cos(a), math.sin(e)]
    np.testing.assert_allclose(looks(camera, 4, 3), axis, atol=1e-15)


def test_the_field_of_view_is_horizontal():
    camera = Perspective(HERE, 0.0, 0.0, 90 * deg, 4, 8)
    half = math.sqrt(0.5)
    np.testing.assert_allclose(looks(camera, 8, 2), [half, half, 0], atol=1e-15)
    np.testing.assert_allclose(looks(camera, 0, 2), [-half, half, 0], atol=1e-15)
    up = looks(camera, 4, 0)
    np.testing.assert_allclose(up[2] / up[1], 0.5, rtol=1e-14)  # square pixels


@pytest.mark.parametrize(
    "camera",
    [
        LatLong(HERE, 2048, 2.0),
        Fisheye(HERE, 2048),
        Perspective(HERE, 4.0, 0.3, 1.0, 2048, 3072),
    ],
    ids=["dome", "fisheye", "pinhole"],
)
def test_single_precision_places_pixels_to_a_millionth(camera):
    x = jnp.asarray(np.append(np.arange(0, camera.width, 31), camera.width - 1) + 0.5)
    y = jnp.asarray(np.append(np.arange(0, camera.height, 31), camera.height - 1) + 0.5)

    def grid(camera, x, y):
        across = jax.vmap(camera.direction, (0, None))
        return np.asarray(jax.vmap(across, (None, 0))(x, y))

    exact = grid(camera, x, y)
    rough = grid(single(camera), x.astype(jnp.float32), y.astype(jnp.float32))
    assert rough.dtype == np.float32
    np.testing.assert_allclose(rough, exact, atol=1e-6)
    if isinstance(camera, LatLong):
        for one, other in zip(single(camera).angles(), camera.angles(), strict=True):
            assert one.dtype == np.float32
            np.testing.assert_allclose(one, other, atol=1e-6)


@every_camera
def test_gradients_are_finite_at_edges_and_poles(name):
    @eqx.filter_jit
    def slopes(camera, x, y):
        def total(camera):
            zenith, azimuth = camera.angles()
            towards = jax.vmap(camera.direction)(x, y)
            areas = jax.vmap(camera.solid_angle)(x, y)
            return zenith.sum() + azimuth.sum() + towards.sum() + areas.sum()

        return jax.value_and_grad(total)(camera)

    for leaf in jax.tree.leaves(slopes(CAMERAS[name], *places(CAMERAS[name]))):
        assert np.all(np.isfinite(leaf))
    for leaf in answers(name):
        assert np.all(np.isfinite(leaf))


def test_pictures_turn_with_the_camera():
    camera = Perspective(HERE, 1.0, 0.2, 1.0, 4, 6)
    x, y = jnp.asarray(1.3), jnp.asarray(0.7)

    def east(azimuth):
        turned = eqx.tree_at(lambda camera: camera.azimuth, camera, azimuth)
        return turned.direction(x, y)[0]

    north = looks(camera, 1.3, 0.7)[1]
    np.testing.assert_allclose(jax.grad(east)(camera.azimuth), north, rtol=1e-13)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: LatLong(HERE, 0), "`height` must be a whole number, 1 or more; got 0"),
        (lambda: LatLong(HERE, -4), "`height` must be a whole number"),
        (lambda: LatLong(HERE * math.nan, 4), "`position` must be finite"),
        (lambda: LatLong(HERE, 4, math.inf), "`centre_azimuth` must be finite"),
        (lambda: Fisheye(HERE, 0), "`size` must be"),
        (lambda: Fisheye(HERE, 4, 0.0), "`angle_of_view` must be above 0 and at most"),
        (lambda: Fisheye(HERE, 4, 400 * deg), "`angle_of_view`.*got 400 degrees"),
        (
            lambda: Perspective(HERE, 0.0, 91 * deg, 1.0, 4, 4),
            "`elevation` must lie between -90 and 90 degrees; got 91 degrees",
        ),
        (
            lambda: Perspective(HERE, 0.0, 0.0, math.pi, 4, 4),
            "`field_of_view` must be above 0 and below 180 degrees; got 180 degrees",
        ),
        (lambda: Perspective(HERE, 0.0, 0.0, math.nan, 4, 4), "`field_of_view`"),
        (lambda: Perspective(HERE, 0.0, 0.0, 1.0, 4, 0), "`width` must be"),
    ],
)
def test_impossible_cameras_are_refused(build, message):
    with pytest.raises(ValueError, match=message):
        build()
