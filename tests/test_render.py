"""Pictures show what the sky is, pixel by pixel, and the disk with all its light."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from atmos import (
    colour,
    deg,
    earth,
    geometry,
    km,
    light,
    mars,
    medium,
    render,
    render_disks,
    Scene,
    solve,
)
from atmos.camera import Fisheye, LatLong, Perspective
from atmos.phase import DoubleHenyeyGreenstein, HenyeyGreenstein, Rayleigh
from atmos.sky import Grid, Resolution
from atmos.solver import QUICK
from atmos.spectrum import Constant, PowerLaw, Tabulated
from atmos.transport import direct_irradiance


NM = jnp.array([400.0, 550.0, 700.0])


def place(altitude):
    return jnp.array([0.0, 0.0, altitude])


def world(zenith, azimuth=0.3, radius=0.0):
    """Air and haze whose phase functions change with the wavelength, and ozone."""
    air = medium.Medium(
        medium.Exponential(8 * km),
        PowerLaw(1.3e-5, -4.0),
        phase=Rayleigh(PowerLaw(0.03, -0.5)),
    )
    lobes = DoubleHenyeyGreenstein(
        Tabulated(np.array([300.0, 800.0]), np.array([0.8, 0.7])), -0.3, 0.9
    )
    haze = medium.Medium(medium.Exponential(1.2 * km), 4e-5, 4e-6, lobes)
    mist = medium.Medium(medium.Exponential(2.0 * km), 1e-5, 0.0, HenyeyGreenstein(0.8))
    ozone = medium.Medium(medium.Tent(25 * km, 15 * km), absorption=2e-6)
    sun = light.Sun.at(zenith, azimuth, Constant(1.5), radius)
    shape = geometry.Spherical(6360 * km)
    return Scene(shape, 60 * km, (air, haze, mist, ozone), (sun,), Constant(0.2))


@eqx.filter_jit
def march(sky, position, zenith, azimuth):
    """Every direction by itself, without a table."""

    def look(zenith, azimuth):
        level = jnp.sin(zenith)
        east, north = level * jnp.sin(azimuth), level * jnp.cos(azimuth)
        return sky.radiance(position, jnp.stack([east, north, jnp.cos(zenith)]))

    return jax.vmap(jax.vmap(look))(zenith, azimuth)


def worst(seen, true):
    """The largest error, relative to the radiance or to 1e-3 of the brightest."""
    scale = np.maximum(true, 1e-3 * np.max(true, (0, 1)))
    return np.max(np.abs(seen - true) / scale)


@pytest.mark.parametrize(
    "zenith, altitude, bar",
    [
        (0.0, 0.0, 1e-3),
        (60.0, 0.0, 1e-3),
        (60.0, 10e3, 1e-3),
        (89.0, 0.0, 2e-3),
        (94.0, 0.0, 3e-3),
        (40.0, 400e3, 2e-3),
    ],
)
def test_a_table_of_the_sky_shows_what_marching_every_pixel_does(zenith, altitude, bar):
    sky = solve(world(zenith * deg), QUICK, NM)
    camera = LatLong(place(altitude), 24)
    zeniths, azimuths = camera.angles()
    true = march(sky, camera.position, *jnp.broadcast_arrays(zeniths, azimuths))
    assert worst(render(sky, camera), true) < bar


def test_all_cameras_see_the_same_sky():
    sky = solve(world(50 * deg), QUICK, NM)
    for camera in (
        Fisheye(place(0.0), 24),
        Perspective(place(0.0), 0.3, 30 * deg, 80 * deg, 24, 24),
    ):
        true = march(sky, camera.position, *camera.angles())
        true = jnp.where(camera.sees()[..., None], true, 0.0)
        assert worst(render(sky, camera), true) < 2e-3


def test_a_picture_is_alike_on_both_sides_of_the_sun():
    sky = solve(world(50 * deg, azimuth=0.0), QUICK, NM)
    image = render(sky, LatLong(place(0.0), 24))
    assert jnp.allclose(image, image[:, ::-1], rtol=1e-9)


def test_two_lights_add():
    one, other = world(30 * deg, 1.0), world(70 * deg, -2.0)
    both = eqx.tree_at(lambda x: x.lights, one, one.lights + other.lights)
    camera = LatLong(place(0.0), 24)
    seen = [render(solve(x, QUICK, NM), camera) for x in (one, other, both)]
    assert jnp.allclose(seen[0] + seen[1], seen[2], rtol=1e-9)


def test_a_response_is_a_sum_over_wavelengths():
    sky, camera = solve(world(60 * deg), QUICK, NM), LatLong(place(0.0), 24)
    response = jnp.array([[0.2, 1.0], [0.5, 0.0], [1.0, -1.0]])
    expected = render(sky, camera) @ response
    assert jnp.allclose(render(sky, camera, response), expected, rtol=1e-10)


def test_progress_ends_with_everything_done():
    told = []
    sky = solve(world(60 * deg), QUICK, NM)
    render(sky, LatLong(place(0.0), 24), progress=told.append)
    assert told[-1] == 1.0 and told == sorted(told)


def test_pictures_in_single_precision_are_those_in_double():
    camera = LatLong(place(2.0), 24)
    double = render(solve(world(60 * deg), QUICK, NM), camera)
    single = render(solve(world(60 * deg), QUICK, NM.astype(jnp.float32)), camera)
    assert single.dtype == jnp.float32
    assert worst(np.asarray(single, float), double) < 1e-4


def test_a_camera_stands_above_the_origin():
    sky = solve(world(60 * deg), QUICK, NM)
    with pytest.raises(ValueError, match="`position` must lie straight above"):
        render(sky, LatLong(jnp.array([1.0, 0.0, 0.0]), 4))


def test_no_light_no_picture_but_black():
    scene = eqx.tree_at(lambda x: x.lights, world(0.0), ())
    image = render(solve(scene, QUICK, NM), LatLong(place(0.0), 24))
    assert image.shape == (24, 48, 3) and not image.any()


@pytest.mark.parametrize("first", [0.0, 1.9])
def test_rings_and_their_places_agree(first):
    grid = Grid(jnp.array(first), jnp.array(1.95), Resolution(9, 7, 5))
    places = jnp.arange(16.0)
    assert jnp.allclose(grid.ring(grid.zeniths()), places, atol=2e-3)
    assert jnp.allclose(grid.side(grid.azimuths()), jnp.arange(5.0), atol=1e-9)
    assert jnp.all(jnp.diff(grid.zeniths()) > 0.0)


def energy(image, camera):
    """What a picture of the disk gives on a plane that faces it."""
    rows = jnp.arange(0.5, camera.height)
    areas = jax.vmap(lambda y: camera.solid_angle(jnp.array(0.5), y))(rows)
    return np.einsum("hwc,h->c", image, np.asarray(areas))


@pytest.mark.parametrize("height", [512, 1024, 2048])
@pytest.mark.parametrize("zenith", [0.0, 57.3, 89.9])
def test_the_disk_in_a_picture_has_the_energy_of_the_sun(zenith, height):
    scene = world(zenith * deg, radius=light.SOLAR_RADIUS)
    sky = solve(scene, QUICK, NM.astype(jnp.float32))
    camera = LatLong(place(2.0), height)
    found = energy(render_disks(sky, camera), camera)
    exact = direct_irradiance(
        sky.scene,
        sky.scene.lights[0],
        camera.position.astype(jnp.float32),
        sky.wavelength,
    )
    np.testing.assert_allclose(found, exact, rtol=5e-3)


def test_without_air_the_disk_is_darker_towards_its_limb():
    sun = light.Sun.at(20 * deg, 0.0, Constant(1.0))
    scene = Scene(geometry.Spherical(6360 * km), 60 * km, (), (sun,))
    sky = solve(scene, QUICK, jnp.array([450.0, 650.0]))
    view = Perspective(place(0.0), 0.0, 70 * deg, 0.6 * deg, 61, 61)
    image = render_disks(sky, view)
    assert image[30, 30, 0] > image[30, 10, 0] > 0.0 == image[0, 0, 0]
    # The limb is redder than the centre.
    assert image[30, 4, 0] / image[30, 30, 0] < image[30, 4, 1] / image[30, 30, 1]


def test_the_horizon_cuts_the_disk():
    scene = world(90 * deg, azimuth=0.0, radius=light.SOLAR_RADIUS)
    view = Perspective(place(0.0), 0.0, 0.0, 0.8 * deg, 40, 40)
    image = render_disks(solve(scene, QUICK, NM), view)
    assert np.all(image[20:] == 0.0) and np.all(image[10:19, 20] > 0.0)


def test_the_earth_s_sky_is_blue_and_that_of_mars_is_not():
    nm = jnp.linspace(380.0, 780.0, 21)
    for home, low, high in ((earth, 1.1, 9.0), (mars, 0.0, 0.9)):
        sun = light.Sun.at(50 * deg, 0.0, light.sunlight(20.0))
        camera = Perspective(place(2.0), 180 * deg, 60 * deg, 20 * deg, 2, 2)
        xyz = render(solve(home(sun), QUICK, nm), camera, colour.response(nm))
        red, _, blue = colour.REC709.from_xyz(xyz)[0, 0]
        assert low < blue / red < high


def test_pictures_have_gradients():
    camera = LatLong(place(2.0), 4)

    def mean(density):
        scene = eqx.tree_at(
            lambda x: x.media[1].scattering, world(50 * deg), Constant(density)
        )
        return jnp.mean(render(solve(scene, QUICK, NM), camera))

    at = jnp.array(4e-5)
    slope = (mean(at * 1.001) - mean(at * 0.999)) / (at * 0.002)
    assert jnp.allclose(jax.grad(mean)(at), slope, rtol=1e-5)
