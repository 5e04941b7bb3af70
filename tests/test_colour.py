import functools as ft
import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from atmos import reference
from atmos.colour import (
    ACES2065_1,
    ACESCG,
    automatic_exposure,
    COLOUR_SPACES,
    D65,
    has_colour,
    preview,
    REC709,
    response,
    to_xyz,
    XYZ,
)
from atmos.spectrum import BandAverage


GRID = jnp.arange(380.0, 781.0, 10.0)
RGB = [REC709, ACESCG, ACES2065_1]
# The sums of the CIE 1931 matching functions from 360 to 830 nm at 1 nm (CIE 018:2019).
SUMS = np.array([106.86546949, 106.85691710, 106.89225128])
# Sun seen through so many airs: noon, afternoon, sunset, the disk on the horizon.
AIRS = [1.0, 10.0, 38.0]
every_light = pytest.mark.parametrize("airs", AIRS)


@pytest.fixture(scope="module")
def judge():
    """The package that answers are compared with: its own tables and formulas."""
    # It changes how NumPy prints numbers, of which other tests know.
    with warnings.catch_warnings(), np.printoptions():
        warnings.simplefilter("ignore")
        import colour
    return colour


def white(xy):
    x, y = xy
    return np.array([x / y, 1.0, (1.0 - x - y) / y])


def through(airs, wavelength, bandwidth):
    """The sun through air: Rayleigh, something like ozone, and haze."""
    sun = BandAverage(*map(jnp.asarray, reference.solar_irradiance()), bandwidth)
    air = 0.0973 * (wavelength / 550.0) ** -4.09
    ozone = 0.035 * jnp.exp(-(((wavelength - 600.0) / 55.0) ** 2))
    haze = 0.1 * (wavelength / 550.0) ** -1.3
    return sun.evaluate(wavelength) * jnp.exp(-airs * (air + ozone + haze))


@ft.cache
def exact_xyz(airs):
    """Summed at 1 nm from 360 to 830 nm, straight from the tables."""
    nm, observer = reference.matching_functions()
    light = np.asarray(through(airs, jnp.asarray(nm), 1.0))
    return 683.0 * light @ observer


@pytest.mark.parametrize(
    "wavelength",
    [
        np.arange(380.0, 781.0, 10.0),
        np.arange(360.0, 831.0, 1.0),
        np.arange(400.0, 701.0, 20.0),
        np.array([440.0, 550.0, 680.0]),
        np.array([300.0, 420.0, 430.0, 470.0, 560.0, 561.0, 640.0, 1000.0]),
    ],
    ids=["default", "1 nm", "20 nm", "three", "uneven"],
)
def test_an_even_spectrum_has_the_sums_of_the_observer(wavelength):
    even = jnp.full(wavelength.size, 2.0)
    xyz = to_xyz(even, jnp.asarray(wavelength))
    np.testing.assert_allclose(xyz, 2.0 * 683.0 * SUMS, rtol=1e-9)


def test_at_1_nm_the_weights_are_the_matching_functions():
    nm, observer = reference.matching_functions()
    np.testing.assert_allclose(response(jnp.asarray(nm)), 683.0 * observer, rtol=1e-12)
    peak = np.argmax(observer[:, 1])
    assert nm[peak] == 555.0 and observer[peak, 1] == 1.0


def test_a_narrow_light_is_as_bright_as_it_looks():
    nm = jnp.arange(360.0, 831.0)
    green = jnp.where(nm == 555.0, 1.0, 0.0)  # 1 W m^-2 sr^-1: 683 lumens a watt
    np.testing.assert_allclose(to_xyz(green, nm)[1], 683.0, rtol=1e-12)


def difference(judge, airs, wavelength, bandwidth):
    """CIEDE2000, of colours of luminance 1 under the white D65."""
    exact = exact_xyz(airs)
    coarse = np.asarray(to_xyz(through(airs, wavelength, bandwidth), wavelength))
    one, other = (
        judge.XYZ_to_Lab(xyz / exact[1], np.array(D65)) for xyz in (coarse, exact)
    )
    return float(judge.delta_E(one, other, method="CIE 2000"))


@every_light
def test_sunlight_has_the_colour_of_a_1_nm_integration(airs, judge):
    assert difference(judge, airs, GRID, 10.0) < 0.5


def test_three_wavelengths_are_too_few_for_a_low_sun(judge):
    """As those that Bruneton's tables and Unreal's sky are made of."""
    few = jnp.array([440.0, 550.0, 680.0])
    noon, _, horizon = (difference(judge, airs, few, 10.0) for airs in AIRS)
    assert noon > 2.0 and horizon > 15.0


@every_light
def test_sunlight_lies_inside_acescg(airs):
    light = to_xyz(through(airs, GRID, 10.0), GRID)
    assert np.all(np.asarray(ACESCG.from_xyz(light)) > 0.0)
    assert np.all(np.asarray(ACES2065_1.from_xyz(light)) > 0.0)


def test_the_sun_on_the_horizon_lies_outside_rec709():
    light = to_xyz(through(38.0, GRID, 10.0), GRID)
    assert REC709.from_xyz(light)[2] < 0.0


@pytest.mark.parametrize("space", RGB)
def test_daylight_of_683_candelas_is_white(space):
    np.testing.assert_allclose(
        space.from_xyz(jnp.asarray(683.0 * white(D65))), np.ones(3), rtol=1e-12
    )


def test_equal_energy_of_683_candelas_is_one_in_xyz():
    np.testing.assert_allclose(XYZ.from_xyz(jnp.full(3, 683.0)), np.ones(3))


@pytest.mark.parametrize("space", RGB)
def test_matrices_are_those_of_colour_science(space, judge):
    xyz = np.random.default_rng(0).random((20, 3))
    expected = judge.XYZ_to_RGB(
        xyz,
        space.name,
        illuminant=np.array(D65),
        chromatic_adaptation_transform="Bradford",
        apply_cctf_encoding=False,
    )
    found = space.from_xyz(jnp.asarray(683.0 * xyz))
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_from_rec709_to_acescg_is_the_matrix_of_the_aces_configurations():
    # As printed in OpenColorIO's ACES configurations (Bradford).
    expected = [
        [0.613097, 0.339523, 0.047379],
        [0.070194, 0.916354, 0.013452],
        [0.020616, 0.109570, 0.869815],
    ]
    found = ACESCG.from_xyz(REC709.to_xyz(jnp.eye(3))).T
    np.testing.assert_allclose(found, expected, atol=1e-6)


@pytest.mark.parametrize("space", COLOUR_SPACES.values(), ids=COLOUR_SPACES.keys())
def test_luminance_can_be_had_back(space):
    xyz = jnp.asarray(np.random.default_rng(1).random((5, 4, 3)))
    values = space.from_xyz(xyz)
    luminance = np.asarray(values) @ space.luminance_weights
    np.testing.assert_allclose(luminance, xyz[..., 1], rtol=1e-12)
    np.testing.assert_allclose(space.luminance_weights.sum(), 683.0, rtol=1e-12)
    np.testing.assert_allclose(space.to_xyz(values), xyz, rtol=1e-12)


def test_the_weights_may_be_seen_through_a_space():
    light = through(1.0, GRID, 10.0)
    direct = light @ ACESCG.from_xyz(response(GRID))
    expected = ACESCG.from_xyz(to_xyz(light, GRID))
    np.testing.assert_allclose(direct, expected, rtol=1e-12)


def test_single_precision_is_enough():
    light, grid = through(10.0, GRID, 10.0), GRID.astype(jnp.float32)
    found = jax.jit(to_xyz)(light.astype(jnp.float32), grid)
    assert found.dtype == jnp.float32
    np.testing.assert_allclose(found, to_xyz(light, GRID), rtol=1e-6)


@pytest.mark.parametrize(
    ("wavelength", "message"),
    [
        ([550.0], "two or more"),
        ([500.0, 500.0, 600.0], "rising"),
        ([700.0, 400.0], "rising"),
        ([400.0, np.nan], "finite"),
        ([500.0, 510.0, 600.0], "must cover what the eye sees"),
        ([900.0, 1000.0], "got 900 to 1000 nm"),
    ],
)
def test_wavelengths_that_give_no_colour_are_refused(wavelength, message):
    with pytest.raises(ValueError, match=message):
        response(jnp.asarray(wavelength))


def test_three_wavelengths_have_colour_and_the_infrared_has_none():
    assert has_colour(np.array([440.0, 550.0, 680.0]))
    assert not has_colour(np.array([300.0, 310.0]))


def test_exposure_is_what_a_meter_reads():
    # ISO 100 and K = 12.5: EV 15, a sunny day, is 4096 cd m^-2.
    sunny = jnp.asarray(white(D65) * 4096.0)
    picture = jnp.stack([sunny, sunny, jnp.zeros(3)])  # what is black does not count
    np.testing.assert_allclose(automatic_exposure(picture), 15.0, rtol=1e-12)
    scene = jnp.stack([x * sunny for x in (0.1, 0.2, 0.5, 1.0, 500.0)])
    np.testing.assert_allclose(automatic_exposure(scene), 15.0, rtol=1e-12)
    assert np.isfinite(automatic_exposure(jnp.zeros((4, 3))))


def shown(xyz, exposure):
    return np.asarray(preview(jnp.asarray(xyz), exposure)).astype(int)


def test_what_the_meter_reads_is_middle_grey():
    # 0.18 in sRGB: 255 (1.055 * 0.18^(1/2.4) - 0.055) = 117.6
    for exposure in (-4.0, 15.0):
        luminance = 2.0 ** (exposure - 3.0)
        grey = shown(luminance * white(D65), exposure)
        np.testing.assert_array_equal(grey, [118, 118, 118])


def test_a_preview_runs_from_black_to_white():
    steps = np.array([0.0, 1e-6, 1.0, 8.0, 32.0, 1e3, 1e12])[:, None] * white(D65)
    found = shown(steps, 6.0)
    assert np.all(np.diff(found[:, 1]) >= 0)
    np.testing.assert_array_equal(found[[0, -1]], [[0] * 3, [255] * 3])


def test_a_preview_holds_colours_that_no_screen_has():
    nm = jnp.arange(380.0, 781.0, 10.0)
    lines = to_xyz(jnp.eye(41), nm)
    lines = 8.0 * lines / lines[:, 1:2]  # all as bright as middle grey
    picture = shown(lines, 6.0)
    laser = picture[14]  # 520 nm: green, outside the gamut; never wrapped to red
    assert laser[1] > 130 and laser[0] == 0
    assert np.all(picture.max(-1) < 255 + 1)
    assert np.all(picture[30:, 0] > picture[30:, 2])


def test_the_solar_constant_of_astm_g173():
    nm, irradiance = reference.solar_irradiance()
    assert (nm[0], nm[-1]) == (280.0, 4000.0)
    np.testing.assert_allclose(np.trapezoid(irradiance, nm), 1347.9, atol=0.1)


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """An empty cache folder that is not there yet; the tables are read anew."""
    folder = tmp_path / "deep" / "cache"
    monkeypatch.setenv("ATMOS_CACHE", str(folder))
    reference._tables.cache_clear()
    yield folder
    reference._tables.cache_clear()


def check_tables():
    reference._tables.cache_clear()
    assert reference.matching_functions()[1].shape == (471, 3)
    np.testing.assert_allclose(reference.matching_functions()[1].sum(0), SUMS)
    assert not reference.matching_functions()[1].flags.writeable


def test_tables_are_read_once_and_kept(cache, monkeypatch):
    check_tables()
    (file,) = cache.iterdir()

    def never():
        raise AssertionError("the cache should have served")

    monkeypatch.setattr(reference, "_read", never)
    check_tables()
    assert list(cache.iterdir()) == [file]


@pytest.mark.parametrize("damage", ["cut", "flip", "empty", "other"])
def test_a_damaged_cache_is_made_anew(cache, damage):
    check_tables()
    (file,) = cache.iterdir()
    whole = file.read_bytes()
    if damage == "cut":
        file.write_bytes(whole[: len(whole) // 2])
    elif damage == "flip":
        middle = whole.index(b"\x93NUMPY") + 2000
        file.write_bytes(whole[:middle] + b"\xff\xff" + whole[middle + 2 :])
    elif damage == "empty":
        file.write_bytes(b"")
    else:
        np.savez(file, sun=np.zeros(3))
    check_tables()
    assert file.read_bytes()[:100] == whole[:100] and file.stat().st_size == len(whole)
    assert list(cache.iterdir()) == [file]


def test_no_cache_is_no_error(cache):
    cache.parent.mkdir()
    cache.write_text("a file where the folder should be")
    check_tables()
    assert cache.read_text().startswith("a file")


def test_a_file_that_cannot_be_replaced_is_left_alone(cache):
    reference._file().mkdir(parents=True)
    check_tables()
    assert list(cache.iterdir()) == [reference._file()]
