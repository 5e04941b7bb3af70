"""Laws that every profile obeys. A new one is tried by adding it to a list."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from atmos import medium, phase
from atmos.geometry import Flat, Spherical
from atmos.medium import (
    Ball,
    Box,
    coloured,
    Everywhere,
    Exponential,
    Glow,
    Grid,
    HeightFog,
    Medium,
    Noise,
    Product,
    Puff,
    StandardAtmosphere,
    Tabulated,
    Tent,
    Thermal,
    Transformed,
    Uniform,
)
from atmos.scene import Scene
from atmos.spectrum import Constant, planck, PowerLaw
from atmos.transport import column, optical_depth


TOP = 100e3
knots = np.array([0.0, 1e3, 4e3, 20e3, 60e3])
values = np.array([2.0, 5.0, 0.0, 1.0, 0.5])
# Each with the column that stands on the ground, and the altitudes where it has a kink.
LAYERED = {
    "exponential": (Exponential(8e3), 8e3 * -np.expm1(-TOP / 8e3), []),
    "thin exponential": (Exponential(400.0), 400.0, []),
    "tent": (Tent(25e3, 15e3), 15e3, [10e3, 25e3, 40e3]),
    "tent in the ground": (Tent(1e3, 2e3), 1.75e3, [1e3, 3e3]),
    "uniform": (Uniform(5e3, 20e3), 15e3, [5e3, 20e3]),
    "fog": (Uniform(0.0, 50.0), 50.0, [50.0]),
    "everywhere": (Everywhere(), TOP, []),
    "height fog": (HeightFog(100.0, 50.0), 150.0, [100.0]),
    "cut exponential": (
        Product(Exponential(8e3), Uniform(1e3, 9e3)),
        8e3 * (np.exp(-1 / 8) - np.exp(-9 / 8)),
        [1e3, 9e3],
    ),
    "table": (Tabulated(knots, values), np.trapezoid(values, knots), knots[1:]),
    "table aloft": (
        Tabulated(np.array([9e3, 9.5e3, 11e3]), np.array([0.0, 1.0, 0.0])),
        1e3,
        [9e3, 9.5e3, 11e3],
    ),
}
ball = Ball(np.array([1e3, -2e3, 5e3]), 800.0)
rng = np.random.default_rng(0)
lower, upper = np.array([-1e3, 0.0, 2e3]), np.array([2e3, 500.0, 3e3])
# Its columns: a box that leans and is turned about the vertical.
TURN = np.array([[2e3, -100.0, 300.0], [1e3, 600.0, 0.0], [0.0, 0.0, 900.0]])
LOCAL = {
    "ball": ball,
    "grid": Grid(rng.uniform(0.0, 1.0, (4, 3, 5)), lower, upper),
    "box": Grid(np.ones((2, 2, 2)), lower, upper),
    "one cell": Grid(np.ones((1, 1, 1)), lower, upper),
    "real box": Box(lower, upper),
    "turned box": Transformed(Box(np.zeros(3), np.ones(3)), TURN, lower),
    "half ball": Product(ball, Uniform(5e3, 6e3)),
}
ROUGH = {
    "noise": Noise(700.0, octaves=2),
    "puff": Puff(np.array([1e3, -2e3, 5e3]), 800.0, 400.0, octaves=2),
}
ALL = {
    **{name: profile for name, (profile, _, _) in LAYERED.items()},
    "standard atmosphere": StandardAtmosphere(),
    **LOCAL,
    **ROUGH,
}
each = pytest.mark.parametrize("profile", ALL.values(), ids=ALL)
each_layered = pytest.mark.parametrize(
    "profile, total, kinks", LAYERED.values(), ids=LAYERED
)
each_world = pytest.mark.parametrize("world", [Spherical(6360e3), Flat()])


def unit(directions):
    return directions / np.linalg.norm(directions, axis=-1)[:, None]


def path(world, position, direction):
    position, direction = jnp.asarray(position, float), jnp.asarray(direction, float)
    return world.path(world.locate(position), direction)


def over(altitudes):
    """Places straight above the origin."""
    nought = jnp.zeros_like(altitudes)
    return jnp.stack([nought, nought, altitudes], -1)


@eqx.filter_jit
def density(profile, positions):
    return jax.vmap(lambda x: profile.density(Flat().locate(x)))(positions)


@eqx.filter_jit
def passed(profile, world, positions, directions, far):
    def one(position, direction):
        path = world.path(world.locate(position), direction)
        return column(profile, path, jnp.asarray(far), nodes=32)

    return jax.vmap(one)(*map(jnp.asarray, (positions, directions)))


@each
def test_density_is_never_negative(profile):
    position = rng.uniform(-3e3, 3e3, (4000, 3)) + [0.0, 0.0, 3e3]
    position[:2000, 2] = np.geomspace(1e-3, 500e3, 2000)
    found = np.asarray(density(profile, jnp.asarray(position)))
    assert np.all(np.isfinite(found) & (found >= 0.0)) and np.any(found > 0.0)


@each
@each_world
def test_breaks_rise_on_every_ray(profile, world):
    directions = np.concatenate(
        [unit(rng.normal(size=(300, 3))), np.eye(3), -np.eye(3)]
    )
    positions = rng.uniform(-3e3, 3e3, directions.shape) + [0.0, 0.0, 3e3]
    positions[::7, 2] = 200e3

    @jax.jit
    @jax.vmap
    def breaks(position, direction):
        return profile.breaks(world.path(world.locate(position), direction))

    found = np.asarray(breaks(jnp.asarray(positions), jnp.asarray(directions)))
    assert np.all(np.isfinite(found)) and np.all(np.diff(found) >= 0.0)


@eqx.filter_jit
def along(profile, position, direction, distances):
    ray = path(Spherical(6360e3), position, direction)
    density = jax.vmap(lambda s: profile.density(ray.at(s)))(distances)
    return profile.breaks(ray), ray.span(jnp.asarray(60e3)).far, density


@pytest.mark.parametrize("name", [x for x in ALL if x not in ROUGH])
def test_density_is_smooth_between_breaks(name):
    # Between neighbouring breaks a polynomial through Chebyshev's places is soon exact.
    positions = np.array(
        [[-500.0, 100.0, 2.2e3], [900.0, -2.1e3, 0.0], [0.0, 0.0, 45e3]]
    )
    directions = unit(np.array([[1.0, 0.01, 0.02], [0.0, 0.01, 1.0], [1.0, 0.0, -0.1]]))
    # Inside, a grid has a kink at every cell.
    profile = LOCAL["box"] if name == "grid" else ALL[name]
    places = 0.5 - 0.5 * np.cos(np.linspace(0.02, np.pi - 0.02, 61))
    for ray in zip(positions, directions, strict=True):
        breaks, far, _ = along(profile, *map(jnp.asarray, ray), jnp.asarray(places))
        edges = np.concatenate([[0.0], np.clip(breaks, 0.0, far), [far]])
        for begin, end in zip(edges[:-1], edges[1:], strict=True):
            if end - begin > 1e-6:
                x = begin + (end - begin) * places
                y = along(profile, *map(jnp.asarray, ray), jnp.asarray(x))[2]
                fit = np.polynomial.Chebyshev.fit(x[::2], y[::2], 26)
                assert np.max(np.abs(fit(x) - y)) < 1e-3


@each_layered
@each_world
def test_the_column_overhead_is_its_closed_form(profile, total, kinks, world):
    up, down = [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]
    positions = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, TOP]])
    found = passed(profile, world, positions, np.array([up, down]), TOP)
    np.testing.assert_allclose(found, total, rtol=1e-12)


@each_layered
def test_levels_are_where_the_profile_has_kinks(profile, total, kinks):
    levels = np.asarray(profile.levels)
    assert np.all(np.diff(levels) > 0.0)
    for kink in kinks:
        assert np.min(np.abs(levels - kink)) < 1e-9


# US Standard Atmosphere, 1976 (NOAA-S/T 76-1562), table I: geometric altitude (m) and
# mass density (kg m^-3). Up to 80 km the number density is in proportion to it.
PUBLISHED = [
    (0.0, 1.2250),
    (1e3, 1.1117),
    (2e3, 1.0066),
    (5e3, 7.3643e-1),
    (8e3, 5.2579e-1),
    (10e3, 4.1351e-1),
    (15e3, 1.9476e-1),
    (20e3, 8.8910e-2),
    (25e3, 4.0084e-2),
    (30e3, 1.8410e-2),
    (40e3, 3.9957e-3),
    (50e3, 1.0269e-3),
    (60e3, 3.0968e-4),
    (70e3, 8.2829e-5),
    (80e3, 1.8458e-5),
]
# Ibid., table VIII: number density (m^-3) at and above 86 km.
PUBLISHED_ABOVE = [
    (86e3, 1.447e20, 1e-3),
    (90e3, 7.116e19, 0.01),
    (100e3, 1.189e19, 0.1),
]


def test_the_standard_atmosphere_is_as_published():
    altitudes, due = np.array(PUBLISHED).T
    found = density(StandardAtmosphere(), over(jnp.asarray(altitudes)))
    np.testing.assert_allclose(found, due / 1.2250, rtol=1e-4)
    np.testing.assert_allclose(medium.SEA_LEVEL, 2.5470e25, rtol=1e-4)


def test_the_standard_atmosphere_goes_on_above_86_km():
    altitudes, due, within = np.array(PUBLISHED_ABOVE).T
    found = density(StandardAtmosphere(), over(jnp.asarray(altitudes)))
    error = np.abs(np.asarray(found) * medium.SEA_LEVEL / due - 1.0)
    assert np.all(error < within)


def test_the_standard_atmosphere_has_no_steps():
    levels = np.asarray(StandardAtmosphere().levels)
    low, high = (
        density(StandardAtmosphere(), over(jnp.asarray(levels * f)))
        for f in (1.0 - 1e-12, 1.0 + 1e-12)
    )
    np.testing.assert_allclose(low, high, rtol=1e-9)


def test_single_precision_knows_the_standard_atmosphere():
    altitudes = jnp.linspace(0.0, 86e3, 500, dtype=jnp.float32)
    one = density(StandardAtmosphere(), over(altitudes))
    other = density(StandardAtmosphere(), over(altitudes.astype(float)))
    assert one.dtype == jnp.float32
    np.testing.assert_allclose(one, other, rtol=1e-5)


def chord(position, direction):
    """What a ray cuts out of the ball, from where it starts."""
    apart = np.asarray(ball.centre) - position
    middle = np.sum(apart * direction, -1)
    aside = np.linalg.norm(np.cross(apart, direction), axis=-1)
    half = np.sqrt(np.maximum(float(ball.radius) ** 2 - aside**2, 0.0))
    return np.maximum(middle + half, 0.0) - np.maximum(middle - half, 0.0)


def slab(position, direction):
    """What a ray cuts out of the box, from where it starts."""
    ends = np.sort([(lower - position) / direction, (upper - position) / direction], 0)
    enter, leave = ends[0].max(-1), ends[1].min(-1)
    return np.maximum(leave, 0.0) - np.clip(enter, 0.0, np.maximum(leave, 0.0))


def rays_near(middle, size, count=400):
    """Rays towards and away from a place, from outside and inside."""
    positions = middle + rng.uniform(-4.0, 4.0, (count, 3)) * size
    positions[: count // 4] = middle + rng.uniform(-0.4, 0.4, (count // 4, 3)) * size
    positions[:, 2] = np.maximum(positions[:, 2], 1.0)
    aims = middle + rng.uniform(-0.9, 0.9, (count, 3)) * size
    return positions, unit(aims - positions)


@each_world
def test_a_ray_through_a_ball_is_its_chord(world):
    positions, directions = rays_near(np.asarray(ball.centre), 800.0)
    found = passed(ball, world, positions, directions, 30e3)
    due = chord(positions, directions)
    assert np.mean(due > 0.0) > 0.5 and np.mean(due == 0.0) > 0.05
    np.testing.assert_allclose(found, due, rtol=1e-10, atol=1e-9)


@each_world
@pytest.mark.parametrize("name", ["box", "one cell"])
def test_a_ray_through_an_even_grid_is_that_through_a_box(world, name):
    positions, directions = rays_near(0.5 * (lower + upper), upper - lower)
    found = passed(LOCAL[name], world, positions, directions, 30e3)
    due = slab(positions, directions)
    assert np.mean(due > 0.0) > 0.5
    np.testing.assert_allclose(found, due, rtol=1e-10, atol=1e-9)


def test_a_ray_through_a_turned_box_is_that_of_the_box_turned_back():
    rays = rays_near(lower + TURN.sum(1) / 2, np.abs(TURN).sum(1) / 2)
    found = passed(LOCAL["turned box"], Flat(), *rays, 30e3)
    positions, directions = (np.linalg.solve(TURN, x.T).T for x in (rays[0], rays[1]))
    positions = positions - np.linalg.solve(TURN, lower)
    ends = np.sort([-positions / directions, (1.0 - positions) / directions], 0)
    enter, leave = ends[0].max(-1), np.maximum(ends[1].min(-1), 0.0)
    due = leave - np.clip(enter, 0.0, leave)
    assert np.mean(due > 0.0) > 0.3
    np.testing.assert_allclose(found, due, rtol=1e-10, atol=1e-8)


def test_a_turned_grid_is_the_grid_seen_in_its_own_frame():
    grid, turned = LOCAL["grid"], Transformed(LOCAL["grid"], TURN / 1e3, lower)
    inside = rng.uniform(lower, upper, (2000, 3))
    found = density(turned, jnp.asarray(inside @ TURN.T / 1e3 + lower))
    np.testing.assert_allclose(found, density(grid, jnp.asarray(inside)), atol=1e-9)


@pytest.mark.parametrize("name", [*LOCAL, *ROUGH])
def test_nothing_of_a_medium_lies_outside_its_box(name):
    profile = ALL[name]
    if profile.box is None:
        assert name == "noise"
        return
    low, high = map(np.asarray, profile.box)
    places = rng.uniform(low - (high - low), high + (high - low), (4000, 3))
    outside = np.any((places < low) | (places > high), -1)
    found = np.asarray(density(profile, jnp.asarray(places)))
    assert np.all(found[outside] == 0.0) and np.any(found[~outside] > 0.0)


def test_noise_is_spread_evenly_about_0_and_has_no_steps():
    noise = Noise(1.0, level=-1.0, softness=2.0, octaves=4)
    places = rng.uniform(-200.0, 200.0, (4000, 3))
    places[::2] = np.round(places[::2])  # at the lattice, where cells meet
    found = 2.0 * np.asarray(density(noise, jnp.asarray(places))) - 1.0
    assert abs(found.mean()) < 0.02 and 0.1 < found[1::2].std() < 0.4
    near = 2.0 * np.asarray(density(noise, jnp.asarray(places - 1e-7))) - 1.0
    assert np.max(np.abs(found - near)) < 1e-5


def test_a_coloured_grid_has_the_extinction_of_the_grid_and_its_albedo():
    grid = LOCAL["grid"]
    albedo = rng.uniform(0.0, 1.0, (*grid.values.shape, 3))
    media = coloured(grid, albedo, PowerLaw(0.02, -1.0), phase.Isotropic())
    wavelength = jnp.array([620.0, 540.0, 450.0, 500.0])
    centres = (np.array([1, 2, 3]) + 0.5) / grid.values.shape
    point = Flat().locate(jnp.asarray(lower + centres * (upper - lower)))
    here = [x.profile.density(point) for x in media]
    total = sum(d * x.extinction(wavelength) for d, x in zip(here, media, strict=True))
    scatters = sum(
        d * x.scattering.evaluate(wavelength)
        for d, x in zip(here, media, strict=True)
        if x.scattering is not None
    )
    due = grid.values[1, 2, 3] * 0.02 * 550.0 / wavelength
    np.testing.assert_allclose(total, due, rtol=1e-12)
    np.testing.assert_allclose((scatters / total)[:3], albedo[1, 2, 3], rtol=1e-12)


def test_a_black_body_shines_as_planck_says():
    # Wien's displacement, 2.897771955 mm K, and Stefan and Boltzmann's constant.
    wavelength = jnp.geomspace(100.0, 1e7, 200001)
    for temperature in (300.0, 1800.0, 5772.0):
        found = np.asarray(planck(wavelength, jnp.asarray(temperature)))
        peak = np.asarray(wavelength)[np.argmax(found)]
        assert peak * temperature == pytest.approx(2.897771955e6, rel=1e-3)
        total = np.trapezoid(found, wavelength) * np.pi
        assert total == pytest.approx(5.670374419e-8 * temperature**4, rel=1e-4)


def test_a_cold_or_hot_body_has_a_radiance_and_a_slope():
    wavelength = jnp.array([400.0, 700.0, 1e5], jnp.float32)
    slope = jax.jit(jax.jacfwd(lambda t: planck(wavelength, t)))
    for temperature in (0.0, 1.0, 300.0, 1e4, 1e8):
        t = jnp.float32(temperature)
        for x in (planck(wavelength, t), slope(t)):
            assert x.dtype == jnp.float32
            assert np.all(np.isfinite(x)) and np.all(x >= 0.0)
    assert np.all(planck(wavelength, jnp.float32(0.0)) == 0.0)


def test_warm_matter_shines_as_it_absorbs():
    point, nm = Flat().locate(jnp.array([0.0, 1e2, 2.5e3])), jnp.array([500.0, 900.0])
    hot = Thermal(Grid(np.full((2, 2, 2), 1500.0), lower, upper))
    found = hot.evaluate(point, jnp.array([3.0]), nm)
    np.testing.assert_allclose(found, 3.0 * planck(nm, jnp.asarray(1500.0)))
    np.testing.assert_allclose(Glow(0.2).evaluate(point, jnp.array([3.0]), nm), 0.2)


def test_a_ray_along_a_row_of_cells_adds_them_up():
    grid = LOCAL["grid"]
    size = (upper - lower) / np.array(grid.values.shape)
    start = lower + size * [-0.5, 1.5, 0.5]
    found = passed(grid, Flat(), start[None], np.array([[1.0, 0.0, 0.0]]), 1e4)
    due = np.sum(np.asarray(grid.values)[:, 1, 0]) * size[0]
    # Within the box it has kinks that it does not tell of.
    np.testing.assert_allclose(found, due, rtol=3e-3)


def test_the_same_integrals_serve_any_medium():
    # A ball of smoke and a box of fog in thin air, in front of a round world's sky.
    air = Medium(Exponential(8e3), scattering=PowerLaw(1e-5, -4.0))
    smoke = Medium(ball, scattering=1e-3, absorption=PowerLaw(2e-3, -1.0))
    fog = Medium(LOCAL["box"], scattering=5e-4)
    world, wavelength = Spherical(6360e3), jnp.array([450.0, 650.0])
    position, aim = np.array([0.0, 0.0, 1.0]), np.array([1050.0, -2e3, 5100.0])
    direction = unit((aim - position)[None])[0]
    look = eqx.filter_jit(
        lambda media: optical_depth(
            Scene(world, 60e3, media, ()),
            jnp.asarray(position),
            jnp.asarray(direction),
            wavelength,
        )
    )
    due = chord(position, direction) * (1e-3 + 2e-3 * (550.0 / np.asarray(wavelength)))
    due = due + slab(position, direction) * 5e-4
    assert chord(position, direction) > 100.0
    np.testing.assert_allclose(look((air, smoke, fog)) - look((air,)), due, rtol=1e-10)


def test_extinction_is_what_scatters_and_what_does_not():
    wavelength = jnp.array([400.0, 550.0])
    dust = medium.of_extinction(
        PowerLaw(2e-5, -1.0), Constant(0.9), Exponential(1e3), phase.Isotropic()
    )
    due = 2e-5 * 550.0 / np.asarray(wavelength)
    np.testing.assert_allclose(dust.extinction(wavelength), due, rtol=1e-14)
    np.testing.assert_allclose(dust.scattering.evaluate(wavelength), 0.9 * due)
    assert Medium(Exponential(1e3)).extinction(wavelength) == 0.0
    assert Medium(Exponential(1e3)).scattering is None


def sides(*lengths):
    return np.ones((2, 2, 2)), np.zeros(3), np.array(lengths)


REFUSED = [
    (lambda: Exponential(0.0), "`scale_height` must be above 0 and finite; got 0.0"),
    (lambda: Exponential(np.nan), "`scale_height` .* got nan"),
    (lambda: Tent(25e3, -1.0), "`half_width` must be above 0 and finite; got -1.0"),
    (lambda: Uniform(2e3, 1e3), "`top - bottom` must be above 0 .* got -1000.0"),
    (lambda: Uniform(0.0, np.inf), "`top - bottom` must be .* finite; got inf"),
    (lambda: Ball(np.zeros(3), -2.0), "`radius` must be above 0 and finite; got -2.0"),
    (lambda: Grid(*sides(1.0, 0.0, 1.0)), "`upper - lower` must be above 0 .* got 0.0"),
    (
        lambda: Grid(np.eye(3)[None] - 2.0 * np.eye(3)[:, None], lower, upper),
        r"`values` must be 0 or above and finite; got values\[0, 0, 0\] = -1.0",
    ),
    (
        lambda: Grid(np.where(np.eye(3) > 0, np.nan, 1.0)[None], lower, upper),
        r"got values\[0, 0, 0\] = nan",
    ),
    (
        lambda: Grid(np.zeros((2, 0, 2)), lower, upper),
        r"`values` must have one cell or more; got shape \(2, 0, 2\)",
    ),
    (lambda: Box(lower, lower), "`upper - lower` must be above 0 .* got 0.0"),
    (lambda: HeightFog(1.0, 0.0), "`scale_height` must be above 0"),
    (lambda: Noise(0.0), "`size` must be above 0 and finite; got 0.0"),
    (lambda: Noise(1.0, softness=-1.0), "`softness` must be above 0"),
    (
        lambda: Puff(np.zeros(3), 1.0, 1.0, -0.5),
        "`roughness` must be 0 or above and finite; got -0.5",
    ),
    (
        lambda: Transformed(Exponential(8e3), np.eye(3), np.zeros(3)),
        "`of` must be a profile that depends on the place.* got Exponential",
    ),
    (
        lambda: Transformed(ball, np.ones((3, 3)), np.zeros(3)),
        "`matrix` must be finite and have an inverse",
    ),
    (
        lambda: coloured(LOCAL["box"], np.ones((2, 2, 3)), 1.0, phase.Isotropic()),
        r"`colour` must have the shape \(2, 2, 2, 3\); got \(2, 2, 3\)",
    ),
    (
        lambda: coloured(
            LOCAL["box"], np.full((2, 2, 2, 3), 2.0), 1.0, phase.Rayleigh()
        ),
        r"`colour` must be from 0 to 1; got colour\[0, 0, 0, 0\] = 2.0",
    ),
    (
        lambda: Tabulated(np.array([0.0, 1e3]), np.array([1.0, -1.0])),
        r"`values` must be 0 or above and finite; got values\[1\] = -1.0",
    ),
    (
        lambda: Tabulated(np.array([1e3, 0.0]), np.array([1.0, 1.0])),
        r"`knots` must be finite and rise; got \[1000. +0.\]",
    ),
    (
        lambda: Tabulated(np.array([0.0, 1.0, 2.0]), np.array([1.0, 1.0])),
        r"`values` must pair with .* `knots`; got shapes \(2,\) and \(3,\)",
    ),
]


@pytest.mark.parametrize("build, message", REFUSED)
def test_bad_input_is_refused_with_argument_rule_and_value(build, message):
    with pytest.raises(ValueError, match=message):
        build()


@each
def test_a_profile_can_be_built_inside_a_transformation(profile):
    leaves, structure = jax.tree.flatten(profile)

    @jax.jit
    def rebuilt(*leaves):
        again = jax.tree.unflatten(structure, leaves)
        rebuild = dataclasses.replace(again)
        return rebuild.density(Flat().locate(jnp.array([0.0, 0.0, 10.0])))

    assert np.isfinite(rebuilt(*leaves))
