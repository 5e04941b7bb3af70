"""Light marched through boxes, clouds and fire, against closed forms."""

import dataclasses
import functools as ft

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hostile import decades, drawn, within
from hypothesis import given, strategies as st

from atmos import render
from atmos.camera import Perspective
from atmos.geometry import Flat, Spherical
from atmos.light import Sun
from atmos.medium import (
    Box,
    Exponential,
    Glow,
    Grid,
    Medium,
    Noise,
    Product,
    Puff,
    Thermal,
    Transformed,
)
from atmos.phase import HenyeyGreenstein, Rayleigh
from atmos.scene import Scene
from atmos.solver import (
    Adaptive,
    Fixed,
    Jittered,
    PathTracing,
    RayMarching,
    ShadowCache,
    ShadowRays,
    SingleScattering,
    Skipping,
    solve,
)
from atmos.spectrum import planck, PowerLaw


NM = np.array([450.0, 650.0])
LOWER, UPPER = np.array([-1.0, -1.0, 1.0]), np.array([1.0, 1.0, 3.0])
ABOVE = np.array([0.0, 0.0, 1.0])
rng = np.random.default_rng(0)


def scene(*media, sun=ABOVE, ground=0.0, lit=True):
    lights = (Sun(np.asarray(sun), 2.0, 0.0),) if lit else ()
    return Scene(Flat(), 100.0, media, lights, ground)


@eqx.filter_jit
def look(sky, positions, directions):
    return jax.vmap(sky.radiance)(positions, directions)


def seen(scene, solver, positions, directions, dtype=float):
    """What one sees along rays, always so many that tests share compilations."""
    sky = solve(scene, solver, jnp.asarray(NM, dtype))
    rays = [jnp.asarray(np.resize(x, (12, 3)), dtype) for x in (positions, directions)]
    return np.asarray(look(sky, *rays), float)[: len(positions)]


def rays_at(middle, size):
    """From all around towards somewhere near the middle; the last from within it."""
    start = rng.normal(size=(12, 3))
    start = middle + 4.0 * size * start / np.linalg.norm(start, axis=1)[:, None]
    start[:, 2] = np.abs(start[:, 2])
    start[-3:] = middle + rng.uniform(-0.3, 0.3, (3, 3)) * size
    aim = middle + rng.uniform(-0.4, 0.4, (12, 3)) * size - start
    return start, aim / np.linalg.norm(aim, axis=1)[:, None]


RAYS = rays_at(0.5 * (LOWER + UPPER), 2.0)
BOX = Medium(
    Box(LOWER, UPPER),
    scattering=PowerLaw(0.8, -1.0),
    absorption=0.3,
    phase=HenyeyGreenstein(0.4),
)
MARCH = RayMarching(Fixed(400), ShadowRays(8))
SLANT = np.array([0.48, 0.36, 0.8])


def crossing(position, direction):
    """Where a ray enters and leaves the box."""
    ends = np.sort([(LOWER - position) / direction, (UPPER - position) / direction], 0)
    enter = max(ends[0].max(), 0.0)
    return enter, max(ends[1].min(), enter)


def due_in_box(position, direction, count=200_000, g=0.4):
    """Light that turned once in it, by the exact lengths to the sun; by midpoints."""
    enter, leave = crossing(position, direction)
    s = enter + (leave - enter) * (np.arange(count) + 0.5) / count
    places = position + s[:, None] * direction
    to_sun = np.min(np.where(SLANT > 0, (UPPER - places) / SLANT, np.inf), 1)
    scattering = 0.8 * 550.0 / NM
    passed = (s - enter + to_sun)[:, None] * (scattering + 0.3)
    cosine = direction @ SLANT
    lobe = (1 - g * g) / (4 * np.pi * (1 + g * g - 2 * g * cosine) ** 1.5)
    return 2.0 * lobe * scattering * np.mean(np.exp(-passed), 0) * (leave - enter)


def test_light_in_a_homogeneous_box_is_its_closed_form():
    found = seen(scene(BOX, sun=SLANT), MARCH, *RAYS)
    due = np.array([due_in_box(*x) for x in zip(*RAYS, strict=True)])
    np.testing.assert_allclose(found, due, rtol=3e-5)
    # With the sun straight above a level ray, whatever the steps.
    start, along = np.array([[-3.0, 0.2, 1.5]]), np.array([[1.0, 0.0, 0.0]])
    found = seen(scene(BOX), MARCH, start, along)[0]
    scattering = 0.8 * 550.0 / NM
    k = scattering + 0.3
    lobe = (1 - 0.16) / (4 * np.pi * (1 + 0.16) ** 1.5)
    due = 2.0 * lobe * scattering * np.exp(-1.5 * k) * -np.expm1(-2.0 * k) / k
    np.testing.assert_allclose(found, due, rtol=1e-12)


@pytest.mark.parametrize("g", [-0.999, 0.999])
def test_it_is_so_within_smoke_and_however_sharp_its_lobe_is(g):
    # Towards the sun, away from it, near both, and aside.
    smoke = dataclasses.replace(BOX, phase=HenyeyGreenstein(g))
    inside = rng.uniform(0.8 * LOWER + 0.2 * UPPER, 0.2 * LOWER + 0.8 * UPPER, (5, 3))
    aim = np.stack([SLANT, -SLANT, SLANT + 0.01 * ABOVE, 0.01 * ABOVE - SLANT, ABOVE])
    aim = (aim + 1e-9) / np.linalg.norm(aim + 1e-9, axis=1)[:, None]
    found = seen(scene(smoke, sun=SLANT), MARCH, inside, aim)
    due = np.array([due_in_box(*x, 20_000, g) for x in zip(inside, aim, strict=True)])
    np.testing.assert_allclose(found, due, rtol=1e-4)
    assert np.max(due) > 1e6 * np.min(due)


def test_a_box_looks_alike_however_it_is_said():
    # As a grid, as noise that fills it, as a turned unit box; and a third of each.
    size = UPPER - LOWER
    alike = [
        Grid(np.ones((3, 4, 2)), LOWER, UPPER),
        Product(Box(LOWER, UPPER), Noise(0.3, level=-2.0, octaves=2)),
        Transformed(Box(0.0 * ABOVE, np.ones(3)), np.diag(size)[[1, 0, 2]], LOWER),
    ]
    due = seen(scene(BOX, sun=SLANT, ground=0.5), MARCH, *RAYS)
    for shares in (*np.eye(3), np.ones(3) / 3.0):
        media = [
            Medium(x, PowerLaw(0.8 * a, -1.0), 0.3 * a, HenyeyGreenstein(0.4))
            for x, a in zip(alike, shares, strict=True)
        ]
        found = seen(scene(*media, sun=SLANT, ground=0.5), MARCH, *RAYS)
        np.testing.assert_allclose(found, due, rtol=1e-9)


def warm(absorption, kelvin=1500.0):
    hot = Thermal(Grid(np.full((2, 2, 2), kelvin), LOWER, UPPER))
    return Medium(Box(LOWER, UPPER), absorption=absorption, emission=hot)


def test_a_warm_slab_tends_to_planck_as_it_thickens():
    lengths = np.array([np.diff(crossing(*x))[0] for x in zip(*RAYS, strict=True)])
    black = np.asarray(planck(jnp.asarray(NM), jnp.asarray(1500.0)))
    for absorption in (0.1, 2.0, 1e4):
        found = seen(scene(warm(absorption), lit=False), MARCH, *RAYS)
        due = -np.expm1(-absorption * lengths)[:, None] * black
        np.testing.assert_allclose(found, due, rtol=1e-9)
    np.testing.assert_allclose(found, np.broadcast_to(black, found.shape), rtol=1e-9)
    # What glows without absorbing adds up along the ray, whatever it is.
    glow = Medium(Box(LOWER, UPPER), emission=Glow(PowerLaw(0.2, 1.0)))
    found = seen(scene(glow, lit=False), MARCH, *RAYS)
    np.testing.assert_allclose(found, lengths[:, None] * 0.2 * NM / 550.0, rtol=1e-9)


def test_a_solver_that_does_not_look_for_it_refuses_what_shines():
    for solver in (SingleScattering(), PathTracing()):
        with pytest.raises(
            ValueError, match=r"`scene.media\[0\].emission` must be None"
        ):
            solve(scene(warm(1.0)), solver, NM)


puff = Puff(np.array([0.0, 0.0, 2.0]), 0.6, 0.5, octaves=2)
PUFF = dataclasses.replace(BOX, profile=puff, scattering=PowerLaw(6.0, -1.0))
TRUTH = RayMarching(Fixed(2000), ShadowRays(32))


@eqx.filter_jit
def look_twice(sky, positions, directions):
    """What one sees, and how far that is off: of one march, to compile it but once."""
    more = sky.prepared, sky.scene, sky.scene.lights[0], sky.wavelength

    def one(*look):
        ray, found = sky.solver._lit(*more, *look)
        return ray.radiance(found), sky.solver.error(*more, *look)

    return jax.vmap(one)(positions, directions)


def test_adaptive_steps_keep_their_error_below_the_tolerance():
    exact = seen(scene(PUFF, sun=SLANT), TRUTH, *RAYS)
    rays = [jnp.asarray(x) for x in RAYS]
    for tolerance in (3e-2, 1e-3):
        solver = RayMarching(Adaptive(tolerance, 48), ShadowRays(32))
        sky = solve(scene(PUFF, sun=SLANT), solver, NM)
        found, says = (np.asarray(x) for x in look_twice(sky, *rays))
        error = np.abs(found - exact)
        assert np.all(says <= 1.01 * tolerance * found)
        assert np.all(error <= tolerance * exact + 1e-6 * exact.max())
        assert np.sum(error) < np.sum(says)


def test_jitter_is_noise_about_the_mean():
    solver = RayMarching(Jittered(16), ShadowRays(32))
    key = lambda i: eqx.tree_at(lambda x: x.steps.key, solver, jax.random.key(i))
    many = np.array([seen(scene(PUFF, sun=SLANT), key(i), *RAYS) for i in range(60)])
    due = seen(scene(PUFF, sun=SLANT), TRUTH, *RAYS)
    spread = np.std(many, 0)
    assert np.all((spread > 0.0) == (due > 0.0))
    # In each step light is dimmed as if all of it were like one place, which is not
    # quite what it does on average.
    off = np.abs(np.mean(many, 0) - due)
    assert np.all(off <= 4.0 * spread / np.sqrt(len(many)) + 0.02 * due)


def test_a_cache_of_shadows_serves_all_places_and_lights():
    world = cloud(rng.uniform(0.0, 3.0, (4, 4, 4)))
    haze = Medium(Exponential(20.0), scattering=0.01, phase=Rayleigh())
    lights = *world.lights, Sun(np.array([-0.6, 0.0, 0.8]), 1.0, 0.0)
    media = haze, *world.media
    world = dataclasses.replace(world, media=media, lights=lights, ground=0.4)
    found, due = (
        seen(world, RayMarching(Fixed(60), x), *RAYS)
        for x in (ShadowCache(24, 8), ShadowRays(8))
    )
    # Only the edges of shadows are blurred.
    off = np.abs(found / due - 1.0)
    assert np.mean(off) < 0.01 and np.max(off) < 0.1


def test_a_cache_of_shadows_keeps_amounts_and_not_what_arrives():
    """So that between its nodes a deep shadow is as exact as a faint one."""
    away = np.linspace(-1.0, 1.0, 33) ** 2
    values = np.exp(-4.0 * (away[:, None, None] + away[:, None] + away))
    thick = Medium(Grid(values, LOWER, UPPER), 10.0)
    world = scene(thick, sun=SLANT)
    places = jnp.asarray(rng.uniform(LOWER, UPPER, (20_000, 3)))
    arrives = []
    for shadows in (ShadowCache(), ShadowRays()):
        found = shadows.towards(shadows.prepare(world), world, world.lights[0])
        at = jax.jit(lambda x, found=found: found(world.geometry.locate(x))[0])
        arrives.append(
            np.exp(-10.0 * np.asarray(jax.lax.map(at, places, batch_size=4096)))
        )
    off = np.abs(arrives[0] / arrives[1] - 1.0)
    assert arrives[1].min() < 1e-3
    assert np.percentile(off, 99.0) < 0.02 and np.median(off) < 0.005


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_cache_of_shadows_of_a_box_is_how_deep_one_is_in_it(axis, sign):
    places = rng.uniform(LOWER, UPPER, (400, 3))
    for slant, allowed in ((0.0, 1e-12), (0.3, 0.02)):
        towards = np.full(3, slant)
        towards[axis] = sign
        towards = towards / np.linalg.norm(towards)
        world = scene(Medium(Box(LOWER, UPPER), 1.0), sun=towards)
        cache = ShadowCache(40)
        ahead = cache.towards(cache.prepare(world), world, world.lights[0])
        look = jax.jit(jax.vmap(lambda x, ahead=ahead: ahead(Flat().locate(x))[0]))
        walls = np.where(towards > 0.0, UPPER, LOWER) - places
        with np.errstate(divide="ignore", invalid="ignore"):
            due = np.min(np.where(towards == 0.0, np.inf, walls / towards), 1)
        off = np.abs(np.asarray(look(jnp.asarray(places))) - due)
        assert np.mean(off) < allowed
        # A light behind all of it has nothing before it.
        beyond = jnp.asarray(places + 10.0 * towards)
        assert np.all(np.asarray(look(beyond)) == 0.0)


def test_layered_air_is_that_of_single_scattering():
    air = Medium(Exponential(8e3), PowerLaw(1.2e-5, -4.0), phase=Rayleigh())
    dust = Medium(Exponential(1.2e3), 2e-5, 5e-6, HenyeyGreenstein(0.7))
    zeniths = np.radians([0.0, 40.0, 80.0, 89.0, 91.0, 120.0, 20, 60, 85, 88, 95, 179])
    views = np.stack([np.sin(zeniths), 0 * zeniths, np.cos(zeniths)], 1)
    starts = np.broadcast_to([0.0, 0.0, 10.0], views.shape)
    for elevation in (40.0, -3.0):
        sun = [np.cos(np.radians(elevation)), 0.0, np.sin(np.radians(elevation))]
        world = Scene(
            Spherical(6371e3), 80e3, (air, dust), (Sun(np.array(sun), 1.0, 0.0),), 0.2
        )
        due = seen(world, SingleScattering(), starts, views)
        found = seen(world, RayMarching(Fixed(300), ShadowRays(8)), starts, views)
        np.testing.assert_allclose(found, due, rtol=2e-3, atol=1e-3 * due.max())


@jax.jit
@ft.partial(jax.value_and_grad, argnums=(0, 1, 2, 3, 4))
def radiance(values, scattering, absorption, g, emission):
    medium = Medium(
        Grid(values, LOWER, UPPER),
        scattering=scattering,
        absorption=absorption,
        phase=HenyeyGreenstein(g),
        emission=Glow(emission),
    )
    solver = RayMarching(Fixed(30), ShadowRays(8))
    sky = solve(scene(medium, sun=SLANT), solver, jnp.asarray(NM))
    return jnp.sum(sky.radiance(*(jnp.asarray(x[0]) for x in RAYS)))


def test_gradients_are_those_of_differences():
    values = rng.uniform(0.5, 1.5, (3, 3, 3))
    at = [jnp.asarray(x, float) for x in (values, 0.8, 0.3, 0.4, 0.2)]
    _, slopes = radiance(*at)
    for i, slope in enumerate(slopes):
        step = np.zeros(slope.shape)
        step[(1,) * slope.ndim] = 1e-5
        ends = [
            radiance(*at[:i], at[i] + sign * jnp.asarray(step), *at[i + 1 :])[0]
            for sign in (1, -1)
        ]
        difference = float(ends[0] - ends[1]) / 2e-5
        assert slope[(1,) * slope.ndim] == pytest.approx(difference, rel=1e-5)


def cloud(values, size=1.0):
    grid = Grid(values, LOWER * size, UPPER * size)
    medium = Medium(grid, 0.8 / size, 0.3 / size, HenyeyGreenstein(0.4))
    return Scene(Flat(), 10.0 * size, (medium,), (Sun(SLANT, 2.0, 0.0),), 0.0)


def test_an_empty_grid_is_dark():
    assert np.all(seen(cloud(np.zeros((4, 4, 4))), MARCH, *RAYS) == 0.0)


def test_what_is_empty_can_be_skipped():
    values = np.zeros((4, 4, 4))
    values[0, 2:, 1:3], values[3, 0, 2] = rng.uniform(0.0, 4.0, (2, 2)), 2.0
    world = cloud(values)
    due = seen(world, MARCH, *RAYS)
    sky = solve(world, RayMarching(Skipping(400, 16), ShadowRays(8)), NM)
    rays = [jnp.asarray(x) for x in RAYS]
    full = eqx.tree_at(lambda x: x.prepared[0].bounds, sky, replace_fn=jnp.ones_like)
    skips, takes = (np.asarray(look(x, *rays)) for x in (sky, full))
    assert np.min(sky.prepared[0].bounds) < -1.0
    np.testing.assert_allclose(skips, takes, rtol=1e-12)
    np.testing.assert_allclose(skips, due, rtol=2e-3, atol=1e-4 * due.max())
    air = scene(Medium(Exponential(8e3), 1e-5))
    with pytest.raises(ValueError, match=r"`scene.media\[0\].profile` must lie in a"):
        solve(air, RayMarching(Skipping()), NM)


def test_a_cell_ten_thousand_times_denser_hides_what_is_behind():
    values = np.ones((4, 4, 4))
    values[2, 2, 2] = 1e4
    found = seen(cloud(values), MARCH, *RAYS)
    # No brighter than white that receives all of the sun's light, in its lobe.
    lobe = (1 - 0.16) / (4 * np.pi * (1 - 0.4) ** 3)
    assert np.all(np.isfinite(found) & (found >= 0.0) & (found <= 2.0 * lobe))


def test_the_same_cloud_looks_alike_in_any_size():
    values = rng.uniform(0.0, 1.0, (4, 4, 4))
    due = seen(cloud(values), MARCH, *RAYS)
    for size in (1e-3, 1.0, 6.4e6):
        rays = RAYS[0] * size, RAYS[1]
        found = seen(cloud(values, size), MARCH, *rays, jnp.float32)
        np.testing.assert_allclose(found, due, rtol=2e-4)


def test_a_picture_of_it_is_made_of_rays():
    sky = solve(scene(BOX, sun=SLANT), MARCH, NM)
    assert not sky.has_panorama
    camera = Perspective(np.array([0.5, -6.0, 1.0]), 0.0, 0.2, 0.6, 3, 4)
    told = []
    picture = render(sky, camera, progress=told.append)
    assert picture.shape == (3, 4, 2) and told == [1.0]
    places = [jnp.asarray([x + 0.5, y + 0.5]) for y in range(3) for x in range(4)]
    directions = jnp.stack([camera.direction(*x) for x in places])
    due = look(sky, jnp.stack([camera.position] * 12), directions)
    assert np.mean(due > 0.0) > 0.5
    np.testing.assert_allclose(picture.reshape(12, 2), due, rtol=1e-12)


def test_grey_media_cast_grey_shadows_in_pictures_of_many_rays():
    # As a sum over an axis, what two media take away came out right in a batch of 256
    # rays, and in one of 2048 for the first wavelength alone.
    grey = [
        Medium(Grid(np.ones((2, 2, 2)), LOWER * a, UPPER * a), 0.3, 0.3)
        for a in (0.9, 1.0)
    ]
    world = scene(*grey, sun=SLANT, ground=0.5)
    nm = jnp.linspace(400.0, 700.0, 7, dtype=jnp.float32)
    sky = solve(world, RayMarching(Fixed(12), ShadowRays(4)), nm)
    camera = Perspective(np.array([0.5, -6.0, 3.0]), 0.0, -0.4, 1.2, 64, 64)
    picture = np.asarray(render(sky, camera), float)
    assert np.std(picture[..., 0]) > 0.1 * np.mean(picture[..., 0])
    np.testing.assert_allclose(picture, picture[..., :1] + 0 * picture, rtol=1e-5)


DENSE, TURN = decades(1e-9, 1e6, 0.0), within(0.0, 1.0)
UPWARDS = within(-1.0, 1.0, 0.0)


@drawn(40)
@given(DENSE, DENSE, within(-0.99, 0.99), UPWARDS, TURN)
def test_random_boxes_are_bright(scattering, absorption, g, up, ground):
    """The box of the closed form, however thick, under a sun however low."""
    coefficients = PowerLaw(scattering, -1.0), absorption
    box = Medium(BOX.profile, *coefficients, HenyeyGreenstein(g))
    sun = np.array([np.sqrt(1.0 - up * up), 0.0, up])
    found = seen(scene(box, sun=sun, ground=ground), MARCH, *RAYS)
    assert np.all(np.isfinite(found) & (found >= 0.0))


@drawn(200)
@given(DENSE, DENSE, within(-0.99, 0.99, 0.0), DENSE, st.integers(0, 2**27 - 1))
def test_random_grids_have_slopes(scattering, absorption, g, emission, full):
    """However thick, with any of its 27 nodes empty."""
    values = (full >> np.arange(27) & 1).reshape(3, 3, 3)
    numbers = (values, scattering, absorption, g, emission)
    value, slopes = radiance(*(jnp.asarray(x, float) for x in numbers))
    assert np.isfinite(value) and value >= 0.0
    assert all(np.all(np.isfinite(x)) for x in slopes)
