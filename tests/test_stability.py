"""Places where sky renderers were caught being wrong, that no other file looks at.

Random skies are tried beside each solver and model: `pytest -k random`.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from atmos import medium
from atmos.geometry import Flat, Point, Spherical
from atmos.light import Sun
from atmos.medium import (
    Exponential,
    HeightFog,
    Medium,
    StandardAtmosphere,
    Tent,
    Uniform,
)
from atmos.phase import HenyeyGreenstein, Rayleigh
from atmos.quantity import deg
from atmos.scene import earth, Scene
from atmos.solver import Fixed, RayMarching, ShadowRays, SingleScattering, solve
from atmos.solver._tally import joined
from atmos.spectrum import BandAverage, Constant, planck, PowerLaw, Tabulated
from atmos.transport import direct_irradiance, optical_depth


KNOTS = np.array([400.0, 500.0, 600.0])
SPECTRA = {
    "power law": PowerLaw(1.0, -4.0, 550.0),
    "table": Tabulated(KNOTS, np.array([1.0, 3.0, 2.0])),
    "table with ends": Tabulated(KNOTS, np.array([1.0, 3.0, 2.0]), 0.0, 0.0),
    "bands": BandAverage(KNOTS, np.array([1.0, 3.0, 2.0]), 10.0),
}
PROFILES = {
    "exponential": Exponential(8e3),
    "tent": Tent(25e3, 15e3),
    "standard atmosphere": StandardAtmosphere(),
    "fog": HeightFog(50.0, 20.0),
}


@pytest.mark.parametrize("name", SPECTRA)
def test_a_wavelength_that_is_no_number_is_not_that_of_the_nearest(name):
    found = SPECTRA[name].evaluate(jnp.array([np.nan, 450.0]))
    assert np.isnan(found[0]) and np.isfinite(found[1])


@pytest.mark.parametrize("name", PROFILES)
def test_an_altitude_that_is_no_number_is_not_the_nearest(name):
    up = jnp.array([0.0, 0.0, 1.0])
    look = lambda z: PROFILES[name].density(Point(z * up, z, up))
    assert np.isnan(look(jnp.array(np.nan)))
    assert np.isfinite(look(jnp.array(100.0)))


@pytest.mark.parametrize("function", [HenyeyGreenstein(0.7), Rayleigh()])
def test_an_angle_that_is_no_number_has_no_brightness(function):
    assert np.all(np.isnan(function.evaluate(jnp.array(np.nan), jnp.array([500.0]))))


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_a_black_body_is_finite_at_every_temperature(dtype):
    nm = jnp.array([200.0, 550.0, 5e4], dtype)
    look = jax.jit(jax.vmap(jax.value_and_grad(lambda t: jnp.sum(planck(nm, t)))))
    found, slope = look(jnp.array([0.0, 1e-6, 1.0, 300.0, 1e4, 1e8], dtype))
    for x in (found, slope):
        assert np.all(np.isfinite(x) & (x >= 0.0))
        assert np.all(np.diff(x[3:]) >= 0.0)


@pytest.mark.parametrize("nm", [[399.0, 500.0], [500.0, 601.0]])
def test_a_table_that_ends_before_the_picture_is_refused(nm):
    """A table of ozone that ended at 519 nm once made the rest of a sky green."""
    gas = Medium(Exponential(8e3), absorption=SPECTRA["table"])
    sun = Sun(np.array([0.0, 0.0, 1.0]), 1.0, 0.0)
    scene = Scene(Flat(), 1e5, (gas,), (sun,), 0.0)
    with pytest.raises(ValueError, match="must cover .* known from 400 to 600 nm"):
        solve(scene, SingleScattering(), np.array(nm))


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_where_no_light_is_left_it_is_known_how_much_was_lost(dtype):
    """Past a depth of 87 no number of single precision is as small as what is left."""
    up, nm = jnp.array([0.0, 0.0, 1.0], dtype), jnp.array([310.0], dtype)

    def world(depth):
        gas = Medium(Uniform(0.0, 1e3), absorption=depth / 1e3)
        scene = Scene(Flat(), 1e3, (gas,), (Sun(up, 1.0, 0.0),), 0.5)
        return jax.tree.map(lambda x: x.astype(dtype), scene)

    def thick(depth):
        return optical_depth(world(depth), jnp.zeros_like(up), up, nm)[0]

    def beam(depth):
        scene = world(depth)
        return direct_irradiance(scene, scene.lights[0], jnp.zeros_like(up), nm)[0]

    depths = jnp.array([80.0, 87.0, 88.0, 100.0, 1e4], dtype)
    look = lambda x: jax.jit(jax.vmap(jax.value_and_grad(x)))(depths)
    found, slope = look(thick)
    np.testing.assert_allclose(found, depths, rtol=1e-6)
    np.testing.assert_allclose(slope, 1.0, rtol=1e-6)
    left, slope = look(beam)
    due = np.exp(-np.asarray(depths, float))
    np.testing.assert_allclose(left, due, rtol=2e-5, atol=1e-37)
    np.testing.assert_allclose(slope, -due, rtol=2e-5, atol=1e-37)


def test_ozone_keeps_the_zenith_blue_after_sunset():
    """Without it, long ways through the air would leave it yellow (Hulburt 1953)."""
    nm, zenith = jnp.array([450.0, 600.0]), jnp.array([0.0, 0.0, 1.0])

    @jax.jit
    def blueness(elevation, column):
        sun = Sun.at(0.5 * jnp.pi - elevation * deg, 0.0, Constant(1.0), 0.0)
        sky = solve(earth(sun, ozone_column=column), SingleScattering(), nm)
        blue, orange = sky.radiance(2.0 * zenith, zenith)
        return blue / orange

    day, dusk = (blueness(x, 300.0) / blueness(x, 0.0) for x in (60.0, -4.0))
    assert 1.0 < day < 1.1
    assert dusk > 2.0


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_a_million_looks_are_averaged_without_losing_digits(dtype):
    """To a tenth of their own standard error of 3e-4, and of what plain sums lose."""
    blocks, each, golden = 125_000, 8, 2654435761

    def trials(block):
        i = (block * each + jnp.arange(each)).astype(jnp.uint32)
        shares = (i * jnp.uint32(golden) >> 8).astype(dtype) / 2.0**24
        return 0.1 + shares[:, None, None]

    dark = jnp.zeros((1, 1), dtype)
    found = jax.jit(lambda n: joined(trials, jnp.array(0), n, dark))(jnp.array(blocks))
    due = np.arange(blocks * each, dtype=np.uint64) * golden % 2**32
    due = 0.1 + (due >> 8) / 2.0**24
    assert float(found.mean[0, 0]) == pytest.approx(due.mean(), rel=2e-5)
    assert float(found.squares[0, 0]) == pytest.approx(due.var() * due.size, rel=1e-3)


def slab(scattering, absorption, ground, g=0.0):
    """Of 1 km, under a sun whose zenith angle has the cosine 0.6."""
    sun = Sun(np.array([0.8, 0.0, 0.6]), 1.0, 0.0)
    phase = HenyeyGreenstein(g)
    matter = Medium(Uniform(0.0, 1e3), scattering, absorption, phase)
    return Scene(Flat(), 1e3, (matter,), (sun,), ground)


def test_twenty_thousand_steps_in_single_precision_add_up():
    """Light that turned once, seen straight down: its closed form is a square."""
    depth, cosine = np.array([0.1, 1.0, 10.0]), 0.6
    solver = RayMarching(Fixed(20_000), ShadowRays(4))

    @jax.jit
    def look(scattering):
        sky = solve(slab(scattering, 0.0, 0.0), solver, jnp.array([500.0], jnp.float32))
        top = jnp.array([0.0, 0.0, 1e3], jnp.float32)
        return sky.radiance(top, jnp.array([0.0, 0.0, -1.0], jnp.float32))[0]

    found = [look(x) for x in jnp.asarray(depth / 1e3, jnp.float32)]
    due = -np.expm1(-depth * (1.0 + 1.0 / cosine)) * cosine / (1.0 + cosine)
    np.testing.assert_allclose(found, due / (4.0 * np.pi), rtol=5e-5)


def test_a_fit_that_starts_where_there_is_nothing_finds_what_there_is():
    """No slope ends at a bound: numbers that may not be negative leave 0 at once."""
    views = np.array([[0.6, 0.0, -0.8], [-0.6, 0.0, -0.8], [0.0, 0.0, -1.0]])
    views = jnp.asarray(np.concatenate([views, views * [1.0, 1.0, -1.0]]))
    heights = jnp.array([1e3] * 3 + [0.0] * 3)

    def look(numbers):
        scattering, absorption, ground, g = numbers
        scene = slab(1e-4 * scattering, 1e-4 * absorption, ground, g)
        sky = solve(scene, SingleScattering(nodes=6), jnp.array([500.0]))
        at = jnp.zeros((6, 3)).at[:, 2].set(heights)
        return jax.vmap(sky.radiance)(at, views)[:, 0]

    both = jax.jit(lambda x: (look(x), jax.jacfwd(look)(x)))
    there, found = jnp.array([1.0, 0.5, 0.3, 0.4]), jnp.array([1e-9, 0.0, 0.0, 0.0])
    due, _ = both(there)
    for _ in range(16):
        seen, slopes = both(found)
        assert np.all(np.isfinite(slopes))
        step = np.linalg.lstsq(slopes, due - seen, rcond=None)[0]
        # Slopes by g are nothing where nothing scatters: its first step is none.
        found = jnp.clip(found + step, 0.0, jnp.array([9.0, 9.0, 1.0, 0.99]))
    np.testing.assert_allclose(found, there, rtol=1e-6)


def test_a_table_of_densities_has_the_slopes_that_differences_have():
    """By its values, its knots and the eye's altitude, across kinks and at one."""
    knots, values = np.array([0.0, 1e3, 3e3, 1e4]), np.array([1.0, 0.3, 0.8, 0.0])
    up, nm = jnp.array([0.0, 0.6, 0.8]), jnp.array([500.0])

    @jax.jit
    @jax.value_and_grad
    def depth(numbers):
        knots, values, altitude = numbers
        gas = Medium(medium.Tabulated(knots, values), absorption=1e-4)
        world = Scene(Spherical(6.4e6), 2e4, (gas,), (), 0.0)
        eye = jnp.zeros(3).at[2].set(altitude)
        return optical_depth(world, eye, up, nm)[0]

    for altitude in (500.0, 1e3, 2e3):
        at = jnp.asarray(knots), jnp.asarray(values), jnp.asarray(altitude)
        _, slopes = depth(at)
        for i, size in ((0, 1.0), (1, 1e-3), (2, 1.0)):
            for j in np.ndindex(at[i].shape):
                if altitude == knots[1] and (i, j) == (0, (1,)):
                    continue  # there it has a kink in this
                moved = [at[i].at[j].add(x) for x in (-size, size)]
                less, more = (depth((*at[:i], x, *at[i + 1 :]))[0] for x in moved)
                due = (more - less) / (2.0 * size)
                assert float(slopes[i][j]) == pytest.approx(float(due), rel=1e-3)


def equations(program):
    """How many steps a traced program has, loops counted once."""
    count = 0
    for step in program.eqns:
        count += 1
        for x in jax.tree.leaves(
            list(step.params.values()), is_leaf=lambda x: hasattr(x, "eqns")
        ):
            inner = getattr(x, "jaxpr", x)
            count += equations(inner) if hasattr(inner, "eqns") else 0
    return count


@pytest.mark.parametrize(
    "coarse, fine",
    [
        (SingleScattering(nodes=4, pieces=4), SingleScattering(nodes=16, pieces=28)),
        # Both go round more than once, by 16 steps each time.
        (RayMarching(Fixed(32)), RayMarching(Fixed(400))),
    ],
    ids=["single", "marching"],
)
def test_a_gradient_is_no_longer_a_program_for_finer_steps(coarse, fine):
    """What is unrolled takes minutes to compile, and on CPUs runs far slower."""

    def length(solver, of):
        def look(depth):
            air = Medium(Exponential(8e3), depth / 8e3, 1e-6, Rayleigh())
            sun = Sun(np.array([0.0, 0.6, 0.8]), 1.0, 0.0)
            scene = Scene(Spherical(6.4e6), 6e4, (air,), (sun,), 0.3)
            sky = solve(scene, solver, jnp.array([500.0]))
            return sky.radiance(jnp.zeros(3), jnp.array([0.6, 0.0, 0.8]))[0]

        return equations(jax.make_jaxpr(of(look))(0.1).jaxpr)

    alone = length(coarse, lambda x: x)
    short, long = length(coarse, jax.grad), length(fine, jax.grad)
    assert 100 < alone < short < 8 * alone
    assert long <= short
