"""Single scattering against a slow quadrature of its own, and the laws it obeys."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import quadrature
from hostile import decades, drawn, rows, within
from hypothesis import given
from quadrature import ALBEDO, ASYMMETRY, OZONE, RADIUS, SHARE, TOP

from atmos.geometry import Flat, Spherical
from atmos.light import Sun
from atmos.medium import Exponential, Medium, of_extinction, Tent
from atmos.phase import HenyeyGreenstein, Rayleigh
from atmos.quantity import deg
from atmos.scene import Scene
from atmos.solver import SingleScattering, solve
from atmos.spectrum import Constant, PowerLaw, Tabulated


WAVELENGTH = np.array([400.0, 550.0, 700.0])
HORIZON = 0.5 * np.pi


def world(geometry, *present):
    """Air, dust and ozone, so much of each, under a sun overhead."""
    air, dust, ozone = (
        Medium(
            Exponential(8e3),
            PowerLaw(present[0] * 1.24062e-6, -4.0, 1e3),
            phase=Rayleigh(),
        ),
        of_extinction(
            PowerLaw(present[1] * 4.1666666667e-5, -0.8, 550.0),
            Constant(SHARE),
            Exponential(1.2e3),
            HenyeyGreenstein(ASYMMETRY),
        ),
        Medium(
            Tent(OZONE[1], OZONE[1] - OZONE[0]),
            absorption=Tabulated(
                WAVELENGTH, present[2] * quadrature.extinctions(WAVELENGTH)[:, 2]
            ),
        ),
    )
    sun = Sun(np.array([0.0, 0.0, 1.0]), Constant(1.0), 0.0)
    return Scene(geometry, TOP, (air, dust, ozone), (sun,), ALBEDO)


ROUND = Spherical(RADIUS)
PURE, HAZY, FULL = (
    world(ROUND, *present) for present in ((1, 0, 0), (1, 1, 0), (1, 1, 1))
)


def cast(tree, dtype):
    return jax.tree.map(lambda x: x.astype(dtype), tree)


def towards(zenith, azimuth):
    level = jnp.sin(zenith)
    parts = [level * jnp.sin(azimuth), level * jnp.cos(azimuth), jnp.cos(zenith)]
    return jnp.stack(parts, -1)


def under(scene, sun):
    return eqx.tree_at(lambda x: x.lights[0].direction, scene, sun)


@eqx.filter_jit
def look(scene, altitudes, views, suns, solver):
    """What one sees straight above the origin, in many directions by many suns."""

    def one(altitude, view, sun):
        sky = solve(under(scene, sun), solver, jnp.asarray(WAVELENGTH, altitude.dtype))
        return sky.radiance(jnp.zeros_like(view).at[2].set(altitude), view)

    return jax.vmap(one)(altitudes, views, suns)


COUNT = 480


def seen(scene, altitudes, views, suns, dtype=jnp.float64, solver=None):
    """The same, always so many at once that all tests share what is compiled."""
    count = len(views)
    arrays = (altitudes, views, suns)
    arrays = (
        jnp.asarray(np.resize(x, (COUNT, *np.shape(x)[1:])), dtype) for x in arrays
    )
    scene, solver = cast(scene, dtype), solver or SingleScattering()
    return np.asarray(look(scene, *arrays, solver), float)[:count]


def by_angles(altitudes, zeniths, azimuths, suns):
    """Altitudes, views and suns, from angles."""
    arrays = np.broadcast_arrays(altitudes, zeniths, azimuths, suns)
    altitudes, zeniths, azimuths, suns = (np.ravel(x).astype(float) for x in arrays)
    views = np.asarray(towards(zeniths, azimuths))
    return altitudes, views, np.asarray(towards(suns, np.zeros_like(suns)))


def horizon(altitude):
    return HORIZON + np.arccos(RADIUS / (RADIUS + altitude))


def cases():
    """Suns from overhead to 96 degrees; views up, level, at the horizon and down."""
    for altitude in (0.0, 10e3, 60e3, 400e3):
        if altitude < 100e3:
            dip = horizon(altitude) - HORIZON
            zeniths = [0.0, 70 * deg, 89.5 * deg, HORIZON + 0.98 * dip]
            zeniths += [horizon(altitude) + 0.3 * deg, horizon(altitude) + 0.5, np.pi]
        else:
            low = np.array([55e3, 30e3, 15e3, 5e3, 1e3, -100.0, -100e3])
            zeniths = np.pi - np.arcsin((RADIUS + low) / (RADIUS + altitude))
        for zenith in zeniths:
            yield altitude, zenith, 0.3, 0.0
            for sun in (60, 85, 88, 90, 92, 94, 96):
                yield altitude, zenith, 0.0, sun * deg
                yield altitude, zenith, 1.5, sun * deg
            yield altitude, zenith, 3.1, 75 * deg
            yield altitude, zenith, 3.1, 90.5 * deg


@pytest.fixture(scope="module")
def truth():
    """The cases, rounded to single precision, and what is to be seen in each world."""
    altitudes, views, suns = by_angles(*np.array(list(cases())).T)
    views, suns = views.astype(np.float32), suns.astype(np.float32)
    due = quadrature.radiances(altitudes, views, suns, WAVELENGTH)
    return altitudes, views, suns, due


def unit(directions):
    directions = directions.astype(float)
    return directions / np.linalg.norm(directions, axis=1)[:, None]


def errors(got, due):
    """Relative, but to a millionth of what is brightest."""
    return np.abs(got - due) / np.maximum(due, 1e-6 * due.max())


@pytest.mark.parametrize("name", ["pure", "hazy", "full"])
def test_single_precision_is_right_to_1e4(truth, name):
    altitudes, views, suns, due = truth
    scene = {"pure": PURE, "hazy": HAZY, "full": FULL}[name]
    got = seen(scene, altitudes, views, suns, jnp.float32)
    assert errors(got, due[name]).max() < 1e-4


@pytest.mark.parametrize("name", ["pure", "hazy", "full"])
def test_double_precision_is_right_to_4e5(truth, name):
    altitudes, views, suns, due = truth
    scene = {"pure": PURE, "hazy": HAZY, "full": FULL}[name]
    got = seen(scene, altitudes, unit(views), unit(suns))
    assert errors(got, due[name]).max() < 4e-5


def test_finer_is_right_to_1e8(truth):
    altitudes, views, suns, due = truth
    fine = SingleScattering(nodes=16, light_nodes=16, pieces=34)
    got = seen(FULL, altitudes, unit(views), unit(suns), solver=fine)
    assert errors(got, due["full"]).max() < 1e-8
    # Twice the nodes change little, also where the shadow cuts the ray.
    coarse = seen(FULL, altitudes, unit(views), unit(suns))
    assert errors(coarse, got).max() < 1e-4


def test_the_quadrature_itself_has_converged(monkeypatch):
    altitudes, views, suns = by_angles(
        [0.0, 10e3, 400e3, 0.0],
        [1.0, horizon(10e3) - 1e-3, 1.911, 1.5],
        0.2,
        [1.6, 1.55, 1.5, 1.64],
    )
    one = quadrature.radiances(altitudes, views, suns, WAVELENGTH)["full"]
    levels = np.unique(np.concatenate([quadrature._LEVELS, np.arange(60.0) * 1e3]))
    monkeypatch.setattr(quadrature, "_LEVELS", levels)
    other = quadrature.radiances(altitudes, views, suns, WAVELENGTH)["full"]
    np.testing.assert_allclose(one, other, rtol=1e-9)


def flat_radiance(altitude, zenith, azimuth, sun):
    """Over flat ground, where all is in altitude: panels of Gauss, in closed form."""
    mu, mu_sun = np.cos(zenith), np.cos(sun)
    extinction = quadrature.extinctions(WAVELENGTH)
    fall = lambda h, scale: scale * (np.exp(-h / scale) - np.exp(-TOP / scale))

    def above(h):
        bottom, centre, top = OZONE
        half = top - centre
        up = np.clip(h - bottom, 0.0, half) ** 2 / (2.0 * half)
        down = half / 2.0 - np.clip(top - h, 0.0, half) ** 2 / (2.0 * half)
        return np.stack([fall(h, 8e3), fall(h, 1.2e3), half - up - down], -1)

    end = TOP if mu > 0.0 else 0.0
    edges = np.unique([altitude, end, *np.linspace(0.0, TOP, 241)])
    edges = edges[(edges >= min(altitude, end)) & (edges <= max(altitude, end))]
    nodes, weights = np.polynomial.legendre.leggauss(10)
    half = 0.5 * np.diff(edges)
    h = (0.5 * (edges[1:] + edges[:-1]) + np.outer(nodes, half)).ravel()
    weights = np.outer(weights, half).ravel() / abs(mu)
    slant = lambda h: np.abs(above(h) - above(np.array(altitude))) / abs(mu)
    arrives = np.exp(-(slant(h) + above(h) / mu_sun) @ extinction.T)
    cosine = mu * mu_sun + np.sin(zenith) * np.sin(sun) * np.cos(azimuth)
    scattering = extinction[:, :2] * [1.0, SHARE] * quadrature.phases(cosine)
    amounts = quadrature.densities(h)[:, :2] * weights[:, None]
    total = np.einsum("pm,pl,lm->l", amounts, arrives, scattering)
    if mu < 0.0:
        foot = slant(np.array(0.0)) + above(np.array(0.0)) / mu_sun
        total += ALBEDO / np.pi * mu_sun * np.exp(-foot @ extinction.T)
    return total


def test_flat_worlds_are_right_too():
    angles = np.array(
        [
            (h, z, a, s)
            for h in (0.0, 3e3, 30e3)
            for z in (0.1, 1.0, 1.5, 1.6, 2.0, 3.0)
            for a, s in ((0.0, 0.0), (1.0, 1.0), (2.0, 1.45))
        ]
    )
    due = np.array([flat_radiance(*x) for x in angles])
    got = seen(world(Flat(), 1, 1, 1), *by_angles(*angles.T))
    assert errors(got, due).max() < 4e-5


def test_a_huge_planet_is_flat():
    zeniths, azimuths, suns = np.meshgrid(
        [0.1, 1.0, 1.4, 2.0, 3.0], [0.0, 2.0], [0.2, 1.3]
    )
    angles = by_angles(2e3, zeniths, azimuths, suns)
    flat = seen(world(Flat(), 1, 1, 1), *angles)
    huge = seen(world(Spherical(1e12), 1, 1, 1), *angles)
    np.testing.assert_allclose(huge, flat, rtol=1e-4)
    # Where the ray and the light are cut alike, much nearer than that.
    assert np.median(np.abs(huge / flat - 1.0)) < 1e-5


def test_a_flat_world_is_dark_once_the_sun_has_set():
    angles = by_angles(0.0, [0.1, 1.0, 1.5, 3.0], 0.0, 91 * deg)
    np.testing.assert_array_equal(seen(world(Flat(), 1, 1, 1), *angles), 0.0)


def test_left_of_the_sun_looks_like_right_of_it():
    zeniths, azimuths, suns = np.meshgrid(
        [0.5, 1.5, 2.0], [0.1, 1.0, 3.0], [0.5, 1.57, 1.62]
    )
    left, right = (by_angles(1e3, zeniths, s * azimuths, suns) for s in (1.0, -1.0))
    np.testing.assert_allclose(seen(FULL, *left), seen(FULL, *right), rtol=1e-12)


def test_twice_the_light_is_twice_as_bright():
    angles = by_angles(0.0, [0.3, 1.5, 2.0], 1.0, [0.2, 1.0, 1.6])
    brighter = eqx.tree_at(
        lambda x: x.lights[0].irradiance.value, FULL, jnp.asarray(2.0, float)
    )
    np.testing.assert_allclose(seen(brighter, *angles), 2.0 * seen(FULL, *angles))


@pytest.mark.usefixtures("hasty")
def test_lights_add_up():
    here, view = jnp.zeros(3), jnp.asarray(towards(1.0, 0.5))
    one, other = (Sun(towards(s, a), 1.0, 0.0) for s, a in ((0.5, 0.0), (1.4, 2.0)))

    @eqx.filter_jit
    def shine(*lights):
        scene = eqx.tree_at(lambda x: x.lights, PURE, lights)
        return solve(scene, SingleScattering(), WAVELENGTH[:1]).radiance(here, view)

    total = shine(one) + shine(other)
    np.testing.assert_allclose(shine(one, other), total, rtol=1e-12)
    assert shine() == 0.0


def test_without_air_the_sky_is_black_and_the_ground_lit():
    suns = np.array([0.0, 1.0, 1.5, 1.6])
    empty = world(ROUND, 0, 0, 0)
    up, down = (seen(empty, *by_angles(1e3, z, 0.0, suns)) for z in (1.0, np.pi))
    np.testing.assert_array_equal(up, 0.0)
    due = np.maximum(ALBEDO / np.pi * np.cos(suns), 0.0)[:, None] * np.ones(3)
    np.testing.assert_allclose(down, due, rtol=1e-12)
    # And so it is with no medium at all.
    nothing = under(Scene(ROUND, TOP, (), FULL.lights, ALBEDO), towards(1.0, 0.0))
    views = [towards(1.0, 0.0), towards(np.pi, 0.0)]
    sky = solve(nothing, SingleScattering(), WAVELENGTH)
    glance = jax.jit(lambda view: sky.radiance(jnp.array([0.0, 0.0, 1e3]), view))
    np.testing.assert_array_equal(glance(views[0]), 0.0)
    np.testing.assert_allclose(glance(views[1]), due[1], rtol=1e-12)


def test_who_looks_past_the_air_from_afar_sees_nothing():
    """However far below the planet the sun stands, in either precision."""
    grid = np.meshgrid([1e7, 1e8, 1e9], [0.0, 0.1, 2.0], [0.0, 2.0, np.pi])
    angles = by_angles(grid[0], grid[1], 0.0, grid[2])
    for dtype in (jnp.float32, jnp.float64):
        np.testing.assert_array_equal(seen(FULL, *angles, dtype), 0.0)


def test_a_thin_medium_is_as_bright_as_there_is_of_it():
    angles = by_angles(0.0, [0.3, 1.0, 1.4], 1.0, [0.2, 1.0, 1.4])
    thin, thinner = (seen(world(ROUND, x, x, x), *angles) for x in (1e-7, 1e-9))
    np.testing.assert_allclose(thin / 1e-7, thinner / 1e-9, rtol=1e-5)


def test_thick_fog_is_seen_through_its_first_metres():
    # 1e3 deep along the ground: nearly all the light comes from the first tenth.
    thick = 1e3 / (4.1666666667e-5 * 109.5e3)
    zeniths, suns = (
        x.ravel() for x in np.meshgrid([0.0, 1.0, 1.5, HORIZON], [0.0, 1.0])
    )
    altitudes, views, suns = by_angles(0.0, zeniths, 0.5, suns)
    due = quadrature.radiances(
        altitudes, views, suns, WAVELENGTH, {"fog": (1, thick, 1)}
    )
    got = seen(world(ROUND, 1, thick, 1), altitudes, views, suns)
    assert errors(got, due["fog"]).max() < 1e-3


def test_the_sky_darkens_smoothly_as_the_sun_sets():
    suns = HORIZON + np.arange(-0.6, 0.6, 0.01) * deg
    for zenith, azimuth in [(0.0, 0.0), (1.4, 0.0), (1.5, 3.0)]:
        got = seen(FULL, *by_angles(0.0, zenith, azimuth, suns))
        step, bend = np.diff(got, axis=0), np.diff(got, 2, axis=0)
        assert np.all(step < 0.0)
        assert np.all(np.abs(step) < 0.05 * got[:-1])
        assert np.all(np.abs(bend) < 2e-3 * got[1:-1])


def test_twilight_fades_without_a_plateau():
    suns = HORIZON + np.linspace(0.0, 18.0, 145) * deg
    got = seen(FULL, *by_angles(0.0, 0.0, 0.0, suns))[:, 0]
    lit = got > 0.0
    assert np.all(np.diff(got[lit]) < 0.0)
    # Overhead the shadow leaves the air at 60 km when the sun is 7.85 degrees down.
    last = (suns[lit].max() - HORIZON) / deg
    assert abs(last - np.degrees(np.arccos(RADIUS / (RADIUS + TOP)))) < 0.125


CHUNK = 38


def slopes(scene, *angles):
    """Radiances; gradients of their sum by all numbers of the scene and all angles.

    With as many scenes as angles, of each. In whole chunks, which share a compilation.
    """
    count = len(angles[0])
    if scene.top.ndim == 0:
        every = lambda x: np.broadcast_to(x, (count, *x.shape))
        scene = jax.tree.map(every, scene)
    each = np.arange(math.ceil(count / CHUNK) * CHUNK).reshape(-1, CHUNK) % count
    looks = jax.tree.map(np.asarray, (scene, *angles))
    parts = [chunk_slopes(*jax.tree.map(lambda x, i=i: x[i], looks)) for i in each]
    return jax.tree.map(lambda *x: np.concatenate(x)[:count], *parts)


@eqx.filter_jit
def chunk_slopes(scenes, altitudes, zeniths, azimuths, suns):

    def total(arguments):
        scene, altitude, zenith, azimuth, sun = arguments
        scene = under(scene, towards(sun, jnp.zeros_like(sun)))
        sky = solve(scene, SingleScattering(), jnp.asarray(WAVELENGTH, altitude.dtype))
        position = jnp.zeros_like(sky.wavelength).at[2].set(altitude)
        found = sky.radiance(position, towards(zenith, azimuth))
        return jnp.sum(found), found

    def one(*arguments):
        return eqx.filter_value_and_grad(total, has_aux=True)(arguments)

    looks = scenes, altitudes, zeniths, azimuths, suns
    (_, found), gradients = jax.vmap(one)(*looks)
    return found, gradients


def edge_cases():
    edges = [TOP - 0.01, TOP, TOP + 0.01]
    for altitude in (0.0, 1.0, *edges, 400e3):
        low = HORIZON + np.arccos(min(1.0, (RADIUS + TOP) / (RADIUS + altitude)))
        views = [(0.0, 0.0), (HORIZON, 0.3), (np.pi, 0.0), (1.0, 0.5)]
        views += [(horizon(altitude), 0.4), (low, 0.2)]
        for sun in (0.0, HORIZON, horizon(altitude), 1.65):
            yield from ((altitude, *view, sun) for view in views)
            yield altitude, sun, 0.0, sun  # straight at it


EDGES = np.array(list(edge_cases()))


def extremes():
    """Scenes of the same form in which some number has reached the end of its range."""

    def changed(*pairs):
        where = lambda x: [f(x) for f, _ in pairs]
        return eqx.tree_at(where, FULL, [jnp.asarray(v, float) for _, v in pairs])

    g = lambda x: x.media[1].phase.g.value
    scatter = lambda x: x.media[1].scattering.other.value
    absorb = lambda x: x.media[1].absorption.other.of.value
    ground = lambda x: x.ground.value
    return {
        "full": FULL,
        "no air": world(ROUND, 0, 0, 0),
        "only air": PURE,
        "only ozone": world(ROUND, 0, 0, 1),
        "1e3 deep": world(ROUND, 1e3, 1e3, 1e3),
        "g 0": changed((g, 0.0)),
        "g 0.999": changed((g, 0.999)),
        "g -0.999": changed((g, -0.999)),
        "all scatters": changed((scatter, 1.0), (absorb, 1.0)),
        "none scatters": changed((scatter, 0.0), (absorb, 0.0)),
        "black ground": changed((ground, 0.0)),
        "white ground": changed((ground, 1.0)),
    }


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_values_and_gradients_are_finite_at_every_edge(dtype):
    angles = [jnp.asarray(x, dtype) for x in EDGES.T]
    for name, scene in extremes().items():
        found, gradients = slopes(cast(scene, dtype), *angles)
        found = np.asarray(found)
        assert np.all(np.isfinite(found) & (found >= 0.0)), name
        for path, leaf in jax.tree_util.tree_leaves_with_path(gradients):
            assert np.all(np.isfinite(leaf)), (name, jax.tree_util.keystr(path))


@pytest.mark.usefixtures("hasty")
def test_no_medium_and_one_have_finite_gradients():
    for media in ((), FULL.media[:1]):
        scene = Scene(ROUND, TOP, media, FULL.lights, ALBEDO)

        def total(scene, media=media):
            sky = solve(scene, SingleScattering(), jnp.asarray(WAVELENGTH))
            return jnp.sum(sky.radiance(jnp.zeros(3), towards(HORIZON, 0.3)))

        value, gradient = eqx.filter_jit(eqx.filter_value_and_grad(total))(scene)
        assert np.isfinite(value)
        assert all(np.all(np.isfinite(x)) for x in jax.tree.leaves(gradient))


ORDINARY = np.array(
    [
        (1e3, 1.0, 0.5, 1.2),
        (0.5, 1.5, 2.0, 1.5),
        (2e3, 2.0, 1.0, 0.5),
        (11e3, 1.6, 0.3, 1.58),
        (400e3, 1.93, 0.4, 1.5),
        # Twilight: the planet's shadow cuts the ray, and carries the derivative.
        (10.0, 0.3, 0.2, 92 * deg),
        (10.0, 0.3, 0.2, 94 * deg),
        (10.0, 1.2, 0.2, 96 * deg),
        (10.0, 1.2, 3.0, 94 * deg),
    ]
)


def test_gradients_are_the_slopes_of_the_radiance():
    # The places and angles as they are, and each of the four a little aside.
    steps = np.array([0.1, 1e-5, 1e-4, 1e-5])
    aside = np.concatenate([np.zeros((1, 4)), np.diag(steps), -np.diag(steps)])
    rows = (aside[:, None] + ORDINARY).reshape(-1, 4)
    count = len(ORDINARY)
    found, (by_scene, *by_angle) = slopes(FULL, *rows.T)
    found = np.asarray(found).sum(1)[: 9 * count].reshape(9, count)
    typical, due = found[0], (found[1:5] - found[5:]) / (2.0 * steps[:, None])
    got = np.stack([np.asarray(x)[:count] for x in by_angle])
    scale = np.array([1e-4, 1.0, 1.0, 1.0])[:, None] * typical
    error = np.abs(got - due) / np.maximum(np.abs(due), scale)
    assert error.max() < 1e-5

    numbers = {
        "scattering": lambda x: x.media[0].scattering.value,
        "exponent": lambda x: x.media[0].scattering.exponent,
        "scale height": lambda x: x.media[1].profile.scale_height,
        "extinction": lambda x: x.media[1].scattering.one.value,
        "g": lambda x: x.media[1].phase.g.value,
        "centre": lambda x: x.media[2].profile.centre,
        "half width": lambda x: x.media[2].profile.half_width,
        "radius": lambda x: x.geometry.radius,
        "top": lambda x: x.top,
        "albedo": lambda x: x.ground.value,
        "irradiance": lambda x: x.lights[0].irradiance.value,
    }
    for name, number in numbers.items():
        value = float(number(FULL))
        step = 1e-5 * value
        higher, lower = (
            eqx.tree_at(number, FULL, jnp.asarray(value + s, float))
            for s in (step, -step)
        )
        higher, lower = (
            np.asarray(slopes(x, *ORDINARY.T)[0]).sum(1)[:count]
            for x in (higher, lower)
        )
        due, got = (higher - lower) / (2.0 * step), np.asarray(number(by_scene))[:count]
        error = np.abs(got - due) / np.maximum(np.abs(due), 0.01 * typical / abs(value))
        assert error.max() < 1e-5, (name, error)


# So much air, dust and ozone; albedo and asymmetry of the dust, the ground's albedo;
# radius and scale height; and an eye, a view and a sun.
AMOUNT = decades(1e-9, 1e3, 0.0)
SHARES = within(0.0, 1.0), within(-0.999, 0.999, 0.0, 1e-6), within(0.0, 1.0)
LENGTHS = decades(1e5, 1e9, RADIUS), decades(30.0, 3e4)
EYE = decades(1e-3, 1e8, 0.0, TOP, TOP - 0.01, TOP + 0.01)
ANGLE = within(0.0, np.pi, HORIZON, HORIZON + 1e-3, HORIZON + 0.1, 1e-4)


@drawn(32)
@given(rows(CHUNK, AMOUNT, AMOUNT, AMOUNT, *SHARES, *LENGTHS, EYE, *3 * [ANGLE]))
def test_random_skies_are_finite_and_so_are_their_slopes(draws):
    """Each by itself, in single precision; seen from no farther than 1000 radii."""
    air, dust, ozone, albedo, g, ground, radius, height, *look = draws.T
    look[0] = np.minimum(look[0], 1e3 * radius)
    many = jax.tree.map(lambda x: jnp.broadcast_to(x, (CHUNK, *x.shape)), FULL)

    def numbers(scene):
        clear, hazy, absorbs = scene.media
        yield clear.scattering.value, air
        yield hazy.scattering.one.value, dust
        yield hazy.absorption.one.value, dust
        yield absorbs.absorption.values, ozone[:, None]

    scaled = [value * by for value, by in numbers(many)]
    scaled += [albedo, albedo, g, ground, radius, height]
    single = lambda x: jnp.asarray(x, jnp.float32)

    def where(scene):
        dusty = scene.media[1]
        return [
            *(scene.media[0].scattering.value, dusty.scattering.one.value),
            *(dusty.absorption.one.value, scene.media[2].absorption.values),
            *(dusty.scattering.other.value, dusty.absorption.other.of.value),
            *(dusty.phase.g.value, scene.ground.value),
            *(scene.geometry.radius, dusty.profile.scale_height),
        ]

    many = eqx.tree_at(where, many, [single(x) for x in scaled])
    found, gradients = slopes(cast(many, jnp.float32), *(single(x) for x in look))
    assert np.all(np.isfinite(found) & (found >= 0.0))
    for path, leaf in jax.tree_util.tree_leaves_with_path(gradients):
        assert np.all(np.isfinite(leaf)), jax.tree_util.keystr(path)
