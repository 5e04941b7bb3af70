"""Skies that are formulas: laws of all of them, and what their papers print."""

import functools as ft
import importlib.util
import math
import warnings

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hostile import drawn, within
from hypothesis import given, strategies as st
from scipy.special import expn

from atmos import colour, deg, render, render_disks
from atmos.camera import LatLong, Perspective
from atmos.quantity import versine
from atmos.sky import (
    CIE,
    Clamp,
    HorizontalIlluminance,
    Hosek,
    HosekRGB,
    Perez,
    Preetham,
    ZenithLuminance,
)
from atmos.sky._aerial import haze
from atmos.sky._daylight import components, spectrum
from atmos.sky._hosek_tables import _FLOAT64, _MAGIC, _read


NM = np.arange(380.0, 721.0, 20.0)
FINE = np.arange(380.0, 781.0, 5.0)
MOST = 64  # directions that are looked at together: one compilation for all
HERE = jnp.array([0.0, 0.0, 2.0])
ZENITH = jnp.array([0.0, 0.0, 1.0])
HAS_MITSUBA = importlib.util.find_spec("mitsuba") is not None
needs_mitsuba = pytest.mark.skipif(
    not HAS_MITSUBA, reason="mitsuba, which ships the coefficients, is not installed"
)

SKIES = {
    "preetham": lambda zenith, nm=NM, ground=0.0: Preetham(
        zenith, 0.7, 2.5, nm, ground
    ),
    "hosek": lambda zenith, nm=NM, ground=0.0: Hosek(zenith, 0.7, 3.5, nm, ground),
    "hosek-rgb": lambda zenith, nm=NM, ground=0.0: HosekRGB(
        zenith, 0.7, 3.5, nm, ground
    ),
    "cie": lambda zenith, nm=NM, ground=0.0: CIE(
        13, zenith, 0.7, ZenithLuminance(3000.0), nm, ground
    ),
    "perez": lambda zenith, nm=NM, ground=0.0: Perez(zenith, 0.7, 1.4, 0.2, nm, ground),
}
MODELS = [
    pytest.param(name, marks=needs_mitsuba if "hosek" in name else ()) for name in SKIES
]
every_sky = pytest.mark.parametrize("name", MODELS)


@eqx.filter_jit
def seen_and_received(sky, directions):
    seen = jax.vmap(lambda x: sky.radiance(HERE.astype(x.dtype), x))(directions)
    return seen, sky.diffuse(), [sky.beam(x, HERE) for x in sky.lights]


def look(sky, directions):
    count = -(-len(directions) // MOST) * MOST
    rays = jnp.pad(directions, ((0, count - len(directions)), (0, 0)), mode="edge")
    parts = [seen_and_received(sky, x)[0] for x in rays.reshape(-1, MOST, 3)]
    return jnp.concatenate(parts)[: len(directions)]


def receive(sky):
    return seen_and_received(sky, jnp.tile(ZENITH, (MOST, 1)))[1:]


def light_of(sky):
    level = jnp.sin(sky.sun_zenith)
    parts = [level * x for x in (jnp.sin(0.7), jnp.cos(0.7))]
    return jnp.stack([*parts, jnp.cos(sky.sun_zenith)])


@eqx.filter_jit
def coloured(sky, directions):
    """What the model itself says."""
    towards = light_of(sky)
    return jax.vmap(lambda x: sky.colour(x[2], versine(x, towards)))(directions)


def toward(zenith, azimuth):
    level = np.sin(zenith)
    parts = [level * np.sin(azimuth), level * np.cos(azimuth), np.cos(zenith)]
    return jnp.asarray(np.stack(np.broadcast_arrays(*parts), -1))


def hard_directions(sun_zenith):
    """Everywhere; the sun, the zenith and the horizon with their neighbourhoods."""
    zenith, azimuth = np.meshgrid(
        [0.0, 1e-7, 0.4, 0.8, 1.2, 1.5, 0.5 * np.pi - 1e-7, 0.5 * np.pi + 1e-7, 2.0],
        [0.0, 0.7, 2.0, 0.7 + np.pi],
    )
    near = sun_zenith + np.array([0.0, 1e-9, 1e-4, -1e-3])
    zenith = np.concatenate([zenith.ravel(), near])
    return toward(zenith, np.concatenate([azimuth.ravel(), np.full(4, 0.7)]))


@every_sky
def test_light_is_finite_and_never_negative(name):
    for zenith in (0.0, 30.0, 60.0, 80.0, 89.0, 90.0):
        found = look(SKIES[name](zenith * deg), hard_directions(zenith * deg))
        assert np.all(np.isfinite(found))
        assert np.all(found >= 0.0), (zenith, np.min(found))


@every_sky
def test_the_sky_is_alike_on_both_sides_of_the_sun(name):
    sky, turn = SKIES[name](50 * deg), np.linspace(0.1, 3.0, 5)
    one, other = (look(sky, toward(np.full(5, 1.0), 0.7 + s * turn)) for s in (1, -1))
    np.testing.assert_allclose(one, other, rtol=1e-10, atol=1e-12)


@every_sky
def test_what_the_ground_receives_is_the_sum_over_the_sky(name):
    sky = SKIES[name](40 * deg)
    rise = (np.arange(48) + 0.5) / 48
    turn = (np.arange(96) + 0.5) * (np.pi / 48)
    zenith, azimuth = np.meshgrid(np.arccos(rise), turn, indexing="ij")
    seen = look(sky, toward(zenith.ravel(), azimuth.ravel())).reshape(48, 96, -1)
    total = np.mean(seen * rise[:, None, None], (0, 1)) * 2 * np.pi
    diffuse, _ = receive(sky)
    np.testing.assert_allclose(diffuse, total, rtol=3e-3, atol=1e-4 * diffuse.max())


@every_sky
def test_below_the_horizon_lies_ground_that_reflects_all_it_receives(name):
    down = toward(np.array([1.6, 2.5, 3.1]), np.array([0.0, 1.0, 2.0]))
    assert np.all(look(SKIES[name](40 * deg), down) == 0.0)
    sky = SKIES[name](40 * deg, ground=0.5)
    diffuse, beams = receive(sky)
    beam = sum(beams, jnp.zeros_like(diffuse))
    due = 0.5 / math.pi * (diffuse + math.cos(40 * deg) * beam)
    np.testing.assert_allclose(look(sky, down), np.tile(due, (3, 1)), rtol=1e-9)


@every_sky
def test_a_panorama_is_the_sky_itself(name):
    sky = SKIES[name](70 * deg, NM.astype(np.float32), 0.3)
    zenith, azimuth = np.meshgrid(np.linspace(0.05, 3.0, 8), np.linspace(0.1, 6.0, 8))

    @eqx.filter_jit
    def table(sky, zenith, azimuth):
        return sky.panorama(HERE).radiance(zenith, azimuth)

    angles = (jnp.asarray(x, np.float32) for x in (zenith, azimuth))
    picture = table(sky, *angles).reshape(64, -1)
    truth = look(
        SKIES[name](70 * deg, NM, 0.3), toward(zenith.ravel(), azimuth.ravel())
    )
    np.testing.assert_allclose(picture, truth, rtol=2e-4, atol=1e-5 * truth.max())


def test_pictures_in_colour_are_the_spectra_under_the_eye():
    sky = SKIES["preetham"](60 * deg, ground=0.3)
    camera = Perspective(HERE, 0.7, 20 * deg, 70 * deg, 6, 8)
    response = colour.response(sky.wavelength)
    spectra = render(sky, camera)
    np.testing.assert_allclose(
        render(sky, camera, response), spectra @ response, rtol=1e-9
    )


@eqx.filter_jit
def brightness(sky, directions):
    towards = light_of(sky)
    look = lambda x: sky.parts(x[2], versine(x, towards)) @ sky.basis
    beams = [jnp.sum(sky.beam(x, HERE)) for x in sky.lights]
    return sum(beams, jnp.sum(jax.vmap(look)(directions)))


slopes = eqx.filter_jit(eqx.filter_grad(brightness))


@pytest.mark.parametrize("name", [x for x in MODELS if x.values != ("hosek-rgb",)])
def test_every_number_has_a_gradient_everywhere(name):
    sky, rays = SKIES[name](55 * deg, ground=0.2), hard_directions(55 * deg)
    rays = rays[rays[:, 2] >= 0.0]
    for zenith in (0.0, 55.0, 90.0):
        found = slopes(SKIES[name](zenith * deg, ground=0.2), rays)
        assert all(np.all(np.isfinite(x)) for x in jax.tree.leaves(found)), zenith
    found = slopes(sky, rays)
    if name in ("preetham", "hosek"):
        hazier = lambda dt: eqx.tree_at(lambda x: x.turbidity, sky, sky.turbidity + dt)
        more, less = (brightness(hazier(x), rays) for x in (1e-5, -1e-5))
        np.testing.assert_allclose(found.turbidity, (more - less) / 2e-5, rtol=1e-5)


def test_the_ground_has_a_gradient():
    sky = SKIES["cie"](55 * deg, ground=0.2)
    whole = lambda sky: jnp.sum(sky.radiance(HERE, -ZENITH))
    value, slope = eqx.filter_jit(eqx.filter_value_and_grad(whole))(sky)
    np.testing.assert_allclose(slope.ground.value, value / 0.2, rtol=1e-9)


BROKEN = {"sun_zenith": 86.7 * deg, "clearness": 6.95, "brightness": 0.275}
OUTSIDE = [
    ("preetham", {"turbidity": 7.0}, "`turbidity` must lie between 2 and 6"),
    ("preetham", {"turbidity": math.nan}, "got nan"),
    ("preetham", {"sun_zenith": 91 * deg}, "`sun_zenith` .* 0 and 90 degrees"),
    (
        "preetham",
        {"wavelength": np.array([370.0, 500.0])},
        "`wavelength` .* got 370 nm",
    ),
    ("preetham", {"ground": 1.5}, "`ground` must lie between 0 and 1; got 1.5"),
    ("hosek", {"turbidity": 0.5}, "between 1 and 10, where the model holds; got 0.5"),
    (
        "hosek",
        {"wavelength": np.array([700.0, 760.0])},
        "between 320 and 720 nm.*got 760 nm",
    ),
    ("hosek", {"sun_zenith": -0.1}, "`sun_zenith`"),
    ("hosek-rgb", {"turbidity": 11.0}, "`turbidity`"),
    ("cie", {"temperature": 3000.0}, "between 4000 and 25000 K.*got 3000 K"),
    ("cie", {"sky_type": 16}, "`sky_type` must be a whole number from 1 to 15"),
    ("perez", {"clearness": 0.9}, "`clearness`"),
    ("perez", {"brightness": 0.7}, "`brightness` must lie between 0.01 and 0.6"),
    ("perez", {"clearness": 11.0, "brightness": 0.5}, "weaker than outside the air"),
    ("perez", BROKEN, "must be those of a measured sky"),
]
GIVEN = {
    "preetham": (Preetham, {"turbidity": 3.0}),
    "hosek": (Hosek, {"turbidity": 3.0}),
    "hosek-rgb": (HosekRGB, {"turbidity": 3.0}),
    "cie": (CIE, {"sky_type": 12, "scale": ZenithLuminance(1.0)}),
    "perez": (Perez, {"clearness": 1.4, "brightness": 0.2}),
}


def build(name, **given):
    model, usual = GIVEN[name]
    usual = {"sun_zenith": 0.5, "sun_azimuth": 0.0, "wavelength": NM} | usual
    return model(**usual | given)


@pytest.mark.parametrize(("name", "given", "message"), OUTSIDE)
def test_what_a_model_was_not_fitted_to_is_refused(name, given, message):
    if "hosek" in name and not HAS_MITSUBA:
        pytest.skip("mitsuba, which ships the coefficients, is not installed")
    with pytest.raises(ValueError, match=message):
        build(name, **given)


@pytest.mark.parametrize("scale", [ZenithLuminance, HorizontalIlluminance])
def test_a_sky_without_light_is_refused(scale):
    with pytest.raises(ValueError, match="`value` must be above 0; got -3"):
        scale(-3.0)


def test_what_was_asked_to_be_clamped_is_the_sky_of_the_edge():
    beyond = {"turbidity": 40.0, "wavelength": np.array([300.0, 500.0, 900.0])}
    found = build("preetham", **beyond, beyond=Clamp())
    edges = {"turbidity": 6.0, "wavelength": np.array([380.0, 500.0, 780.0])}
    edge = build("preetham", **edges)
    rays = hard_directions(0.5)
    np.testing.assert_array_equal(look(found, rays), look(edge, rays))
    with pytest.raises(ValueError, match="`turbidity` must be a number"):
        build("preetham", turbidity=math.nan, beyond=Clamp())


def test_skies_seen_from_the_ground_are_not_shown_from_an_aeroplane():
    camera = LatLong(jnp.array([0.0, 0.0, 10e3]), 4)
    with pytest.raises(ValueError, match="`position` .* 1000 m"):
        render(SKIES["preetham"](0.5), camera)


# --- Preetham, Shirley and Smits 1999


@eqx.filter_jit
def spectra(sky, directions):
    towards, fine = light_of(sky), jnp.asarray(FINE)
    parts = jax.vmap(lambda x: sky.parts(x[2], versine(x, towards)))(directions)
    return colour.to_xyz(parts @ components(fine), fine)


@pytest.mark.parametrize("turbidity", [2.0, 4.0, 6.0])
def test_preethams_spectra_have_his_colours(turbidity):
    sky = Preetham(60 * deg, 0.7, turbidity, NM)
    rays = toward(np.array([0.0, 0.5, 1.3]), np.array([0.0, 1.0, 0.7]))
    seen, model = np.asarray(spectra(sky, rays)), np.asarray(coloured(sky, rays))
    # The formulas from chromaticity to daylight are rounded.
    for xyz, (luminance, x, y) in zip(seen, model, strict=True):
        np.testing.assert_allclose(xyz[1], luminance, rtol=1e-3)
        np.testing.assert_allclose(xyz[:2] / xyz.sum(), [x, y], atol=1e-3)
    np.testing.assert_allclose(model[0], sky.zenith, rtol=1e-12)


def test_preethams_zenith_is_as_his_authors_program_has_it():
    # "sunsky" of 1999, RiSunSky.C: coefficients with more digits than in the paper.
    t, s = 3.0, 60 * deg
    chi = (4 / 9 - t / 120) * (math.pi - 2 * s)
    luminance = 1000 * ((4.0453 * t - 4.9710) * math.tan(chi) - 0.2155 * t + 2.4192)
    cubic = lambda a, b, c, d: ((a * s + b) * s + c) * s + d
    x = (
        cubic(0.00165, -0.00374, 0.00208, 0.0) * t * t
        + cubic(-0.02902, 0.06377, -0.03202, 0.00394) * t
        + cubic(0.11693, -0.21196, 0.06052, 0.25885)
    )
    y = (
        cubic(0.00275, -0.00610, 0.00316, 0.0) * t * t
        + cubic(-0.04214, 0.08970, -0.04153, 0.00515) * t
        + cubic(0.15346, -0.26756, 0.06669, 0.26688)
    )
    found = Preetham(s, 0.0, t, NM).zenith
    np.testing.assert_allclose(found, [luminance, x, y], rtol=1e-3)


def test_preethams_sun_is_dimmed_by_what_iqbal_lists():
    sky = Preetham(60 * deg, 0.0, 2.0, np.array([550.0, 760.0]))
    # Kasten's relative optical mass of 60 degrees is 1.993 (Iqbal 1983, table 5.7.1).
    mass, beta = 1.993, 0.04608 * 2 - 0.04586
    clear = 0.008735 * 0.55**-4.08 + beta * 0.55**-1.3 + 0.35 * 0.085
    gas = 1.41 * 3.0 * mass / (1 + 118.93 * 3.0 * mass) ** 0.45
    (light,) = sky.lights
    depth = sky.depth(HERE, light.direction)
    np.testing.assert_allclose(depth[0], mass * clear, rtol=1e-3)
    assert depth[1] > gas
    # The sun's constant at 550 nm: 1.725 W m^-2 nm^-1 (Thekaekara 1973).
    outside = light.irradiance.evaluate(sky.wavelength)[0]
    np.testing.assert_allclose(outside, 1.725, rtol=5e-3)


def test_the_disk_in_a_picture_holds_the_suns_irradiance():
    sky = Preetham(75 * deg, 0.3, 3.0, NM)
    camera = LatLong(HERE, 64)
    picture = render_disks(sky, camera)
    side = math.pi / 64
    area = np.diff(-np.cos(np.arange(65) * side)) * side
    total = np.sum(picture * area[:, None, None], (0, 1))
    np.testing.assert_allclose(total, receive(sky)[1][0], rtol=5e-3)


@ft.cache
def hazy():
    return Preetham(50 * deg, 0.0, 3.0, np.array([400.0, 550.0, 700.0]))


@eqx.filter_jit
def through(sky, altitude, distance, direction):
    return sky.aerial_perspective(ZENITH * altitude, direction, distance)


LEVEL, UP = jnp.array([0.6, 0.8, 0.0]), jnp.array([0.0, 0.8, 0.6])


def test_molecules_and_haze_scatter_in_all_directions_what_they_take():
    angle, nm = np.linspace(0.0, np.pi, 4001), hazy().wavelength

    @jax.jit
    def scatter(turbidity, angle):
        air = haze(turbidity, nm)
        return jax.vmap(air.scattered)(angle), jnp.stack([air.molecules, air.haze])

    into, taken = scatter(jnp.asarray(3.0), jnp.asarray(angle))
    around = 2 * np.pi * np.sin(angle)[:, None, None]
    total = np.trapezoid(into * around, angle, axis=0)
    np.testing.assert_allclose(total, taken, rtol=2e-3)


def test_molecules_of_the_aerial_perspective_are_those_of_air():
    # Bodhaine et al. 1999: optical depth 0.0973 at 550 nm, of a column of 8.44 km.
    air = haze(jnp.asarray(2.0), hazy().wavelength)
    np.testing.assert_allclose(air.molecules[1] * 8.44e3, 0.0973, rtol=2e-2)


def test_the_air_of_a_path_adds_up():
    sky = hazy()
    paths = np.array([[100.0, 3e3], [100.0 + 0.6 * 3e3, 4e3], [100.0, 7e3]])
    first, second, whole = (through(sky, *x, UP) for x in paths)
    np.testing.assert_allclose(whole[0], first[0] * second[0], rtol=1e-9)
    np.testing.assert_allclose(whole[1], first[1] + first[0] * second[1], rtol=1e-6)


def test_level_air_tends_to_the_light_it_turns():
    sky = hazy()
    ground = np.zeros(())
    none, near, far = (
        through(sky, ground, np.array(x), LEVEL) for x in (0.0, 20e3, 200e3)
    )
    assert np.all(none[0] == 1.0) and np.all(none[1] == 0.0)
    air = haze(sky.turbidity, sky.wavelength)
    taken = air.molecules + air.haze
    np.testing.assert_allclose(near[0], np.exp(-20e3 * taken), rtol=1e-9)
    source = near[1] / (1 - near[0])
    np.testing.assert_allclose(far[1], source * (1 - far[0]), rtol=1e-5)
    # Beside the sun the horizon is white and as bright as the sky there.
    assert np.all(far[1] > 0.0)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_the_air_before_a_thing_grows_with_its_distance(dtype):
    """From none and in proportion at first; at the horizon as beside it."""
    sky = jax.tree.map(lambda x: x.astype(dtype), hazy())
    distances = np.geomspace(1e-4, 1e5, 46).astype(dtype)
    tilts = np.array([-1e-3, -1e-6, 0.0, 1e-6, 1e-3])
    views = np.stack([0.6 + 0 * tilts, 0.8 + 0 * tilts, tilts], -1).astype(dtype)

    @eqx.filter_jit
    @ft.partial(jax.vmap, in_axes=(None, 0, None))
    @ft.partial(jax.vmap, in_axes=(None, None, 0))
    def look(sky, view, distance):
        eye = (100.0 * ZENITH).astype(dtype)
        return sky.aerial_perspective(eye, view, distance)

    left, added = map(np.asarray, look(sky, views, distances))
    assert np.all((left > 0.0) & (left <= 1.0) & (added > 0.0))
    falls, grows = np.diff(left, axis=1), np.diff(added, axis=1)
    assert np.all(falls <= 0.0) and np.all(grows > -1e-6 * added[:, 1:])
    near = added[:, distances < 1.0] / distances[distances < 1.0, None]
    np.testing.assert_allclose(near, near[:, :1] + 0.0 * near, rtol=1e-4)
    np.testing.assert_allclose(added[1:4:2], added[2] + 0.0 * added[1:4:2], rtol=1e-4)


# --- Hosek and Wilkie 2012


def test_a_tensor_file_is_read_as_it_is_laid_out():
    values = np.arange(6.0).reshape(2, 3)
    head = _MAGIC + b"\1\0" + (1).to_bytes(4, "little") + (3).to_bytes(2, "little")
    head += b"abc" + (2).to_bytes(2, "little") + bytes([_FLOAT64])
    shape = b"".join(x.to_bytes(8, "little") for x in (2, 3))
    start = len(head) + 8 + len(shape)
    content = head + start.to_bytes(8, "little") + shape + values.tobytes()
    np.testing.assert_array_equal(_read(content)["abc"], values)
    with pytest.raises(ValueError):
        _read(b"something else")


def test_without_the_coefficients_one_is_told_where_they_are(monkeypatch):
    from atmos.sky import _hosek_tables

    _hosek_tables._tables.cache_clear()
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(ImportError, match=r"atmos\[hosek\]"):
        Hosek(0.5, 0.0, 3.0, NM)
    _hosek_tables._tables.cache_clear()


@ft.cache
def mitsuba(variant):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import mitsuba

        mitsuba.set_variant(variant)
    return mitsuba


def sunsky(package, direction, **given):
    import drjit

    emitter = package.load_dict({"type": "sunsky", "sun_scale": 0.0} | given)

    def look(x, nm=None):
        ray = drjit.zeros(package.SurfaceInteraction3f)
        ray.wi = package.Vector3f(*(-np.asarray(x)).tolist())
        if nm is not None:
            ray.wavelengths = nm
        return np.array(emitter.eval(ray)).ravel()

    return np.stack([look(*x) for x in direction])


HAZES = [(1.0, 20.0, 0.0), (2.7, 55.0, 0.4), (5.5, 80.0, 0.9), (10.0, 87.0, 0.2)]


@needs_mitsuba
@pytest.mark.parametrize(("turbidity", "zenith", "albedo"), HAZES)
def test_hosek_is_mitsubas_sunsky(turbidity, zenith, albedo):
    package = mitsuba("scalar_spectral")
    nm = [321.0, 443.0, 560.0, 713.0]
    sky = Hosek(zenith * deg, 0.0, turbidity, np.array(nm), albedo)
    rays = toward(np.array([0.0, 0.3, 1.0, 1.5, 1.56]), np.array([0.0, 3.0, 0.1, 1, 2]))
    theirs = sunsky(
        package,
        [(x, nm) for x in rays],
        turbidity=turbidity,
        albedo=albedo,
        sun_direction=toward(zenith * deg, 0.0).tolist(),
    )
    np.testing.assert_allclose(
        look(sky, rays), np.maximum(theirs, 0.0), rtol=1e-4, atol=1e-9
    )


@needs_mitsuba
def test_hoseks_colours_are_those_of_his_spectra():
    # Two fits of the same simulations.
    nm = NM
    rays = toward(np.linspace(0.0, 1.4, 8), np.linspace(0.0, 3.0, 8))
    spectral = colour.to_xyz(look(Hosek(1.0, 0.7, 3.0, nm, 0.3), rays), jnp.asarray(nm))
    seen = np.asarray(colour.REC709.from_xyz(spectral))
    fitted = HosekRGB(1.0, 0.7, 3.0, nm, 0.3)
    model = coloured(fitted, rays)
    np.testing.assert_allclose(seen, model, rtol=0.05)
    to_colour = colour.REC709.from_xyz(colour.response(jnp.asarray(nm)))
    np.testing.assert_allclose(fitted.basis @ to_colour, np.eye(3), atol=1e-9)


@needs_mitsuba
def test_hoseks_sun_is_dimmer_than_outside_and_redder_when_low():
    high, low = (Hosek(x * deg, 0.0, 3.0, NM) for x in (10.0, 85.0))
    outside = light_outside()
    shares = [receive(sky)[1][0] / outside for sky in (high, low)]
    assert np.all((shares[0] > 0.3) & (shares[0] < 1.0))
    assert np.all(shares[1] < shares[0]) and shares[1][0] < 0.1 * shares[1][-1]


def light_outside():
    from atmos.light import sunlight

    return sunlight(20.0).evaluate(jnp.asarray(NM))


# --- CIE standard general sky


@eqx.filter_jit
def zenith_luminance(sky):
    return sky.zenith_luminance


def test_skies_that_do_not_know_the_sun_have_closed_forms():
    # 2 pi times the integral of (1 + a exp(b / cos)) cos: an exponential integral.
    for kind, a, b in [(1, 4.0, 0.70), (3, 1.1, 0.80), (5, 0.0, 1.0)]:
        sky = CIE(kind, 1.0, 0.0, HorizontalIlluminance(10e3), NM)
        exact = 2 * math.pi * (0.5 + a * expn(3, b)) / (1 + a * math.exp(-b))
        np.testing.assert_allclose(zenith_luminance(sky), 10e3 / exact, rtol=1e-9)


# Kittler, Perez and Darula 1997: B, C, D, E of their fit to the zenith's luminance over
# the diffuse illuminance, for suns up to 70 degrees high.
RATIOS = [
    (54.63, 1.00, 0.00, 0.00),
    (12.35, 3.68, 0.59, 50.47),
    (48.30, 1.00, 0.00, 0.00),
    (12.23, 3.57, 0.57, 44.27),
    (42.59, 1.00, 0.00, 0.00),
    (11.84, 3.53, 0.55, 38.78),
    (21.72, 4.52, 0.64, 34.56),
    (29.35, 4.94, 0.70, 30.41),
    (10.34, 3.45, 0.50, 27.47),
    (18.41, 4.27, 0.63, 24.04),
    (24.41, 4.60, 0.72, 20.76),
    (23.00, 4.43, 0.74, 18.52),
    (27.45, 4.61, 0.76, 16.59),
    (25.54, 4.40, 0.79, 14.56),
    (28.08, 4.13, 0.79, 13.03),
]


@pytest.mark.parametrize("kind", range(1, 16))
def test_the_zeniths_share_of_the_light_is_as_published(kind):
    b, c, d, e = RATIOS[kind - 1]
    for elevation in (25.0, 45.0, 65.0):
        rise, level = math.sin(elevation * deg), math.cos(elevation * deg)
        published = (b * rise**c / level**d + e * rise) / (133.8 * rise)
        scale = HorizontalIlluminance(1.0)
        sky = CIE(kind, (90.0 - elevation) * deg, 0.0, scale, NM)
        np.testing.assert_allclose(zenith_luminance(sky), published, rtol=0.035)


def lux(irradiance):
    """To 0.2 %, at wavelengths so far apart."""
    return float(colour.to_xyz(irradiance, jnp.asarray(NM))[..., 1])


def test_scales_are_what_they_say():
    sky = CIE(12, 1.0, 0.0, ZenithLuminance(2500.0), NM)
    np.testing.assert_allclose(lux(look(sky, ZENITH[None])[0]), 2500.0, rtol=2e-3)
    sky = CIE(12, 1.0, 0.0, HorizontalIlluminance(12e3), NM)
    np.testing.assert_allclose(lux(receive(sky)[0]), 12e3, rtol=2e-3)


def test_daylight_of_6504_kelvin_is_d65_of_one_candela():
    light = jax.jit(spectrum)(jnp.asarray(6504.0), jnp.asarray(FINE))
    xyz = np.asarray(colour.to_xyz(light, jnp.asarray(FINE)))
    np.testing.assert_allclose(xyz[1], 1.0, rtol=1e-4)
    np.testing.assert_allclose(xyz[:2] / xyz.sum(), colour.D65, atol=2e-4)


# --- Perez, Seals and Michalsky 1993

# gendaylit of Radiance 6.0: -ang elevation 0 -P clearness brightness; its a to e.
GENDAYLIT = [
    (30, 1.03, 0.20, [0.728061, -0.537411, 0.871947, -0.629599, -0.001100]),
    (60, 1.15, 0.10, [-1.228323, -0.872863, 8.344452, -2.190771, 0.208913]),
    (20, 1.40, 0.30, [-1.132988, -0.861931, 10.201120, -2.924327, 0.101622]),
    (45, 1.70, 0.25, [-0.998062, -0.668999, 13.629126, -3.190966, 0.178673]),
    (70, 2.30, 0.15, [-1.062161, -0.696665, 15.524462, -3.245163, 0.007785]),
    (15, 3.50, 0.12, [-1.154353, -0.341790, 13.019726, -3.423464, 0.418608]),
    (50, 5.50, 0.10, [-0.970757, -0.209503, 15.500420, -3.925564, 0.639496]),
    (35, 9.00, 0.08, [-0.960609, -0.151592, 17.706810, -5.726554, 1.074942]),
]


@pytest.mark.parametrize(("elevation", "clearness", "brightness", "wanted"), GENDAYLIT)
def test_perez_has_the_coefficients_of_radiance(
    elevation, clearness, brightness, wanted
):
    sky = Perez((90.0 - elevation) * deg, 0.0, clearness, brightness, NM)
    np.testing.assert_allclose(sky.coefficients, wanted, rtol=1e-4, atol=2e-6)


def test_perez_sends_down_what_was_measured():
    sky = Perez.measured(50 * deg, 0.0, 700.0, 120.0, NM)
    np.testing.assert_allclose(sky.irradiances, [700.0, 120.0], rtol=1e-12)
    direct, diffuse = (float(x) for x in sky.illuminances)
    # Perez et al. 1990: about 100 lm/W from the sun, 130 from a clear sky.
    assert 90.0 < direct / 700.0 < 115.0 and 110.0 < diffuse / 120.0 < 150.0
    fallen, (beam,) = receive(sky)
    np.testing.assert_allclose(lux(fallen), diffuse, rtol=2e-3)
    np.testing.assert_allclose(lux(beam), direct, rtol=2e-3)


def test_overcast_skies_have_no_sun():
    sky = Perez.measured(50 * deg, 0.0, 0.0, 120.0, NM)
    np.testing.assert_allclose(sky.clearness, 1.0, rtol=1e-12)
    assert np.all(receive(sky)[1][0] == 0.0)


PARAMETERS = {
    "preetham": (Preetham, ["turbidity"]),
    "hosek": (Hosek, ["turbidity"]),
    "hosek-rgb": (HosekRGB, ["turbidity"]),
    "perez": (Perez, ["clearness", "brightness"]),
    "cie": (CIE, []),
}


@every_sky
@drawn(60)
@given(data=st.data())
def test_random_skies_are_bright_and_have_slopes_or_are_refused(name, data):
    """Of any numbers that the model holds for."""
    model, names = PARAMETERS[name]
    draw = lambda x: data.draw(within(model.ranges[x].low, model.ranges[x].high), x)
    zenith, ground = draw("sun_zenith"), data.draw(within(0.0, 1.0))
    numbers = {x: draw(x) for x in names}
    if name == "cie":
        kind = data.draw(st.integers(1, 15))
        numbers = {"sky_type": kind, "scale": ZenithLuminance(3000.0)}
    try:
        given = {"sun_zenith": zenith, "sun_azimuth": 0.7, "wavelength": NM}
        sky = model(**given, **numbers, ground=ground)
    except ValueError as refused:
        assert "must" in str(refused)
        return
    rays = hard_directions(55 * deg)
    seen = np.asarray(look(sky, jnp.concatenate([rays, light_of(sky)[None]])))
    assert np.all(np.isfinite(seen) & (seen >= 0.0))
    if name != "hosek-rgb":
        found = slopes(sky, rays[rays[:, 2] >= 0.0])
        assert all(np.all(np.isfinite(x)) for x in jax.tree.leaves(found))
