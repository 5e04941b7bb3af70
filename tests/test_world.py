"""Clouds in air, of all orders of scattering, judged in standard errors."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hostile import decades, drawn, rows, within
from hypothesis import given

from atmos.geometry import Flat, Spherical
from atmos.light import Sun
from atmos.medium import (
    Box,
    Everywhere,
    Exponential,
    HeightFog,
    Medium,
    Noise,
    Product,
    StandardAtmosphere,
    Tabulated,
    Tent,
    Uniform,
)
from atmos.phase import HenyeyGreenstein, Rayleigh
from atmos.quantity import deg
from atmos.scene import Scene
from atmos.solver import solve, VolumeTracing
from atmos.solver._strata import climb, Strata
from atmos.spectrum import PowerLaw


NM = np.array([450.0, 650.0])
LOOKS = 64
ROUND = Spherical(6360e3)
rng = np.random.default_rng(0)


def towards(zenith, azimuth):
    level = np.sin(zenith * deg)
    parts = level * np.sin(azimuth * deg), level * np.cos(azimuth * deg)
    return np.array([*parts, np.cos(zenith * deg)])


def tallied(scene, altitudes, directions, solver):
    """Means and standard errors of looks from above the origin, in single precision."""
    sky = solve(scene, solver, jnp.asarray(NM, jnp.float32))
    repeat = LOOKS // len(altitudes)
    start = np.zeros((LOOKS, 3))
    start[:, 2] = np.repeat(altitudes, repeat)
    # No two looks are alike, or they would be alike in all that is random too.
    start[:, :2] = rng.uniform(-0.1, 0.1, (LOOKS, 2))
    looks = [jnp.asarray(x, jnp.float32) for x in (start, directions.repeat(repeat, 0))]
    world = sky.prepared, sky.scene, sky.scene.lights[0], sky.wavelength
    found = sky.solver.tally(*world, *looks)
    parts = lambda x: np.asarray(x, float).reshape(-1, repeat, len(NM))
    error = np.sqrt(np.mean(parts(found.standard_error) ** 2, 1) / repeat)
    return np.mean(parts(found.mean), 1), error


FAR = 4e5
LAYER = Uniform(1e3, 2e3)
NEAR = Box(np.array([-FAR, -FAR, -20e3]), np.array([FAR, FAR, 2e3]))
AIR = Medium(Exponential(8e3), PowerLaw(1.2e-5, -4.0), 1e-6, Rayleigh(0.03))


def test_a_cloud_that_covers_all_one_sees_is_a_layer_of_the_air():
    # Below it, in it and above it, and from space. The one is met in cells, the other
    # with the air around it.
    looks = [(0.0, 60.0, 20.0), (1.5e3, 80.0, 90.0), (5e3, 150.0, 50.0)]
    altitude, *views = np.array([*looks, (400e3, 170.0, 10.0)]).T
    views = np.stack([towards(*x) for x in zip(*views, strict=True)])
    sun = Sun(towards(70.0, 0.0), 2.0, 0.0)

    def found(profile):
        cloud = Medium(profile, 1e-3, 1e-5, HenyeyGreenstein(0.8))
        scene = Scene(ROUND, 60e3, (AIR, cloud), (sun,), 0.3)
        return tallied(scene, altitude, views, VolumeTracing(walks=8, paths=16))

    one, other = found(LAYER), found(Product(LAYER, NEAR))
    spread = np.hypot(one[1], other[1])
    assert np.all(spread < 0.25 * one[0])
    assert np.all(np.abs(one[0] - other[0]) < 4.0 * spread)


DENSE, SHARE = decades(1e-7, 0.02, 0.0), within(0.0, 1.0)
ANGLE = within(0.0, 180.0, 90.0, 90.001)
EYE = decades(1e-3, 1e7, 0.0, 1e3, 2e3, 60e3)


@drawn(4)
@given(DENSE, DENSE, within(-0.99, 0.99), SHARE, ANGLE, rows(4, EYE, ANGLE, ANGLE))
def test_random_cloudy_skies_are_bright(dense, dark, g, ground, zenith, looks):
    """Seen from anywhere, under suns however high or low."""
    altitude, *views = looks.T
    views = np.stack([towards(*x) for x in zip(*views, strict=True)])
    cloud = Medium(Product(LAYER, NEAR), dense, dark, HenyeyGreenstein(g))
    sun = Sun(towards(zenith, 0.0), 2.0, 0.0)
    scene = Scene(ROUND, 60e3, (AIR, cloud), (sun,), ground)
    solver = VolumeTracing(walks=8, paths=16)
    mean, error = tallied(scene, altitude, views, solver)
    assert np.all(np.isfinite(mean) & (mean >= 0.0) & np.isfinite(error))


PROFILES = {
    "everywhere": Everywhere(),
    "exponential": Exponential(8e3),
    "fog": HeightFog(1e3, 2e3),
    "product": Product(Exponential(8e3), Tent(20e3, 9e3)),
    "standard": StandardAtmosphere(),
    "table": Tabulated(np.array([1e3, 4e3, 9e3]), np.array([2.0, 1.0, 5.0])),
    "tent": Tent(25e3, 15e3),
    "uniform": LAYER,
}


@pytest.mark.parametrize("name", PROFILES)
def test_no_air_is_denser_than_its_bound(name):
    profile = PROFILES[name]
    low = np.array([0.0, 0.5e3, 1e3, 2e3, 3.5e3, 9e3, 24e3, 50e3])
    high = np.append(low[1:], 100e3)
    for a, b in zip(low, high, strict=True):
        inside = np.linspace(a, b, 101)[1:-1]
        points = [Flat().locate(jnp.array([0.0, 0.0, h])) for h in inside[::10]]
        dense = [float(profile.density(x)) for x in points]
        most = float(profile.most_between(jnp.asarray(a), jnp.asarray(b)))
        assert max(dense) <= most * (1.0 + 1e-12)
        # And no bound is far above what it bounds.
        assert most <= max(dense) * 3.0 + 1.0 * (max(dense) > 0.0)


@jax.jit
def climbed(strata, path, far, depth):
    begun = jnp.zeros_like(far), depth, far, jnp.array(False)
    goes_on = lambda x: (x[0] < far) & ~x[3]
    on = lambda x: climb(strata, path, x[0], far, x[1])
    return jax.lax.while_loop(goes_on, on, begun)


def test_a_ray_meets_as_much_as_lies_in_its_strata():
    edges = np.array([0.0, 1e3, 3e3, 3.5e3, 20e3, 60e3])
    strata = Strata(jnp.asarray(edges), jnp.array([2e-4, 0.0, 1e-3, 5e-5, 1e-6]))
    # Up, down to the ground, past it, level, and in from the top.
    rays = [(500.0, 30.0), (10e3, 120.0), (10e3, 92.0), (3.2e3, 90.0), (60e3, 97.0)]
    for altitude, zenith in rays:
        start = ROUND.locate(jnp.array([0.0, 0.0, altitude]))
        path = ROUND.path(start, jnp.asarray(towards(zenith, 0.0)))
        far = path.span(jnp.asarray(60e3)).far
        s = (np.arange(100_000) + 0.5) / 1e5 * float(far)
        q = s * (s + 2.0 * float(path.rise))
        r = 6360e3 + altitude
        above = altitude + q / (np.sqrt(r * r + q) + r)
        index = np.clip(np.searchsorted(edges, above) - 1, 0, 4)
        depth = np.cumsum(np.asarray(strata.bounds)[index]) * float(far) / 1e5
        np.testing.assert_allclose(strata.depth(path, far), depth[-1], rtol=1e-3)
        assert not climbed(strata, path, far, 1.01 * depth[-1])[3]
        at, _, bound, met = climbed(strata, path, far, 0.5 * depth[-1])
        assert met and bound > 0.0
        np.testing.assert_allclose(np.interp(at, s, depth), 0.5 * depth[-1], rtol=1e-3)


def test_what_has_no_bounds_is_refused():
    clouds = Medium(Product(Noise(300.0), LAYER), 1e-3)
    with pytest.raises(ValueError, match="must lie in a box or depend on altitude"):
        solve(Scene(ROUND, 60e3, (clouds,), ()), VolumeTracing(), NM)
