"""Light of all orders in clouds and fire, judged in standard errors."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from atmos.geometry import Flat
from atmos.light import Sun
from atmos.medium import (
    Ball,
    Box,
    Exponential,
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
from atmos.solver._majorants import cross, fly, Majorants
from atmos.spectrum import PowerLaw


NM = np.array([450.0, 650.0])
LOWER, UPPER = np.array([-1.0, -1.0, 1.0]), np.array([1.0, 1.0, 3.0])
SLANT = np.array([0.48, 0.36, 0.8])
rng = np.random.default_rng(0)


def tallied(scene, solver, positions, directions, light=True, dtype=float):
    """Means and standard errors of many looks."""
    sky = solve(scene, solver, jnp.asarray(NM, dtype))
    lights = sky.scene.lights[0] if light else None
    looks = (jnp.asarray(x, dtype) for x in (positions, directions))
    found = sky.solver.tally(sky.prepared, sky.scene, lights, sky.wavelength, *looks)
    return np.asarray(found.mean), np.asarray(found.standard_error)


# Van de Hulst (1980), Multiple Light Scattering, tables 12 and 35: reflected and all
# transmitted light of slabs of depth 1 under a sun in the zenith; asymmetry, albedo.
SLABS = [
    (0.0, 1.0, 0.34133, 0.65867),
    (0.5, 1.0, 1.0 - 0.82389, 0.82389),
    (0.5, 0.9, None, 0.73909),
]


@pytest.mark.parametrize("g, albedo, reflected, transmitted", SLABS)
def test_a_slab_reflects_and_transmits_what_is_published(
    g, albedo, reflected, transmitted
):
    wide = np.array([1e4, 1e4, 0.0])
    box = Box(np.array([0.0, 0.0, 1.0]) - wide, np.array([0.0, 0.0, 2.0]) + wide)
    slab = Medium(box, albedo, 1.0 - albedo, HenyeyGreenstein(g))
    world = Scene(Flat(), 3.0, (slab,), (Sun(np.array([0.0, 0.0, 1.0]), 1.0, 0.0),))
    up = np.sqrt((np.arange(400) + rng.uniform(size=400)) / 400)
    turn, level = rng.uniform(0.0, 2.0 * np.pi, 400), np.sqrt(1.0 - up * up)
    solver = VolumeTracing(walks=4, paths=8, cells=2)
    for sign, due in ((-1.0, reflected), (1.0, transmitted)):
        if due is not None:
            looks = [level * np.cos(turn), level * np.sin(turn), sign * up]
            start = np.broadcast_to([0.0, 0.0, 1.5 - sign], (400, 3))
            mean, error = tallied(world, solver, start, np.stack(looks, 1))
            flux = np.pi * mean.mean()
            beam = np.exp(-1.0) if sign > 0.0 else 0.0
            off = np.pi * np.sqrt(np.sum(error**2)) / error.size
            assert off < 0.01 and abs(flux + beam - due) < 4.0 * off


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
    bounds = rng.uniform(0.0, 1.0, (6, 6, 6)) ** 3
    bounds[bounds < 0.1] = 0.0
    cells = Majorants(*map(jnp.asarray, (LOWER, UPPER, bounds)))
    start = rng.uniform(-4.0, 4.0, (40, 3))
    aim = rng.uniform(LOWER, UPPER, (40, 3)) - start
    aim = aim / np.linalg.norm(aim, axis=1)[:, None]

    @jax.jit
    @jax.vmap
    def through(start, aim, depth):
        return fly(cells, cross(cells, start, aim, jnp.asarray(100.0)), depth)

    # A fine march through the same cells by midpoints.
    s = (np.arange(20_000) + 0.5) * 6e-4
    places = start[:, None] + s[:, None] * aim[:, None]
    inside = np.all((places > LOWER) & (places < UPPER), -1)
    index = np.clip(np.floor((places - LOWER) / (UPPER - LOWER) * 6), 0, 5).astype(int)
    depth = np.cumsum(bounds[tuple(np.moveaxis(index, -1, 0))] * inside, 1) * 6e-4
    looks = jnp.asarray(start), jnp.asarray(aim)
    assert not np.any(through(*looks, jnp.asarray(1.01 * depth[:, -1] + 1e-3))[2])
    ray, bound, met = through(*looks, jnp.asarray(0.5 * depth[:, -1]))
    assert np.all(met) and np.all(bound > 0.0)
    reached = [d[np.searchsorted(s, x)] for d, x in zip(depth, ray.at, strict=True)]
    np.testing.assert_allclose(reached, 0.5 * depth[:, -1], atol=2e-3)


def cloud(profile, scattering):
    medium = Medium(profile, scattering, 2.0, HenyeyGreenstein(0.4))
    return Scene(Flat(), 10.0, (medium,), (Sun(SLANT, 2.0, 0.0),))


GRID = Grid(np.ones((9, 9, 9)), LOWER, UPPER)
BOX = Transformed(Box(np.zeros(3), np.ones(3)), np.eye(3) * 2.0, LOWER)
START = np.array([[0.0, -4.0, 2.0], [0.3, 0.2, 2.2], [3.0, 1.0, 4.0], [0.5, 0.0, 6.0]])
AIM = np.array([[0.1, 1, 0.05], [0.01, 0.6, 0.8], [-1, -0.3, -0.7], [0.1, 0.2, -1]])
AIM = AIM / np.linalg.norm(AIM, axis=1)[:, None]
SOLVER = VolumeTracing(walks=256, paths=8, cells=16)


def test_light_of_dark_smoke_turns_once_and_is_as_it_is_marched():
    dark = cloud(BOX, PowerLaw(0.02, -1.0))
    mean, error = tallied(dark, SOLVER, START, AIM)
    sky = solve(dark, RayMarching(), NM)
    look = eqx.filter_jit(jax.vmap(lambda sky, *ray: sky.radiance(*ray), (None, 0, 0)))
    due = np.asarray(look(sky, jnp.asarray(START), jnp.asarray(AIM)))
    # A hundredth scatters: of light that turned twice there is so little.
    assert np.all(np.abs(mean - due) <= 4.5 * error + 0.01 * due)
    assert np.all(error < 0.2 * due)


def test_a_grid_and_a_box_look_alike_and_a_peak_aside_changes_nothing():
    one = tallied(cloud(BOX, PowerLaw(3.0, -1.0)), SOLVER, START, AIM)
    peak = np.ones((9, 9, 9))
    peak[0, -1, 0] = 1e4  # in a corner that light hardly comes near
    for other in (GRID, Grid(peak, LOWER, UPPER)):
        other = tallied(cloud(other, PowerLaw(3.0, -1.0)), SOLVER, START, AIM)
        spread = np.hypot(one[1], other[1])
        assert np.all(np.abs(one[0] - other[0]) <= 4.5 * spread)
        assert np.all(spread < 0.2 * one[0])


def test_strong_colours_keep_their_variance():
    # At one wavelength a hundred times thicker than at the other.
    mean, error = tallied(cloud(BOX, PowerLaw(1.0, -12.5)), SOLVER, START, AIM)
    assert (650.0 / 450.0) ** 12.5 > 95.0
    assert np.all(np.isfinite(mean)) and np.all(error < 0.5 * mean)


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


def test_light_that_is_never_absorbed_comes_to_an_end():
    thick = Medium(Box(LOWER, UPPER), scattering=500.0, phase=HenyeyGreenstein(0.0))
    world = Scene(Flat(), 10.0, (thick,), (Sun(SLANT, 1.0, 0.0),))
    solver = VolumeTracing(walks=32, paths=2, cells=2)
    mean, error = tallied(world, solver, START[:1], AIM[:1])
    # A white wall seen straight on, lit from behind a little or from the side.
    assert np.all(np.isfinite(mean) & (mean >= 0.0) & (mean < 1.0))


def test_what_it_does_not_hold_for_is_refused():
    air = Scene(Flat(), 10.0, (Medium(Exponential(8e3), 1e-5),), ())
    with pytest.raises(
        ValueError, match=r"`scene.media\[0\].profile` must lie in a box"
    ):
        solve(air, VolumeTracing(), NM)
    with pytest.raises(ValueError, match="`walks` must be at least 2; got 1"):
        VolumeTracing(walks=1)
    glows = Medium(GRID, emission=Glow(1.0))
    with pytest.raises(ValueError, match="emission` must be None"):
        solve(Scene(Flat(), 10.0, (glows,), ()), PathTracing(), NM)
