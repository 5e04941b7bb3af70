"""Path tracing against closed forms and published numbers, in standard errors."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hostile import decades, drawn, rows, within
from hypothesis import given

from atmos.geometry import Flat, Spherical
from atmos.light import Sun
from atmos.medium import Ball, Exponential, Medium, of_extinction, Tent, Uniform
from atmos.phase import HenyeyGreenstein, Isotropic, Rayleigh
from atmos.quantity import deg
from atmos.scene import Scene
from atmos.solver import (
    _directions,
    estimate,
    PathTracing,
    SingleScattering,
    solve,
    Tally,
)
from atmos.spectrum import Constant, PowerLaw, Tabulated


# In the slabs each "wavelength" is a case of its own.
CASES = np.array([400.0, 500.0, 600.0])
COLOURS = np.array([400.0, 550.0, 700.0])
TRACED = PathTracing(walks=2, paths=8, single=None)
LOOKS = 256


def per_case(values):
    return Tabulated(CASES, np.broadcast_to(np.asarray(values, float), CASES.shape))


def slab(depth, albedo, asymmetry, cosine, ground=0.0):
    """A slab one metre thick, under a sun of irradiance 1."""
    medium = of_extinction(
        per_case(depth),
        per_case(albedo),
        Uniform(0.0, 1.0),
        HenyeyGreenstein(per_case(asymmetry)),
    )
    sun = Sun(np.array([np.sqrt(1.0 - cosine**2), 0.0, cosine]), Constant(1.0), 0.0)
    scene = Scene(Flat(), 1.0, (medium,), (sun,), per_case(ground))
    return solve(scene, TRACED, CASES)


def look(sky, positions, directions, key, block=0):
    solver = eqx.tree_at(lambda x: x.key, TRACED, key)
    world = sky.prepared, sky.scene, sky.scene.lights[0], sky.wavelength
    return solver.tally(*world, jnp.asarray(positions), jnp.asarray(directions), block)


def radiance(sky, altitude, cosine, seed=0):
    """Mean and standard error of many walks in one direction, across the sun's."""
    level = np.sqrt(1.0 - cosine**2)
    directions = np.broadcast_to([-level, 0.0, cosine], (LOOKS, 3))
    return mean(look(sky, places(altitude), directions, jax.random.key(seed)))


def places(altitude):
    return np.broadcast_to([0.0, 0.0, altitude], (LOOKS, 3))


def mean(tally):
    found = np.asarray(tally.mean)
    return found.mean(0), found.std(0, ddof=1) / np.sqrt(len(found))


def flux(sky, altitude, seed=0):
    """What falls through a level from the side that is not the sun's, from above if it
    is the ground."""
    random = np.random.default_rng(seed)
    share = (np.arange(LOOKS) + random.uniform(size=LOOKS)) / LOOKS
    turn = random.permutation(2.0 * np.pi * share)
    across, along = np.sqrt(1.0 - share), np.sqrt(share)
    along = along if altitude == 0.0 else -along
    directions = np.stack([across * np.cos(turn), across * np.sin(turn), along], -1)
    found = look(sky, places(altitude), directions, jax.random.key(seed))
    value, error = mean(found)
    return np.pi * value, np.pi * error


def agree(found, truth, sigmas=3.5):
    value, error = found
    assert np.all(np.isfinite(value)) and np.all(error > 0.0)
    assert np.all(np.abs(value - truth) <= sigmas * error), (value, truth, error)


def test_fluxes_of_slabs_are_van_de_hulst_s():
    # Multiple Light Scattering (1980), Tables 12 and 35: depth 1, sun overhead. With
    # the direct light, exp(-1).
    sky = slab(1.0, [1.0, 1.0, 0.9], [0.0, 0.5, 0.5], 1.0)
    through, error = flux(sky, 0.0)
    assert np.all(error < 0.02)
    agree((through + np.exp(-1.0), error), [0.65867, 0.82389, 0.73909])
    back, error = flux(sky, 1.0, seed=1)
    agree((back[:2], error[:2]), [0.34133, 1.0 - 0.82389])


def test_a_very_thick_slab_is_chandrasekhar_s():
    # Radiative Transfer (1960), chapter III: isotropic scattering by an atmosphere
    # without end; his H from its integral equation.
    albedo, sun, view = np.array([0.2, 0.5, 0.9]), 0.6, 0.8
    x, w = np.polynomial.legendre.leggauss(64)
    x, w = 0.5 * (x + 1.0), 0.5 * w

    def h_of(cosine, h):
        integral = np.sum(w * x * h / (cosine[:, None, None] + x), -1)
        root = np.sqrt(1.0 - albedo)
        return 1.0 / (root + 0.5 * albedo * integral)

    h = np.ones((3, 64))
    for _ in range(200):
        h = 0.5 * (h + h_of(x, h).T)
    ends = h_of(np.array([sun, view]), h)
    truth = 0.25 / np.pi * albedo * sun / (sun + view) * ends[0] * ends[1]
    found = radiance(slab(40.0, albedo, 0.0, sun), 1.0, -view)
    assert np.all(found[1] < 0.03 * truth)
    agree(found, truth)


def test_radiances_are_disort_s():
    # DISORT's test problem 1a (Stamnes et al. 2000): depth 1/32, albedo 0.2, grazing
    # sun of irradiance 10 pi; converged in streams.
    sky = slab(0.03125, [0.2, 1.0, 0.0], 0.0, 0.1)
    for altitude, view, truth in [(1.0, -0.5, 0.0264219), (0.0, 1.0, 0.0133851)]:
        value, error = radiance(sky, altitude, view)
        value, error = 10.0 * np.pi * value, 10.0 * np.pi * error
        agree((value[:1], error[:1]), truth)
        assert error[0] < 0.01 * truth
        # A case that scatters nothing shows nothing.
        assert value[2] == 0.0


@pytest.mark.parametrize("depth", [0.5, 4.0])
def test_a_white_world_gives_back_all(depth):
    sky = slab(depth, 1.0, [0.0, 0.75, -0.5], 0.5, ground=1.0)
    agree(flux(sky, 1.0), 0.5)


def test_what_scatters_nothing_is_black():
    for sky in [slab(1.0, 0.0, 0.0, 0.5), slab(0.0, 1.0, 0.0, 0.5)]:
        for altitude, view in [(0.0, 0.5), (1.0, -0.5)]:
            value, error = radiance(sky, altitude, view)
            assert np.all(value == 0.0) and np.all(error == 0.0)


def test_a_bare_ground_shines_as_lambert_says():
    value, _ = radiance(slab(0.0, 1.0, 0.0, 0.5, ground=0.3), 1.0, -0.5)
    np.testing.assert_allclose(value, 0.3 * 0.5 / np.pi, rtol=1e-12)
    # As it does where what turned once comes from the march.
    scene = slab(0.0, 1.0, 0.0, 0.5, ground=0.3).scene
    sky = solve(scene, PathTracing(walks=2, paths=1), CASES)
    down = jnp.array([0.0, 0.0, -1.0])
    found = estimate(sky, jnp.array([0.0, 0.0, 1.0]), down)
    np.testing.assert_allclose(found.mean, 0.3 * 0.5 / np.pi, rtol=1e-12)
    assert np.all(found.standard_error == 0.0)


def test_standard_errors_are_the_scatter_of_the_means():
    # They also fall with the square root of the number of trials, as it is so: the
    # trials of eight calls, taken together, against each alone.
    sky = slab(1.0, 0.9, 0.5, 0.5)
    calls = [radiance(sky, 0.0, 0.5, seed) for seed in range(16)]
    values, errors = (np.stack(x) for x in zip(*calls, strict=True))
    expected = np.mean(errors**2, 0)
    # Chi-squared with 15 degrees of freedom: this holds with probability 0.999.
    assert np.all(np.abs(values.var(0, ddof=1) / expected - 1.0) < 1.5)
    trials = np.random.default_rng(0).normal(size=(4096, 3))
    parts = [Tally.of(jnp.asarray(x)) for x in np.split(trials, 16)]
    whole = parts[0]
    for part in parts[1:]:
        whole = whole.join(part)
    np.testing.assert_allclose(whole.mean, trials.mean(0), atol=1e-14)
    np.testing.assert_allclose(whole.standard_error, trials.std(0, ddof=1) / 64.0)
    np.testing.assert_allclose(
        np.sqrt(16.0) * whole.standard_error, parts[3].standard_error, rtol=0.2
    )


def test_the_key_decides_all():
    sky = slab(1.0, 0.9, 0.5, 0.5)
    arguments = sky, places(0.0), np.broadcast_to([0.6, 0.0, 0.8], (LOOKS, 3))
    key = jax.random.key(5)
    one, again = (look(*arguments, key).mean for _ in range(2))
    assert np.all(one == again)
    assert np.any(one != look(*arguments, key, 1).mean)
    assert np.any(one != look(*arguments, jax.random.key(6)).mean)


def world(amount):
    """So much of air, dust and ozone around a planet."""
    air = Medium(
        Exponential(8e3),
        PowerLaw(amount * 1.24062e-6, -4.0, 1e3),
        phase=Rayleigh(PowerLaw(0.03, -1.0, 500.0)),
    )
    dust = of_extinction(
        PowerLaw(amount * 4e-5, -0.8, 550.0),
        Constant(0.9),
        Exponential(1.2e3),
        HenyeyGreenstein(0.7),
    )
    ozone = Medium(Tent(25e3, 15e3), absorption=Constant(amount * 2e-6))
    sun = Sun(np.array([0.0, 0.0, 1.0]), Constant(2.0), 0.0)
    return Scene(Spherical(6360e3), 60e3, (air, dust, ozone), (sun,), 0.3)


def towards(zenith, azimuth):
    level = np.sin(zenith * deg)
    parts = level * np.sin(azimuth * deg), level * np.cos(azimuth * deg)
    return np.array([*parts, np.cos(zenith * deg)])


ROUND = [
    # sun, altitude of the eye, view zenith and azimuth
    (30.0, 0.0, 80.0, 60.0),
    (88.0, 10e3, 93.0, 20.0),
    (93.0, 0.0, 85.0, 40.0),
    (60.0, 400e3, 160.0, 90.0),
    (91.0, 400e3, 109.2, 10.0),
]


@eqx.filter_jit
def look_round(scene, layers, suns, positions, directions):
    def one(sun, position, direction):
        light = eqx.tree_at(lambda x: x.direction, scene.lights[0], sun)
        lit = eqx.tree_at(lambda x: x.lights[0], scene, light)
        solver = PathTracing(walks=64, paths=16, single=None)
        fine = SingleScattering(nodes=16, light_nodes=16)
        once = solve(lit, fine, COLOURS).radiance(position, direction)
        looks = position[None], direction[None]
        tally = solver.tally(layers, scene, light, jnp.asarray(COLOURS), *looks)
        return tally.mean[0], tally.standard_error[0], once

    return jax.vmap(one)(suns, positions, directions)


def looks():
    suns = np.stack([towards(x[0], 0.0) for x in ROUND])
    positions = np.stack([[0.0, 0.0, x[1]] for x in ROUND])
    return suns, positions, np.stack([towards(*x[2:]) for x in ROUND])


def test_thin_air_scatters_once_in_a_round_world():
    scene = world(1e-6)
    # A ground as good as black, so that what it throws into the air is not seen.
    scene = eqx.tree_at(lambda x: x.ground.value, scene, jnp.asarray(1e-8))
    layers = PathTracing().prepare(scene, jnp.asarray(COLOURS))
    mean, error, once = look_round(scene, layers, *looks())
    assert np.all(error < 0.1 * once)
    agree((np.asarray(mean), np.asarray(error)), once, 4.0)


def test_a_poor_guess_changes_the_noise_alone():
    scene = world(1.0)
    layers = PathTracing().prepare(scene, jnp.asarray(COLOURS))
    shares = jnp.full_like(layers.whence, 1.0 / layers.whence.shape[2])
    poor = eqx.tree_at(
        lambda x: (x.guess, x.diffuse, x.whence),
        layers,
        (layers.guess**0.5, layers.diffuse**0.5, shares),
    )
    good, few, _ = look_round(scene, layers, *looks())
    other, many, _ = look_round(scene, poor, *looks())
    agree((np.asarray(other), np.hypot(few, many)), good, 4.0)
    assert np.all(np.mean(few / good, 1) < np.mean(many / other, 1) * 1.5)


def test_blocks_add_up_and_a_sky_is_its_estimate():
    scene = slab(1.0, 0.9, 0.5, 0.5).scene
    one = PathTracing(walks=8, paths=2, single=None)
    sky = solve(scene, PathTracing(blocks=2, walks=8, paths=2, single=None), CASES)
    position, direction = jnp.zeros(3), jnp.asarray([0.6, 0.0, 0.8])
    world = sky.prepared, scene, scene.lights[0], sky.wavelength
    looks = position[None], direction[None]
    tally = one.tally(*world, *looks, 0).join(one.tally(*world, *looks, 1))
    radiance = sky.radiance(position, direction)
    np.testing.assert_allclose(radiance, tally.mean[0], rtol=1e-12)
    found = estimate(sky, position, direction)
    np.testing.assert_allclose(found.mean, radiance, rtol=1e-9)
    np.testing.assert_allclose(found.standard_error, tally.standard_error[0], rtol=1e-6)


def test_what_cannot_be_traced_is_refused():
    with pytest.raises(ValueError, match="`walks` must be at least 2; got 1"):
        PathTracing(walks=1)
    ball = Medium(Ball(np.array([0.0, 0.0, 1.0]), 1.0), 1.0, phase=Isotropic())
    scene = eqx.tree_at(lambda x: x.media, slab(1.0, 1.0, 0.0, 0.5).scene, (ball,))
    with pytest.raises(ValueError, match="must depend on altitude alone"):
        solve(scene, PathTracing(), CASES)
    sky = solve(slab(1.0, 1.0, 0.0, 0.5).scene, SingleScattering(), CASES)
    with pytest.raises(ValueError, match="`sky` must be traced by paths"):
        estimate(sky, jnp.zeros(3), jnp.array([0.0, 0.0, 1.0]))


@pytest.mark.parametrize("mode", [jax.jacfwd, jax.grad])
def test_slopes_are_refused(mode):
    """Without what paths draw by chance they would be off by half."""

    def look(depth):
        sky = eqx.tree_at(lambda x: x.scene.media[0].profile.top, thick, depth)
        return sky.radiance(jnp.zeros(3), jnp.array([0.6, 0.0, 0.8]))[0]

    thick = slab(1.0, 0.9, 0.5, 0.5)
    with pytest.raises(RuntimeError, match="`PathTracing` has no gradients; `Single"):
        mode(look)(jnp.array(1.0))


@pytest.mark.parametrize("sun", [[0.0, 0.6, -0.8], [0.0, 0.0, 1.0]])
def test_cells_of_directions_are_the_sphere(sun):
    """What is drawn from a cell lies in it, and by their sizes all is even."""
    up, sun = jnp.array([0.48, 0.6, 0.64]), jnp.array(sun)
    _, shares = _directions.views(up.dtype)
    cells = jnp.arange(len(shares), dtype=jnp.int32)
    sizes = jax.vmap(lambda x: _directions.solid_angle(x, up.dtype))(cells)
    np.testing.assert_allclose(sizes, 4.0 * np.pi * shares, rtol=1e-12)
    assert float(jnp.sum(shares)) == pytest.approx(1.0, rel=1e-12)
    u = jax.random.uniform(jax.random.key(0), (len(cells), 64, 2), up.dtype)
    draw = jax.vmap(lambda i, u: _directions.draw(i, u, up, sun), (None, 0))
    found = jax.vmap(draw)(cells, u)
    sort = jax.vmap(jax.vmap(lambda x: _directions.sort(x, up, sun)))
    assert np.all(sort(found) == cells[:, None])
    spread = jnp.einsum("c,cni,cnj->ij", shares / 64.0, found, found)
    np.testing.assert_allclose(spread, np.eye(3) / 3.0, atol=0.01)


SHARE, LOBE = within(0.0, 1.0), within(-0.99, 0.99, 0.0)
SUN = within(1e-3, 1.0)


@drawn(6)
@given(rows(3, decades(1e-9, 4.0, 0.0), SHARE, LOBE, SHARE), SUN, within(-1.0, 1.0))
def test_random_slabs_are_bright(cases, sun, cosine):
    depth, albedo, g, ground = cases.T
    sky = slab(depth, albedo, g, sun, ground)
    for altitude in (0.0, 0.5):
        value, error = radiance(sky, altitude, cosine)
        assert np.all(np.isfinite(value) & (value >= 0.0) & np.isfinite(error))
