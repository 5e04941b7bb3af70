"""Lights and surfaces against closed forms, and white worlds."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from atmos import image, surroundings
from atmos.colour import ACESCG
from atmos.geometry import Flat, Spherical
from atmos.light import Lamp, Spot, Sun, Surrounding
from atmos.medium import Box, Exponential, Medium
from atmos.phase import HenyeyGreenstein, Isotropic, Rayleigh
from atmos.quantity import deg
from atmos.scene import Scene
from atmos.sky import CIE, ZenithLuminance
from atmos.solver import RayMarching, solve, VolumeTracing
from atmos.surface import Glass, Lambertian, Mirror, Plane, Sphere, Surface


NM = np.array([450.0, 650.0])
LOOKS = 64
UP, DOWN = np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0])
SLANT = np.array([0.48, 0.36, 0.8])
rng = np.random.default_rng(0)
PICTURE = rng.uniform(0.0, 1.0, (8, 16, 2)) ** 3
PICTURE[5, 3] = 0.0


def tallied(scene, starts, directions, solver, light=0):
    """Means and standard errors, in single precision."""
    sky = solve(scene, solver, jnp.asarray(NM, jnp.float32))
    repeat = LOOKS // len(starts)
    looks = [np.repeat(np.asarray(x, float), repeat, 0) for x in (starts, directions)]
    # No two looks are alike, or they would be alike in all that is random too.
    looks[0] = looks[0] + 1e-5 * rng.uniform(-1.0, 1.0, (LOOKS, 3))
    looks = [jnp.asarray(x, jnp.float32) for x in looks]
    world = sky.prepared, sky.scene, sky.scene.lights[light], sky.wavelength
    found = sky.solver.tally(*world, *looks)
    parts = lambda x: np.asarray(x, float).reshape(-1, repeat, len(NM))
    error = np.sqrt(np.mean(parts(found.standard_error) ** 2, 1) / repeat)
    return np.mean(parts(found.mean), 1), error


BEYOND = {
    "sun": Sun(SLANT, 2.0, 0.4),
    "surrounding": Surrounding(PICTURE, NM, 0.3),
}


@pytest.mark.parametrize("name", BEYOND)
def test_what_is_sent_is_what_is_seen_over_the_chance_to_look_there(name):
    light, nm = BEYOND[name], jnp.asarray(NM)
    u = jnp.asarray((np.indices((200, 200)).reshape(2, -1).T + 0.5) / 200)

    @jax.jit
    @jax.vmap
    def look(u):
        shine = light.sample(jnp.zeros(3), u, nm)
        ahead = shine.direction
        return shine, light.radiance(ahead, nm), light.solid_angle(ahead)

    shine, radiance, solid_angle = look(u)
    np.testing.assert_allclose(shine.solid_angle, solid_angle, rtol=1e-9)
    due = radiance * np.asarray(solid_angle)[:, None]
    np.testing.assert_allclose(shine.irradiance, due, rtol=1e-9)
    # All directions that light comes from, with their solid angles, are a sphere or a
    # disk; and light adds up. Strips of strata leave some grain.
    total = np.mean(shine.irradiance, 0)
    if name == "sun":
        np.testing.assert_allclose(total, 2.0, rtol=1e-3)
        np.testing.assert_allclose(
            solid_angle, 2.0 * np.pi * (1.0 - np.cos(0.4)), rtol=1e-9
        )
    else:
        rows = -np.diff(np.cos(np.linspace(0.0, np.pi, 9))) * 2.0 * np.pi / 16
        due = np.sum(PICTURE * rows[:, None, None], (0, 1))
        np.testing.assert_allclose(total, due, rtol=2e-2)


def ground_by(light, starts, directions, surfaces=(), media=(), albedo=0.5):
    scene = Scene(Flat(), 100.0, media, (light,), albedo, surfaces)
    solver = VolumeTracing(walks=16, paths=16, cells=1)
    return tallied(scene, starts, directions, solver)


def test_ground_under_a_spot_is_lit_by_its_cone_and_the_square_of_the_distance():
    # Through smoke that takes away light, and past a ball that casts a shadow.
    extinction, narrow, wide = 0.2, 20.0 * deg, 30.0 * deg
    room = Box(np.array([-50.0, -50.0, -1.0]), np.array([50.0, 50.0, 50.0]))
    smoke = Medium(room, absorption=extinction)
    ball = Surface(Sphere(np.array([0.0, 0.4, 1.0]), 0.1), Lambertian(0.0))
    spot = Spot(np.array([0.0, 0.0, 2.0]), DOWN, 3.0, narrow, wide)
    angles = np.array([15.0, 25.0, 35.0]) * deg
    seen = np.array([[2.0 * np.tan(x), 0.0] for x in angles] + [[0.0, 0.8]])
    starts = np.concatenate([seen, np.full((4, 1), 1.0)], 1)
    aims = np.broadcast_to(DOWN, (4, 3))
    mean, error = ground_by(spot, starts, aims, (ball,), (smoke,))
    squared, cosine = 4.0 / np.cos(angles) ** 2, np.cos(angles)
    step = (np.cos(angles) - np.cos(wide)) / (np.cos(narrow) - np.cos(wide))
    step = np.clip(step, 0.0, 1.0)
    due = 0.5 / np.pi * 3.0 * cosine / squared * step * step * (3.0 - 2.0 * step)
    due = due * np.exp(-extinction * (1.0 + np.sqrt(squared)))
    assert np.all(mean[2:] == 0.0) and np.all(error[:2] < 0.04 * due[:2, None])
    assert np.all(np.abs(mean[:2] - due[:2, None]) < 4.0 * error[:2])


@pytest.mark.parametrize("name", BEYOND)
def test_wide_lights_light_the_ground_by_the_cosine_and_mirrors_show_them(name):
    light = BEYOND[name]
    mirror = Surface(Sphere(np.array([3.0, 0.0, 1.0]), 0.5), Mirror(0.7))
    starts = np.array([[0.0, 0.0, 1.0], [3.2, 0.1, 3.0]])
    mean, error = ground_by(
        light, starts, np.stack([DOWN, DOWN]), (mirror,), albedo=0.5
    )
    z = (np.arange(400) + 0.5) / 400
    turn = (np.arange(800) + 0.5) / 800 * 2.0 * np.pi
    z, turn = np.meshgrid(z, turn)
    level = np.sqrt(1.0 - z * z)
    ways = np.stack([level * np.cos(turn), level * np.sin(turn), z], -1).reshape(-1, 3)
    look = jax.jit(jax.vmap(lambda x: light.radiance(x, jnp.asarray(NM))))
    falls = 2.0 * np.pi * np.mean(np.asarray(look(ways)) * z.reshape(-1, 1), 0)
    # The mirror, from above, hides a little of the sky from the ground; it is far.
    due = 0.5 / np.pi * falls
    assert np.all(error[0] < 0.04 * due)
    assert np.all(np.abs(mean[0] - due) < 4.0 * error[0] + 0.02 * due)
    # In the ball one sees what stands where it sends the view back to.
    normal = np.array([0.2, 0.1, np.sqrt(0.25 - 0.05)]) / 0.5
    back = np.asarray(look((DOWN + 2.0 * normal[2] * normal)[None]))[0]
    np.testing.assert_allclose(mean[1], 0.7 * back, rtol=1e-4)


def test_a_white_world_in_even_light_is_white():
    # White air, a white cloud, white ground; balls of chalk, of silver and of glass.
    air = Medium(Exponential(8e3), 2e-5, phase=Rayleigh(0.03))
    box = Box(np.array([-300.0, -300.0, 500.0]), np.array([300.0, 300.0, 900.0]))
    cloud = Medium(box, 5e-3, phase=HenyeyGreenstein(0.7))
    stuff = {-50.0: Lambertian(1.0), 0.0: Mirror(), 50.0: Glass(1.5)}
    balls = tuple(
        Surface(Sphere(np.array([x, 200.0, 30.0]), 20.0), material)
        for x, material in stuff.items()
    )
    light = Surrounding(np.ones((4, 8, 2)), NM)
    scene = Scene(Spherical(6360e3), 60e3, (air, cloud), (light,), 1.0, balls)
    eye = np.array([0.0, 0.0, 30.0])
    aims = [np.array([x, 200.0, 35.0]) - eye for x in stuff] + [UP, DOWN, SLANT]
    starts = [eye] * 6 + [[0.0, 0.0, 700.0], [0.0, 0.0, 400e3]]
    aims = np.stack([*aims, SLANT, DOWN])
    aims = aims / np.linalg.norm(aims, axis=1)[:, None]
    mean, error = tallied(scene, starts, aims, VolumeTracing(walks=8, paths=16))
    assert np.all(error < 0.12) and np.all(np.abs(mean - 1.0) < 4.0 * error + 1e-5)


def test_a_lamp_in_smoke_lights_it_and_a_ball_casts_its_shadow_there():
    box = Box(np.array([-1.0, -1.0, 1.0]), np.array([1.0, 1.0, 3.0]))
    scattering, absorption, intensity = 0.01, 1.0, 5.0
    smoke = Medium(box, scattering, absorption, Isotropic())
    place, middle, radius = np.array([0.0, 0.1, 2.8]), np.array([0.0, 0.0, 2.4]), 0.1
    ball = Surface(Sphere(middle, radius), Lambertian(0.9))
    scene = Scene(Flat(), 10.0, (smoke,), (Lamp(place, intensity),), 0.0, (ball,))
    start, look = np.array([[0.0, -4.0, 2.0]]), np.array([[0.0, 1.0, 0.0]])
    mean, error = tallied(
        scene, start, look, VolumeTracing(walks=16, paths=16, cells=2)
    )
    y = (np.arange(20000) + 0.5) / 1e4 - 1.0
    ways = place - np.stack([0.0 * y, y, 0.0 * y + 2.0], 1)
    far = np.linalg.norm(ways, axis=1)
    along = np.sum((place - middle) * ways, 1) / far
    lit = np.sum((place - middle) ** 2) - along**2 > radius**2
    assert 0.1 < np.mean(~lit) < 0.3
    each = np.exp(-1.01 * (y + 1.0 + far)) / far**2 * lit
    due = scattering * intensity / (4.0 * np.pi) * np.mean(each) * 2.0
    assert np.all(error < 0.05 * due)
    # A hundredth of what turned once turns again.
    assert np.all(np.abs(mean - due) < 4.0 * error + 0.01 * due)


def test_glass_bends_light_as_snell_says_and_sends_back_as_fresnel_says():
    glass, count = Glass(1.5), 4000
    u = jnp.asarray((np.arange(count) + 0.5) / count)
    turn = jax.jit(
        jax.vmap(
            lambda x, u: glass.turn(x, jnp.asarray(UP), jnp.stack([u, u, u])), (None, 0)
        )
    )
    for angle, sent in [(0.0, 0.04), (np.arctan(1.5), None), (1.2, None)]:
        sine, cosine = np.sin(angle), np.cos(angle)
        found = np.asarray(turn(jnp.array([sine, 0.0, -cosine]), u))
        back = found[:, 2] > 0.0
        np.testing.assert_allclose(found[back], [[sine, 0, cosine]] * sum(back))
        np.testing.assert_allclose(found[~back][:, 0], sine / 1.5, atol=1e-12)
        within = np.sqrt(1.0 - (sine / 1.5) ** 2)
        across = ((cosine - 1.5 * within) / (cosine + 1.5 * within)) ** 2
        along = ((1.5 * cosine - within) / (1.5 * cosine + within)) ** 2
        due = 0.5 * (across + along)
        assert abs(np.mean(back) - due) < 1e-3
        # At Brewster's angle only what vibrates across is sent back; 4 % at right ones.
        assert sent is None or abs(due - sent) < 1e-12
        assert angle != np.arctan(1.5) or along < 1e-30
    # From within, beyond the critical angle, all is sent back.
    steep = np.asarray(turn(jnp.array([0.8, 0.0, 0.6]), u))
    np.testing.assert_allclose(steep, [[0.8, 0.0, -0.6]] * count, atol=1e-12)


def test_a_plane_is_met_once_and_not_by_what_leaves_it():
    plane = Plane(np.array([0.0, 0.0, 1.0]), UP)
    meet = lambda *x: float(plane.meet(*map(jnp.asarray, x)))
    start = np.array([0.0, 0.0, 3.0])
    np.testing.assert_allclose(meet(start, -SLANT, False), 2.0 / 0.8)
    assert meet(start, SLANT, False) >= 1e18
    assert meet(np.array([0.0, 0.0, 1.0]), SLANT, True) >= 1e18


def test_skies_and_pictures_surround_a_scene(tmp_path):
    sky = CIE(12, 50.0 * deg, 0.6, ZenithLuminance(5e3), NM)
    light = surroundings.of_sky(sky, np.zeros(3), 64)
    ways = np.array([[0.2, 0.1, 1.0], [-0.7, 0.9, 0.4], [0.1, -0.9, 0.2]])
    ways = ways / np.linalg.norm(ways, axis=1)[:, None]
    both = lambda x: (light.radiance(x, sky.wavelength), sky.radiance(jnp.zeros(3), x))
    found, due = jax.jit(jax.vmap(both))(ways)
    np.testing.assert_allclose(found, due, rtol=0.06)
    path = tmp_path / "sky.exr"
    image.write_spectral_exr(path, PICTURE.astype(np.float32), NM)
    light = surroundings.of_exr(path, 0.3)
    np.testing.assert_array_equal(light.picture, PICTURE.astype(np.float32))
    colours = tmp_path / "colours.exr"
    image.write_exr(colours, PICTURE[..., [0, 0, 1]].astype(np.float32), ACESCG)
    with pytest.raises(ValueError, match="must have spectral layers"):
        surroundings.of_exr(colours)


def test_what_a_solver_does_not_know_is_refused():
    lamp = Lamp(UP, 1.0)
    ball = Surface(Sphere(UP, 1.0), Mirror())
    scene = Scene(Flat(), 10.0, (), (lamp,))
    with pytest.raises(ValueError, match=r"`scene.lights\[0\]` must be a sun"):
        solve(scene, RayMarching(), NM)
    scene = Scene(Flat(), 10.0, (), (), 0.0, (ball,))
    with pytest.raises(ValueError, match="`scene.surfaces` must be empty"):
        solve(scene, RayMarching(), NM)
    with pytest.raises(ValueError, match="`inner` and `outer` must rise"):
        Spot(UP, DOWN, 1.0, 0.5, 0.4)
    with pytest.raises(ValueError, match=r"`picture` must be 0 or above"):
        Surrounding(-np.ones((2, 4, 2)), NM)
