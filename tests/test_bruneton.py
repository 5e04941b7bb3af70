"""Light in tables, order by order: its laws, and against discrete ordinates."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hostile import decades, drawn, rows, within
from hypothesis import given

from atmos.geometry import Spherical
from atmos.light import Sun
from atmos.medium import Ball, Exponential, Medium
from atmos.phase import HenyeyGreenstein, Rayleigh
from atmos.scene import Scene
from atmos.solver import Bruneton, SingleScattering, solve
from atmos.solver._sight import sight


NM = np.array([500.0])
TOP, RADIUS = 6e4, 6.4e6
# One set of sizes for all tests, so that they share a compilation.
TABLES = Bruneton(layers=16, views=10, azimuths=6, suns=20, degrees=6, steps=14)


def sun(zenith):
    level, zero = jnp.sin(zenith), jnp.zeros_like(zenith)
    return Sun(jnp.stack([zero, level, jnp.cos(zenith)]), jnp.ones_like(zenith), 0.0)


def numbers(depth=0.2, haze=0.1, white=0.9, ground=0.3, radius=RADIUS, g=0.5):
    """Molecules and a haze, the optical depths of which are those straight up."""
    air, low = 8e3, 1.5e3
    thick = lambda height: height * (1.0 - math.exp(-TOP / height))
    x = [jnp.array(x) for x in (depth / thick(air), haze / thick(low), white, ground)]
    rayleigh, haze, white, ground = x
    both = (
        Medium(Exponential(air), rayleigh, 0.0 * rayleigh, Rayleigh()),
        Medium(
            Exponential(low),
            white * haze,
            (1.0 - white) * haze,
            HenyeyGreenstein(jnp.array(g)),
        ),
    )
    world = Spherical(jnp.array(radius))
    return Scene(world, TOP, both, (sun(jnp.array(1.0)),), ground)


def tables(scene):
    return solve(scene, TABLES, NM)


@eqx.filter_jit
def see(sky, zenith, views, altitude):
    """What one sees from above the origin, by a sun of this zenith angle."""
    at = jnp.zeros_like(views[0]).at[2].set(altitude)
    lit = eqx.tree_at(lambda x: x.scene.lights, sky, (sun(zenith),))
    return jax.vmap(lambda view: lit.radiance(at, view)[0])(views)


def seen(sky, zenith, views, altitude):
    return np.asarray(see(sky, jnp.array(zenith), views, jnp.array(altitude)))


@jax.jit
def look_up(sky, views, at, slope):
    """What the tables tell at a sun's zenith angle and an altitude, and its slope."""
    field, scene = sky.prepared.field, sky.scene

    def look(at):
        eye, light = jnp.zeros(3).at[2].set(at[1]), sun(at[0])

        def one(view):
            line = sight(scene, eye, view, field.mixture.extinction, 4)
            towards = scene, light, light.direction[None], sky.wavelength
            unknown = jnp.zeros((1, len(scene.media) + 1, sky.wavelength.size))
            return field.gather(*towards, line, unknown, nodes=0)[0, 0, 0]

        return jax.vmap(one)(views)

    return jax.jvp(look, (at,), (slope,))


def directions(*zeniths):
    zenith, azimuth = np.meshgrid(zeniths, [0.4, 2.8], indexing="ij")
    level = np.sin(zenith)
    found = level * np.sin(azimuth), level * np.cos(azimuth), np.cos(zenith)
    return jnp.asarray(np.stack(found, -1).reshape(-1, 3))


UPWARDS = directions(0.0, 0.6, 1.2, 1.5)
DOWNWARDS = directions(math.pi, 2.4, 2.0, 1.9)
DAY = np.array([0.5, 1.2])
EYE = 2.0


def test_without_air_one_sees_the_ground_in_the_sun():
    sky = tables(numbers(depth=0.0, haze=0.0))
    for zenith in DAY:
        found = seen(sky, zenith, DOWNWARDS, EYE)
        np.testing.assert_allclose(found, 0.3 / math.pi * math.cos(zenith), rtol=1e-4)


def test_what_only_absorbs_is_black():
    sky = tables(numbers(depth=0.0, haze=1.0, white=0.0, ground=0.0))
    assert np.all(seen(sky, DAY[0], UPWARDS, EYE) == 0.0)


def test_thin_air_scatters_once():
    more = []
    for thin in (1e-3, 1e-5):
        scene = numbers(depth=thin, haze=thin, ground=0.0)
        once = seen(solve(scene, SingleScattering(), NM), DAY[1], UPWARDS, EYE)
        more.append(seen(tables(scene), DAY[1], UPWARDS, EYE) / once - 1.0)
    assert np.all((more[0] > 0.0) & (more[0] < 0.1))
    np.testing.assert_allclose(more[1], 1e-2 * more[0], rtol=0.1, atol=1e-7)


# Cosine of the view, azimuth from the sun's, and radiance by PythonicDISORT 1.8 with 64
# streams: depth 1, albedo 0.9, g 0.5, a ground of 0.3, the sun 60 degrees from the
# zenith. From the ground, and from the top.
FROM_GROUND = [(0.9, 0.0898493, 0.0379777), (0.5, 0.1877059, 0.0405185)]
FROM_TOP = [(-0.9, 0.0544224, 0.0423350), (-0.5, 0.1024572, 0.0458843)]


@pytest.mark.parametrize("altitude, cases", [(0.0, FROM_GROUND), (TOP, FROM_TOP)])
def test_a_huge_planet_is_as_bright_as_flat_by_discrete_ordinates(altitude, cases):
    huge = numbers(depth=0.0, haze=1.0, radius=1e3 * RADIUS)
    rise = np.repeat([x[0] for x in cases], 2)
    level = np.sqrt(1.0 - rise * rise) * np.tile([1.0, -1.0], len(cases))
    views = np.resize(np.stack([0.0 * rise, level, rise], -1), UPWARDS.shape)
    found = seen(tables(huge), math.acos(0.5), jnp.asarray(views), altitude)
    due = np.concatenate([x[1:] for x in cases])
    np.testing.assert_allclose(found[: len(due)], due, rtol=1.2e-2)


@eqx.filter_jit
def flux(sky, zenith, altitude):
    """What comes down through a level plane, and what goes up."""
    place = jnp.zeros(3).at[2].set(altitude)
    world = sky.prepared, sky.scene, sun(zenith), sky.wavelength
    found = sky.solver.fluxes(*world, place)
    return (found.diffuse + found.direct)[0], found.up[0]


def test_fluxes_of_a_slab_are_van_de_hulst_s():
    """Multiple Light Scattering (1980), table 35: depth 1, g 0.5, the sun overhead."""
    sky = tables(numbers(depth=0.0, haze=1.0, ground=0.0, radius=1e3 * RADIUS))
    down, _ = flux(sky, jnp.array(0.0), jnp.array(0.0))
    assert float(down) == pytest.approx(0.73909, rel=4e-3)


def test_what_is_not_absorbed_leaves():
    """White air over white ground: as much comes down as goes up, at every height."""
    sky = tables(numbers(depth=0.3, haze=0.0, ground=1.0, radius=1e3 * RADIUS))
    for altitude in (0.0, 5e3, TOP):
        down, up = flux(sky, jnp.array(DAY[0]), jnp.array(altitude))
        assert abs(down - up) < 5e-3 * math.cos(DAY[0])


def test_night_falls_smoothly():
    sky = tables(numbers())
    found = np.stack([seen(sky, x, UPWARDS, EYE) for x in DUSK])
    assert np.all(np.diff(np.log(found), axis=0) < 0.0)
    assert found[0].min() / found[-1].max() > 1e5


DUSK = np.deg2rad(np.arange(88.0, 108.1, 1.0))


def test_single_precision_agrees_with_double():
    """Down to where the sun is 6 degrees below the horizon."""
    scene = jax.tree.map(lambda x: x.astype(jnp.float32), numbers())
    both = solve(scene, TABLES, NM.astype(np.float32)), tables(numbers())
    fields = [x.prepared.field for x in both]
    bright = lambda x: np.exp(np.asarray(x.reference, float))[:, None, None, :, None]
    light = [np.asarray(x.seen) * bright(x) for x in fields]
    zenith = fields[1].suns.zeniths()
    dusk = np.asarray(zenith < np.deg2rad(96.0))
    one, other = (x[:, :, :, dusk] for x in light)
    most = other.max((1, 2), keepdims=True)
    assert np.max(np.abs(one - other) / (other + 1e-2 * most)) < 1e-2


@eqx.filter_jit
def _down(numbers_, slope):
    def down(x):
        field = solve(numbers(*x), TABLES, NM).prepared.field
        return jnp.sum(field.down[0]) + jnp.sum(field.up[-1])

    return jax.jvp(down, (numbers_,), (slope,))


def test_slopes_agree_with_differences():
    at = np.array([0.2, 0.1, 0.9, 0.3, RADIUS, 0.5])
    for i in (0, 2, 3):
        # Small, as now and then a line of sight is cut otherwise.
        step = 1e-5 * at[i] * np.eye(6)[i]
        _, slope = _down(jnp.asarray(at), jnp.asarray(step))
        more, less = (
            _down(jnp.asarray(at + x), jnp.zeros(6))[0] for x in (step, -step)
        )
        assert float(slope) == pytest.approx(0.5 * float(more - less), rel=1e-5)
    sky = tables(numbers())
    for step in ((1e-4, 0.0), (0.0, 0.1)):
        at = np.array([DAY[1], 1e3])
        look = lambda x, step: look_up(sky, UPWARDS, jnp.array(x), jnp.array(step))
        (more, _), (less, _) = (look(x, step) for x in (at + step, at - step))
        due = 0.5 * (more - less)
        np.testing.assert_allclose(look(at, step)[1], due, rtol=1e-2, atol=1e-9)


def test_what_is_not_layered_is_refused():
    ball = Medium(Ball(jnp.array([0.0, 0.0, 500.0]), 100.0), 1e-3, 0.0, Rayleigh())
    uneven = Scene(Spherical(RADIUS), TOP, (ball,), (), 0.3)
    with pytest.raises(ValueError, match="altitude alone"):
        solve(uneven, TABLES, NM)


def test_what_takes_more_orders_is_refused():
    """A white cloud of optical depth 30 would take thousands."""
    with pytest.raises(ValueError, match="`orders` must be enough .*; 6 leave"):
        solve(numbers(haze=30.0, white=1.0), TABLES, NM)


ANGLE = within(0.0, math.pi, 0.5 * math.pi, 0.5 * math.pi + 0.1)
THICK, SHARE = decades(1e-9, 3.0, 0.0), within(0.0, 1.0)
AIR = THICK, THICK, SHARE, SHARE, decades(1e6, 1e8, RADIUS), within(-0.9, 0.9, 0.0)
EYES = rows(3, ANGLE, decades(1e-3, 1e8, 0.0, TOP))


@drawn(6)
@given(*AIR, EYES)
def test_random_skies_are_bright_and_have_slopes_or_are_refused(
    depth, haze, white, ground, radius, g, eyes
):
    """One solution serves all suns and eyes."""
    given = depth, haze, white, ground, radius, g
    try:
        sky = tables(numbers(*given))
    except ValueError as refused:
        assert "`orders` must be enough" in str(refused)
        return
    for zenith, altitude in eyes:
        for views in (UPWARDS, DOWNWARDS):
            found = seen(sky, zenith, views, altitude)
            assert np.all(np.isfinite(found)), (zenith, altitude)
            assert np.all(found >= 0.0), (zenith, altitude, found)
            at = jnp.array([zenith, altitude])
            assert np.all(np.isfinite(look_up(sky, views, at, jnp.ones(2))))


@drawn(2)
@given(*AIR)
def test_random_airs_have_slopes(depth, haze, white, ground, radius, g):
    at = jnp.array([depth, haze, white, ground, radius, g])
    try:
        found = _down(at, jnp.ones(6))
    except RuntimeError as refused:
        assert "`orders` must be enough" in str(refused)
        return
    assert np.all(np.isfinite(found))
