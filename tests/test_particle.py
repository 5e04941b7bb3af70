"""What air is made of, against figures that others published."""

from importlib import resources
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad

from atmos import data
from atmos.particle import (
    Aerosol,
    aerosol,
    Air,
    CarbonDioxide,
    Depolarisation,
    ozone,
    Scattering,
    surface,
)
from atmos.quantity import km


TRUTH = Path(__file__).parents[2] / "shared" / "truth"

# Bodhaine et al. (1999), table 3, air with 360 ppm of carbon dioxide: wavelength in nm,
# cross section in cm^2, King factor.
BODHAINE = np.array(
    [
        (350.0, 2.9289e-26, 1.05312),
        (400.0, 1.6738e-26, 1.05126),
        (450.0, 1.0274e-26, 1.05011),
        (500.0, 6.6614e-27, 1.04935),
        (550.0, 4.5105e-27, 1.04882),
        (600.0, 3.1640e-27, 1.04844),
        (650.0, 2.2856e-27, 1.04815),
        (700.0, 1.6926e-27, 1.04793),
        (750.0, 1.2803e-27, 1.04776),
        (800.0, 9.8642e-28, 1.04762),
        (850.0, 7.7235e-28, 1.04751),
    ]
)

# Ciddor (1996), dry air with 450 ppm at 15 degrees Celsius and 1013.25 hPa, n - 1.
CIDDOR = np.array(
    [
        (300.0, 2.91569e-4),
        (400.0, 2.82762e-4),
        (500.0, 2.78974e-4),
        (550.0, 2.77838e-4),
        (600.0, 2.76983e-4),
        (700.0, 2.75804e-4),
        (800.0, 2.75048e-4),
        (1000.0, 2.74166e-4),
    ]
)

# Ozone, averages over 10 nm from the wavelength on, in m^2: Serdyuchenko et al. (2014)
# at 233 K, as averaged by Bruneton in "precomputed atmospheric scattering".
BRUNETON = np.array(
    [
        (480.0, 7.752e-26),
        (500.0, 1.480e-25),
        (520.0, 2.139e-25),
        (540.0, 3.091e-25),
        (560.0, 4.266e-25),
        (580.0, 4.398e-25),
        (600.0, 5.019e-25),
        (620.0, 3.740e-25),
        (640.0, 2.662e-25),
        (660.0, 1.852e-25),
        (680.0, 1.209e-25),
    ]
)

# The same from other people's measurements: Daumont, Brion, Malicet et al. (1992 to
# 1998), interpolated to 233 K.
DAUMONT = np.array(
    [
        (295.0, 3.857e-23),
        (300.0, 1.930e-23),
        (305.0, 9.600e-24),
        (310.0, 4.776e-24),
        (315.0, 2.331e-24),
        (320.0, 1.095e-24),
        (325.0, 5.229e-25),
        (330.0, 2.429e-25),
        (495.0, 1.218e-25),
        (545.0, 3.384e-25),
        (595.0, 5.139e-25),
        (645.0, 2.503e-25),
    ]
)


def averages(spectrum, starts):
    """Over 10 nm from each start."""
    inside = np.arange(0.05, 10.0, 0.1)
    wavelength = jnp.asarray((starts[:, None] + inside).ravel())
    return np.asarray(spectrum.evaluate(wavelength)).reshape(len(starts), -1).mean(1)


def test_air_scatters_as_bodhaine_tabulates():
    wavelength, area, _ = BODHAINE.T
    ours = 1e4 * Air().cross_section(jnp.asarray(wavelength))
    np.testing.assert_allclose(ours, area, rtol=5e-5)  # 4 to 5 digits are printed


def test_air_scatters_as_bodhaine_fits():
    # Eq. 29, good to 0.01 % by its own account, from 250 to 850 nm.
    um = np.linspace(0.25, 0.85, 61)
    above = 1.0455996 - 341.29061 / um**2 - 0.90230850 * um**2
    below = 1.0 + 0.0027059889 / um**2 - 85.968563 * um**2
    ours = Air().cross_section(jnp.asarray(1e3 * um))
    np.testing.assert_allclose(1e32 * ours, above / below, rtol=1e-4)


def test_air_has_the_king_factor_of_bates():
    wavelength, _, king = BODHAINE.T
    np.testing.assert_allclose(
        Air().king_factor(jnp.asarray(wavelength)), king, atol=6e-6
    )


@pytest.mark.parametrize("gas", [Air(), CarbonDioxide()])
def test_depolarisation_and_king_factor_are_one_number(gas):
    wavelength = jnp.asarray(BODHAINE[:, 0])
    rho = Depolarisation(gas).evaluate(wavelength)
    king = (6.0 + 3.0 * rho) / (6.0 - 7.0 * rho)
    np.testing.assert_allclose(king, gas.king_factor(wavelength), rtol=1e-14)


def test_air_refracts_as_ciddor_says():
    wavelength, excess = CIDDOR.T
    ours = Air(co2=450e-6).refractivity(jnp.asarray(wavelength))
    np.testing.assert_allclose(ours, excess, atol=1.2e-8)


def test_air_refracts_as_ciddor_says_at_every_wavelength():
    path = TRUTH / "refindex_air_ciddor1996.csv"
    if not path.exists():
        pytest.skip(f"{path.name} is not here")
    table = np.loadtxt(path, delimiter=",", skiprows=2)
    ours = Air(co2=450e-6).refractivity(jnp.asarray(1e3 * table[:, 0]))
    np.testing.assert_allclose(ours, table[:, 1] - 1.0, atol=1.5e-8)


def test_carbon_dioxide_refracts_as_owens_says():
    # Owens (1967) as in Bodhaine et al. (1999), eq. 27: other measurements.
    um = np.linspace(0.35, 0.85, 11)
    owens = 22822.1 + 117.8 / um**2
    owens = owens + 2406030.0 / (130.0 - um**-2) + 15997.0 / (38.9 - um**-2)
    ours = CarbonDioxide().refractivity(jnp.asarray(1e3 * um))
    np.testing.assert_allclose(ours, 1e-8 * owens, rtol=2.5e-3)


def test_carbon_dioxide_has_the_king_factor_of_bates():
    # 1.15 at all wavelengths, by Bates (1984).
    ours = CarbonDioxide().king_factor(jnp.array([300.0, 400.0, 550.0, 800.0]))
    np.testing.assert_allclose(ours, 1.15, rtol=0.013)


@pytest.mark.parametrize("gas", [Air(), CarbonDioxide()])
def test_a_cross_section_survives_single_precision(gas):
    wavelength = jnp.geomspace(200.0, 4000.0, 64)
    single = jax.tree.map(lambda x: x.astype(jnp.float32), (gas, wavelength))
    ours = single[0].cross_section(single[1])
    assert ours.dtype == jnp.float32
    np.testing.assert_allclose(ours, gas.cross_section(wavelength), rtol=2e-6)


def test_the_coefficient_is_cross_section_times_number():
    wavelength = jnp.array([550.0])
    coefficient = Scattering(Air(), 2.0e25).evaluate(wavelength)
    np.testing.assert_allclose(coefficient, 2.0e25 * 4.5105e-31, rtol=1e-4)
    assert Scattering(Air()).domain[0] == 185.0


def test_bad_gases_are_refused():
    with pytest.raises(ValueError, match="`co2` must lie between 0 and 1; got 400"):
        Air(co2=400.0)
    with pytest.raises(ValueError, match="`number_density` must be 0 m\\^-3 or more"):
        Scattering(Air(), -1.0)


def test_ozone_is_what_bruneton_averaged():
    starts, area = BRUNETON.T
    ours = averages(ozone.cross_section(), starts)
    np.testing.assert_allclose(ours, area, rtol=0.01)


def test_ozone_is_what_others_measured():
    # Laboratories differ by 1 to 4 %.
    starts, area = DAUMONT.T
    ours = averages(ozone.cross_section(), starts)
    np.testing.assert_allclose(ours, area, rtol=0.03)


def test_ozone_is_what_bruneton_averaged_at_every_wavelength():
    path = TRUTH / "bruneton_ozone233K_and_solar_10nm.csv"
    if not path.exists():
        pytest.skip(f"{path.name} is not here")
    table = np.loadtxt(path, delimiter=",", skiprows=2)
    starts, area = table[table[:, 0] < 830.0, :2].T
    error = averages(ozone.cross_section(), starts) - area
    assert np.all(np.abs(error) < 0.01 * area + 1.6e-27)
    assert np.all(300.0 * ozone.DOBSON * np.abs(error) < 2e-4)


def test_a_dobson_unit_is_ten_micrometres_of_ozone():
    # Loschmidt's constant (CODATA 2018): molecules in 1 m^3 at 0 degrees, 1013.25 hPa.
    np.testing.assert_allclose(ozone.DOBSON, 1e-5 * 2.686780111e25, rtol=1e-4)


def test_ozone_is_unknown_in_the_far_ultraviolet():
    assert ozone.cross_section().domain[0] == 280.0


# Mixtures of Hess et al. (1998) have one exponential layer at the ground, in km: depth
# and scale height; what lies above adds 0.013 in the free troposphere, less where the
# layer is deep, and 0.005 in the stratosphere.
LAYER = {"desert": (6.0, 2.0), "arctic": (2.0, 99.0), "antarctic": (10.0, 8.0)}
LAYER |= {name: (2.0, 1.0) for name in aerosol.NAMES if name.startswith("maritime")}


@pytest.mark.parametrize("name", aerosol.NAMES)
def test_an_opac_column_is_its_layers(name):
    bottom = aerosol.opac(name)
    ground = float(bottom.extinction().evaluate(jnp.array([550.0]))[0]) * km
    depth, height = LAYER.get(name, (2.0, 8.0))
    layer, _ = quad(lambda z: ground * np.exp(-z / height), 0.0, depth)
    above = float(bottom.optical_depth) - layer
    # The extinction is printed to 0.0005 per km.
    room = 0.0005 * layer / ground + 0.001
    assert 0.005 - room < above < 0.018 + room


def test_opac_itself_gives_what_we_have_of_it():
    # Output of OPAC 3.1 for continental polluted air, at 550 nm and 80 %.
    ours = aerosol.opac("continental_polluted")
    wavelength = jnp.array([550.0])
    scattering = ours.scattering().evaluate(wavelength)
    np.testing.assert_allclose(scattering, 1.558e-4, rtol=5e-3)
    np.testing.assert_allclose(
        ours.absorption().evaluate(wavelength), 1.877e-5, rtol=0.01
    )
    np.testing.assert_allclose(ours.asymmetry.evaluate(wavelength), 0.6977, atol=5e-4)
    np.testing.assert_allclose(ours.optical_depth, 0.3270, atol=5e-4)


def test_one_exponent_spans_what_two_did():
    ends = aerosol.opac("continental_clean").extinction()
    ends = ends.evaluate(jnp.array([350.0, 800.0]))
    ratio = (500.0 / 350.0) ** 1.10 * (800.0 / 500.0) ** 1.42
    np.testing.assert_allclose(ends[0] / ends[1], ratio, rtol=1e-12)


@pytest.mark.parametrize("visibility", [100.0, 5000.0, 23000.0, 300000.0])
def test_two_per_cent_of_contrast_is_left_at_the_visibility(visibility):
    molecules = float(Scattering(Air()).evaluate(jnp.array([550.0]))[0])
    extinction = float(aerosol.surface_extinction(visibility)) + molecules
    np.testing.assert_allclose(np.exp(-extinction * visibility), 0.02, rtol=1e-3)


def test_a_deeper_haze_is_thicker():
    thin, thick = (aerosol.optical_depth(23.0 * km, h) for h in (1.0 * km, 2.0 * km))
    np.testing.assert_allclose(thin, (3.912 / 23.0 - 0.01149) * 1.0, rtol=1e-12)
    np.testing.assert_allclose(thick, 2.0 * thin, rtol=1e-12)


def test_bad_aerosols_are_refused():
    with pytest.raises(ValueError, match="`name` must be one of .*urban.*; got 'fog'"):
        aerosol.opac("fog")
    with pytest.raises(ValueError, match="`visibility` must be above 0"):
        aerosol.surface_extinction(0.0)
    with pytest.raises(ValueError, match="`visibility` must be below that of pure air"):
        aerosol.surface_extinction(400.0 * km)
    with pytest.raises(ValueError, match="`scale_height` must be above 0"):
        Aerosol(0.1, 0.0, 1.3, 0.9, 0.7)
    with pytest.raises(ValueError, match="`single_scattering_albedo` must be 0"):
        Aerosol(0.1, 1000.0, 1.3, 1.2, 0.7)


def test_martian_dust_absorbs_what_was_observed():
    # Wolff et al. (2009), as in the Mars Planetary Climate Model.
    albedo = aerosol.martian_dust().single_scattering_albedo
    ours = albedo.evaluate(jnp.array([388.0, 650.0, 700.0]))
    np.testing.assert_allclose(ours, [0.73, 0.967, 0.975], atol=0.015)


def test_martian_dust_throws_light_ahead_as_observed():
    # Chen-Chen et al. (2019), from the sky of Gale crater at 650 nm: 0.687 +- 0.081,
    # and a phase function of two lobes.
    red = jnp.array([650.0])
    asymmetry = aerosol.martian_dust().asymmetry.evaluate(red)
    np.testing.assert_allclose(asymmetry, 0.687, atol=0.081)
    phase = aerosol.martian_dust_phase()
    for degrees, observed in ((5.0, 4.7287), (10.0, 1.6164), (20.0, 0.3266)):
        bent = jnp.asarray(1.0 - np.cos(np.deg2rad(degrees)))
        np.testing.assert_allclose(phase.evaluate(bent, red), observed, rtol=0.25)


def test_the_lobes_of_martian_dust_have_its_mean_cosine():
    wavelength = jnp.asarray(data.read("mars_dust")["wavelength"].astype(float))
    mean = aerosol.martian_dust_phase().moments(2, wavelength)[1]
    asymmetry = aerosol.martian_dust().asymmetry.evaluate(wavelength)
    np.testing.assert_allclose(mean, asymmetry, atol=2e-3)


def test_the_martian_sky_is_butterscotch_but_blue_about_the_sun():
    dust, phase = aerosol.martian_dust(), aerosol.martian_dust_phase()
    wavelength = jnp.array([450.0, 650.0])
    scattering = dust.scattering().evaluate(wavelength)

    def blue_to_red(degrees):
        bent = jnp.asarray(1.0 - np.cos(np.deg2rad(degrees)))
        blue, red = scattering * phase.evaluate(bent, wavelength)
        return blue / red

    assert blue_to_red(2.0) > 1.3
    assert blue_to_red(60.0) < 0.8


@pytest.mark.parametrize("name", surface.NAMES)
def test_no_ground_reflects_more_than_it_gets(name):
    albedo = surface.albedo(name)
    values = albedo.evaluate(jnp.linspace(200.0, 1200.0, 101))
    assert np.all((values > 0.0) & (values < 1.0))
    assert albedo.domain == (0.0, np.inf)
    assert values[0] == albedo.values[0] and values[-1] == albedo.values[-1]


def test_grounds_look_like_themselves():
    blue, green, red, infrared = jnp.array([[450.0], [550.0], [650.0], [850.0]])
    grass, sea, snow, mars, soil = (
        surface.albedo(name).evaluate
        for name in ("grass", "sea", "snow", "mars", "soil")
    )
    assert grass(infrared) > 4.0 * grass(green) > 8.0 * grass(red)
    assert sea(blue) > 1.2 * sea(red)
    # Diffuse light on flat water of index 1.34: 6.7 % (Fresnel).
    np.testing.assert_allclose(sea(infrared), 0.0675, atol=1e-3)
    assert snow(blue) > snow(red) > snow(infrared) > 0.8
    assert mars(red) > 2.0 * mars(blue) and soil(red) > 1.5 * soil(blue)


def test_an_unknown_ground_is_refused():
    with pytest.raises(ValueError, match="`name` must be one of grass, .*; got 'lava'"):
        surface.albedo("lava")


def test_every_table_says_whose_it_is():
    tables = [t for t in resources.files(data).iterdir() if t.name.endswith(".csv")]
    assert len(tables) >= 4
    for table in tables:
        text = table.read_text()
        assert text.startswith("#") and "Licence:" in text
