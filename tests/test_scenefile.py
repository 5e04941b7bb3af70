import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import vdb_files

from atmos import deg, earth, image, km, mars, medium, phase, Scene, spectrum
from atmos.camera import Fisheye, LatLong, Perspective
from atmos.geometry import Flat, Spherical
from atmos.light import Lamp, Spot, Sun, sunlight
from atmos.particle import Air, CarbonDioxide, Depolarisation, Scattering
from atmos.particle.aerosol import opac, optical_depth
from atmos.particle.surface import albedo
from atmos.scene import air, haze, ozone
from atmos.scenefile import dump, GUIDE, load, load_camera, parse, parse_camera
from atmos.surface import Glass, Lambertian, Mirror, Plane, Sphere, Surface


PLANET = """
[planet]
shape = "spherical"
radius = 6360e3
top = 60e3
ground_albedo = 0.1
"""
SUN = """
[sun]
zenith = 60.0
irradiance = 1.0
angular_radius = 0.0
"""
CAMERA = """
[camera]
kind = "perspective"
position = [0, -3e3, 200]
azimuth = 20
"""
AIR = """
[[medium]]
name = "air"
scattering = { kind = "power_law", value = 1e-6, exponent = -4.0, at = 1000.0 }
profile = { kind = "exponential", scale_height = 8000.0 }
phase = { kind = "rayleigh", depolarisation = 0.0 }
"""
HAZE = """
[[medium]]
single_scattering_albedo = 0.75
profile = { kind = "uniform", bottom = 0, top = 1200 }
phase = { kind = "henyey_greenstein", g = 0.76 }
[medium.extinction]
kind = "table"
wavelength = [400, 600, 800]
value = [4e-5, 2e-5, 1e-5]
"""
LIT = """
[[light]]
kind = "lamp"
position = [1, 2, 3]
intensity = 4.0

[[light]]
kind = "spot"
position = [0, 0, 7]
direction = [0, 0.3, -0.4]
intensity = { kind = "power_law", value = 2.0, exponent = 1.0 }
inner = 10
outer = 15

[[surface]]
shape = { kind = "sphere", centre = [0, 0, 8], radius = 5 }
material = { kind = "lambertian", albedo = 0.8 }

[[surface]]
shape = { kind = "plane", place = [0, 0, 9], upright = [0, 0, 2] }
material = { kind = "mirror", reflectance = 0.6 }
"""
TEXT = PLANET + SUN + CAMERA + AIR + HAZE + LIT


def alike(a, b):
    """Whether two scenes are one but for rounding."""
    assert jax.tree.structure(a) == jax.tree.structure(b)
    for x, y in zip(jax.tree.leaves(a), jax.tree.leaves(b), strict=True):
        near = 2.0 * float(jnp.finfo(x.dtype).eps)
        np.testing.assert_allclose(x, y, rtol=near, atol=near if x.ndim else 0.0)


def test_a_scene_file_says_what_the_air_is():
    found = parse(TEXT)
    wavelength = jnp.array([500.0, 700.0])
    clear, haze = found.media
    np.testing.assert_allclose(clear.extinction(wavelength)[0], 1e-6 * 2**4)
    np.testing.assert_allclose(haze.extinction(wavelength), [3e-5, 1.5e-5])
    assert haze.scattering is not None
    np.testing.assert_allclose(
        haze.scattering.evaluate(wavelength), [2.25e-5, 1.125e-5]
    )
    assert isinstance(haze.profile, medium.Uniform) and haze.profile.top == 1200.0
    assert isinstance(clear.profile, medium.Exponential)
    assert isinstance(clear.phase, phase.Rayleigh)
    assert isinstance(found.geometry, Spherical) and found.geometry.radius == 6360e3
    assert found.ground.evaluate(wavelength) == 0.1


def test_the_sun_stands_where_the_file_says():
    text = TEXT.replace("zenith = 60.0", "zenith = 60.0\nazimuth = 90.0")
    np.testing.assert_allclose(
        parse(text).lights[0].direction, [np.sqrt(0.75), 0.0, 0.5], atol=1e-15
    )


def test_a_flat_planet_needs_no_radius():
    text = TEXT.replace('"spherical"', '"flat"').replace("radius = 6360e3\n", "")
    assert isinstance(parse(text).geometry, Flat)


def test_lamps_and_surfaces_lie_where_the_file_says():
    _, lamp, spot = parse(TEXT).lights
    np.testing.assert_array_equal(lamp.position, [1.0, 2.0, 3.0])
    np.testing.assert_allclose(spot.direction, [0.0, 0.6, -0.8], rtol=1e-15)
    np.testing.assert_allclose([spot.inner, spot.outer], np.radians([10.0, 15.0]))
    # A power law of exponent 1 through 2 at 550 nm.
    nm = jnp.array([275.0])
    assert (lamp.intensity.evaluate(nm), spot.intensity.evaluate(nm)) == (4.0, 1.0)
    ball, wall = parse(TEXT).surfaces
    assert ball.shape.radius == 5.0 and ball.material.share(nm) == 0.8
    np.testing.assert_array_equal(wall.shape.normal(jnp.zeros(3)), [0.0, 0.0, 1.0])
    assert wall.material.share(nm) == 0.6
    short = """
[[surface]]
shape = { kind = "plane", place = [0, 0, 0.1] }
material = { kind = "lambertian", albedo = "snow" }
"""
    level = Plane(row(0.0, 0.0, 0.1), row(0.0, 0.0, 1.0))
    due = (Surface(level, Lambertian(albedo("snow"))),)
    alike(parse(PLANET + SUN + short).surfaces, due)


def test_where_nothing_shines_a_file_must_say_so():
    lit = LIT.split("[[surface]]")[0]
    assert len(parse(PLANET + lit).lights) == 2
    assert len(parse(PLANET + GLOW).media) == 1
    assert parse("sun = []" + PLANET).lights == ()
    with pytest.raises(ValueError, match="^`sun` is missing, and nothing else"):
        parse(PLANET + AIR)


GLOW = """
[[medium]]
emission = 1.0
profile = { kind = "box", lower = [0, 0, 0], upper = [1, 1, 1] }
"""


def test_what_lies_all_around_is_a_picture_beside_the_scene(tmp_path):
    path, picture = tmp_path / "scene.toml", tmp_path / "dusk.exr"
    around = 'kind = "surrounding"\nfile = "dusk.exr"\ncentre_azimuth = 90'
    path.write_text(f"{PLANET}\n[[light]]\n{around}")
    with pytest.raises(ValueError, match=r"`light\[0\].file`: dusk.exr: cannot be"):
        load(path)
    pixels = np.arange(16.0, dtype=np.float32).reshape(2, 4, 2)
    image.write_spectral_exr(picture, pixels, np.array([450.0, 650.0]))
    (found,) = load(path).lights
    np.testing.assert_array_equal(found.picture, pixels)
    np.testing.assert_allclose(found.centre, 0.5 * np.pi)
    image.write_spectral_exr(picture, pixels[:, :3], np.array([450.0, 650.0]))
    with pytest.raises(ValueError, match=r"`light\[0\].file` must be twice as wide"):
        load(path)
    # In memory nothing says what file it was.
    with pytest.raises(ValueError, match=r"`lights\[1\]`: must .* got Surrounding"):
        dump(Scene(Flat(), 1.0, (), (SUNLIT, found)))


def test_a_ready_made_medium_is_that_of_the_library():
    text = """
[[medium]]
preset = "air"
[[medium]]
preset = "ozone"
column = 250
[[medium]]
preset = "desert"
visibility = 20e3
[[medium]]
preset = "urban"
optical_depth = 0.2
[[medium]]
preset = "arctic"
"""
    desert, urban = opac("desert"), opac("urban")
    amount = optical_depth(20e3, desert.scale_height)
    wanted = (
        air(),
        ozone(250.0),
        haze(dataclasses.replace(desert, optical_depth=amount)),
        haze(dataclasses.replace(urban, optical_depth=0.2)),
        haze(opac("arctic")),
    )
    alike(parse(PLANET + SUN + text).media, wanted)


def row(*numbers):
    return np.array(numbers)


def table(knots, values, *beyond):
    return spectrum.Tabulated(row(*knots), row(*values), *beyond)


SUNLIT = Sun.at(50.0 * deg, 200.0 * deg, sunlight(5.0, 1.0163))
STAR = spectrum.BandAverage(row(300.0, 400.0, 900.0), row(1.0, 2.0, 1.0), 5.0)
SHARE = table([300.0, 500.0, 900.0], [0.1, 0.7, 0.3])
SLAB = medium.Uniform(0.0, 1e3)
MEDIA = [
    medium.Medium(medium.Tent(25 * km, 15 * km), absorption=SHARE),
    medium.Medium(
        medium.Tabulated(row(0.0, 1e3, 5e3), row(1.0, 0.5, 0.0)),
        scattering=spectrum.PowerLaw(1e-5, -1.3),
        absorption=table([400.0, 700.0], [1e-6, 2e-6], 0.0, 0.0),
        phase=phase.Isotropic(),
    ),
    medium.of_extinction(
        spectrum.PowerLaw(1e-5, -0.5),
        SHARE,
        medium.Ball(row(1.0, 2.0, 300.0), 100.0),
        phase.CornetteShanks(0.5),
    ),
    medium.Medium(
        medium.Grid(
            np.arange(24.0).reshape(2, 3, 4), row(0.0, 0.0, 1.0), row(1.0, 2.0, 3.0)
        ),
        scattering=1e-3,
        phase=phase.Draine(spectrum.as_spectrum(0.4), SHARE),
    ),
    medium.Medium(
        medium.StandardAtmosphere(),
        scattering=Scattering(Air(420e-6)),
        phase=phase.Rayleigh(Depolarisation(CarbonDioxide())),
    ),
    medium.Medium(
        SLAB,
        scattering=table([400.0, 700.0], [1e-6, 2e-6], None, 1e-6),
        phase=phase.EmpiricalMie.hazy(),
    ),
    medium.Medium(
        SLAB,
        scattering=2e-5,
        phase=phase.Tabulated(row(-1.0, 0.2, 0.999, 1.0), row(1.0, 2.0, 30.0, 5e3)),
    ),
    medium.Medium(
        SLAB,
        scattering=2e-5,
        phase=phase.Tabulated(
            row(-1.0, 0.5, 1.0),
            np.array([[1.0, 2.0], [2.0, 3.0], [7.0, 9.0]]),
            row(400.0, 800.0),
        ),
    ),
    medium.Medium(
        medium.Exponential(8 * km),
        scattering=2e-5,
        phase=phase.DoubleHenyeyGreenstein(
            spectrum.as_spectrum(0.9), spectrum.as_spectrum(-0.5), SHARE
        ),
    ),
    medium.Medium(medium.HeightFog(100.0, 50.0), scattering=0.01),
    medium.Medium(
        medium.Product(medium.Noise(300.0, 0.1, seed=3), medium.Everywhere()),
        absorption=0.01,
        emission=medium.Glow(spectrum.PowerLaw(0.2, 2.0)),
    ),
    medium.Medium(
        medium.Transformed(
            medium.Puff(np.zeros(3), 10.0, 4.0), np.eye(3) * 2.0, np.ones(3)
        ),
        scattering=1.0,
        absorption=2.0,
        emission=medium.Thermal(medium.Box(np.zeros(3), np.ones(3))),
    ),
]
SCENES = {
    "earth": earth(SUNLIT),
    "mars": mars(SUNLIT),
    "every medium": Scene(Flat(), 50 * km, tuple(MEDIA), (SUNLIT,), SHARE),
    "two suns": Scene(
        Spherical(6360 * km),
        60 * km,
        (),
        (SUNLIT, Sun.at(1.0, 2.0, spectrum.as_spectrum(0.1), 0.0)),
        albedo("snow"),
    ),
    "lamps and solids": Scene(
        Flat(),
        10.0,
        (),
        (
            SUNLIT,
            Lamp(row(1.0, 2.0, 3.0), SHARE),
            Spot(row(0.0, 0.1, 7.0), row(0.48, 0.36, -0.8), 2.0, 0.0, 0.3),
            Spot(row(0.0, 0.1, 7.0), row(0.0, 0.0, 1.0), STAR, 1.0, np.pi),
        ),
        0.1,
        (
            Surface(Sphere(row(0.0, 0.1, 1.0), 0.3), Lambertian(albedo("sand"))),
            Surface(Sphere(row(0.0, 5.1, 1.0), 0.7), Glass(1.33)),
            Surface(Plane(row(9.0, 0.0, 0.0), row(0.6, 0.8, 0.0)), Mirror(SHARE)),
        ),
    ),
    "a lamp alone": Scene(Flat(), 1.0, (), (Lamp(np.zeros(3), sunlight(5.0)),)),
    "no sun": Scene(Flat(), 1 * km, (air(),), ()),
    "another star": Scene(Flat(), 1 * km, (air(),), (Sun.at(1.0, 0.0, STAR),)),
}


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
@pytest.mark.parametrize("dtype", [jnp.float64, jnp.float32])
def test_what_is_written_is_read_again(scene, dtype):
    scene = jax.tree.map(lambda x: x.astype(dtype), scene)
    found = parse(dump(scene))
    alike(jax.tree.map(lambda x: x.astype(dtype), found), scene)


CAMERAS = {
    "dome": LatLong(row(0.0, 0.0, 2.0), 64, 1.0),
    "fisheye": Fisheye(row(1.0, 2.5, 3.0), 64, 200.0 * deg, -0.3),
    "perspective": Perspective(row(-6.5e3, 0.1, 3e5), 0.7, -0.2, 40.0 * deg, 3, 7),
}


@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
@pytest.mark.parametrize("dtype", [jnp.float64, jnp.float32])
def test_a_camera_is_written_and_read_again(camera, dtype):
    camera = jax.tree.map(lambda x: x.astype(dtype), camera)
    text = dump(SCENES["no sun"], camera=camera)
    found = jax.tree.map(lambda x: x.astype(dtype), parse_camera(text))
    alike(found, camera)
    assert len(parse(text).media) == 1
    assert parse_camera(PLANET + SUN) is None


def test_a_sampled_profile_is_a_grid_of_it():
    fog = 'profile = { kind = "height_fog", top = 10, scale_height = 50 }'
    box = "lower = [0, 0, 0], upper = [30, 20, 100], cells = [3, 2, 5]"
    text = f"[[medium]]\nabsorption = 1.0\nprofile = {{ kind = 'sampled', {box}, of = "
    found = parse(PLANET + SUN + text + fog.removeprefix("profile = ") + " }").media[0]
    due = np.exp(-np.maximum(np.arange(10.0, 100.0, 20.0) - 10.0, 0.0) / 50.0)
    np.testing.assert_allclose(
        found.profile.values, np.broadcast_to(due, (3, 2, 5)), rtol=1e-12
    )
    np.testing.assert_array_equal(found.profile.upper, [30.0, 20.0, 100.0])


def test_the_sun_and_the_ground_are_written_by_name():
    text = dump(SCENES["earth"], ["air", "ozone", "haze"])
    assert 'irradiance = { kind = "solar", bandwidth = 5.0, distance = 1.0163 }' in text
    assert 'ground_albedo = "grass"' in text
    assert "zenith = 50.0\n" in text and "azimuth = 200.0\n" in text
    assert 'name = "haze"' in text
    assert len(text) < 1500


def test_the_guide_names_every_kind():
    kinds = """exponential tent uniform table standard_atmosphere ball grid isotropic
    rayleigh henyey_greenstein double_henyey_greenstein cornette_shanks draine
    empirical_mie power_law molecules ozone solar height_fog everywhere box file noise
    puff transformed product blackbody sampled latlong fisheye perspective lamp spot
    surrounding sphere plane lambertian mirror glass""".split()
    assert all(f'kind = "{x}"' in GUIDE for x in kinds)
    assert parse(GUIDE + TEXT).top == 60e3


def test_a_scene_that_has_no_words_is_not_written():
    mixed = spectrum.Product(SHARE, SHARE)
    odd = medium.Medium(medium.Exponential(8 * km), absorption=mixed)
    with pytest.raises(ValueError, match=r"media\[0\].absorption"):
        dump(Scene(Flat(), 1 * km, (odd,), ()))


FILES = """
[[medium]]
extinction = 2.0
single_scattering_albedo = 0.5
phase = { kind = "isotropic" }
[medium.profile]
kind = "transformed"
of = { kind = "file", file = "smoke.vdb", grid = "density", factor = 2.0 }
offset = [0.0, 0.0, 10.0]

[[medium]]
emission = { kind = "blackbody", temperature = { kind = "everywhere" } }
absorption = 1.0
profile = { kind = "file", file = "smoke.vdb", grid = "density" }

[[medium]]
extinction = 2.0
colour = "tint"
profile = { kind = "file", file = "cloud.npz", grid = "thick" }
phase = { kind = "isotropic" }
"""


def test_a_scene_names_files_that_lie_beside_it(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(PLANET + SUN + FILES)
    with pytest.raises(ValueError, match="medium.0..profile.of.file.* cannot be read"):
        load(path)
    (tmp_path / "smoke.vdb").write_bytes(vdb_files.raw("float"))
    box = {"lower": np.zeros(3), "upper": np.ones(3)}
    tint = np.full((2, 2, 2, 3), 0.25)
    np.savez(tmp_path / "cloud.npz", thick=np.ones((2, 2, 2)), tint=tint, **box)
    smoke, fire, *cloud = load(path).media
    np.testing.assert_array_equal(smoke.profile.of.values, 2.0 * fire.profile.values)
    assert isinstance(fire.emission, medium.Thermal) and len(cloud) == 6
    path.write_text(PLANET + SUN + FILES.replace('"density"', '"heat"'))
    with pytest.raises(ValueError, match="`heat` must be one of density; got 'heat'"):
        load(path)


def changed(old, new):
    assert old in TEXT
    return TEXT.replace(old, new, 1)


PHASE = '{ kind = "rayleigh", depolarisation = 0.0 }'
PROFILE = '{ kind = "exponential", scale_height = 8000.0 }'
BAD = [
    ("top = 60e3", "top = 60e3\nhue = 3", "`planet.hue` is not known", "ground_albedo"),
    ("[planet]", "[plant]", "`plant` is not known", "sun, light, surface"),
    ("radius = 6360e3", "", "`planet.radius` is missing", "m"),
    (
        "radius = 6360e3",
        "radius = -6360e3",
        "`planet.radius`",
        "above 0; got -6360000.0",
    ),
    ("radius = 6360e3", "radius = 6360", "`planet.radius`", "above `top`, 60000.0 m"),
    ("6360e3", '"6360 km"', "`planet.radius` must be a number", "got '6360 km'"),
    ("6360e3", "nan", "`planet.radius` must be a finite number", "got nan"),
    ("6360e3", "inf", "`planet.radius` must be a finite number", "got inf"),
    ("6360e3", "1e999", "`planet.radius` must be a finite number", "got inf"),
    ("6360e3", "1" * 400, "`planet.radius` must be a finite number", "got 111"),
    ("6360e3", "true", "`planet.radius` must be a number", "got True"),
    ("6360e3", "1979-05-27", "`planet.radius` must be a number", "1979"),
    ('"spherical"', '"round"', "`planet.shape` must be one of", "got 'round'"),
    ("top = 60e3", "top = 0", "`planet.top` must be a number above 0", "got 0"),
    ("albedo = 0.1", "albedo = 1.1", "`planet.ground_albedo` must be", "got 1.1."),
    ("albedo = 0.1", 'albedo = "gras"', "must be one of grass", "got 'gras'"),
    ("albedo = 0.1", 'albedo = {kind = "solar"}', "ground_albedo.kind`", "got 'solar'"),
    (
        "albedo = 0.1",
        "albedo = {value = 3}",
        "`planet.ground_albedo.kind` is missing",
        "",
    ),
    ("zenith = 60.0", "zenith = 190", "`sun.zenith`", "180 or less; got 190"),
    ("zenith = 60.0", "", "`sun.zenith` is missing", ""),
    ("irradiance = 1.0", "irradiance = -1.0", "`sun.irradiance` must be", "got -1.0"),
    ("radius = 0.0", "radius = -0.1", "`sun.angular_radius`", "got -0.1"),
    ("8000.0", "-8000.0", "`medium[0].profile.scale_height`", "above 0; got -8000.0"),
    ("8000.0", "0", "`medium[0].profile.scale_height`", "above 0; got 0"),
    (PROFILE, "3", "`medium[0].profile` must be a table", "got 3"),
    (
        PROFILE,
        '{ kind = "grid", values = [[[1], [2, 3]]], lower = [0, 0, 0], '
        "upper = [1, 1, 1] }",
        "`medium[0].profile.values` must have as many",
        "got [1, 2]",
    ),
    ('"exponential"', '"cone"', "`medium[0].profile.kind` must be one", "got 'cone'"),
    (
        "top = 1200",
        "top = -1",
        "`medium[1].profile.top - bottom` must be above 0",
        "-1",
    ),
    ("value = 1e-6", "value = -1e-6", "`medium[0].scattering` must be", "got -1e-06"),
    ("at = 1000.0", "at = 1.0", "`medium[0].scattering.at`", "100 or more; got 1.0"),
    ("[400, 600, 800]", "[400, 800, 600]", "`medium[1].extinction.wavelength`", "rise"),
    ("[400, 600, 800]", "[0.4, 0.6, 0.8]", "extinction.wavelength[0]`", "got 0.4"),
    ("[400, 600, 800]", "[400, 600]", "`medium[1].extinction.value` must pair", ""),
    ("[4e-5, 2e-5", "[4e-5, -2e-5", "`medium[1].extinction` must be", "got -2e-05"),
    ("[4e-5, 2e-5", '[4e-5, "a"', "`medium[1].extinction.value[1]`", "got 'a'"),
    (
        "albedo = 0.75",
        "albedo = 1.5",
        "`medium[1].single_scattering_albedo`",
        "got 1.5",
    ),
    ("single_scattering_albedo = 0.75", "", "single_scattering_albedo` is missing", ""),
    ("medium.extinction", "medium.scattering", "single_scattering_albedo`", "beside"),
    ("g = 0.76", "g = 1.2", "`medium[1].phase.g` must be", "got 1.2"),
    ("g = 0.76", "h = 0.76", "`medium[1].phase.h` is not known", "known there: g"),
    (
        "depolarisation = 0.0",
        "depolarisation = 0.7",
        "phase.depolarisation`",
        "got 0.7",
    ),
    (f"phase = {PHASE}", "", "`medium[0].phase` is missing", ""),
    (
        PHASE,
        '{ kind = "table", cosine = [-1, 0.9], value = [1, 1] }',
        "`medium[0].phase.cosine` must rise from -1 to 1",
        "0.9",
    ),
    (
        PHASE,
        '{ kind = "table", cosine = [-1, 1], value = [1, [1]] }',
        "`medium[0].phase.value` must have rows",
        "",
    ),
    ('name = "air"', 'preset = "air"', "`medium[0].scattering` must not", "beside"),
    (
        "[[medium]]",
        '[[medium]]\npreset = "smog"\n[[medium]]',
        "medium[0].preset`",
        "smog",
    ),
    (
        "[[medium]]",
        '[[medium]]\npreset = "desert"\nvisibility = 400e3\n[[medium]]',
        "`medium[0].visibility` must be below",
        "got 400000.0",
    ),
    ("[[medium]]", "[[medium]]\n[[medium]]", "`medium[0].profile` is missing", ""),
    ("azimuth = 20", "azimuth = 400", "`camera.azimuth`", "360 or less; got 400"),
    ("azimuth = 20", "elevation = 91", "`camera.elevation`", "90 or less; got 91"),
    ("azimuth = 20", "field_of_view = 0", "`camera.field_of_view`", "above 0; got 0"),
    ("azimuth = 20", "height = 2.5", "`camera.height` must be a whole number", "2.5"),
    ("azimuth = 20", "zenith = 3", "`camera.zenith` is not known", "field_of_view"),
    (
        "-3e3, 200",
        "200",
        "`camera.position` must be a list of length 3",
        "got [0, 200]",
    ),
    (
        'kind = "perspective"\nposition',
        'kind = "panorama"\nposition',
        "`camera.kind` must be one of latlong, fisheye, perspective",
        "got 'panorama'",
    ),
    ('kind = "lamp"', 'kind = "lmp"', "`light[0].kind` must be one of lamp", "'lmp'"),
    ("[1, 2, 3]", "[1, 2]", "`light[0].position` must be a list of length 3", "[1, 2]"),
    ("= 4.0", "= -4.0", "`light[0].intensity` must be at least 0", "got -4.0"),
    ("= 4.0", "= 4.0\npower = 3", "`light[0].power` is not known", "intensity"),
    ("[0, 0.3, -0.4]", "[0, 0, 0]", "`light[1].direction` must point", "[0.0, 0.0"),
    ("inner = 10", "", "`light[1].inner` is missing", ""),
    ("inner = 10", "inner = 15", "`light[1].outer` must be above `inner`", "got 15.0"),
    ("outer = 15", "outer = 181", "`light[1].outer`", "180 or less; got 181"),
    (
        '"sphere"',
        '"ball"',
        "`surface[0].shape.kind` must be one of sphere, plane",
        "ll",
    ),
    ("radius = 5", "radius = 0", "`surface[0].shape.radius`", "above 0; got 0"),
    ("[0, 0, 2]", "[0, 0, 0]", "`surface[1].shape.upright` must point", "[0.0, 0.0"),
    ("albedo = 0.8", "albedo = 1.2", "`surface[0].material.albedo` must be", "1.2"),
    ("albedo = 0.8", 'albedo = "wood"', "`surface[0].material.albedo`", "got 'wood'"),
    ("reflectance = 0.6", "reflectance = 2", "`surface[1].material.reflectance`", "2"),
    ('"mirror"', '"glass"', "`surface[1].material.reflectance` is not known", "index"),
    ("[[medium]]", "[[medium]", "must be TOML", "line"),
    ("[sun]", f"x = {'[' * 3000}", "must be TOML", ""),
]


@pytest.mark.parametrize(("old", "new", "key", "rest"), BAD)
def test_a_bad_file_is_refused_by_key_rule_and_value(tmp_path, old, new, key, rest):
    path = tmp_path / "scene.toml"
    path.write_text(changed(old, new))
    with pytest.raises(ValueError) as caught:
        load(path)
    if "camera" in key:
        with pytest.raises(ValueError, match="camera"):
            load_camera(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert key in str(caught.value) and rest in str(caught.value)


def test_a_file_that_is_no_text_is_refused(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ValueError, match="UTF-8"):
        load(path)
    with pytest.raises(FileNotFoundError):
        load(tmp_path / "none.toml")
