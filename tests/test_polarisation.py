"""Polarised light: published numbers, closed forms, and its laws."""

import math
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from atmos import polarisation
from atmos.camera import Fisheye, LatLong
from atmos.colour import ACESCG
from atmos.geometry import Flat, Spherical
from atmos.image import read_exr, write_exr, write_spectral_exr
from atmos.light import Sun
from atmos.medium import Exponential, Medium, Uniform
from atmos.phase import HenyeyGreenstein, Isotropic, Rayleigh
from atmos.render import render, render_stokes
from atmos.scene import Scene
from atmos.solver import AbstractSolver, Columns, SingleScattering, solve
from atmos.solver._harmonics import harmonics, spin_harmonics
from atmos.spectrum import Constant


NM = jnp.array([500.0])
DEEP = 1000.0
SOLVER = Columns(layers=32, stokes=3)
ONCE = SingleScattering(stokes=3)


def world(numbers):
    """Air and haze over a ground, under a sun of irradiance pi in the east."""
    air, rho, haze, cosine, ground = numbers
    slab = Uniform(0.0, DEEP)
    media = (
        Medium(slab, air / DEEP, phase=Rayleigh(rho)),
        Medium(slab, haze / DEEP, phase=HenyeyGreenstein(0.6)),
    )
    sun = jnp.stack([jnp.sqrt(1.0 - cosine**2), jnp.zeros_like(cosine), cosine])
    return Scene(Flat(), DEEP, media, (Sun(sun, math.pi, 0.0),), ground)


def towards(cosine, azimuth):
    """Clockwise from the sun, which is in the east."""
    level = np.sqrt(1.0 - np.square(cosine))
    flat = [level * np.cos(azimuth), -level * np.sin(azimuth)]
    return np.stack([*flat, cosine + 0.0 * flat[0]], -1)


# Every look is at so many views, so that all share what is compiled.
COSINES = np.array([-1.0, -0.7, -0.3, -0.05, 0.05, 0.3, 0.7, 1.0])
AZIMUTHS = np.array([0.0, 0.7, 2.0, np.pi])
VIEWS = towards(COSINES[:, None], AZIMUTHS[None]).reshape(-1, 3)


@eqx.filter_jit
def looks(numbers, views, solver):
    """I, Q and U at the ground and the top, in every direction: [place, view, 3]."""
    sky = solve(world(numbers), solver, jnp.asarray(NM, numbers.dtype))
    at = jnp.zeros((2, 3), numbers.dtype).at[1, 2].set(DEEP)
    see = sky.stokes
    if solver.stokes == 1:
        see = lambda *place: sky.radiance(*place)[None]
    return jax.vmap(jax.vmap(see, (None, 0)), (0, None))(at, views)[..., 0]


@eqx.filter_jit
def fluxes(numbers):
    """Up, and down, at the ground and the top."""
    sky = solve(world(numbers), SOLVER, NM)
    at = jnp.zeros((2, 3)).at[1, 2].set(DEEP)
    found = jax.vmap(
        lambda x: SOLVER.fluxes(
            sky.prepared, sky.scene, sky.scene.lights[0], sky.wavelength, x
        )
    )(at)
    return found.up[:, 0], (found.diffuse + found.direct)[:, 0]


def at(air=0.0, rho=0.0, haze=0.0, cosine=0.6, ground=0.0, dtype=jnp.float64):
    return jnp.asarray([air, rho, haze, cosine, ground], dtype)


@pytest.mark.parametrize(
    "depth, ground, sun, view, azimuth, up, down",
    [
        # Natraj, Li and Yung 2009, ApJ 691, 1909, which correct the tables of Coulson,
        # Dave and Sekera (1960): I, Q, U at the top and at the ground.
        (0.1, 0.25, 0.92, 0.4, 180, (0.26834227, 0.02017301, 0.0),
         (0.07119677, 0.04365854, 0.0)),
        (0.5, 0.0, 0.6, 0.4, 30, (0.20749302, 0.05496754, 0.09209640),
         (0.26316961, -0.02984764, 0.03030870)),
        (0.5, 0.25, 0.2, 0.64, 90, (0.10085308, -0.06076128, 0.01855839),
         (0.07578342, -0.04878055, 0.01479565)),
        (1.0, 0.8, 0.8, 0.2, 60, (0.56916035, 0.08399198, 0.20948010),
         (0.66039237, 0.00670080, 0.10548953)),
        (1.0, 0.0, 0.1, 0.52, 150, (0.09072420, -0.01267988, -0.01433721),
         (0.03545455, -0.00277195, 0.00717349)),
    ],
)  # fmt: skip
def test_polarised_skies_are_as_published(depth, ground, sun, view, azimuth, up, down):
    turn = np.radians(azimuth)
    views = np.stack([towards(-view, turn), towards(view, turn)])
    numbers = at(depth, cosine=sun, ground=ground)
    seen = looks(numbers, np.resize(views, (32, 3)), SOLVER)
    for found, due in [(seen[1, 0], up), (seen[0, 1], down)]:
        np.testing.assert_allclose(found, due, atol=1e-3 * due[0])


@pytest.mark.parametrize("rho", [0.0, 0.028, 0.5])
def test_light_from_the_side_is_polarised_as_depolarisation_says(rho):
    # Its definition; across the plane of scattering, which stands upright here.
    views = np.resize(towards(0.0, np.array([0.3, 2.0])), (32, 3))
    seen = np.asarray(looks(at(0.3, rho, cosine=1.0), views, ONCE))[:, :2]
    due = (1.0 - rho) / (1.0 + rho) * seen[..., 0]
    np.testing.assert_allclose(seen[..., 1], due, rtol=1e-9)
    np.testing.assert_allclose(seen[..., 2], 0.0, atol=1e-12)


def test_light_vibrates_across_the_plane_of_scattering():
    numbers, views = at(0.3, cosine=0.35), VIEWS[4:28]
    sun = np.array([math.sqrt(1.0 - 0.35**2), 0.0, 0.35])
    seen = looks(numbers, np.resize(views, (32, 3)), ONCE)[0, :24]
    lit = np.asarray(seen[:, 0]) > 0.0
    psi = np.asarray(polarisation.angle(seen.T))
    right = np.cross(views, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right, axis=-1, keepdims=True)
    upwards = np.cross(right, views)
    along = np.cos(psi)[:, None] * right + np.sin(psi)[:, None] * upwards
    assert lit.sum() == 12
    np.testing.assert_allclose((along @ sun)[lit], 0.0, atol=1e-9)
    cosine = views @ sun
    due = (1.0 - cosine**2) / (1.0 + cosine**2)
    found = np.asarray(polarisation.degree(seen.T))
    np.testing.assert_allclose(found[lit], due[lit], rtol=1e-9)


HAZY = at(0.4, 0.03, 0.2, 0.5, 0.3)


def test_left_and_right_of_the_sun_are_mirrored():
    seen = np.asarray(looks(HAZY, VIEWS, SOLVER))
    mirrored = looks(HAZY, VIEWS * np.array([1.0, -1.0, 1.0]), SOLVER)
    other = np.asarray(mirrored) * np.array([1.0, 1.0, -1.0])
    # Straight up and down what is level is as if towards north, for both.
    np.testing.assert_allclose(other[:, 4:28], seen[:, 4:28], rtol=1e-9, atol=1e-12)
    assert np.abs(seen[..., 2]).max() > 0.02


def test_no_light_is_more_than_fully_polarised():
    for numbers in (HAZY, at(1e-6), at(1.0, cosine=1.0), at(30.0, 0.0, 3.0, 0.2, 1.0)):
        seen = looks(numbers, VIEWS, SOLVER)
        share = polarisation.degree(jnp.moveaxis(seen, -1, 0))
        assert bool(jnp.all((share >= 0.0) & (share <= 1.0)))
    # Nor is there any direction left in what came through thick clouds.
    seen = np.asarray(looks(at(0.01, 0.0, 40.0), VIEWS, SOLVER))[0, 16:]
    assert np.abs(seen[:, 1:]).max() < 2e-3 * seen[:, 0].min()


def test_haze_alone_leaves_light_as_it_would_without_polarisation():
    numbers = at(haze=0.7, ground=0.3)
    seen = np.asarray(looks(numbers, VIEWS, SOLVER))
    alone = looks(numbers, VIEWS, Columns(layers=32))[..., 0]
    np.testing.assert_allclose(seen[..., 0], alone, rtol=1e-9)
    np.testing.assert_array_equal(seen[..., 1:], 0.0)


def test_what_is_not_absorbed_comes_back_from_white_ground():
    for numbers in (at(1.0, ground=1.0), at(20.0, 0.03, 10.0, 0.3, 1.0)):
        up, down = fluxes(numbers)
        np.testing.assert_allclose(up, down, rtol=1e-9)


def test_thin_air_scatters_once():
    numbers = at(1e-6, 0.03)
    once, all_ = (np.asarray(looks(numbers, VIEWS, x)) for x in (ONCE, SOLVER))
    lit = once[..., 0] > 0.0
    error = np.abs(all_ - once)[lit] / once[..., :1][lit]
    assert lit.sum() == 32 and error.max() < 1e-4


def test_there_are_points_without_polarisation_above_and_below_the_sun():
    # Those of Babinet and Brewster, which single scattering has not.
    height = np.radians(40.0 + np.linspace(-30.0, 30.0, 32))
    views = towards(np.sin(height), np.zeros(32))
    numbers = at(0.3, cosine=math.sin(math.radians(40.0)))
    q = np.asarray(looks(numbers, views, SOLVER))[0, :, 1]
    crossed = np.degrees(height)[np.nonzero(np.diff(np.sign(q)))[0]]
    assert len(crossed) == 2 and q[15] < 0.0
    assert 15.0 < crossed[0] < 35.0 and 45.0 < crossed[1] < 65.0
    assert np.asarray(looks(numbers, views, ONCE))[0, :, 1].min() > -1e-15


def test_single_precision_is_right_to_1e4():
    double = np.asarray(looks(HAZY, VIEWS, SOLVER))
    single = looks(HAZY.astype(jnp.float32), VIEWS.astype(np.float32), SOLVER)
    error = np.abs(np.asarray(single) - double) / np.maximum(double[..., :1], 1e-9)
    assert single.dtype == jnp.float32 and error.max() < 1e-4


@eqx.filter_jit
def slopes(direction):
    """Of light that turned once; for the rest see `validation.polarisation`."""

    def total(x):
        numbers, view = x
        sky = solve(world(numbers), ONCE, NM)
        return jnp.sum(sky.stokes(jnp.zeros(3), view))

    return jax.vmap(lambda x: jax.grad(total)((HAZY, x)))(direction)


def test_gradients_are_finite_at_the_zenith_and_at_the_sun():
    sun = np.array([math.sqrt(0.75), 0.0, 0.5])
    views = np.stack([sun, -sun, [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    for x in slopes(views):
        assert bool(jnp.all(jnp.isfinite(x)))


def wigner(l, n, m, angle):
    """d^l_(n,m) by the sum that defines it (Wigner 1931)."""
    total = np.zeros_like(angle)
    for k in range(max(0, m - n), min(l + m, l - n) + 1):
        powers = 2 * l + m - n - 2 * k, n - m + 2 * k
        below = [math.factorial(x) for x in (l + m - k, k, n - m + k, l - n - k)]
        term = np.cos(0.5 * angle) ** powers[0] * np.sin(0.5 * angle) ** powers[1]
        total += (-1) ** (n - m + k) * term / math.prod(below)
    four = [math.factorial(x) for x in (l + n, l - n, l + m, l - m)]
    return math.sqrt(math.prod(four)) * total


def test_spin_harmonics_are_wigners_functions():
    angle = np.linspace(0.0, np.pi, 41)
    r, s = spin_harmonics(np.cos(angle), 12)
    p = harmonics(np.cos(angle), 12)
    for l in range(2, 12):
        for m in range(l + 1):
            for found, n in ((p, 0), (r + s, 2), (r - s, -2)):
                due = wigner(l, n, m, angle)
                np.testing.assert_allclose(found[:, l, m], due, atol=1e-11)
    traced = spin_harmonics(jnp.cos(angle), 12)
    np.testing.assert_allclose(np.stack(traced), np.stack([r, s]), atol=1e-14)


@pytest.mark.parametrize("rho", [0.0, 0.028, 0.5])
def test_expansions_are_the_scattering_matrix(rho):
    # That of Hansen and Travis (1974), equation 2.15.
    lobe, cosine = Rayleigh(rho), np.linspace(-1.0, 1.0, 11)
    delta = (1.0 - rho) / (1.0 + 0.5 * rho)
    versine = jnp.asarray(1.0 - cosine)
    value = lambda f: np.asarray(jax.vmap(lambda x: f(x, NM)[0])(versine)) * 4.0 * np.pi
    known = np.asarray(lobe.polarisation_moments(16, NM))[..., 0]
    alpha1 = np.asarray(lobe.moments(3, NM))[:, 0]
    p = harmonics(cosine, 3)
    r, s = spin_harmonics(cosine, 3)
    twice = 2.0 * np.arange(3) + 1.0
    series = lambda f, moments: f @ (twice * moments)
    p11 = 0.75 * delta * (1.0 + cosine**2) + 1.0 - delta
    p12 = 0.75 * delta * (1.0 - cosine**2)
    p22, p33 = 0.75 * delta * (1.0 + cosine**2), 1.5 * delta * cosine
    np.testing.assert_allclose(value(lobe.evaluate), p11, atol=1e-12)
    np.testing.assert_allclose(value(lobe.polarisation), p12, atol=1e-12)
    np.testing.assert_allclose(series(p[:, :, 0], alpha1), p11, atol=1e-12)
    np.testing.assert_allclose(series(p[:, :, 2], known[:, 2]), p12, atol=1e-12)
    alpha2, alpha3 = known[:, 0], known[:, 1]
    one = series((r + s)[:, :, 2], alpha2 + alpha3)
    other = series((r - s)[:, :, 2], alpha2 - alpha3)
    np.testing.assert_allclose(one, p22 + p33, atol=1e-12)
    np.testing.assert_allclose(other, p22 - p33, atol=1e-12)
    assert lobe.polarisation_moments(2, NM).shape[0] == 2


def test_mixtures_are_polarised_as_what_they_are_made_of():
    lobe, versine = Rayleigh(0.1), jnp.asarray(0.7)
    made = sum(w * x.polarisation(versine, NM) for x, w in lobe.terms(NM))
    np.testing.assert_allclose(made, lobe.polarisation(versine, NM), rtol=1e-12)
    for other in (Isotropic(), HenyeyGreenstein(0.5)):
        assert other.polarisation(versine, NM)[0] == 0.0
        assert other.polarisation_moments(8, NM).shape == (0, 3, 1)


def test_degree_and_angle_are_those_of_the_definition():
    psi = np.array([-1.2, 0.0, 0.4, 0.5 * np.pi])
    light = jnp.stack([2.0 + 0.0 * psi, np.cos(2.0 * psi), np.sin(2.0 * psi)])
    np.testing.assert_allclose(polarisation.degree(light), 0.5)
    apart = np.asarray(polarisation.angle(light)) - psi
    np.testing.assert_allclose(np.sin(apart), 0.0, atol=1e-12)
    dark = jnp.zeros((3, 2))
    for found in (polarisation.degree(dark), polarisation.angle(dark)):
        np.testing.assert_array_equal(found, 0.0)


class Formula(AbstractSolver):
    """Light that is known: of air that scatters evenly, and some more."""

    around: ClassVar[int] = 9
    stokes: int = eqx.field(static=True, default=3)

    def prepare(self, scene, wavelength):
        return None

    def scattered(self, prepared, scene, light, wavelength, position, direction):
        sun, (x, y, z) = light.direction, direction
        ahead, aside = sun[0] * x + sun[1] * y, x * sun[1] - y * sun[0]
        parts = [1.0 + z * z, 2.0 + ahead, (1.0 - z * z) * ahead, z * ahead * aside]
        parts = jnp.stack(parts[: 1 + self.stokes])[:, None]
        return parts * jnp.ones_like(wavelength)[None]


@eqx.filter_jit
def look_around(sky, place, views):
    return jax.vmap(jax.vmap(sky.stokes, (None, 0)), (None, 0))(place, views)


@pytest.mark.parametrize("kind", [LatLong, Fisheye])
def test_a_picture_shows_what_one_sees(kind, tmp_path):
    air = Medium(Exponential(8e3), 1.2e-5, phase=Rayleigh(0.03))
    sun = Sun.at(0.8, 2.0, Constant(1.0))
    scene = Scene(Spherical(6.36e6), 6e4, (air,), (sun,), 0.2)
    sky = solve(scene, Formula(), NM)
    place = np.array([0.0, 0.0, 2.0])
    camera = (
        LatLong(place, 16, 0.3) if kind is LatLong else Fisheye(place, 16, 3.0, 0.3)
    )
    zenith, azimuth = (np.asarray(x) for x in camera.angles())
    views = [np.sin(zenith) * np.sin(azimuth), np.sin(zenith) * np.cos(azimuth)]
    views = np.stack(np.broadcast_arrays(*views, np.cos(zenith)), -1)
    seen = look_around(sky, jnp.asarray(place), jnp.asarray(views))
    seen = np.moveaxis(np.asarray(seen), 2, 0)
    picture = np.asarray(render_stokes(sky, camera))
    sees = np.broadcast_to(np.asarray(camera.sees()), seen.shape[1:3])
    assert sees.sum() > 100 and np.abs(seen[2]).max() > 0.05
    assert np.max(np.abs(picture - seen)[:, sees]) < 2e-3
    np.testing.assert_allclose(picture[0], render(sky, camera), rtol=1e-9)
    path = tmp_path / "sky.exr"
    write_spectral_exr(path, picture[0], NM, stokes=picture[1:])
    found = read_exr(path)
    for i in range(3):
        np.testing.assert_array_equal(found.spectrum(i)[1], picture[i].astype("f4"))
    assert found.attributes["polarisationHandedness"] == "right"


def test_pictures_have_layers_of_q_and_u(tmp_path):
    planes = np.random.default_rng(0).uniform(-1.0, 1.0, (3, 4, 8, 3))
    planes = planes.astype(np.float32)
    write_exr(tmp_path / "sky.exr", planes[0], ACESCG, stokes=planes[1:])
    found = read_exr(tmp_path / "sky.exr")
    for layer, plane in zip(["", "Q.", "U."], planes, strict=True):
        names = [f"{layer}{x}" for x in "RGB"]
        np.testing.assert_array_equal(found.stack(*names), plane)


@pytest.mark.parametrize("kind", [SingleScattering, Columns])
def test_other_numbers_of_stokes_parameters_are_refused(kind):
    with pytest.raises(ValueError, match="`stokes` must be 1 or 3; got 4"):
        kind(stokes=4)
    with pytest.raises(ValueError, match="`streams` must be at least 4"):
        Columns(streams=2, stokes=3)


def test_skies_without_polarisation_have_no_stokes_parameters():
    air = Medium(Uniform(0.0, DEEP), 0.1 / DEEP, phase=Rayleigh())
    sun = Sun(np.array([0.0, 0.0, 1.0]), 1.0, 0.0)
    sky = solve(Scene(Flat(), DEEP, (air,), (sun,)), Formula(stokes=1), NM)
    with pytest.raises(ValueError, match="`stokes` 3"):
        sky.stokes(jnp.zeros(3), jnp.array([0.0, 0.0, 1.0]))
    with pytest.raises(ValueError, match="`stokes` 3"):
        render_stokes(sky, LatLong(np.zeros(3), 4))
