"""Orders of scattering that share one field: its laws, and against all orders."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hostile import decades, drawn, within
from hypothesis import given

from atmos.geometry import Flat, Spherical
from atmos.light import Sun
from atmos.medium import Ball, Exponential, Medium, Uniform
from atmos.optics import mixture
from atmos.phase import HenyeyGreenstein, Rayleigh
from atmos.scene import Scene
from atmos.sky import fine_enough
from atmos.solver import Columns, Shared, SingleScattering, solve
from atmos.solver._second import turns
from atmos.spectrum import Constant, Tabulated


NM = np.array([500.0])
DEEP = 1000.0
SHARED = Shared(layers=8)
ONCE = SingleScattering()


def sun(cosine, irradiance=1.0):
    level = jnp.sqrt(1.0 - cosine**2)
    return Sun(jnp.stack([level, 0.0 * cosine, cosine]), irradiance, 0.0)


def slab(air, haze, g, albedo, cosine, ground):
    """Two media in each other's place, of so much optical depth."""
    fills, both = Uniform(0.0, DEEP), []
    for depth, phase in ((air, Rayleigh()), (haze, HenyeyGreenstein(g))):
        scattered, absorbed = depth * albedo / DEEP, depth * (1.0 - albedo) / DEEP
        both.append(Medium(fills, scattered, absorbed, phase))
    return Scene(Flat(), DEEP, tuple(both), (sun(cosine),), ground)


COSINES = np.array([-1.0, -0.7, -0.3, -0.1, 0.1, 0.3, 0.7, 1.0])
AZIMUTHS = np.array([0.3, 1.1, 2.0, 3.0])
LEVEL = np.sqrt(1.0 - COSINES**2)[:, None]
VIEWS = np.stack(
    [
        LEVEL * np.cos(AZIMUTHS),
        LEVEL * np.sin(AZIMUTHS),
        COSINES[:, None] + 0.0 * AZIMUTHS,
    ],
    -1,
).reshape(-1, 3)
UP, DOWN = VIEWS[:, 2] > 0.0, VIEWS[:, 2] < 0.0


@eqx.filter_jit
def looks(scene, solver, dtype=float):
    """From the ground and from the top, in every direction."""
    sky = solve(scene, solver, jnp.asarray(NM, dtype))
    at = jnp.array([[0.0, 0.0, 0.0], [0.0, 0.0, DEEP]], dtype)
    see = jax.vmap(jax.vmap(sky.radiance, (None, 0)), (0, None))
    return see(at, jnp.asarray(VIEWS, dtype))[..., 0]


def numbers(air=0.0, haze=0.0, g=0.0, albedo=1.0, cosine=0.87, ground=0.0):
    return jnp.array([air, haze, g, albedo, cosine, ground])


def away(found, due):
    """Relative differences of what one sees, but for the ground and the black sky."""
    off = found / due - 1.0
    return np.concatenate([off[0][UP], off[1][DOWN]])


def test_without_air_one_sees_the_ground_in_the_sun():
    seen = looks(slab(*numbers(0.0, cosine=0.6, ground=0.5)), SHARED)
    due = np.where(DOWN, 0.5 / np.pi * 0.6, 0.0)
    np.testing.assert_allclose(seen, np.stack([due, due]), rtol=1e-12)


@pytest.mark.parametrize("depth", [1e-4, 1e-6])
def test_thin_media_scatter_once(depth):
    scene = slab(*numbers(depth, 2.0 * depth, 0.7))
    off = away(looks(scene, SHARED), looks(scene, ONCE))
    assert 0.0 < np.max(off) < 30.0 * depth


@pytest.mark.parametrize("depth", [0.01, 0.1, 1.0, 10.0])
def test_a_white_medium_turns_just_the_light_that_it_does_not_let_through(depth):
    scene, nm = slab(*numbers(depth)), jnp.asarray(NM)
    altitude, zeniths = jnp.linspace(0.0, DEEP, 5), jnp.array([0.0, 1.0])
    mixed, black = mixture(scene, nm, 1), jnp.zeros(1)
    found = eqx.filter_jit(turns)(scene, mixed, black, altitude, zeniths)
    way = np.where(found.cosine > 0.0, DEEP - altitude[:, None], altitude[:, None])
    passed = np.exp(-depth * way / DEEP / np.abs(found.cosine))
    np.testing.assert_allclose(found.again[..., 0], 1.0 - passed, atol=1e-12)
    np.testing.assert_allclose(jnp.sum(found.weight, 1), 1.0, rtol=1e-12)
    share = found.mean(found.again)
    assert jnp.all((share > 0.0) & (share < 1.0))


def test_of_what_absorbs_less_comes_back():
    def more(albedo):
        scene = slab(*numbers(0.5, 0.3, albedo=albedo))
        return looks(scene, SHARED)[0][UP] / looks(scene, ONCE)[0][UP]

    assert np.all((more(0.4) > 1.0) & (more(0.4) < more(0.8)))


@pytest.mark.parametrize(
    "scene, mean, most",
    [
        (numbers(0.1), 0.01, 0.025),
        (numbers(0.3, cosine=0.3), 0.03, 0.05),
        (numbers(0.3, ground=0.8), 0.03, 0.05),
        (numbers(1.0), 0.055, 0.17),
        (numbers(0.1, 0.1, 0.7, ground=0.2), 0.03, 0.06),
        (numbers(0.1, 0.4, 0.7, 0.9, ground=0.2), 0.06, 0.17),
        # A low sun in haze: nearly all comes from ahead, and it does not know of that.
        (numbers(0.1, 0.5, 0.76, 0.95, cosine=0.087, ground=0.2), 0.3, 2.4),
    ],
)
def test_slabs_are_nearly_as_bright_as_by_discrete_ordinates(scene, mean, most):
    scene = slab(*scene)
    off = np.abs(away(looks(scene, SHARED), looks(scene, Columns(layers=12))))
    assert off.mean() < mean and off.max() < most


def test_twice_the_sun_is_twice_the_light():
    scene = slab(*numbers(0.3, 0.3, 0.7, 0.9, ground=0.3))
    double = eqx.tree_at(lambda x: x.lights, scene, (sun(jnp.array(0.87), 2.0),))
    twice = 2.0 * looks(scene, SHARED)
    np.testing.assert_allclose(looks(double, SHARED), twice, rtol=1e-12)


def planet(depth, g, ground):
    """A round world whose air is of so much optical depth."""
    air = Medium(Exponential(8e3), depth / 8e3, 1e-6, HenyeyGreenstein(g))
    return Scene(Spherical(6.4e6), 1e5, (air,), (), ground)


@eqx.filter_jit
def total(x):
    field = solve(planet(*x), SHARED, NM).prepared.field
    return jnp.sum(field.moments) + jnp.sum(field.down)


slopes = eqx.filter_jit(jax.grad(total))


def test_gradients_agree_with_differences():
    start = jnp.array([0.4, 0.5, 0.3])
    slope = slopes(start)
    for i, step in enumerate(1e-5 * np.eye(3)):
        due = (total(start + step) - total(start - step)) / 2e-5
        assert abs(slope[i] / due - 1.0) < 1e-5, i


@pytest.mark.parametrize("cosine", [1.0, 0.5, 0.05])
def test_single_precision_agrees_with_double(cosine):
    scene = slab(*numbers(0.2, 0.3, 0.7, 0.95, cosine, 0.3))
    found, due = looks(scene, SHARED, jnp.float32), looks(scene, SHARED)
    assert found.dtype == jnp.float32
    np.testing.assert_allclose(found, due, rtol=1e-4, atol=1e-6 * due.max())


def test_twilight_fades_and_never_falls_below_nothing():
    field = solve(planet(*jnp.array([0.1, 0.0, 0.2])), SHARED, NM).prepared.field
    light, zeniths = field.moments[:, 0, :, 0].T, np.degrees(field.suns.zeniths())
    assert jnp.all(jnp.isfinite(light) & (light >= 0.0))
    sinks = zeniths > 80.0
    assert np.all(np.diff(light[:, 0])[sinks[1:]] <= 0.0)
    # Twice the dip of the horizon from the top, beyond which nothing is seen lit.
    assert zeniths[-1] == pytest.approx(90.0 + 2.0 * np.degrees(np.arccos(64 / 65)))
    assert light[-1, 0] < 1e-15 * light[0, 0]


def test_what_is_too_thick_is_refused():
    solve(slab(*numbers(0.99)), SHARED, NM)
    # Without a peak of half of it, and where most absorbs, there is less to turn.
    solve(slab(*numbers(haze=1.9, g=math.sqrt(0.5))), SHARED, NM)
    solve(slab(*numbers(9.0, albedo=0.1)), SHARED, NM)
    thick = slab(*numbers(1.02))
    with pytest.raises(ValueError, match="scene.media. must not scatter .* got 1.02"):
        solve(thick, SHARED, NM)
    with pytest.raises(RuntimeError, match="scene.media. must not scatter"):
        jax.block_until_ready(looks(thick, SHARED))


def test_media_that_change_sideways_are_refused():
    ball = Medium(Ball(np.array([0.0, 0.0, 1.0]), 1.0), 1.0)
    scene = eqx.tree_at(lambda x: x.media, slab(*numbers(0.1)), (ball,))
    with pytest.raises(ValueError, match="media.0..profile. must depend on altitude"):
        solve(scene, SHARED, NM)


DEPTH, SHARE = decades(1e-12, 3.0, 0.0), within(0.0, 1.0)
LOBE = within(-0.99, 0.99, 0.0)


@drawn(300)
@given(DEPTH, DEPTH, LOBE, SHARE, within(1e-3, 1.0), SHARE)
def test_random_skies_are_bright_or_refused(air, haze, g, albedo, cosine, ground):
    try:
        scene = slab(*numbers(air, haze, g, albedo, cosine, ground))
        seen = np.asarray(looks(scene, SHARED))
    except RuntimeError as refused:
        assert "must not scatter more than an optical depth of 1" in str(refused)
        return
    # Where next to nothing is left between layers, cubics swing below it.
    assert np.all(np.isfinite(seen) & (seen >= -1e-4 * seen.max()))


@drawn(100)
@given(decades(1e-12, 1.0, 0.0), LOBE, SHARE)
def test_random_skies_have_slopes(depth, g, ground):
    try:
        found = slopes(jnp.array([depth, g, ground]))
    except RuntimeError as refused:
        assert "must not scatter more than an optical depth of 1" in str(refused)
        return
    assert np.all(np.isfinite(found))


@pytest.mark.parametrize("solver", [SHARED, ONCE])
def test_where_some_numbers_are_traced_a_panorama_is_no_finer(solver):
    ground = Tabulated(np.array([400.0, 600.0]), np.array([0.1, 0.3]))
    here, zenith = jnp.array([0.0, 0.0, 2.0]), math.radians(60.0)

    air = Medium(Exponential(8e3), 0.0, 0.0, Rayleigh())
    light = Sun.at(zenith, 0.0, Constant(1.0))
    scene = Scene(Spherical(6.371e6), 1e5, (air,), (light,), ground)

    def table(amount):
        bright = eqx.tree_at(lambda x: x.media[0].scattering.value, scene, amount)
        return solve(bright, solver, NM).panorama(here).table

    rings = fine_enough(2.0, zenith, solver.around)
    expected = 1, rings.above + rings.below, rings.around, 2, NM.size
    assert jax.eval_shape(table, jnp.array(1e-5)).shape == expected
