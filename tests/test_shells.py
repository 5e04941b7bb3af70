"""Light of all orders in a round world: its laws, and against discrete ordinates."""

import dataclasses
import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hostile import decades, drawn, rows, within
from hypothesis import given
from scipy.interpolate import CubicSpline

from atmos.geometry import Flat, Spherical
from atmos.light import Sun
from atmos.medium import Ball, Exponential, Medium
from atmos.optics import layers
from atmos.phase import HenyeyGreenstein, Rayleigh
from atmos.scene import Scene
from atmos.solver import Columns, Shells, SingleScattering, solve
from atmos.solver._krylov import fixed_point
from atmos.solver._rays import rays
from atmos.solver._suns import RoundSuns
from atmos.solver.shells import _EVEN


NM = np.array([500.0])
TOP, RADIUS = 6e4, 6.4e6
# One set of sizes for all tests, so that they share a compilation.
SIZES = dict(layers=24, grounded=8, azimuths=6, degrees=6, suns=48)
SHELLS = Shells(**SIZES)
ONCE = SingleScattering()


def sun(zenith):
    level, zero = jnp.sin(zenith), jnp.zeros_like(zenith)
    return Sun(jnp.stack([zero, level, jnp.cos(zenith)]), jnp.ones_like(zenith), 0.0)


def world(depth=0.2, haze=0.1, white=0.9, ground=0.3, radius=RADIUS):
    """Molecules and a haze, the optical depths of which are those straight up."""
    air, low = 8e3, 1.5e3
    thick = lambda height: height * (1.0 - math.exp(-TOP / height))
    haze, rayleigh = haze / thick(low), depth / thick(air)
    both = (
        Medium(Exponential(air), rayleigh, 0.0 * rayleigh, Rayleigh()),
        Medium(Exponential(low), white * haze, (1.0 - white) * haze, PHASE),
    )
    return Scene(Spherical(radius), TOP, both, (sun(jnp.array(1.0)),), ground)


PHASE = HenyeyGreenstein(0.5)


@eqx.filter_jit
def see(sky, zenith, views, altitude):
    """What one sees from above the origin, by a sun of this zenith angle."""
    at = jnp.zeros_like(views[0]).at[2].set(altitude)
    lit = eqx.tree_at(lambda x: x.scene.lights, sky, (sun(zenith),))
    return jax.vmap(lambda view: lit.radiance(at, view)[0])(views)


def looks(scene, solver, zeniths, views, altitude):
    sky = solve(scene, solver, jnp.asarray(NM, views.dtype))
    zeniths = jnp.asarray(zeniths, views.dtype)
    return np.stack([see(sky, x, views, altitude) for x in zeniths])


def directions(*zeniths):
    zenith, azimuth = np.meshgrid(zeniths, [0.4, 2.8], indexing="ij")
    level = np.sin(zenith)
    found = level * np.sin(azimuth), level * np.cos(azimuth), np.cos(zenith)
    return jnp.asarray(np.stack(found, -1).reshape(-1, 3))


VIEWS = directions(0.0, 0.6, 1.2, 1.5)
BELOW = directions(math.pi, 2.4, 2.0, 1.9)
DAY = jnp.array([0.5, 1.2])
EYE, TALL = jnp.array(2.0), jnp.array(4e5)


def numbers(**changed):
    """The same world in numbers that share a compilation."""
    default = dict(depth=0.2, haze=0.1, white=0.9, ground=0.3, radius=RADIUS)
    return world(**{k: jnp.array(v) for k, v in (default | changed).items()})


def test_without_air_one_sees_the_ground_in_the_sun():
    seen = looks(numbers(depth=0.0, haze=0.0), SHELLS, DAY, BELOW, EYE)
    due = 0.3 / math.pi * np.cos(DAY)
    np.testing.assert_allclose(seen, due[:, None] + 0.0 * seen, rtol=1e-4)


def test_what_only_absorbs_is_black():
    scene = numbers(depth=0.0, haze=1.0, white=0.0, ground=0.0)
    assert np.all(looks(scene, SHELLS, DAY, VIEWS, EYE) == 0.0)


def test_thin_air_scatters_once():
    more = []
    for thin in (1e-3, 1e-5):
        scene = numbers(depth=thin, haze=thin, ground=0.0)
        once = looks(scene, ONCE, DAY, VIEWS, EYE)
        more.append(looks(scene, SHELLS, DAY, VIEWS, EYE) / once - 1.0)
    assert np.all((more[0] > 0.0) & (more[0] < 0.1))
    np.testing.assert_allclose(more[1], 1e-2 * more[0], rtol=0.1, atol=1e-7)


DUSK = np.deg2rad(np.arange(88.0, 108.1, 0.5))


@pytest.fixture(scope="module")
def seen():
    return looks(numbers(), SHELLS, DUSK, VIEWS, EYE)


def test_night_falls_smoothly(seen):
    fall = np.diff(np.log(seen), axis=0)
    assert np.all(seen > 0.0)
    assert np.all(fall < 0.0)
    assert seen[0].min() / seen[-1].max() > 1e5
    assert np.max(np.abs(np.diff(fall, axis=0))) < 0.25


def test_single_precision_agrees_with_double(seen):
    scene = jax.tree.map(lambda x: x.astype(jnp.float32), numbers())
    views, eye = VIEWS.astype(jnp.float32), jnp.float32(EYE)
    off = np.abs(looks(scene, SHELLS, DUSK, views, eye) / seen - 1.0)
    assert np.max(off[:9]) < 2e-5
    assert np.max(off) < 6e-5


def test_suns_that_stand_lower_are_where_their_zenith_angle_is():
    suns = RoundSuns(jnp.array([1.69]), jnp.array(1.95), jnp.array(0.07), 48)
    lower = jnp.array([-3.0, -0.3, -1e-3, 0.0, 1e-6, 0.02, 0.2, 3.0])[:, None]
    lower = jnp.broadcast_to(lower, (8, 48))
    first, x = map(np.asarray, suns.place(suns.zeniths()[None] + lower))
    other, y = map(np.asarray, suns.place_lower(lower))
    np.testing.assert_allclose(other + y, first + x, atol=1e-9)
    assert np.all((y >= 0.0) & (y <= 3.0))


def test_a_huge_planet_is_flat():
    """Against discrete ordinates, which know no lines from shell to shell."""
    huge = numbers(radius=1e3 * RADIUS)
    flat = eqx.tree_at(lambda x: x.geometry, huge, Flat())
    flat = eqx.tree_at(lambda x: x.lights, flat, (sun(DAY[1]),))
    views = jnp.concatenate([VIEWS[:6], BELOW[2:4]])
    high = jnp.array(2e4)
    due = see(solve(flat, Columns(layers=24), NM), DAY[1], views, high)
    found = looks(huge, SHELLS, DAY[1:], views, high)[0]
    np.testing.assert_allclose(found, due, rtol=2e-3)


@eqx.filter_jit
def see_polarised(sky, zenith, views):
    """From the ground and from the top: [place, view, 3]."""
    lit = eqx.tree_at(lambda x: x.scene.lights, sky, (sun(zenith),))
    at = jnp.array([[0.0, 0.0, 0.0], [0.0, 0.0, TOP]])
    return jax.vmap(jax.vmap(lit.stokes, (None, 0)), (0, None))(at, views)[..., 0]


@pytest.mark.usefixtures("hasty")
def test_polarised_light_on_a_huge_planet_is_as_published():
    """Natraj, Li and Yung 2009, ApJ 691, 1909: depth 0.5, albedo of the ground 0.25."""
    scene = numbers(depth=0.5, haze=0.0, ground=0.25, radius=1e3 * RADIUS)
    air = dataclasses.replace(scene.media[0], phase=Rayleigh(0.0))
    scene = dataclasses.replace(scene, media=(air,))
    # Where a step is no way for the sun, few of them tell the rest.
    sky = solve(scene, dataclasses.replace(SHELLS, suns=16, stokes=3), NM)
    level, turn = math.sqrt(1.0 - 0.64**2), math.pi / 2.0
    view = np.array([level * math.sin(turn), level * math.cos(turn), 0.64])
    views = np.stack([view, view * [1, 1, -1]])
    seen = math.pi * see_polarised(sky, math.acos(0.2), views)  # there it shines by pi
    for found, due in [
        (seen[1, 1], (0.10085308, -0.06076128, 0.01855839)),
        (seen[0, 0], (0.07578342, -0.04878055, 0.01479565)),
    ]:
        np.testing.assert_allclose(found / due[0], np.array(due) / due[0], atol=5e-3)


def test_what_is_not_absorbed_leaves():
    """White air over white ground: all light that meets either flies out at the top."""
    field = solve(numbers(depth=0.5, haze=0.0, ground=1.0), Shells(), NM).prepared.field
    zenith = np.asarray(field.suns.zeniths())
    up = np.asarray(field.up)[-1, :, 0] * np.exp(np.asarray(field.reference)[-1])
    leaves = 2.0 * CubicSpline(zenith, up * np.sin(zenith)).integrate(0.0, zenith[-1])
    # Of parallel light, what passes by the planet at a distance and is dimmed.
    above = np.linspace(0.0, TOP, 2001)
    along = np.linspace(-1.5e6, 1.5e6, 4001)
    height = np.hypot(RADIUS + above[:, None], along) - RADIUS
    density = 0.5 / (8e3 * (1.0 - math.exp(-TOP / 8e3))) * np.exp(-height / 8e3)
    depth = np.trapezoid(np.where(height < TOP, density, 0.0), along, axis=1)
    passed = np.trapezoid(2.0 * (RADIUS + above) * np.exp(-depth), above)
    met = 1.0 - passed / (RADIUS + TOP) ** 2
    assert leaves == pytest.approx(met, rel=1e-5)


def test_sums_over_lines_are_integrals():
    """At every level, over what is seen downwards or upwards, which is alike.

    Of layers some have no thickness, at the ground, at the top and in between.
    """
    scene = numbers()
    extinction = jnp.stack([x.extinction(jnp.asarray(NM)) for x in scene.media])

    @eqx.filter_jit
    def lines(scene):
        cut = layers(scene, extinction, 40, _EVEN)
        thrice = jnp.concatenate([cut.altitude, cut.altitude[::20].repeat(2)])
        return rays(scene, dataclasses.replace(cut, altitude=jnp.sort(thrice)), 10)

    found = lines(scene)
    cosine, weight = np.asarray(found.cosine), np.asarray(found.weight)
    near_level = 0.1 * math.sqrt(math.pi) * math.erf(5.0)
    for f, due, off in [
        (np.ones_like, 1.0, 1e-12),
        (np.square, 1.0 / 3.0, 1e-6),
        (lambda x: np.exp(-((x / 0.2) ** 2)), near_level, 5e-4),
    ]:
        summed = np.sum(weight * f(cosine), 1)
        np.testing.assert_allclose(summed, due, rtol=off)


# Small, to have slopes; in fewer layers those of how bright it is itself are missed,
# and no line passes so near to the top that its way there is next to nothing.
SMALL = Shells(layers=32, grounded=4, azimuths=4, degrees=4, suns=24)


@eqx.filter_jit
def mean(given, ahead):
    """Of what one sees by day, and its slope: by depth, haze, white, ground, radius."""

    def look(given):
        depth, haze, white, ground, radius = given
        scene = world(depth, haze, white, ground, radius)
        return jnp.mean(see(solve(scene, SMALL, NM), DAY[1], VIEWS, EYE))

    return jax.jvp(look, (given,), (ahead,))


def test_slopes_agree_with_differences():
    """Of light that the ground returns, whose every order has a part in them."""
    at, step = jnp.array([0.2, 0.1, 0.9, 0.3, RADIUS]), 1e-4 * jnp.eye(5)[3]
    _, slope = mean(at, step)
    more, less = (mean(at + x, step)[0] for x in (step, -step))
    assert float(slope) == pytest.approx(0.5 * float(more - less), rel=3e-5)


def test_a_fixed_point_has_exact_slopes():
    matrix = jnp.array([[0.1, 0.4], [0.3, -0.2]])
    first = jnp.array([[1.0], [2.0]])
    found = lambda x: fixed_point(lambda y: x * matrix @ y, first, 1e-12, 50)[0].sum()
    due = lambda x: jnp.linalg.solve(jnp.eye(2) - x * matrix, first).sum()
    slopes = [jax.grad(f)(0.9) for f in (found, due)]
    assert float(slopes[0]) == pytest.approx(float(slopes[1]), rel=1e-9)


def test_slopes_of_a_fixed_point_that_are_not_known_are_not_zero():
    """A square root has no slope at 0."""
    found = lambda x: fixed_point(lambda y: 0.5 * y, jnp.sqrt(x), 1e-9, 50)[0]
    look = lambda x: jax.jvp(found, (jnp.array([x]),), (jnp.array([x]),))
    np.testing.assert_allclose(look([4.0]), [[[4.0]], [[2.0]]])
    np.testing.assert_allclose(look([0.0]), [[[0.0]], [[math.nan]]])


def test_what_is_not_round_or_not_layered_is_refused():
    flat = eqx.tree_at(lambda x: x.geometry, numbers(), Flat())
    with pytest.raises(ValueError, match="must be round"):
        solve(flat, SHELLS, NM)
    ball = Medium(Ball(jnp.array([0.0, 0.0, 500.0]), 100.0), 1e-3, 0.0, PHASE)
    uneven = Scene(Spherical(RADIUS), TOP, (ball,), (sun(DAY[0]),), 0.3)
    with pytest.raises(ValueError, match="altitude alone"):
        solve(uneven, SHELLS, NM)


def test_what_is_not_solved_to_the_tolerance_is_refused():
    prepared = solve(numbers(), SHELLS, NM).prepared
    with pytest.raises(
        ValueError, match="within 200 `orders`; what is missing is 0.02"
    ):
        SHELLS.found(dataclasses.replace(prepared, error=jnp.array(0.02)))
    never = lambda x: -2.0 * x
    _, error = fixed_point(never, jnp.ones((3, 1)), 1e-9, 0)
    assert error == 1.0


def test_a_fixed_point_solves_its_equations():
    generator = np.random.default_rng(1)
    matrix = jnp.asarray(generator.uniform(-0.1, 0.1, (2, 30, 30)))
    first = jnp.asarray(generator.uniform(size=(30, 2)))
    carry = lambda x: jnp.einsum("lij,jl->il", matrix, x)
    found, error = fixed_point(carry, first, 1e-10, 100)
    due = np.linalg.solve(np.eye(30) - np.asarray(matrix), first.T[..., None])[..., 0].T
    np.testing.assert_allclose(found, due, rtol=1e-8)
    assert np.all(error <= 1e-10)


DEPTH, SHARE = decades(1e-9, 10.0, 0.0), within(0.0, 1.0)
ANGLE = within(0.0, math.pi, 0.5 * math.pi, 0.5 * math.pi + 0.1)
PLANET = decades(1e6, 1e8, RADIUS)


@drawn(4)
@given(DEPTH, DEPTH, SHARE, SHARE, PLANET, rows(4, ANGLE, decades(1e-3, 1e8, 0.0, TOP)))
def test_random_skies_are_bright_or_refused(depth, haze, white, ground, radius, looks):
    """One solution serves all suns and eyes."""
    given = dict(depth=depth, haze=haze, white=white, ground=ground, radius=radius)
    try:
        sky = solve(numbers(**given), SHELLS, NM)
    except ValueError as refused:
        assert "`tolerance` must be reached" in str(refused)
        return
    for zenith, altitude in looks:
        for views in (VIEWS, BELOW):
            seen = np.asarray(see(sky, jnp.array(zenith), views, jnp.array(altitude)))
            assert np.all(np.isfinite(seen)), (zenith, altitude)
            # By night cubics swing below nothing, by less than a sun of 1 leaves there.
            assert np.all(seen >= -1e-15), (zenith, altitude, seen)


@drawn(6)
@given(DEPTH, DEPTH, SHARE, SHARE, PLANET)
def test_random_airs_have_slopes_or_are_refused(depth, haze, white, ground, radius):
    at = jnp.array([depth, haze, white, ground, radius])
    try:
        found = mean(at, jnp.ones(5))
    except RuntimeError as refused:
        assert "`tolerance` must be reached" in str(refused)
        return
    assert np.all(np.isfinite(found)), (found, at)
