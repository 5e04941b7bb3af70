"""Light of all orders in clouds and fire, judged in standard errors."""

import dataclasses
import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hostile import decades, drawn, within
from hypothesis import given

from atmos.geometry import Flat
from atmos.light import Sun
from atmos.medium import (
    Ball,
    Box,
    Glow,
    Grid,
    Medium,
    Noise,
    Product,
    Puff,
    Tabulated,
    Transformed,
)
from atmos.phase import HenyeyGreenstein
from atmos.scene import Scene
from atmos.solver import estimate, PathTracing, RayMarching, solve, VolumeTracing
from atmos.solver._chance import quick
from atmos.solver._majorants import Cells, cross, fly
from atmos.spectrum import Constant, PowerLaw


NM = np.array([450.0, 650.0])
LOWER, UPPER = np.array([-1.0, -1.0, 1.0]), np.array([1.0, 1.0, 3.0])
SLANT = np.array([0.48, 0.36, 0.8])
rng = np.random.default_rng(0)


LOOKS = 64
SOLVER = VolumeTracing(walks=8, paths=8, turns=1000)


def cloud(profile, scattering, absorption, g, sun=SLANT, exponent=0.0):
    coefficients = PowerLaw(scattering, exponent), absorption
    medium = Medium(profile, *coefficients, HenyeyGreenstein(g))
    return Scene(Flat(), 1e8, (medium,), (Sun(sun, 1.0, 0.0),))


def glimpsed(scene, positions, directions, solver=SOLVER):
    """Always of so many looks that tests share compilations.

    In single precision, as pictures are made.
    """
    sky = solve(scene, solver, jnp.asarray(NM, jnp.float32))
    looks = [np.repeat(x, LOOKS // len(x), 0) for x in (positions, directions)]
    # No two looks are alike, or they would be alike in all that is random too.
    looks[0] = looks[0] * (1.0 + 1e-6 * rng.uniform(-1.0, 1.0, (LOOKS, 1)))
    looks = [jnp.asarray(x, jnp.float32) for x in looks]
    more = sky.prepared, sky.scene, sky.scene.lights[0], sky.wavelength
    return sky.solver.tally(*more, *looks)


def tallied(scene, positions, directions, solver=SOLVER):
    """Means and standard errors."""
    found = glimpsed(scene, positions, directions, solver)
    repeat = LOOKS // len(positions)
    parts = lambda x: np.asarray(x, float).reshape(-1, repeat, len(NM))
    error = np.sqrt(np.mean(parts(found.standard_error) ** 2, 1) / repeat)
    return np.mean(parts(found.mean), 1), error


# Van de Hulst (1980), Multiple Light Scattering, tables 12 and 35: reflected and all
# transmitted light of slabs of depth 1 under a sun in the zenith; asymmetry, albedo.
SLABS = [
    (0.0, 1.0, 0.34133, 0.65867),
    (0.5, 1.0, 1.0 - 0.82389, 0.82389),
    (0.5, 0.9, None, 0.73909),
]
# And, as nothing is lost, both together of white ones.
WHITE = [-0.5, 0.6]


def fluxes(g, albedo, depth=1.0):
    """What is reflected and transmitted, each with its standard error."""
    wide = np.array([1e5, 1e5, 0.0])
    box = Box(np.array([0.0, 0.0, 1.0]) - wide, np.array([0.0, 0.0, 2.0]) + wide)
    sun = np.array([0.0, 0.0, 1.0])
    slab = cloud(box, depth * albedo, depth * (1.0 - albedo), g, sun)
    # Evenly in the square of the cosine, as light leaves a surface.
    up = np.sqrt((np.arange(LOOKS) + rng.uniform(size=LOOKS)) / LOOKS)
    turn, level = rng.uniform(0.0, 2.0 * np.pi, LOOKS), np.sqrt(1.0 - up * up)
    for sign, beam in ((-1.0, 0.0), (1.0, np.exp(-depth))):
        looks = [level * np.cos(turn), level * np.sin(turn), sign * up]
        start = np.broadcast_to([0.1, 0.2, 1.5 - sign], (LOOKS, 3))
        flux = np.pi * tallied(slab, start, np.stack(looks, 1))[0].mean(1)
        yield beam + flux.mean(), flux.std(ddof=1) / np.sqrt(LOOKS)


@pytest.mark.parametrize("g, albedo, reflected, transmitted", SLABS)
def test_a_slab_reflects_and_transmits_what_is_published(
    g, albedo, reflected, transmitted
):
    dues = reflected, transmitted
    for (flux, error), due in zip(fluxes(g, albedo), dues, strict=True):
        assert error < 0.06 and (due is None or abs(flux - due) < 4.5 * error)


@pytest.mark.parametrize("g", WHITE)
def test_a_white_slab_loses_nothing(g):
    (above, error), (below, other) = fluxes(g, 1.0, 2.0)
    assert abs(above + below - 1.0) < 4.5 * np.hypot(error, other) < 0.4


values = rng.uniform(0.0, 1.0, (5, 9, 7)) ** 4
values[2, 5, 3] = 1e4
TURN = np.array([[0.5, -0.4, 0.1], [0.4, 0.5, 0.0], [0.0, 0.2, 0.6]])
PROFILES = {
    "ball": Ball(np.array([0.2, 0.1, 2.0]), 0.7),
    "grid": Grid(values, LOWER, UPPER),
    "turned grid": Transformed(Grid(values, LOWER, UPPER), TURN, SLANT),
    "puff": Puff(np.array([0.0, 0.0, 2.0]), 0.5, 0.4, octaves=2),
    "bounded": Product(
        Tabulated(np.array([0.0, 9.0]), np.array([3.0, 5.0])),
        Product(Noise(0.3, octaves=2), Ball(np.array([0.2, 0.1, 2.0]), 0.7)),
    ),
}


CELLS = 7


def test_nothing_is_denser_than_its_bound():
    at = jax.vmap(lambda profile, x: profile.density(Flat().locate(x)), (None, 0))
    index = np.indices((CELLS,) * 3).reshape(3, -1).T
    steps, places = [], []
    for name, profile in PROFILES.items():
        low, high = map(np.asarray, profile.box)
        inside = rng.uniform(low, high, (5000, 3))
        if name == "grid":  # and about the peak, where most is
            peak = LOWER + (np.array([2, 5, 3]) + 0.5) / values.shape * (UPPER - LOWER)
            inside[:100] = peak + rng.uniform(-1e-2, 1e-2, (100, 3))
        places.append(inside)
        steps.append((low, (high - low) / CELLS))

    @jax.jit
    def found(profiles):
        dense = [at(x, jnp.asarray(y)) for x, y in zip(profiles, places, strict=True)]
        bounds = [
            jax.vmap(x.most)(jnp.asarray(low + index * step), low + step + index * step)
            for x, (low, step) in zip(profiles, steps, strict=True)
        ]
        return dense, bounds

    all_found = found(list(PROFILES.values()))
    for name, dense, bound, place, (low, step) in zip(
        PROFILES, *map(list, all_found), places, steps, strict=True
    ):
        bound = np.asarray(bound).reshape((CELLS,) * 3)
        cell = np.clip(np.floor((place - low) / step), 0, CELLS - 1).astype(int)
        assert np.all(dense <= bound[tuple(cell.T)] * (1.0 + 1e-9))
        # A peak is paid for near it alone.
        if "grid" in name:
            assert np.median(bound) < 1e-2 * np.max(bound)
            assert np.mean(bound == np.max(bound)) < 0.3


def test_a_ray_meets_as_much_as_lies_in_its_cells():
    rng = np.random.default_rng(0)  # whatever was drawn before
    bounds = rng.uniform(0.0, 1.0, (6, 6, 6)) ** 3
    bounds[bounds < 0.1] = 0.0
    cells = Cells(*map(jnp.asarray, (LOWER, UPPER, bounds)))
    start = rng.uniform(-4.0, 4.0, (40, 3))
    aim = rng.uniform(LOWER, UPPER, (40, 3)) - start
    aim = aim / np.linalg.norm(aim, axis=1)[:, None]

    @jax.jit
    @jax.vmap
    def through(start, aim, depth):
        ray = cross(cells, start, aim, *map(jnp.asarray, (0.0, 100.0)))
        begun = ray, depth, depth, jnp.array(False)
        goes_on = lambda x: x[0].inside(cells) & ~x[3]
        return jax.lax.while_loop(goes_on, lambda x: fly(cells, *x[:2]), begun)

    # A fine march through the same cells by midpoints.
    s = (np.arange(20_000) + 0.5) * 6e-4
    places = start[:, None] + s[:, None] * aim[:, None]
    inside = np.all((places > LOWER) & (places < UPPER), -1)
    index = np.clip(np.floor((places - LOWER) / (UPPER - LOWER) * 6), 0, 5).astype(int)
    depth = np.cumsum(bounds[tuple(np.moveaxis(index, -1, 0))] * inside, 1) * 6e-4
    looks = jnp.asarray(start), jnp.asarray(aim)
    assert not np.any(through(*looks, jnp.asarray(1.01 * depth[:, -1] + 1e-3))[3])
    ray, _, bound, met = through(*looks, jnp.asarray(0.5 * depth[:, -1]))
    assert np.all(met) and np.all(bound > 0.0)
    reached = [d[np.searchsorted(s, x)] for d, x in zip(depth, ray.at, strict=True)]
    np.testing.assert_allclose(reached, 0.5 * depth[:, -1], atol=2e-3)


@pytest.mark.parametrize("bound", [0.0, 3.0])
def test_the_least_and_the_greatest_random_numbers_lead_somewhere(bound):
    # One cell, 2 m wide, that holds something or not, and a ray out of it; as free
    # paths are drawn in single precision.
    least, greatest = np.float32([0.0, 1.0 - 2.0**-24])
    lower, upper = (jnp.asarray(x, jnp.float32) for x in (LOWER, UPPER))
    cells = Cells(lower, upper, jnp.full((1, 1, 1), bound, jnp.float32))
    start, along = jnp.float32([-3.0, 0.0, 2.0]), jnp.float32([1.0, 0.0, 0.0])
    for far in (50.0, 1e18):
        ray = cross(cells, start, along, jnp.float32(0.0), jnp.float32(far))
        assert ray.at == 2.0 and ray.far == 4.0
        for u, meets in ((least, bound > 0.0), (greatest, False)):
            found, left, _, met = fly(cells, ray, -jnp.log1p(-u))
            assert met == meets and found.at == (2.0 if meets else 4.0)
            assert np.isfinite(left) and (met or not found.inside(cells))
    assert -np.log1p(-greatest) < 17.0


def test_quick_random_numbers_are_even_and_know_nothing_of_each_other():
    key, count = quick(jax.random.key(0)), 2**14
    draw = lambda i: jax.random.uniform(jax.random.fold_in(key, i), (6,), jnp.float32)
    u = np.asarray(jax.jit(jax.vmap(draw))(jnp.arange(count)), float)
    assert np.all((u >= 0.0) & (u < 1.0)) and len(np.unique(u[:, 0])) > 0.99 * count
    # Those of a key, and those of a key and of the next; in standard errors.
    pairs = np.corrcoef(np.concatenate([u[:-1], u[1:]], 1).T) - np.eye(12)
    assert np.max(np.abs(pairs)) < 4.5 / np.sqrt(count)
    for one, other in ((0, 1), (3, 4)):
        cells = np.histogram2d(u[:, one], u[:, other], 16, [[0, 1], [0, 1]])[0]
        squares = np.sum((cells - count / 256) ** 2) / (count / 256)
        assert abs(squares - 255.0) < 4.5 * np.sqrt(2.0 * 255.0)


GRID = Grid(np.ones((9, 9, 9)), LOWER, UPPER)
BOX = Box(LOWER, UPPER)
START = np.array([[0.0, -4.0, 2.0], [0.3, 0.2, 2.2], [3.0, 1.0, 4.0], [0.5, 0.0, 6.0]])
AIM = np.array([[0.1, 1, 0.05], [0.01, 0.6, 0.8], [-1, -0.3, -0.7], [0.1, 0.2, -1]])
AIM = AIM / np.linalg.norm(AIM, axis=1)[:, None]


def test_light_of_dark_smoke_turns_once_and_is_as_it_is_marched_in_any_size():
    # And with any asymmetry, in smoke and outside.
    look = eqx.filter_jit(jax.vmap(lambda sky, *ray: sky.radiance(*ray), (None, 0, 0)))
    cases = [(1e-3, 0.4), (1.0, 0.4), (6.4e6, 0.4), (1.0, 0.999), (1.0, -0.999)]
    for size, g in cases:
        sky = solve(cloud(BOX, 0.02, 2.0, g), RayMarching(), NM)
        due = np.asarray(look(sky, jnp.asarray(START), jnp.asarray(AIM)))
        box = Box(LOWER * size, UPPER * size)
        smoke = cloud(box, 0.02 / size, 2.0 / size, g)
        mean, error = tallied(smoke, START * size, AIM)
        # A hundredth scatters: of light that turned twice there is so little.
        assert np.all(np.abs(mean - due) <= 4.5 * error + 0.01 * due)
        assert np.all(error < 0.4 * due)


def test_a_grid_and_a_box_look_alike_and_a_peak_aside_changes_nothing():
    one = tallied(cloud(BOX, 1.0, 0.2, 0.4), START, AIM)
    peak = np.ones((9, 9, 9))
    peak[0, -1, 0] = 1e4  # in a corner that light hardly comes near
    for other in (GRID, Grid(peak, LOWER, UPPER)):
        other = tallied(cloud(other, 1.0, 0.2, 0.4), START, AIM)
        spread = np.hypot(one[1], other[1])
        assert np.all(np.abs(one[0] - other[0]) <= 4.5 * spread)
        assert np.all(spread < 0.3 * one[0])
    empty = tallied(
        cloud(Grid(np.zeros((9, 9, 9)), LOWER, UPPER), 1.0, 0.2, 0.4), START, AIM
    )
    assert np.all(empty[0] == 0.0)


def test_bounds_far_too_high_change_nothing():
    # They cost a hundred times as many collisions with nothing, and no more.
    smoke = cloud(GRID, 1.0, 0.2, 0.4)
    due, error = tallied(smoke, START, AIM)
    for slack in (10.0, 100.0):
        loose = dataclasses.replace(SOLVER, slack=slack)
        mean, other = tallied(smoke, START, AIM, loose)
        assert np.all(np.abs(mean - due) <= 4.5 * np.hypot(error, other))
        assert np.all(other < 0.3 * mean)


@drawn(12)
@given(
    decades(1e-6, 10.0, 0.0),
    decades(1e-6, 1e3, 0.0),
    within(-0.99, 0.99),
    within(-1.0, 1.0, 0.0),
    decades(1e-3, 1e4, 0.0),
)
def test_random_clouds_are_bright(scattering, absorption, g, up, peak):
    """From outside and within, mostly empty or not, under suns however low."""
    values = np.zeros((9, 9, 9))
    values[2:4, :, 5], values[8, 0, 0] = 1.0, peak
    sun = np.array([np.sqrt(1.0 - up * up), 0.0, up])
    grid = Grid(values, LOWER, UPPER)
    mean, error = tallied(cloud(grid, scattering, absorption, g, sun), START, AIM)
    assert np.all(np.isfinite(mean) & (mean >= 0.0) & np.isfinite(error))


def test_strong_colours_keep_their_variance():
    # At one wavelength a hundred times thicker than at the other.
    blue = cloud(BOX, 1.0, 2.0, 0.4, exponent=-12.5)
    assert (650.0 / 450.0) ** 12.5 > 95.0
    mean, error = tallied(blue, START, AIM)
    assert np.all(np.isfinite(mean)) and np.all(error < mean)


def test_light_that_is_never_absorbed_comes_to_an_end_and_says_what_was_ended():
    found = glimpsed(cloud(BOX, 500.0, 0.0, 0.0), START[3:], AIM[3:])
    # A white wall, lit from above: no brighter than white in full light.
    mean = np.mean(found.mean, 0)
    assert np.all((mean > 0.0) & (mean < 1.0 / np.pi))
    # In half of all space so much is not out after n turns, on average over where it
    # came from (Sparre Andersen 1954), and H / 2 times as much of what came this way
    # (Chandrasekhar 1950, table 11).
    due = 2.8653 / np.sqrt(np.pi * SOLVER.turns)
    late = np.asarray(found.late, float)
    error = np.std(late, ddof=1) / np.sqrt(LOOKS)
    assert abs(np.mean(late) - due) < 4.5 * error < 0.6 * due
    # Where it is thin or dark there is no such light.
    assert np.all(np.asarray(glimpsed(cloud(BOX, 1.0, 0.2, 0.4), START, AIM).late) == 0)


@jax.jit
def moved(prepared, scene, looks, numbers, ahead):
    """What one sees of a box of other numbers, and how that changes with them."""
    nm = jnp.asarray(NM, jnp.float32)
    solver = dataclasses.replace(SOLVER, slack=2.0)

    def seen(numbers):
        dense, albedo, g = numbers
        parts = [Constant(0.5 * dense * x) for x in (albedo, 1.0 - albedo)]
        medium = Medium(BOX, *parts, HenyeyGreenstein(Constant(g)))
        other = dataclasses.replace(scene, media=(medium,), ground=Constant(0.3))
        other = jax.tree.map(lambda x: x.astype(nm.dtype), other)
        return solver.tally(prepared, other, other.lights[0], nm, *looks).mean

    return jax.jvp(seen, (numbers,), (ahead,))


@functools.cache
def box():
    """A box of optical depth 1, prepared for up to twice that, and looks at it."""
    rng = np.random.default_rng(0)  # whatever was drawn before
    solver = dataclasses.replace(SOLVER, slack=2.0)
    sky = solve(cloud(BOX, 0.45, 0.05, 0.5), solver, jnp.asarray(NM, jnp.float32))
    looks = [np.repeat(x, LOOKS // len(START), 0) for x in (START, AIM)]
    looks[0] = looks[0] * (1.0 + 1e-6 * rng.uniform(-1.0, 1.0, (LOOKS, 1)))
    return sky.prepared, sky.scene, [jnp.asarray(x, jnp.float32) for x in looks]


def test_gradients_are_those_of_differences():
    # How dense it is, how white, and how far ahead it scatters; the bounds stay.
    at = jnp.array([1.0, 0.9, 0.5], jnp.float32)
    look = lambda at, ahead: moved(*box(), at, ahead)
    for one, step in zip(jnp.eye(3, dtype=jnp.float32), (0.2, 0.08, 0.1), strict=True):
        ends = [look(at + sign * step * one, one)[0] for sign in (1.0, -1.0)]
        both = look(at, one)[1], (ends[0] - ends[1]) / (2.0 * step)
        found = [np.asarray(x, float).mean(1) for x in both]
        parts = [x.reshape(len(START), -1) for x in found]
        mean, due = (x.mean(1) for x in parts)
        error = [x.std(1, ddof=1) / np.sqrt(x.shape[1]) for x in parts]
        assert np.all(np.abs(mean - due) < 4.0 * np.hypot(*error))
        assert np.any(np.hypot(*error) < 0.2 * np.abs(due))


@drawn(24)
@given(decades(1e-6, 2.0, 0.0), within(0.0, 1.0), within(-0.99, 0.99, 0.0))
def test_random_boxes_have_slopes(dense, albedo, g):
    at, ahead = jnp.array([dense, albedo, g], jnp.float32), jnp.ones(3, jnp.float32)
    found, slope = moved(*box(), at, ahead)
    assert np.all(np.isfinite(found) & (found >= 0.0))
    assert np.all(np.isfinite(slope))


def test_fire_shines_and_lights_the_smoke_around_it():
    middle, radius, glow, thin = np.array([0.0, 0.0, 2.0]), 0.3, 10.0, 0.1
    fire = Medium(Ball(middle, radius), emission=Glow(glow))
    smoke = Medium(Box(LOWER, UPPER), scattering=thin)
    solver = VolumeTracing(walks=2048, paths=8, cells=4)
    sky = solve(Scene(Flat(), 10.0, (fire, smoke), ()), solver, NM)
    look = lambda x: estimate(
        sky, jnp.asarray([x, -4.0, 2.0]), jnp.asarray([0, 1.0, 0])
    )
    found = look(0.0)
    np.testing.assert_allclose(found.mean, glow * 2.0 * radius, rtol=0.1)
    # Beside it one sees what has turned once: the integral over the ball and the ray.
    inside = rng.uniform(-radius, radius, (4000, 3))
    inside = inside[np.sum(inside**2, 1) < radius**2]
    along = np.linspace(-0.99, 0.99, 100)
    places = np.stack([0.8 + 0.0 * along, along, 0.0 * along], 1)
    far = np.sum((places[:, None] - inside[None]) ** 2, -1)
    volume = 4.0 / 3.0 * np.pi * radius**3
    due = thin / (4.0 * np.pi) * glow * volume * np.mean(1.0 / far) * 2.0
    found = look(0.8)
    assert np.all(found.standard_error < 0.2 * due)
    assert np.all(np.abs(found.mean - due) < 4.5 * found.standard_error + 0.15 * due)


def test_what_it_does_not_hold_for_is_refused():
    with pytest.raises(ValueError, match="`walks` must be at least 2; got 1"):
        VolumeTracing(walks=1)
    glows = Medium(GRID, emission=Glow(1.0))
    with pytest.raises(ValueError, match="emission` must be None"):
        solve(Scene(Flat(), 10.0, (glows,), ()), PathTracing(), NM)
