"""Line integrals, and the light of the sun's disk at the end of them."""

import datetime
import itertools
import warnings

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad

from atmos.geometry import Flat, Spherical
from atmos.light import ephemeris, limb_darkening, Sun
from atmos.medium import Exponential, Medium, Tent, Uniform
from atmos.quantity import deg
from atmos.scene import Scene
from atmos.spectrum import Constant
from atmos.transport import (
    columns,
    cumulative,
    direct_irradiance,
    enter,
    FINE,
    gauss_legendre,
    optical_depth,
    transmittance,
)


RADIUS, TOP = 6360e3, 60e3
# Each with what a quadrature must know: the altitudes of its kinks and its density.
PROFILES = {
    "air": (Exponential(8e3), [], lambda h: np.exp(-h / 8e3)),
    "dust": (Exponential(1.2e3), [], lambda h: np.exp(-h / 1.2e3)),
    "ozone": (
        Tent(25e3, 15e3),
        [10e3, 25e3, 40e3],
        lambda h: max(0.0, 1.0 - abs(h - 25e3) / 15e3),
    ),
    "shell": (Uniform(5e3, 20e3), [5e3, 20e3], lambda h: float(5e3 <= h <= 20e3)),
}
WORLD = Scene(
    Spherical(RADIUS),
    TOP,
    tuple(Medium(x, absorption=1.0) for x, _, _ in PROFILES.values()),
    (),
)
WAVELENGTH = jnp.array([400.0, 550.0, 700.0])
dtypes = pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])


def cast(tree, dtype):
    return jax.tree.map(lambda x: x.astype(dtype), tree)


def towards(zenith, azimuth=0.6435):
    level = np.sin(zenith)
    return np.stack([level * np.sin(azimuth), level * np.cos(azimuth), np.cos(zenith)])


def exact(altitude, direction):
    """The columns by adaptive quadrature over altitude.

    On rays that graze, over the root of the height above their lowest place, where the
    integrand has no pole.
    """
    direction = np.asarray(direction, float) / np.linalg.norm(direction.astype(float))
    mu, level = direction[2], np.hypot(direction[0], direction[1])
    lowest = altitude * level - RADIUS * mu**2 / (1.0 + level)
    if altitude > TOP and (mu >= 0.0 or lowest >= TOP):
        return np.zeros(len(PROFILES))
    rise = (RADIUS + altitude) * mu
    steep = lowest < -10e3

    def along(density):
        def by_altitude(h):
            squared = rise**2 + (h - altitude) * (h + altitude + 2.0 * RADIUS)
            return density(h) * (RADIUS + h) / np.sqrt(squared)

        def by_root(u):
            h = lowest + u * u
            return density(h) * 2.0 * (RADIUS + h) / np.sqrt(h + lowest + 2.0 * RADIUS)

        def between(low, high, kinks):
            if not steep:
                low, high = (np.sqrt(max(x - lowest, 0.0)) for x in (low, high))
                kinks = [np.sqrt(x - lowest) for x in kinks if x > lowest]
            edges = sorted([low, high, *(x for x in kinks if low < x < high)])
            function = by_altitude if steep else by_root
            pieces = zip(edges[:-1], edges[1:], strict=True)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # that 1e-13 is at the edge of rounding
                return sum(
                    quad(function, *x, epsabs=0.0, epsrel=1e-13, limit=200)[0]
                    for x in pieces
                    if function(0.5 * sum(x)) > 0.0
                )

        return between

    def total(density, kinks):
        kinks = [*kinks, 500.0, 2e3, 5e3, 15e3]
        between, first = along(density), min(altitude, TOP)
        if mu >= 0.0:
            return between(first, TOP, kinks)
        if lowest < 0.0:
            return between(0.0, first, kinks)
        return between(lowest, first, kinks) + between(lowest, TOP, kinks)

    return np.array([total(density, kinks) for _, kinks, density in PROFILES.values()])


@eqx.filter_jit
def found(scene, positions, directions, nodes=FINE):
    def one(position, direction):
        path, far, _ = enter(scene, position, direction)
        return columns(scene, path, far, nodes=nodes)

    return jax.vmap(one)(positions, directions)


def rays():
    """From the ground to space: up, level, through the limb and to the ground."""
    for altitude in (0.0, 1.0, 1e3, 10e3, 30e3, 60e3):
        dip = np.arccos(RADIUS / (RADIUS + altitude))
        yield from (
            (altitude, x)
            for x in (0.0, 0.5, 1.2, 1.5, 0.5 * np.pi - 1e-3, 0.5 * np.pi)
            if (altitude, x) < (60e3, 0.0)
        )
        if altitude:
            yield from (
                (altitude, 0.5 * np.pi + x)
                for x in (0.3 * dip, 0.9 * dip, 1.1 * dip + 1e-4, 1.0, 0.5 * np.pi)
            )
    for altitude in (60001.0, 400e3, 36000e3):
        for low in (55e3, 30e3, 17e3, 1e3, 10.0, -1e3, -100e3, -3e6):
            sine = (RADIUS + low) / (RADIUS + altitude)
            yield altitude, np.pi - np.arcsin(sine)
        yield altitude, np.pi


ALTITUDES, ZENITHS = np.array(list(rays())).T
POSITIONS = np.stack([0.0 * ALTITUDES, 0.0 * ALTITUDES, ALTITUDES], -1)
# Rounded once, so that all precisions are asked about the same rays.
DIRECTIONS = np.array([towards(x) for x in ZENITHS]).astype(np.float32)
UNIT = DIRECTIONS.astype(float)
UNIT /= np.linalg.norm(UNIT, axis=1)[:, None]


@pytest.fixture(scope="module")
def due():
    return np.array([exact(h, x) for h, x in zip(ALTITUDES, UNIT, strict=True)])


def test_columns_in_double_precision_are_right_to_1e10(due):
    got = np.asarray(found(WORLD, jnp.asarray(POSITIONS), jnp.asarray(UNIT)))
    # Of a thousandth of a metre of full density nobody needs ten digits.
    error = np.abs(got - due) / np.maximum(due, 1e-3)
    assert error.max() < 1e-10


def test_columns_in_single_precision_are_right_to_1e5(due):
    scene = cast(WORLD, jnp.float32)
    arrays = (jnp.asarray(x, jnp.float32) for x in (POSITIONS, DIRECTIONS))
    got = np.asarray(found(scene, *arrays), float)
    error = np.abs(got - due) / np.maximum(due, 1e-3)
    within = ALTITUDES <= 60e3
    assert error[within].max() < 1e-5
    # From space the rounding of a direction itself moves a ray. What that does:
    blur = 0.0
    for axis, sign in itertools.product(range(3), (-1, 1)):
        turned = DIRECTIONS.astype(float)
        turned[:, axis] *= 1.0 + sign * 2.0**-23
        turned /= np.linalg.norm(turned, axis=1)[:, None]
        moved = found(WORLD, jnp.asarray(POSITIONS), jnp.asarray(turned))
        blur = np.maximum(blur, np.abs(np.asarray(moved) - due))
    assert np.all(error < 1e-5 + 1.5 * blur / np.maximum(due, 1e-3))


def test_a_level_ray_is_chapmans_integral():
    # Chapman 1931: over the angle at the planet's centre, here in steps of tanh-sinh.
    scene = Scene(Spherical(RADIUS), 600e3, (Medium(Exponential(8e3), 0.0, 1e-5),), ())
    t = np.linspace(-3.2, 3.2, 401)
    x = 0.5 * np.pi * np.sinh(t)
    last = np.arccos(RADIUS / (RADIUS + 600e3))
    phi = last / (1.0 + np.exp(-2.0 * x))
    weight = last * 0.5 * np.pi * np.cosh(t) / (2.0 * np.cosh(x) ** 2) * (t[1] - t[0])
    height = 2.0 * RADIUS * np.sin(0.5 * phi) ** 2 / np.cos(phi)
    chapman = np.sum(weight * np.exp(-height / 8e3) * RADIUS / np.cos(phi) ** 2)
    level = jnp.array([1.0, 0.0, 0.0])
    got = optical_depth(scene, jnp.zeros(3), level, WAVELENGTH)
    np.testing.assert_allclose(got, 1e-5 * chapman, rtol=1e-10)
    # Its first terms for a large planet: Chapman's function at 90 degrees.
    ratio = RADIUS / 8e3
    series = np.sqrt(0.5 * np.pi * ratio) * (1.0 + 3.0 / (8.0 * ratio)) * 8e3
    np.testing.assert_allclose(got, 1e-5 * series, rtol=1e-6)


def test_a_shell_is_as_long_as_its_chords():
    got = np.asarray(found(WORLD, jnp.asarray(POSITIONS), jnp.asarray(UNIT)))[:, 3]
    b = (RADIUS + ALTITUDES) * np.hypot(UNIT[:, 0], UNIT[:, 1])
    x = (RADIUS + ALTITUDES) * UNIT[:, 2]
    half = lambda r: np.sqrt(np.maximum(r * r - b * b, 0.0))
    end = np.where((b < RADIUS) & (x < 0.0), -half(RADIUS), np.inf)

    def within(radius):
        first, last = np.maximum(x, -half(radius)), np.minimum(end, half(radius))
        return np.maximum(last - first, 0.0)

    due = within(RADIUS + 20e3) - within(RADIUS + 5e3)
    np.testing.assert_allclose(got, due, rtol=1e-8, atol=1e-4)


@pytest.mark.parametrize("nodes", [1, 2, 7, 8, 16, 32])
def test_the_weights_add_up_to_the_length(nodes):
    u, w = gauss_legendre(nodes)
    np.testing.assert_allclose(w.sum(), 1.0, rtol=1e-13)
    np.testing.assert_allclose(cumulative(nodes) @ np.ones(nodes), u, rtol=1e-11)
    if nodes > 1:
        np.testing.assert_allclose(cumulative(nodes) @ (2.0 * u), u * u, rtol=1e-9)


@pytest.mark.parametrize("nodes", [1, 3, 8])
def test_uniform_air_is_as_deep_as_it_is_long_with_any_nodes(nodes):
    scene = Scene(Spherical(RADIUS), TOP, (Medium(Uniform(0.0, TOP), 0.0, 1.0),), ())
    chosen = ALTITUDES > 0.0
    arrays = jnp.asarray(POSITIONS[chosen]), jnp.asarray(UNIT[chosen])
    length = jax.vmap(lambda x, d: enter(scene, x, d)[1])(*arrays)
    got = found(scene, *arrays, nodes)[:, 0]
    np.testing.assert_allclose(got, length, rtol=1e-9)


def test_few_nodes_are_right_where_there_is_much():
    # Relative to the column overhead, as what matters to light is exp(-column).
    got, best = (
        np.asarray(found(WORLD, jnp.asarray(POSITIONS), jnp.asarray(UNIT), nodes))
        for nodes in (8, 32)
    )
    overhead = np.array([8e3, 1.2e3, 15e3, 15e3])
    error = np.abs(got - best) / np.maximum(best, overhead)
    assert error.max() < 1e-4


def test_the_deeper_a_ray_looks_the_more_air_it_crosses():
    # And with no formula for an air mass, nothing gives out at the horizon.
    zeniths = np.linspace(80.0, 93.0, 261) * deg
    directions = jnp.asarray(np.stack([towards(x) for x in zeniths]))
    position = jnp.broadcast_to(jnp.array([0.0, 0.0, 10e3]), directions.shape)
    got = np.asarray(found(WORLD, position, directions))[:, 0]
    assert np.all(np.diff(got) > 0.0)


def test_a_distance_cuts_the_way_short():
    scene = eqx.tree_at(lambda x: x.media, WORLD, WORLD.media[:1])
    look = lambda h, z, far: optical_depth(
        scene,
        jnp.array([0.0, 0.0, h]),
        jnp.asarray(towards(z)),
        WAVELENGTH[:1],
        distance=jnp.asarray(far),
    )[0]
    due = 8e3 * -np.expm1(-5e3 / 8e3)
    np.testing.assert_allclose(look(0.0, 0.0, 5e3), due, rtol=1e-12)
    # From space down: only what lies in the air counts.
    due = 8e3 * (np.exp(-50e3 / 8e3) - np.exp(-TOP / 8e3))
    np.testing.assert_allclose(look(400e3, np.pi, 350e3), due, rtol=1e-9)
    assert look(400e3, np.pi, 300e3) == 0.0
    np.testing.assert_allclose(look(0.0, 0.0, 1e9), -8e3 * np.expm1(-TOP / 8e3))


def test_nothing_shines_through_the_ground():
    scene = eqx.tree_at(
        lambda x: [m.absorption.value for m in x.media], WORLD, [jnp.asarray(1e-5)] * 4
    )
    look = jax.jit(jax.vmap(lambda x, d: transmittance(scene, x, d, WAVELENGTH)))
    got = np.asarray(look(jnp.asarray(POSITIONS), jnp.asarray(UNIT)))
    lowest = (RADIUS + ALTITUDES) * np.hypot(UNIT[:, 0], UNIT[:, 1]) - RADIUS
    grounded = (UNIT[:, 2] < 0.0) & (lowest < 0.0)
    assert np.all(got[grounded] == 0.0)
    deep = np.asarray(found(WORLD, jnp.asarray(POSITIONS), jnp.asarray(UNIT))).sum(1)
    due = np.exp(-1e-5 * deep)[:, None] * np.ones(3)
    np.testing.assert_allclose(got[~grounded], due[~grounded], rtol=1e-9)


def test_no_air_has_no_depth():
    empty = Scene(Flat(), TOP, (), ())
    args = jnp.zeros(3), jnp.asarray(towards(0.5)), WAVELENGTH
    np.testing.assert_array_equal(optical_depth(empty, *args), 0.0)
    np.testing.assert_array_equal(transmittance(empty, *args), 1.0)


def test_flat_air_grows_with_the_secant():
    scene = eqx.tree_at(lambda x: x.geometry, WORLD, Flat())
    zeniths = np.array([0.0, 0.5, 1.0, 1.5])
    directions = jnp.asarray(np.stack([towards(x) for x in zeniths]))
    got = found(scene, jnp.zeros((4, 3)), directions)
    overhead = [8e3 * -np.expm1(-TOP / 8e3), 1.2e3, 15e3, 15e3]
    np.testing.assert_allclose(got, overhead / np.cos(zeniths)[:, None], rtol=1e-11)


EVEN = Constant(1.5)
AIR, VOID = (
    Scene(Spherical(RADIUS), TOP, (Medium(Exponential(8e3), absorption=x),), ())
    for x in (2e-5, 0.0)
)


@jax.jit
@jax.vmap
def direct_at(absorption, zenith, altitude, radius):
    scene = eqx.tree_at(lambda x: x.media[0].absorption.value, AIR, absorption)
    sun = Sun.at(zenith, 1.0, EVEN, radius)
    position = jnp.zeros(3).at[2].set(altitude)
    return direct_irradiance(scene, sun, position, WAVELENGTH)


def direct(scene, zeniths, altitude=0.0, radius=0.26656 * deg):
    """Of many suns, always as many, so that all tests share what is compiled."""
    absorption = scene.media[0].absorption.value
    each = np.broadcast_arrays(absorption, np.resize(zeniths, 130), altitude, radius)
    return np.asarray(direct_at(*map(jnp.asarray, each)))[: len(zeniths)]


def test_without_air_the_whole_sun_arrives():
    zeniths = jnp.array([0.0, 0.5, 1.0, 89.7 * deg, 90.3 * deg, 2.0])
    got = direct(VOID, zeniths)
    np.testing.assert_allclose(got[:4], 1.5, rtol=1e-9)
    np.testing.assert_array_equal(got[4:], 0.0)


def test_a_sun_cut_in_half_by_the_horizon_shines_half():
    got = direct(VOID, jnp.array([0.5 * np.pi]))
    np.testing.assert_allclose(got, 0.75, rtol=1e-9)
    # From a mountain one sees as much when it has sunk by the dip of the horizon.
    dip = np.arccos(RADIUS / (RADIUS + 3e3))
    got = direct(VOID, jnp.array([0.5 * np.pi + dip]), 3e3)
    np.testing.assert_allclose(got, 0.75, rtol=1e-6)


def test_the_sun_sets_smoothly():
    zeniths = np.arange(89.4, 90.6 + 1e-9, 0.01) * deg
    for scene in (VOID, AIR):
        got = np.asarray(direct(scene, jnp.asarray(zeniths)))
        step, bend = np.diff(got, axis=0), np.diff(got, 2, axis=0)
        assert np.all(step <= 1e-12) and np.all(np.isfinite(got))
        # A hundredth of a degree is a 53rd of the disk: no step, and no kink.
        assert np.abs(step).max() < 0.03 * got.max()
        assert np.abs(bend).max() < 0.005 * got.max()
        np.testing.assert_allclose(got[-30:], 0.0, atol=1e-15)


def test_a_small_disk_is_a_point():
    zeniths = np.array([0.3, 1.0, 1.5])
    one = direct(AIR, zeniths, 0.0, 1e-5)
    due = [1.5 * np.exp(-2e-5 * exact(0.0, towards(x, 1.0))[0]) for x in zeniths]
    np.testing.assert_allclose(one, np.array(due)[:, None] * np.ones(3), rtol=1e-7)
    np.testing.assert_allclose(direct(AIR, zeniths, 0.0, 0.0), one, rtol=1e-7)


def test_the_air_dims_a_low_sun_strip_by_strip():
    # By adaptive quadrature over the disk's height, with the columns of `exact`.
    zenith, radius = 89.5 * deg, 0.26656 * deg
    sun = Sun.at(zenith, 1.0, EVEN, radius)
    depth = lambda x: 2e-5 * exact(0.0, towards(zenith - radius * x, 1.0))[0]
    share = lambda x: float(sun.slice(jnp.asarray(x), WAVELENGTH[:1])[0])
    due = quad(lambda x: share(x) * np.exp(-depth(x)), -1, 1, epsrel=1e-9)[0]
    got = direct(AIR, jnp.array([zenith]))[0, 0]
    np.testing.assert_allclose(got, 1.5 * due, rtol=1e-6)


@dtypes
def test_the_disk_drawn_is_the_irradiance(dtype):
    sun = cast(Sun.at(0.7, 2.0, EVEN), dtype)
    wavelength = jnp.array([310.0, 450.0, 1000.0], dtype)
    # Rings of equal versine are of equal area: Gauss in the cosine seen on the disk.
    nodes, weights = np.polynomial.legendre.leggauss(24)
    cosine, weights = 0.5 * (nodes + 1.0), 0.5 * weights
    across = np.sqrt(1.0 - cosine**2)
    angle = 2.0 * np.arcsin(across * np.sin(0.5 * 0.26656 * deg))
    z = np.array([np.sin(0.7) * np.sin(2.0), np.sin(0.7) * np.cos(2.0), np.cos(0.7)])
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    seen = np.cos(angle)[:, None] * z + np.sin(angle)[:, None] * x
    got = jax.vmap(lambda d: sun.radiance(d, wavelength))(jnp.asarray(seen, dtype))
    area = 4.0 * np.pi * np.sin(0.5 * 0.26656 * deg) ** 2
    total = np.sum((2.0 * cosine * weights)[:, None] * np.asarray(got, float), 0) * area
    rtol = 1e-4 if dtype == jnp.float32 else 1e-6
    np.testing.assert_allclose(total, 1.5, rtol=rtol)
    aside = jnp.asarray(np.cos(0.005) * z + np.sin(0.005) * x, dtype)
    np.testing.assert_array_equal(sun.radiance(aside, wavelength), 0.0)


def test_the_strips_of_the_disk_make_up_all_of_it():
    sun = Sun.at(0.0, 0.0, EVEN)
    wavelength = jnp.array([310.0, 450.0, 1000.0])
    angles, weights = np.polynomial.legendre.leggauss(40)
    angles, weights = 0.5 * np.pi * (angles + 1.0), 0.5 * np.pi * weights
    found = jax.vmap(lambda x: sun.slice(x, wavelength))(jnp.asarray(np.cos(angles)))
    total = np.sum((weights * np.sin(angles))[:, None] * np.asarray(found), 0)
    np.testing.assert_allclose(total, 1.0, rtol=1e-9)


def test_the_limb_is_as_dark_as_measured():
    # Neckel and Labs 1994, Solar Physics 153, 91: relative to the centre at mu = 0.5
    # and 0.2, and the mean of the disk.
    wavelength = [401.970, 445.125, 559.950, 700.875]
    measured = [
        [0.5965, 0.3261, 0.7303],
        [0.6421, 0.3834, 0.7596],
        [0.7131, 0.4875, 0.8061],
        [0.7690, 0.5768, 0.8434],
    ]
    found = np.asarray(limb_darkening(jnp.array(wavelength)))
    powers = np.arange(6)[:, None]
    means = np.sum(found * 2.0 / (powers + 2.0), 0)
    shapes = [np.sum(found * mu**powers, 0) for mu in (0.5, 0.2)]
    np.testing.assert_allclose(np.sum(found, 0), 1.0, atol=1e-3)
    error = np.abs(np.stack([*shapes, means], -1) - measured)
    assert np.all(error.max(0) < [0.004, 0.01, 0.004])


# NREL's solar position algorithm (Reda and Andreas 2004) as in pvlib 0.16.1's
# `spa_python` and `nrel_earthsun_distance`: zenith angle and azimuth without refraction
# (degrees), distance (au). The first is the paper's own example.
PLACES = [
    ("2003-10-17T19:30:30", 39.742476, -105.1786, 50.12795, 194.34028, 0.996542),
    ("2024-06-20T12:00:00", 51.4779, 0.0, 28.04318, 179.16767, 1.016171),
    ("2020-12-21T15:30:00", -33.8688, 151.2093, 118.2748, 154.80823, 0.9837),
    ("2000-01-01T00:00:00", 0.0, 180.0, 23.08404, 178.21222, 0.983332),
    ("2045-03-20T06:10:00", -89.0, 45.0, 89.30476, 44.35432, 0.99583),
    ("1985-08-08T17:45:10", 69.6, 18.95, 79.73048, 288.47649, 1.013856),
]


@pytest.mark.parametrize("moment, latitude, longitude, zenith, azimuth, far", PLACES)
def test_the_sun_stands_where_the_almanac_says(
    moment, latitude, longitude, zenith, azimuth, far
):
    naive = datetime.datetime.fromisoformat(moment)
    found = ephemeris(naive, latitude, longitude)
    np.testing.assert_allclose(np.degrees(found[:2]), [zenith, azimuth], atol=4e-4)
    # That distance is from the earth's centre, 4.3e-5 au below our feet.
    np.testing.assert_allclose(found[2], far, atol=5e-5)
    zone = datetime.timezone(datetime.timedelta(hours=-7))
    aware = naive.replace(tzinfo=datetime.UTC).astimezone(zone)
    assert ephemeris(aware, latitude, longitude) == found


def test_a_place_that_is_not_on_earth_is_refused():
    moment = datetime.datetime(2024, 6, 20)
    with pytest.raises(
        ValueError, match="`latitude` must lie between -90.0 and 90.0; got"
    ):
        ephemeris(moment, 90.5, 0.0)
    with pytest.raises(ValueError, match="`longitude` must lie .*; got 400.0"):
        ephemeris(moment, 0.0, 400.0)
    with pytest.raises(ValueError, match="`latitude` must lie .*; got nan"):
        ephemeris(moment, float("nan"), 0.0)


def test_a_sun_knows_its_angles():
    zeniths, azimuths = np.array([0.3, 1.0, 1.9]), np.array([-2.0, 0.5, 3.0])
    for zenith, azimuth in zip(zeniths, azimuths, strict=True):
        sun = Sun.at(zenith, azimuth, EVEN)
        np.testing.assert_allclose(sun.direction, towards(zenith, azimuth), atol=1e-15)
        np.testing.assert_allclose([sun.zenith, sun.azimuth], [zenith, azimuth])
    overhead = Sun.at(0.0, 0.0, EVEN)
    assert overhead.zenith == 0.0 and overhead.azimuth == 0.0


def test_who_stands_on_the_ground_sees_it_there():
    """Not what lies elsewhere, though no air is between."""
    up = jnp.array([0.6, 0.0, 0.8])
    position = RADIUS * (up - jnp.array([0.0, 0.0, 1.0]))
    path, far, grounded = enter(WORLD, position, -up)
    assert grounded and far == pytest.approx(0.0, abs=1e-6)
    np.testing.assert_allclose(path.at(far).position, position, atol=1e-6)
