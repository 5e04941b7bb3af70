"""Light of all orders in flat columns: published slabs, closed forms, and its laws."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hostile import decades, drawn, within
from hypothesis import given

from atmos.geometry import Flat, Spherical
from atmos.light import Sun, sunlight
from atmos.medium import Ball, Medium, Uniform
from atmos.phase import HenyeyGreenstein
from atmos.quantity import deg, versine
from atmos.scene import earth, Scene
from atmos.solver import Columns, SingleScattering, solve, SolvedSky
from atmos.solver._peaks import Peaks
from atmos.solver._sight import sight
from atmos.spectrum import Constant, Tabulated


pytestmark = pytest.mark.usefixtures("hasty")
NM = np.array([500.0])
DEEP = 1000.0
SOLVER = Columns(layers=32)
ONCE = SingleScattering()


def world(geometry, depth, albedo, g, cosine, ground, cut):
    """Two slabs of the same stuff, one on the other, under a sun of irradiance 1."""
    media = tuple(
        Medium(
            Uniform(low * DEEP, high * DEEP),
            depth * albedo / DEEP,
            depth * (1.0 - albedo) / DEEP,
            HenyeyGreenstein(g),
        )
        for low, high in ((0.0 * cut, cut), (cut, 1.0 + 0.0 * cut))
    )
    sun = jnp.stack([jnp.sqrt(1.0 - cosine**2), jnp.zeros_like(cosine), cosine])
    return Scene(geometry, DEEP, media, (Sun(sun, 1.0, 0.0),), ground)


def towards(cosine, azimuth):
    level = np.sqrt(1.0 - np.square(cosine))
    flat = [level * np.cos(azimuth), level * np.sin(azimuth)]
    return np.stack([*flat, cosine + 0.0 * flat[0]], -1)


COSINES = np.array([-1.0, -0.7, -0.3, -0.05, 0.05, 0.3, 0.7, 1.0])
AZIMUTHS = np.array([0.0, 0.7, 2.0, np.pi])
VIEWS = towards(COSINES[:, None], AZIMUTHS[None]).reshape(-1, 3)
HEIGHTS = np.array([0.0, 0.5, 1.0]) * DEEP


@eqx.filter_jit
def fluxes(numbers, solver=SOLVER):
    """Up, diffuse and direct at the bottom, in the middle and at the top."""
    scene = world(Flat(), *numbers)
    sky = solve(scene, solver, jnp.asarray(NM, numbers.dtype))
    up = jnp.zeros((3, 3), numbers.dtype).at[:, 2].set(HEIGHTS.astype(numbers.dtype))
    each = lambda at: solver.fluxes(
        sky.prepared, sky.scene, sky.scene.lights[0], sky.wavelength, at
    )
    found = jax.vmap(each)(up)
    return found.up[:, 0], found.diffuse[:, 0], found.direct[:, 0]


@eqx.filter_jit
def looks(numbers, views, solver):
    """Radiance at the same places, in every direction."""
    sky = solve(world(Flat(), *numbers), solver, jnp.asarray(NM, numbers.dtype))
    at = jnp.zeros((3, 3), numbers.dtype).at[:, 2].set(HEIGHTS.astype(numbers.dtype))
    see = jax.vmap(jax.vmap(sky.radiance, (None, 0)), (0, None))
    return see(at, views)[..., 0]


def at(*numbers, cut=0.5, dtype=jnp.float64):
    return jnp.asarray([*numbers, cut], dtype)


def shares(*numbers):
    """Reflected and transmitted flux, over what comes in."""
    up, diffuse, direct = fluxes(at(*numbers))
    return float(up[2] / direct[2]), float((diffuse[0] + direct[0]) / direct[2])


@pytest.mark.parametrize(
    "depth, albedo, g, cosine, reflected, transmitted",
    [
        # van de Hulst 1980, Multiple Light Scattering, tables 12 and 35.
        (1.0, 1.0, 0.0, 1.0, 0.34133, 0.65867),
        (1.0, 1.0, 0.5, 1.0, 0.17611, 0.82389),
        (1.0, 0.9, 0.5, 1.0, None, 0.73909),
        # The slab by which Monte Carlo codes for tissue are judged (Wang 1995).
        (2.0, 0.9, 0.75, 1.0, 0.09739, 0.66096),
        # CDISORT 2.1.3, 128 streams; where albedo 1 - 1e-12 has misled such codes.
        (1.0, 1.0, 0.5, 0.6, 0.5870097 / (0.6 * np.pi), None),
    ],
)
def test_slabs_are_as_published(depth, albedo, g, cosine, reflected, transmitted):
    found = shares(depth, albedo, g, cosine, 0.0)
    for got, due in zip(found, (reflected, transmitted), strict=True):
        assert due is None or abs(got - due) < 2e-5


@pytest.mark.parametrize("geometry", [Flat(), Spherical(6.4e6)])
def test_without_a_sun_all_is_dark(geometry):
    numbers = (jnp.asarray(x) for x in (1.0, 0.9, 0.5, 0.6, 0.3, 0.5))
    scene = dataclasses.replace(world(geometry, *numbers), lights=())
    sky = solve(scene, Columns(streams=4, layers=8, suns=2), NM)
    place, view = jnp.zeros(3), jnp.array([0.0, 0.6, 0.8])
    assert sky.radiance(place, view).tolist() == [0.0]
    assert not np.any(sky.panorama(place).radiance(view[2:, None], view[:1, None]))


@pytest.mark.parametrize("geometry", [Flat(), Spherical(6.4e6)])
def test_a_panorama_from_the_ground_is_what_each_look_sees(geometry):
    numbers = (jnp.asarray(x) for x in (0.3, 0.9, 0.7, 0.6, 0.3, 0.5))
    solver = Columns(streams=8, layers=8, suns=4)
    sky = solve(world(geometry, *numbers), solver, NM)
    zenith, azimuth = np.deg2rad([5.0, 50.0, 80.0, 88.0, 100.0, 170.0]), AZIMUTHS
    angles = jnp.asarray(zenith)[:, None], jnp.asarray(azimuth)[None]
    found = sky.panorama(jnp.zeros(3)).radiance(*angles)
    level = (
        np.sin(zenith)[:, None] * np.stack([np.sin(azimuth), np.cos(azimuth)])[:, None]
    )
    views = np.stack([*level, np.cos(zenith)[:, None] + 0.0 * level[0]], -1)
    see = jax.jit(jax.vmap(jax.vmap(lambda x: sky.radiance(jnp.zeros(3), x))))
    np.testing.assert_allclose(found, see(jnp.asarray(views)), rtol=1e-3)


@pytest.mark.parametrize("depth", [30.0, 100.0, 1000.0])
def test_thick_clouds_pass_as_much_as_diffusion_theory_says(depth):
    # Exact up to exp(-depth), van de Hulst 1980: 4/3 K(1) / (depth + 2 * 0.7104461),
    # with K = 3^(1/2) H / 4 and H(1) = 2.9078105 (Chandrasekhar 1960).
    due = np.sqrt(3.0) / 3.0 * 2.9078105 / (depth + 2.0 * 0.7104461)
    reflected, transmitted = shares(depth, 1.0, 0.0, 1.0, 0.0)
    assert abs(transmitted / due - 1.0) < 1e-4
    assert abs(reflected + transmitted - 1.0) < 1e-10


@pytest.mark.parametrize("depth", [0.0, 1e-12, 0.1, 10.0, 1000.0, 1e5])
@pytest.mark.parametrize("g", [0.0, 0.85, 0.99])
def test_what_is_not_absorbed_comes_back_from_white_ground(depth, g):
    up, diffuse, direct = fluxes(at(depth, 1.0, g, 0.3, 1.0))
    np.testing.assert_allclose(up, diffuse + direct, atol=1e-9, rtol=1e-9)
    np.testing.assert_allclose(up[2], 0.3, rtol=1e-9)


def test_the_ground_gets_what_it_reflects_again_and_again():
    # Adding a Lambertian ground: T + a S T / (1 - a S), with S seen from below.
    cosines, weights = np.polynomial.legendre.leggauss(24)
    cosines, weights = 0.5 + 0.5 * cosines, 0.5 * weights
    below = sum(
        2.0 * w * c * shares(2.0, 0.9, 0.7, c, 0.0)[0]
        for c, w in zip(cosines, weights, strict=True)
    )
    _, black = shares(2.0, 0.9, 0.7, 0.6, 0.0)
    _, bright = shares(2.0, 0.9, 0.7, 0.6, 0.8)
    assert abs(bright * (1.0 - 0.8 * below) / black - 1.0) < 1e-5


def test_absorbers_show_the_ground_by_the_direct_sun_alone():
    seen = np.asarray(looks(at(0.8, 0.0, 0.0, 0.6, 0.5), VIEWS, SOLVER))
    cosines = np.abs(VIEWS[:, 2])
    due = (
        0.5 / np.pi * 0.6 * np.exp(-0.8 / 0.6 - np.outer(HEIGHTS / DEEP, 0.8 / cosines))
    )
    np.testing.assert_allclose(seen, np.where(VIEWS[:, 2] < 0.0, due, 0.0), rtol=1e-9)


@pytest.mark.parametrize("depth", [1e-5, 1e-9, 1e-12])
def test_thin_media_scatter_once(depth):
    numbers = at(depth, 1.0, 0.6, 0.5, 0.0)
    once, all_ = looks(numbers, VIEWS, ONCE), looks(numbers, VIEWS, SOLVER)
    lit = np.asarray(once) > 0.0
    assert lit.sum() == 64
    assert np.abs(np.asarray(all_ / jnp.where(lit, once, 1.0))[lit] - 1.0).max() < 2e-4


def test_layers_without_depth_change_nothing():
    numbers = 0.8, 0.9, 0.7, 0.6, 0.3
    due = fluxes(at(*numbers))
    for cut in (0.0, 1e-12, 1.0):
        for got, x in zip(fluxes(at(*numbers, cut=cut)), due, strict=True):
            np.testing.assert_allclose(got, x, rtol=1e-7, atol=1e-12)


@pytest.mark.parametrize("layers", [5, 200])
def test_a_slab_is_solved_alike_in_one_layer_and_in_many(layers):
    # Three of five layers are edges, and hold nothing.
    numbers = at(3.0, 0.9, 0.7, 0.6, 0.3, cut=1.0)
    found = fluxes(numbers, Columns(layers=layers))
    for got, due in zip(found, fluxes(numbers), strict=True):
        np.testing.assert_allclose(got[::2], due[::2], rtol=1e-7, atol=1e-12)


def test_a_level_sun_lights_no_flat_world():
    numbers = at(0.8, 0.9, 0.7, 0.0, 0.3)
    for got in fluxes(numbers):
        np.testing.assert_allclose(got, 0.0, atol=1e-6)
    seen = np.asarray(looks(numbers, VIEWS, SOLVER))
    assert np.isfinite(seen).all() and seen.min() >= 0.0


def test_above_all_air_the_sky_is_black():
    seen = np.asarray(looks(at(0.8, 0.9, 0.7, 0.6, 0.3), VIEWS, SOLVER))
    up = VIEWS[:, 2] > 0.0
    assert (seen[2, up] == 0.0).all() and (seen[2, ~up] > 0.0).all()


def test_light_that_turned_in_peaks_alone_is_summed_up_in_closed_form():
    # At the sun's own height all ways are as long: of each Legendre moment the sum over
    # orders is exp(-t) (exp(x) - 1), with t the depth and x the peaks' moment times it;
    # once with delta-M's depth is what single scattering has found of it.
    depth, albedo, g, cosine, degrees = 1.2, 0.9, 0.9, 0.8, 16
    azimuths = np.array([0.01, 0.05, 0.2, 1.0, 3.0])

    @eqx.filter_jit
    def added(numbers, views):
        scene = world(Flat(), *numbers)
        light, nm = scene.lights[0], jnp.asarray(NM)
        peaks = Peaks.of(scene, nm, degrees)
        place = jnp.zeros(3)

        def look(view):
            once = [
                jnp.sum(ONCE.march(scene, x.extinction, light, nm, place, view)[:2])
                for x in (peaks.within, peaks.without)
            ]
            lobe = HenyeyGreenstein(g).evaluate(versine(view, light.direction), nm)
            line = sight(scene, place, view, peaks.without.extinction, 12)
            known = scene, light, light.direction[None], nm, line
            more = peaks.scattered(*known, once[0][None, None], 1)[0]
            return more[0] + lobe[0] * (once[0] - once[1])

        return jax.vmap(look)(views)

    l = np.arange(400)
    slant, f = depth / cosine, g**degrees
    x = albedo * slant * np.where(l < degrees, f, g**l)
    known = np.exp(x - slant) - np.exp(-slant)
    known -= x * np.exp(albedo * f * slant - slant)
    views = towards(cosine, azimuths)
    apart = views @ np.array([np.sqrt(1.0 - cosine**2), 0.0, cosine])
    due = np.polynomial.legendre.legval(apart, (2 * l + 1) / (4.0 * np.pi) * known)
    got = added(at(depth, albedo, g, cosine, 0.0), views)
    np.testing.assert_allclose(got, due, atol=1e-5 * np.abs(due).max(), rtol=1e-3)


def test_a_sun_at_an_ordinate_is_like_any_other():
    node = 0.5 + 0.5 * np.polynomial.legendre.leggauss(8)[0][4]
    aside = np.array([0.0, 1e-12, 1e-9, 1e-6, 1e-4])
    found = [shares(1.0, 0.9, 0.5, node * (1.0 + x), 0.0) for x in aside]
    slope = (np.array(found[-1]) - found[0]) / aside[-1]
    for x, got in zip(aside, found, strict=True):
        np.testing.assert_allclose(got, found[0] + slope * x, atol=1e-8)


@pytest.mark.parametrize("depth", [0.3, 3.0, 300.0])
@pytest.mark.parametrize("g", [0.95, 0.99])
def test_radiance_is_never_negative(depth, g):
    seen = np.asarray(looks(at(depth, 1.0, g, 0.7, 0.2), VIEWS, SOLVER))
    assert np.isfinite(seen).all() and seen.min() >= 0.0


def test_a_cloud_over_snow_is_as_bright_from_all_sides():
    # Nothing is lost, so it is nearly a white Lambertian one below.
    seen = np.asarray(looks(at(100.0, 1.0, 0.85, 0.5, 1.0), VIEWS, SOLVER))
    below = seen[0].reshape(8, 4)
    assert np.ptp(below, axis=1).max() < 1e-4 * below.mean()
    np.testing.assert_allclose(below, 0.5 / np.pi * np.ones((8, 4)), rtol=0.15)


def test_light_goes_back_the_way_it_came():
    one, other = at(0.7, 0.9, 0.6, 0.35, 0.3), at(0.7, 0.9, 0.6, 0.8, 0.3)
    azimuths = np.resize([0.4, 1.3, 2.8], 32)
    there = looks(one, towards(-0.8, azimuths), SOLVER)[2]
    back = looks(other, towards(-0.35, azimuths), SOLVER)[2]
    np.testing.assert_allclose(there * 0.8, back * 0.35, rtol=2e-3)


def test_left_and_right_of_the_sun_are_alike():
    numbers = at(0.7, 0.9, 0.6, 0.35, 0.3)
    mirrored = looks(numbers, VIEWS * np.array([1.0, -1.0, 1.0]), SOLVER)
    np.testing.assert_allclose(mirrored, looks(numbers, VIEWS, SOLVER), rtol=1e-9)


def test_a_slab_may_be_cut_anywhere():
    seen = looks(at(2.0, 0.95, 0.7, 0.4, 0.1), VIEWS, SOLVER)
    again = looks(at(2.0, 0.95, 0.7, 0.4, 0.1, cut=0.81), VIEWS, SOLVER)
    np.testing.assert_allclose(again, seen, rtol=3e-3)


def test_single_precision_is_right_to_1e4():
    numbers = 0.8, 0.9, 0.7, 0.6, 0.2
    double = looks(at(*numbers), VIEWS, SOLVER)
    single = looks(at(*numbers, dtype=jnp.float32), VIEWS.astype(np.float32), SOLVER)
    np.testing.assert_allclose(single, double, rtol=1e-4, atol=1e-9)


@eqx.filter_jit
@jax.value_and_grad
def brightness(numbers):
    """Of a few views, coarsely, and its slopes."""
    solver = Columns(streams=4, layers=8, pieces=6)
    scene = world(Flat(), *numbers)
    sky = solve(scene, solver, jnp.asarray(NM))
    views = jnp.array([[0.6, 0.0, 0.8], [0.0, 0.8, -0.6], [-0.28, 0.0, 0.96]])
    seen = jax.vmap(sky.radiance, (None, 0))(jnp.array([0.0, 0.0, 300.0]), views)
    return jnp.sum(seen[:, 0] * jnp.array([1.0, 2.0, 3.0]))


def test_gradients_agree_with_differences():
    numbers = at(1.3, 0.95, 0.7, 0.6, 0.3)
    _, slope = brightness(numbers)
    for i, step in enumerate(1e-5 * np.eye(6)[:5]):
        due = (brightness(numbers + step)[0] - brightness(numbers - step)[0]) / 2e-5
        assert abs(slope[i] / due - 1.0) < 1e-5, i


@pytest.mark.parametrize(
    "numbers",
    [
        (0.0, 1.0, 0.5, 0.6, 0.5),
        (1e-12, 1.0, 0.5, 0.6, 0.0),
        (100.0, 1.0, 0.85, 0.5, 1.0),
        (1.0, 0.0, 0.0, 0.6, 0.0),
        (2.0, 1.0, 0.99, 0.1, 1.0),
        # An ordinate's own cosine.
        (1.0, 0.9, 0.5, 0.5 + 0.5 / np.sqrt(3.0), 0.3),
    ],
)
def test_gradients_are_finite(numbers):
    value, slope = brightness(at(*numbers))
    assert value >= 0.0
    assert np.isfinite(slope).all()


def test_a_huge_planet_is_flat():
    numbers = at(0.7, 0.9, 0.6, 0.7, 0.3)

    @eqx.filter_jit
    def seen(numbers):
        sky = solve(world(Spherical(1e12), *numbers), SOLVER, NM)
        place = jnp.array([0.0, 0.0, HEIGHTS[1]])
        return jax.vmap(sky.radiance, (None, 0))(place, VIEWS)[:, 0]

    flat = looks(numbers, VIEWS, SOLVER)[1]
    np.testing.assert_allclose(seen(numbers), flat, rtol=1e-4)


MANY = np.linspace(380.0, 780.0, 41)
COARSE = Columns(streams=4, layers=16, suns=5, pieces=6, stokes=3)


def hazy(ground, zenith=60 * deg, ozone=300.0):
    """Clear air over ground whose albedo may be as rough as one likes."""
    sun = Sun.at(zenith, 0.0, sunlight())
    return earth(sun, ozone_column=ozone, ground=ground)


@eqx.filter_jit
def spectra(scene, solver):
    """I, Q and U from the ground and from space, and fluxes at the ground."""
    sky = solve(scene, solver, MANY)
    views = jnp.asarray(towards(np.array([1.0, 0.1, -0.4]), np.array([0.3, 1.0, 2.0])))
    places = jnp.array([[0.0, 0.0, 2.0], [0.0, 0.0, 4e5]])
    look = sky.prepared, sky.scene, sky.scene.suns[0], sky.wavelength
    fluxes = sky.solver.fluxes(*look, places[0])
    seen = jax.vmap(jax.vmap(sky.stokes, (None, 0)), (0, None))(places, views)
    return seen.reshape(-1, 3, MANY.size), jnp.stack([fluxes.up, fluxes.diffuse])


@pytest.mark.parametrize("zenith", [30.0, 75.0])
@pytest.mark.parametrize("rough", [False, True])
def test_few_wavelengths_tell_the_rest(zenith, rough):
    albedo = 0.3 + 0.3 * np.sin(np.arange(MANY.size) ** 2.0) * rough
    scene = hazy(Tabulated(MANY, albedo), zenith * deg)
    (few, flux), (every, due) = (
        spectra(scene, dataclasses.replace(COARSE, wavelengths=n)) for n in (10, 41)
    )
    brightest = np.max(every[:, 0])
    error = np.abs(few - every) / np.maximum(every[:, :1], 1e-6 * brightest)
    assert 0.0 < np.max(error) < 3e-3
    assert np.mean(error) < 2e-4
    np.testing.assert_allclose(flux, due, rtol=3e-3)


def test_few_wavelengths_are_chosen_where_the_air_is_smooth():
    suited = lambda scene, nm: Columns().suited(scene, jnp.asarray(nm)).wavelengths
    smooth, ground = hazy(Constant(0.2)), Constant(0.2)
    assert suited(smooth, MANY) == 10
    assert suited(smooth, MANY[:9]) >= 9
    # Ozone is rough below 330 nm, and so is a gas with lines.
    assert suited(smooth, np.linspace(300.0, 780.0, 49)) == 49
    lines = Medium(Uniform(0.0, 1e3), absorption=Tabulated(MANY, MANY % 20.0 * 1e-5))
    striped = dataclasses.replace(smooth, media=(*smooth.media, lines))
    assert suited(striped, MANY) == 41
    # Where numbers are traced, nothing is left out.
    lengths = []

    @jax.jit
    def traced(ozone):
        sky = solve(hazy(ground, ozone=ozone), COARSE, MANY)
        lengths.append(sky.prepared.field.field.up.shape[-1])
        return ozone

    traced(300.0)
    assert lengths == [41]


def test_wavelengths_that_do_not_lie_apart_are_refused():
    scene, same = hazy(Constant(0.2)), np.full(20, 500.0)
    assert Columns().suited(scene, jnp.asarray(same)).wavelengths == 20
    with pytest.raises(ValueError, match="`wavelengths` must be no more than lie"):
        solve(scene, Columns(wavelengths=8), same)
    with pytest.raises(ValueError, match="`wavelengths` must be at least 5; got 4"):
        Columns(wavelengths=4)


def test_more_edges_than_layers_are_refused():
    with pytest.raises(ValueError, match="`layers` must be at least 5"):
        solve(world(Flat(), *at(1.0, 1.0, 0.0, 0.5, 0.0)), Columns(layers=3), NM)


def test_low_suns_in_a_round_world_are_refused():
    sinking = lambda zenith: world(
        Spherical(6.4e6), 0.1, 1.0, 0.0, jnp.cos(jnp.radians(zenith)), 0.0, 0.5
    )
    SOLVER.check(sinking(84.9), jnp.asarray(NM))
    for zenith in (86.0, 90.0, 100.0):
        with pytest.raises(ValueError, match="lights.0.. must stand 5 degrees"):
            solve(sinking(zenith), SOLVER, NM)


def test_panoramas_beyond_the_line_between_day_and_night_are_refused():
    """From 400 km the horizon of this planet lies 19.75 degrees of arc away."""
    zenith = lambda elevation: jnp.cos(jnp.radians(90.0 - elevation))
    at = jnp.array([0.0, 0.0, 4e5])
    low, high = (
        world(Spherical(6.4e6), 0.1, 1.0, 0.0, zenith(x), 0.0, 0.5)
        for x in (19.7, 19.8)
    )
    with pytest.raises(ValueError, match="`position` must be so low .* 0.0499 degrees"):
        SolvedSky(low, SOLVER, jnp.asarray(NM), None).panorama(at)
    horizon = high.lights[0].zenith + high.geometry.dip(at[2], 0.0 * at[2])
    SOLVER.check_panorama(high, float(horizon))


def test_media_that_change_sideways_are_refused():
    ball = Medium(Ball(np.array([0.0, 0.0, 1.0]), 1.0), 1.0)
    layered = world(Flat(), 0.1, 1.0, 0.0, jnp.array(0.5), 0.0, 0.5)
    scene = eqx.tree_at(lambda x: x.media, layered, (ball,))
    with pytest.raises(ValueError, match="media.0..profile. must depend on altitude"):
        solve(scene, SOLVER, NM)


# In a flat world there is light from a sun as low as one likes.
SLAB = decades(1e-12, 1e4, 0.0, 1.0), within(0.0, 1.0, 1.0 - 1e-12, 1.0 - 1e-6)
# Lobes that throw light back swing below nothing with so few streams.
LOBE = within(0.0, 0.99, 0.9)
SUN = within(1e-3, 0.999, 0.5 + 0.5 / np.sqrt(3.0))


@drawn(600)
@given(*SLAB, LOBE, SUN, within(0.0, 1.0), within(0.2, 0.8))
def test_random_skies_are_bright_and_have_slopes(depth, albedo, g, sun, ground, cut):
    value, slope = brightness(at(depth, albedo, g, sun, ground, cut=cut))
    # Eight layers do not follow light to where next to nothing is left of it.
    assert np.isfinite(value) and value >= -1e-9
    assert np.isfinite(slope).all()
