"""Where rays meet the world, in single precision and in double.

The truth is worked out in radii, the textbook's way, with the 64 bits of a long double.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from atmos.geometry import FAR, Flat, Point, Spherical
from atmos.quantity import versine


RADIUS, TOP = 6371e3, 60e3
ROUND = Spherical(RADIUS)
dtypes = pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
long = lambda x: np.asarray(x).astype(np.longdouble)


def cast(tree, dtype):
    return jax.tree.map(lambda x: x.astype(dtype), tree)


def over(altitudes, cosines):
    """Positions above the origin and directions, in single precision."""
    altitudes, cosines = np.broadcast_arrays(altitudes, cosines)
    sines = np.sqrt(np.maximum(1.0 - cosines**2, 0.0))
    nought = np.zeros_like(altitudes)
    positions = np.stack([nought, nought, altitudes], -1)
    directions = np.stack([0.6 * sines, 0.8 * sines, cosines], -1)
    return positions.astype(np.float32), directions.astype(np.float32)


@eqx.filter_jit
def paths(geometry, look, positions, directions, *more):
    def one(position, direction, *more):
        return look(geometry.path(geometry.locate(position), direction), *more)

    return jax.vmap(one)(positions, directions, *more)


def span(geometry, positions, directions, dtype=jnp.float64):
    arrays = (jnp.asarray(x, dtype) for x in (positions, directions))
    top = jnp.asarray(TOP, dtype)
    found = paths(cast(geometry, dtype), lambda path: path.span(top), *arrays)
    return np.asarray(found.near), np.asarray(found.far), np.asarray(found.grounded)


def textbook(altitudes, cosines):
    """The distance to the ground, NaN where the ray misses it."""
    r, mu, ground = long(altitudes) + long(RADIUS), long(cosines), long(RADIUS)
    squared = (r * mu) ** 2 - (r - ground) * (r + ground)
    hit = (squared >= 0.0) & (mu < 0.0)
    return np.where(hit, -r * mu - np.sqrt(np.where(hit, squared, 0.0)), np.nan)


def below_horizon(altitudes, share):
    """The cosine of the zenith angle at the horizon, times so much."""
    return (
        -share * np.sqrt(altitudes * (2.0 * RADIUS + altitudes)) / (RADIUS + altitudes)
    )


def test_single_precision_knows_which_rays_meet_the_ground():
    generator = np.random.default_rng(0)
    altitudes = 10.0 ** generator.uniform(0.0, 5.0, 200_000)
    share = 1.0 + generator.uniform(-1e-3, 1e-3, 200_000)
    near = below_horizon(altitudes, share)
    cosines = np.where(
        np.arange(200_000) % 2, near, generator.uniform(-1.0, 0.0, 200_000)
    )
    positions, directions = over(altitudes, cosines)
    due = textbook(positions[:, 2], directions[:, 2])
    near, far, grounded = span(ROUND, positions, directions, jnp.float32)
    assert np.mean(grounded != ~np.isnan(due)) <= 1e-4
    both = grounded & ~np.isnan(due)
    error = np.abs(long(far) - due)[both]
    assert error.max() < 200.0 and np.median(error / due[both]) < 1e-6
    assert np.all(near[altitudes < TOP] == 0.0)


def test_single_precision_sees_the_ground_at_its_feet():
    altitudes = np.array([1e-3, 0.1, 1.0, 1.7, 100.0])
    positions, directions = over(altitudes, -1.0)
    _, far, grounded = span(ROUND, positions, directions, jnp.float32)
    assert np.all(grounded)
    np.testing.assert_allclose(far, altitudes, rtol=1e-6)


def test_single_precision_knows_the_ground_below_from_space():
    altitudes = np.array([100e3, 400e3, 36000e3])[:, None]
    share = np.array([1.000001, 1.001, 1.01])
    cosines = np.minimum(below_horizon(altitudes, share), -0.3)
    cosines = np.concatenate([cosines, np.full((3, 1), -1.0)], 1)
    positions, directions = over(altitudes, cosines)
    positions, directions = positions.reshape(-1, 3), directions.reshape(-1, 3)
    due = textbook(positions[:, 2], directions[:, 2])
    _, far, grounded = span(ROUND, positions, directions, jnp.float32)
    assert np.all(grounded == ~np.isnan(due))
    # One rounding of the cosine moves the foot of a grazing ray far more than this.
    far, due = far[grounded], due[grounded]
    np.testing.assert_allclose(far, due.astype(float), rtol=2e-3)


@dtypes
def test_the_horizon_dips_as_it_should(dtype):
    altitudes = np.array([0.1, 1.0, 2.0, 10.0, 1e3, 1e5, 36e6])
    heights = jnp.zeros(7, dtype)
    found = jax.vmap(cast(ROUND, dtype).dip)(jnp.asarray(altitudes, dtype), heights)
    given = long(altitudes.astype(dtype))
    due = np.arccos(long(RADIUS) / (long(RADIUS) + given)).astype(float)
    np.testing.assert_allclose(found, due, rtol=1e-6 if dtype == jnp.float32 else 1e-9)


def test_the_limb_dips_less_than_the_horizon_and_nothing_above_dips():
    dip = jax.vmap(ROUND.dip, (None, 0))
    found = dip(jnp.asarray(400e3), jnp.array([0.0, 60e3, 399e3, 400e3, 500e3]))
    due = np.arccos((RADIUS + np.array([0.0, 60e3, 399e3])) / (RADIUS + 400e3))
    np.testing.assert_allclose(found[:3], due, rtol=1e-9)
    np.testing.assert_array_equal(found[3:], 0.0)
    np.testing.assert_array_equal(jax.vmap(Flat().dip)(found, found), 0.0)


@pytest.mark.parametrize("steepest, most", [(0.003, 1e-4), (1.0, 1e-2)])
def test_single_precision_keeps_the_altitude_along_a_ray(steepest, most):
    generator = np.random.default_rng(1)
    altitudes = generator.uniform(0.0, 100.0, 20_000)
    cosines = steepest * generator.uniform(0.0, 1.0, 20_000)
    positions, directions = over(altitudes, cosines)
    distances = generator.uniform(0.0, 50e3, 20_000).astype(np.float32)
    at = lambda path, distance: path.at(distance).altitude
    arrays = (jnp.asarray(x) for x in (positions, directions, distances))
    found = paths(cast(ROUND, jnp.float32), at, *arrays)
    r, mu, t = (
        long(positions[:, 2]) + long(RADIUS),
        long(directions[:, 2]),
        long(distances),
    )
    due = np.sqrt(r * r + t * (t + 2.0 * r * mu)) - long(RADIUS)
    assert np.sqrt(np.mean((long(found) - due) ** 2)) < most


def test_a_place_on_a_ray_is_where_it_says():
    generator = np.random.default_rng(2)
    positions = generator.uniform(-1.0, 1.0, (500, 3)) * [3e6, 3e6, 2e5] + [
        0.0,
        0.0,
        1e6,
    ]
    directions = generator.normal(size=(500, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    distances = generator.uniform(0.0, 1e6, 500)

    def look(path, distance):
        there = path.at(distance)
        return path.start, there, ROUND.locate(there.position)

    found = paths(ROUND, look, *map(jnp.asarray, (positions, directions, distances)))
    for point in found:
        centre = long(point.position) + [0.0, 0.0, RADIUS]
        r = np.sqrt(np.sum(centre * centre, -1))
        np.testing.assert_allclose(
            point.altitude, (r - RADIUS).astype(float), atol=1e-8
        )
        np.testing.assert_allclose(point.up, centre / r[:, None], atol=1e-15)


def test_places_are_found_all_around_the_planet():
    ends = np.array(
        [[0, 0, 5e3], [0, 0, -2 * RADIUS - 5e3], [RADIUS + 5e3, 0, -RADIUS]]
    )
    found = jax.vmap(ROUND.locate)(jnp.asarray(ends))
    np.testing.assert_allclose(found.altitude, 5e3, atol=1e-8)
    np.testing.assert_allclose(found.up, [[0, 0, 1], [0, 0, -1], [1, 0, 0]], atol=1e-15)
    single = cast(ROUND, jnp.float32).locate(jnp.array([0.0, 0.0, 60e3], jnp.float32))
    assert single.altitude == 60e3


@dtypes
def test_the_air_seen_from_its_top_comes_and_goes_without_a_jump(dtype):
    step = 1.0 / 128.0
    altitudes = np.array([TOP - step, TOP, TOP + step, 400e3, 36000e3])[:, None]
    tangent = -np.sqrt(1.0 - ((RADIUS + TOP) / (RADIUS + 400e3)) ** 2)
    cosines = np.array([-1.0, -0.99, tangent - 1e-3, tangent, tangent + 1e-3, 0.0, 1.0])
    positions, directions = over(altitudes, cosines)
    near, far, grounded = (
        x.reshape(5, 7)
        for x in span(ROUND, positions.reshape(-1, 3), directions.reshape(-1, 3), dtype)
    )
    assert np.all(np.isfinite(near) & np.isfinite(far))
    assert np.all((near >= 0.0) & (far >= near))
    length = far - near
    np.testing.assert_array_equal(length[1:, -1], 0.0)  # looking up
    np.testing.assert_array_equal(length[1:, -2], 0.0)  # looking along the top
    assert length[0, -1] <= 2.0 * step and length[0, -2] <= 2.0 * np.sqrt(
        2.0 * (RADIUS + TOP) * step
    )
    assert np.all(grounded[:, 0]) and not np.any(grounded[:, -2:])
    np.testing.assert_allclose(length[:, 0], TOP, rtol=1e-4)
    # Down to a hundredth of a metre in altitude, the way through changes as little.
    np.testing.assert_allclose(length[0, :2], length[1, :2], atol=0.1)
    np.testing.assert_allclose(length[2, :2], length[1, :2], atol=0.1)


@dtypes
def test_on_the_ground_and_just_below_it_one_sees_the_sky(dtype):
    altitudes = np.array([-0.5, -1e-6, 0.0, 1e-6])[:, None]
    cosines = np.array([-1.0, -0.1, 0.1, 1.0])
    positions, directions = over(altitudes, cosines)
    near, far, grounded = (
        x.reshape(4, 4)
        for x in span(ROUND, positions.reshape(-1, 3), directions.reshape(-1, 3), dtype)
    )
    np.testing.assert_array_equal(near, 0.0)
    np.testing.assert_array_equal(grounded, np.broadcast_to(cosines < 0.0, (4, 4)))
    np.testing.assert_allclose(far[:, :2], 0.0, atol=1e-4)
    due = np.broadcast_to(far[2, 2:], (4, 2))
    np.testing.assert_allclose(far[:, 2:], due, rtol=2e-5)


@dtypes
def test_small_angles_keep_their_digits(dtype):
    tilt, angles = 0.7, np.geomspace(1e-6, 0.1, 50)
    sun = np.array([np.sin(tilt), 0.0, np.cos(tilt)]).astype(dtype)
    seen = [np.sin(tilt + angles), np.zeros(50), np.cos(tilt + angles)]
    seen = np.stack(seen, -1).astype(dtype)
    found = jax.vmap(versine, (0, None))(jnp.asarray(seen), jnp.asarray(sun))
    found = 2.0 * np.arcsin(np.sqrt(0.5 * np.asarray(found, float)))
    seen, sun = seen.astype(float), sun.astype(float)
    due = np.arctan2(np.linalg.norm(np.cross(seen, sun), axis=1), seen @ sun)
    # Rounded directions differ in length, which adds to the chord.
    np.testing.assert_allclose(found, due, rtol=1e-6, atol=2e-10)


def test_a_huge_planet_is_flat():
    generator = np.random.default_rng(3)
    positions = np.stack([*np.zeros((2, 200)), generator.uniform(0.0, 100e3, 200)], -1)
    zeniths = generator.uniform(0.0, np.pi, 200)
    zeniths = np.where(np.abs(zeniths - 0.5 * np.pi) < 0.05, 0.3, zeniths)
    _, directions = over(0.0, np.cos(zeniths))
    directions = directions.astype(float)
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    huge = Spherical(1e13)
    one, other = span(huge, positions, directions), span(Flat(), positions, directions)
    for found, due in zip(one, other, strict=True):
        np.testing.assert_allclose(found, due, rtol=1e-6, atol=1e-3)

    def look(path):
        return path.at(jnp.asarray(1e4)).altitude, path.crossings(jnp.asarray(3e4))[:]

    arrays = jnp.asarray(positions), jnp.asarray(directions)
    (high, _), (due, cross) = paths(huge, look, *arrays), paths(Flat(), look, *arrays)
    np.testing.assert_allclose(high, due, atol=1e-3)
    np.testing.assert_array_equal(cross[:, 0], cross[:, 1])


def test_a_ray_crosses_an_altitude_where_it_has_it():
    generator = np.random.default_rng(4)
    altitudes = generator.uniform(0.0, 400e3, 500)
    positions, directions = over(altitudes, generator.uniform(-1.0, 1.0, 500))

    def look(path):
        low = path.at(path.lowest()).altitude
        found = path.crossings(jnp.asarray(20e3))
        return low, found, jax.vmap(path.at)(found).altitude

    arrays = jnp.asarray(positions, float), jnp.asarray(directions, float)
    low, distances, there = paths(ROUND, look, *arrays)
    low, distances, there = map(np.asarray, (low, distances, there))
    crosses = low < 20e3
    np.testing.assert_allclose(there[crosses], 20e3, atol=1e-5)
    assert np.all(np.diff(distances[crosses]) > 0.0)
    np.testing.assert_array_equal(np.diff(distances[~crosses]), 0.0)
    np.testing.assert_allclose(there[~crosses, 0], low[~crosses], atol=1e-5)


SUNS = np.array([30.0, 85.0, 89.99, 90.0, 90.5, 92.0, 96.0, 108.0, 170.0])


def shadows(dtype, height, unit=True):
    """Rays at random, each with the bounds of its shadow under one of the suns."""
    generator = np.random.default_rng(5)
    altitudes = 10.0 ** generator.uniform(0.0, 6.0, 1800)
    positions, directions = over(altitudes, generator.uniform(-1.0, 1.0, 1800))
    suns = np.radians(np.tile(SUNS, 200))
    suns = np.stack([np.sin(suns), 0.0 * suns, np.cos(suns)], -1).astype(np.float32)
    if unit:
        directions, suns = (
            x.astype(float) / np.linalg.norm(x.astype(float), axis=1)[:, None]
            for x in (directions, suns)
        )
    look = lambda path, sun: path.shadow(sun, jnp.asarray(height, dtype))
    arrays = (jnp.asarray(x, dtype) for x in (positions, directions, suns))
    found = np.asarray(paths(cast(ROUND, dtype), look, *arrays), float)
    return long(positions), long(directions), long(suns), found


def hidden(positions, directions, suns, distances, height):
    """Has the sun's light passed below this height on its way? Worked out in radii."""
    at = positions + [0.0, 0.0, RADIUS] + distances[:, None] * directions
    along = np.sum(at * suns, -1)
    across = np.sqrt(np.maximum(np.sum(at * at, -1) - along * along, 0.0))
    return (along < 0.0) & (across < RADIUS + height)


@pytest.mark.parametrize("height", [0.0, 10e3])
def test_the_shadow_is_where_the_sun_is_hidden(height):
    *world, found = shadows(jnp.float64, height)
    dark = 0
    for share in np.linspace(0.0, 1.0, 101):
        distances = long(np.full(len(found), 8e6 * share**2))
        due = hidden(*world, distances, height)
        told = (distances > found[:, 0]) & (distances < found[:, 1])
        doubtful = np.min(np.abs(distances[:, None] - found), 1) < 1e-3
        assert np.all((due == told) | doubtful)
        dark += due.sum()
    assert dark > 10_000


def test_the_shadow_begins_and_ends_to_a_hundredth_of_a_metre():
    *world, found = shadows(jnp.float64, 0.0)
    inside = (found > 1.0) & (found < 8e6)
    for end, before in [(0, False), (1, True)]:
        chosen = inside[:, end]
        assert chosen.sum() > 50
        for aside, due in [(-0.01, before), (0.01, not before)]:
            told = hidden(*world, long(found[:, end] + aside), 0.0)
            assert np.all(told[chosen] == due)


def test_the_shadow_ends_in_single_precision_where_it_does_in_double():
    one = shadows(jnp.float32, 0.0, unit=False)[-1]
    other = shadows(jnp.float64, 0.0, unit=False)[-1]
    there = np.abs(other) < 0.5 * FAR
    np.testing.assert_array_equal(np.abs(one) < 0.5 * FAR, there)
    near = there & (np.abs(other) < 4e6)
    np.testing.assert_allclose(one[near], other[near], atol=2.0)


def test_flat_ground_hides_a_sun_below_it_and_no_other():
    start = Flat().locate(jnp.array([0.0, 0.0, 10.0]))
    path = Flat().path(start, jnp.array([0.6, 0.0, 0.8]))
    nought = jnp.asarray(0.0)
    above = path.shadow(jnp.array([0.0, 0.6, 0.8]), nought)
    below = path.shadow(jnp.array([0.0, 0.6, -0.8]), nought)
    np.testing.assert_array_equal(above, [FAR, FAR])
    np.testing.assert_array_equal(below, [-FAR, FAR])
    assert isinstance(start, Point) and start.altitude == 10.0
