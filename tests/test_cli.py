import csv
import datetime
import io
import math
import os
import re
import subprocess
import sys
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
from PIL import Image

import atmos
from atmos.camera import Perspective
from atmos.cli import main, SunPosition
from atmos.cli._march import March
from atmos.cli._view import View
from atmos.colour import COLOUR_SPACES
from atmos.image import read_exr
from atmos.scenefile import dump, load, parse
from atmos.solver import (
    Adaptive,
    Fixed,
    Jittered,
    RayMarching,
    ShadowCache,
    ShadowRays,
    Skipping,
)


pytestmark = pytest.mark.usefixtures("hasty")
DEPTH = 1e-6
THIN = f"""
[planet]
shape = "flat"
top = 2e3

[sun]
zenith = 60.0
azimuth = 200.0
irradiance = 2.0

[[medium]]
scattering = {DEPTH / 1e3}
profile = {{ kind = "uniform", bottom = 0, top = 1e3 }}
phase = {{ kind = "henyey_greenstein", g = 0.5 }}
"""
SUNNY = THIN.replace("60.0", "50.0").replace(
    "irradiance = 2.0",
    'irradiance = { kind = "solar", bandwidth = 25 }\nangular_radius = 2',
)
LAMP = """
[[light]]
kind = "lamp"
position = [0, 0, 10]
intensity = 1
"""
BALL = """
[[surface]]
shape = { kind = "sphere", centre = [0, 0, 5], radius = 1 }
material = { kind = "glass" }
"""
BANDS = "400:700:25"
HEIGHT = 32


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ATMOS_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "thin.toml").write_text(THIN)
    (tmp_path / "sunny.toml").write_text(SUNNY)
    return tmp_path


def run(capsys, command, code=0):
    found = main(command.split())
    shown = capsys.readouterr()
    assert found == code, shown.err
    return shown.out, shown.err


def rows(text):
    return list(csv.DictReader(io.StringIO(text)))


def henyey_greenstein(g, cosine):
    return (1 - g * g) / (4 * math.pi * (1 + g * g - 2 * g * cosine) ** 1.5)


@pytest.mark.parametrize(
    "solver, double",
    [
        ("single", False),
        ("single", True),
        ("columns", False),
        ("shared", False),
        ("march", False),
    ],
)
def test_a_thin_slab_is_as_bright_as_its_phase_function(capsys, solver, double):
    command = (
        f"radiance thin.toml --solver {solver} --sun-zenith 60,70 --altitude 0,1500 "
        "--view-zenith 0,60,120 --azimuth 0,90,-180 --wavelength 450,650 --output "
    )
    out, err = run(capsys, f"{command} out.csv" + " --float64" * double)
    assert (out, err) == ("", "")
    text = Path("out.csv").read_text()
    assert text.startswith(
        "sun_zenith,altitude,view_zenith,azimuth,wavelength,radiance\n"
    )
    found = rows(text)
    assert len(found) == 2 * 2 * 3 * 3 * 2
    assert list(found[1].values())[:-1] == ["60", "0", "0", "0", "650"]
    for row in found:
        sun, view, azimuth = (
            math.radians(float(row[x]))
            for x in ("sun_zenith", "view_zenith", "azimuth")
        )
        cosine = math.cos(sun) * math.cos(view)
        cosine += math.sin(sun) * math.sin(view) * math.cos(azimuth)
        # Above the slab one sees it below, in it above.
        seen = (row["altitude"] == "0") == (math.cos(view) > 0.0)
        wanted = 2.0 * DEPTH * henyey_greenstein(0.5, cosine) / abs(math.cos(view))
        # The slab dims itself by its depth of a few millionths.
        near = 1e-5 if double else 3e-5
        assert math.isclose(float(row["radiance"]), wanted * seen, rel_tol=near)
    digits = [len(re.sub(r"e.*|[.]|^0\.0*", "", row["radiance"])) for row in found]
    assert max(digits) >= 16 if double else max(digits) <= 9


def test_the_scenes_own_sun_shines_unless_another_is_asked_for(capsys):
    out, _ = run(capsys, "radiance thin.toml --view-zenith 0:60:30 --wavelength 450")
    assert {row["sun_zenith"] for row in rows(out)} == {"60"}
    assert [row["view_zenith"] for row in rows(out)] == ["0", "30", "60"]


def test_the_optical_depth_of_a_slab_is_its_column_over_the_cosine(capsys, folder):
    # Whatever shines there.
    glow = THIN.replace(
        "phase =", 'emission = { kind = "constant", value = 1 }\nphase ='
    )
    (folder / "bright.toml").write_text(glow + LAMP)
    out, _ = run(
        capsys, "optical-depth bright.toml --altitude 0,250 --view-zenith 0,60,180"
    )
    found = rows(out)
    assert list(found[0]) == ["altitude", "view_zenith", "wavelength", "optical_depth"]
    wanted = [DEPTH, 2 * DEPTH, 0.0, 0.75 * DEPTH, 1.5 * DEPTH, 0.25 * DEPTH]
    depths = [float(row["optical_depth"]) for row in found]
    np.testing.assert_allclose(depths, np.repeat(wanted, 3), rtol=1e-6, atol=1e-20)


def sky(capsys, options="", output="sky.exr", code=0):
    shape = f"--height {HEIGHT} --wavelength {BANDS}"
    return run(capsys, f"sky sunny.toml {shape} --output {output} {options}", code)


def test_a_picture_says_what_it_shows(capsys):
    out, err = sky(capsys, "--altitude 10")
    assert err == ""
    assert "wrote sky.exr: 64 x 32, rec709" in out and "wrote sky.png" in out
    header = read_exr("sky.exr").attributes
    assert dump(parse(header["scene"])) == dump(load("sunny.toml"))
    assert header["software"].startswith("atmos ")
    assert "SingleScattering" in header["solver"]
    assert header["wavelengths"].split(",")[::12] == ["400", "700"]
    assert header["altitude"] == 10.0
    np.testing.assert_allclose(header["sunElevation"], 40.0, rtol=1e-6)
    np.testing.assert_allclose(header["sunAzimuth"], 200.0, rtol=1e-6)
    assert "elevation 40.000, azimuth 200.000" in out
    with Image.open("sky.png") as preview:
        assert preview.size == (64, 32)
        assert "EV" in preview.info["exposure"]


def test_the_suns_disk_in_a_picture_is_the_lamp(capsys):
    sky(capsys)
    picture = read_exr("sky.exr")
    sky(capsys, "--no-sun --no-preview", "dark.exr")
    dark = read_exr("dark.exr").stack("R", "G", "B")
    disk = picture.stack("R", "G", "B") - dark
    side = math.pi / HEIGHT
    edges = np.cos(np.arange(HEIGHT + 1) * side)
    area = (edges[:-1] - edges[1:]) * side
    lamp = np.sum(disk * area[:, None, None], (0, 1))
    np.testing.assert_allclose(lamp, picture.attributes["sunColour"], rtol=5e-3)
    # Azimuth 200 lies 160 degrees to the left of the centre, which looks north.
    row, column = np.argwhere(disk[..., 1] > 0.0).mean(0) + 0.5
    np.testing.assert_allclose(row * side, math.radians(50.0), atol=side)
    np.testing.assert_allclose(
        (column - HEIGHT) * side, math.radians(-160.0), atol=side
    )
    assert not os.path.exists("dark.png")


def test_the_lamp_has_the_irradiance_of_the_sun(capsys):
    out, _ = sky(capsys, "--no-preview --no-sun")
    numbers = r"lamp: (\S+) W/m2 from 387.5 to 712.5 nm, (\S+) lux, colour \((.*)\)"
    power, lux, colour = re.search(numbers, out).groups()
    colour = [float(x) for x in colour.split(",")]
    # A thin slab takes nothing: what is left is the sun of ASTM G173-03, whole bands
    # beside each other.
    wanted = atmos.light.sunlight(325.0).evaluate(jnp.array([550.0]))[0] * 325.0
    np.testing.assert_allclose(float(power), wanted, rtol=1e-4)
    weights = COLOUR_SPACES["rec709"].luminance_weights
    np.testing.assert_allclose(np.dot(colour, weights), float(lux), rtol=1e-3)


GLOW = """
sun = []

[planet]
shape = "flat"
top = 100

[[medium]]
emission = 0.5
profile = { kind = "box", lower = [-9, -9, 0], upper = [9, 9, 12] }
"""


def test_options_stand_above_the_camera_of_the_scene():
    own = Perspective(jnp.array([1.0, 2.0, 3.0]), 0.5, 0.2, 0.7, 40, 90)
    assert View().camera(own) is own
    nearer = View(field_of_view=10.0, height=20).camera(own)
    assert (nearer.height, nearer.width) == (20, 45)
    np.testing.assert_allclose(nearer.field_of_view, math.radians(10.0))
    np.testing.assert_allclose(nearer.azimuth, 0.5)
    np.testing.assert_allclose(nearer.elevation, 0.2)
    np.testing.assert_allclose(View(altitude=9.0).camera(own).position, [1, 2, 9])
    place = (4.0, 5.0, 6.0)
    assert tuple(View(position=place).camera(own).position) == place
    # Of a camera of another kind only the place is left.
    dome = View(projection="latlong").camera(own)
    np.testing.assert_array_equal(dome.position, own.position)
    assert (dome.height, dome.width, dome.centre_azimuth) == (512, 1024, 0.0)
    for camera in (dome, View(projection="fisheye", azimuth=30.0).camera()):
        turned = View(azimuth=90.0).camera(camera)
        assert type(turned) is type(camera)
        looks = turned.direction(*jnp.array([0.5, 0.25]) * turned.width)
        np.testing.assert_allclose(looks[1], 0.0, atol=1e-6)


def test_what_shines_is_marched_along_every_ray(capsys, folder):
    (folder / "glow.toml").write_text(GLOW)
    view = "--projection perspective --elevation 90 --field-of-view 20 --height 3"
    output = "--colour-space spectral --wavelength 500,600 --no-preview"
    run(capsys, f"sky glow.toml --solver march {view} --width 3 {output}")
    found = read_exr("sky.exr").channels["S0.500,000000nm"]
    # Of the box's 12 m one sees 10 from 2 m above the ground.
    assert math.isclose(found[1, 1], 0.5 * 10.0, rel_tol=1e-5)
    _, err = run(capsys, "sky glow.toml --height 3", 2)
    assert "`medium[0].emission` must be None, for this solver" in err


def test_options_say_how_rays_are_marched_along():
    usual = March().solver()
    assert isinstance(usual.steps, Jittered) and usual.steps.count == 256
    assert isinstance(usual.shadows, ShadowCache)
    sharp = March(steps="fixed", step_count=7, shadows="rays").solver()
    assert sharp == RayMarching(Fixed(7), ShadowRays())
    assert March(steps="skipping", step_count=9).solver().steps == Skipping(9)
    exact = March(steps="adaptive", tolerance=0.5).solver().steps
    assert isinstance(exact, Adaptive)
    assert (exact.tolerance, exact.count) == (0.5, Adaptive().count)


def test_spectral_pictures_hold_the_same_light(capsys):
    sky(capsys, "--no-preview")
    wanted = read_exr("sky.exr").stack("R", "G", "B")
    sky(capsys, "--colour-space spectral --no-preview", "spectral.exr")
    picture = read_exr("spectral.exr")
    assert picture.spectrum()[1].shape == (32, 64, 13)
    np.testing.assert_allclose(
        picture.stack("R", "G", "B"), wanted, rtol=1e-4, atol=1e-4 * wanted.max()
    )


def test_polarised_light_has_columns_and_layers_of_its_own(capsys):
    air = THIN.split("phase")[0] + 'phase = { kind = "rayleigh" }\n'
    Path("sunny.toml").write_text(air)
    out, _ = run(
        capsys, "radiance sunny.toml --stokes 3 --view-zenith 30 --azimuth 180"
    )
    (row, *_) = rows(out)
    assert list(row)[-3:] == ["radiance", "q", "u"]
    # Light that turned by a right angle is all polarised, across the sun's plane.
    light = [float(row[x]) for x in ("radiance", "q", "u")]
    assert light[0] > 0.0
    np.testing.assert_allclose(light[1:], [light[0], 0.0], atol=1e-6 * light[0])
    sky(capsys, "--stokes 3 --no-preview --no-sun")
    picture = read_exr("sky.exr")
    q, u = (picture.stack(*(f"{x}.{y}" for y in "RGB")) for x in "QU")
    share = np.sqrt(q**2 + u**2)[:16] / picture.stack("R", "G", "B")[:16]
    assert 0.97 < share.max() < 1.001


def test_halves_that_cannot_hold_the_sun_are_refused_and_nothing_is_written(capsys):
    Path("sky.exr").write_text("what was there")
    bright = SUNNY.replace('"solar"', '"solar", distance = 0.01')
    Path("sunny.toml").write_text(bright)
    out, err = sky(capsys, "--half", code=2)
    assert err.count("\n") == 1 and "`--half`" in err and "--no-sun" in err
    assert Path("sky.exr").read_text() == "what was there"
    assert not os.path.exists("sky.png")


def test_a_failed_table_leaves_what_was_there(capsys):
    Path("out.csv").write_text("what was there")
    tabled = THIN.replace(
        f"= {DEPTH / 1e3}",
        '= { kind = "table", wavelength = [400, 500], value = [1e-9, 1e-9] }',
    )
    Path("tabled.toml").write_text(tabled)
    out, err = run(
        capsys, "optical-depth tabled.toml --wavelength 600 --output out.csv", 2
    )
    assert "tabled.toml: `medium[0].scattering` must cover the wavelengths 600" in err
    assert Path("out.csv").read_text() == "what was there"
    assert sorted(os.listdir()) == ["out.csv", "sunny.toml", "tabled.toml", "thin.toml"]


def test_the_sun_is_overhead_at_noon_of_an_equinox_on_the_equator():
    noon = datetime.datetime(2026, 3, 20, 12, 7, 30, tzinfo=datetime.UTC)
    zenith, _, distance = SunPosition(date=noon, latitude=0.0, longitude=0.0).find()
    assert zenith < 0.3
    np.testing.assert_allclose(distance, 0.996, atol=1e-3)


def test_a_scene_file_to_start_from_is_the_world_asked_for(capsys):
    out, _ = run(capsys, "scene --sun-elevation 30 --aerosol urban --visibility 2e4")
    urban = parse(out)
    run(capsys, "scene --world mars --ground 0.3 --output mars.toml")
    mars = load("mars.toml")
    np.testing.assert_allclose(urban.lights[0].zenith, math.pi / 3, rtol=1e-12)
    assert urban.media[2].extinction(jnp.array([550.0])) == pytest.approx(
        3.912 / 2e4 - 1.149e-5
    )
    assert mars.geometry.radius == 3389.5e3
    assert mars.ground.evaluate(jnp.array([550.0])) == 0.3
    none, _ = run(capsys, "scene --aerosol none --ozone 250")
    assert len(parse(none).media) == 2


def test_a_fitted_sky_says_what_it_is_and_stands_on_ground(capsys):
    shape = f"--height {HEIGHT} --wavelength {BANDS} --ground 0.5"
    model = "--model preetham --turbidity 4 --sun-elevation 30 --sun-azimuth 90"
    out, err = run(capsys, f"sky {shape} {model}")
    assert err == "" and "elevation 30.000, azimuth 90.000" in out
    picture = read_exr("sky.exr")
    assert picture.attributes["model"] == "--model preetham, --turbidity 4.0"
    luminance = picture.stack("R", "G", "B") @ COLOUR_SPACES["rec709"].luminance_weights
    assert luminance[:16].min() > 500.0
    lower = luminance[16:]
    np.testing.assert_allclose(lower, lower[0, 0], rtol=1e-5)
    # The lamp and the sky light the ground, which reflects a half.
    side = math.pi / HEIGHT
    rise = np.cos((np.arange(16) + 0.5) * side) * np.sin((np.arange(16) + 0.5) * side)
    whole = np.sum(luminance[:16] * rise[:, None]) * side * side
    np.testing.assert_allclose(lower[0, 0], 0.5 / math.pi * whole, rtol=0.02)
    # East is a quarter to the right of the centre, which looks north.
    assert np.argmax(luminance.max(0)) in (47, 48)


def test_skies_are_compared_as_files_and_by_name(capsys):
    shape = f"--height {HEIGHT}"
    cie = "--cie-type 5 --horizontal-illuminance 10000 --ground 0"
    run(capsys, f"sky --model cie {cie} {shape} --no-preview --output a.exr")
    more = cie.replace("10000", "12500")
    run(capsys, f"sky --model cie {more} {shape} --no-preview --output b.exr")
    out, _ = run(capsys, "compare a.exr b.exr")
    wanted = "above the horizon: luminance: mean +25.00%, median 25.00%"
    assert wanted in out and "wrote compare.png" in out
    out, _ = run(capsys, f"compare a.exr cie {cie} {shape} --output same.png")
    assert "0.00%, median 0.00%, 95 of 100 0.00%, largest 0.00%" in out
    with Image.open("compare.png") as page:
        assert page.size[0] > 3 * 2 * HEIGHT


BAD = [
    ("foo", '"foo"', "sky"),
    ("sky --heigth 3", "--heigth", "--height"),
    ("sky --height 0", "--height", "1 to 32768; got '0'"),
    ("sky --height 4.5", "--height", "whole number from 1 to 32768; got '4.5'"),
    ("sky --sun-elevation 95", "--sun-elevation", "-90 to 90; got '95'"),
    ("sky --sun-azimuth nan", "--sun-azimuth", "got 'nan'"),
    ("sky --latitude 3", "--latitude", "needs a --date"),
    ("sky --date 2026-06-21T12:00", "--date", "needs --latitude"),
    ("sky --date noon --latitude 1 --longitude 1", "--date", "got 'noon'"),
    (
        "sky --date 2026-06-21 --latitude 1 --longitude 1 --sun-azimuth 3",
        "--sun-azimuth",
        "beside --date",
    ),
    ("sky --date 2026-06-21 --latitude 91 --longitude 1", "--latitude", "got '91'"),
    ("sky thin.toml --aerosol urban", "--aerosol", "scene file; got thin.toml"),
    ("sky none.toml", "none.toml", "No such file"),
    ("sky .", ".", "Is a directory"),
    ("sky --aerosol soot", "--aerosol", "urban, desert"),
    ("sky --ground gras", "--ground", "grass, soil"),
    ("sky --ground 1.5", "--ground", "0 to 1; got 1.5"),
    ("sky --world venus", "--world", "mars"),
    ("sky --world mars --ozone 3", "--ozone", "mars"),
    ("sky --world mars --date 2026-06-21 --latitude 1 --longitude 1", "--date", "Mars"),
    ("sky --aerosol none --visibility 3e4", "--visibility", "--aerosol none"),
    ("sky --optical-depth 1 --visibility 3e4", "--visibility", "--optical-depth"),
    ("sky --visibility 400e3", "--visibility", "below that of pure air"),
    ("sky --output a/b.exr", "--output", "folder that exists; got a/b.exr"),
    ("sky --output a.png", "--output", ".exr file; got a.png"),
    ("sky --preview a.jpg", "--preview", ".png file; got a.jpg"),
    ("sky --no-preview --preview a.png", "--preview", "--no-preview"),
    ("sky --no-preview --exposure 3", "--exposure", "--no-preview"),
    ("sky --exposure dark", "--exposure", "got 'dark'"),
    ("sky --width 30", "--width", "perspective"),
    ("sky --projection fisheye --elevation 3", "--elevation", "perspective"),
    ("sky --field-of-view 30", "--field-of-view", "latlong"),
    (
        "sky --projection perspective --field-of-view 190",
        "--field-of-view",
        "below 180 in perspective; got 190",
    ),
    ("sky --wavelength 500:600:10", "wavelength", "what the eye sees"),
    ("sky --wavelength 200:780:20", "media[1]", "known from 280"),
    ("sky --wavelength 0.5", "--wavelength", "100 to 100000; got '0.5'"),
    ("sky --wavelength 780:380:10", "--wavelength", "FIRST:LAST:STEP"),
    ("sky --wavelength 380:780:1e-9", "--wavelength", "at most 1000000"),
    ("sky --turbidity 3", "--turbidity", "needs a model"),
    ("sky --model cie --turbidity 3", "--turbidity", "preetham, hosek"),
    ("sky --model cie", "cie", "--zenith-luminance, or --horizontal-illuminance"),
    ("sky --model perez --direct 500", "perez", "--direct and --diffuse, or"),
    ("sky --model perez --direct 5 --diffuse 0", "--diffuse", "above 0 W m^-2"),
    ("sky --model perez --direct 9 --diffuse 900", "--direct and --diffuse", "0.6"),
    ("sky --model preetham --aerosol urban", "--aerosol", "beside models"),
    ("sky thin.toml --model preetham", "scene", "beside --model; got preetham"),
    ("sky --model preetham --solver single", "--solver", "beside --model"),
    ("sky --model preetham --stokes 3", "--stokes", "must be 1 with --model"),
    ("sky --model preetham --turbidity 9", "--turbidity", "between 2 and 6"),
    ("sky --model preetham --sun-elevation -3", "--sun-elevation", "above the horizon"),
    ("sky --model preetham --altitude 5000", "--altitude", "1000 m above the ground"),
    ("sky --model cie --zenith-luminance 0", "--zenith-luminance", "above 0"),
    ("sky --model preetham --wavelength 400:800:20", "--wavelength", "780 nm"),
    ("compare thin.png preetham", "what to compare", "got thin.png"),
    ("compare none.exr preetham", "none.exr", "No such file"),
    ("compare preetham cie", "cie", "needs --zenith-luminance"),
    ("compare a.exr b.exr --sun-elevation 5", "a sun", "not for two files"),
    ("render", "SCENE", "requires"),
    ("render none.toml", "none.toml", "No such file"),
    ("render thin.toml --samples 0", "--samples", "from 1 to 1e+09; got '0'"),
    ("render thin.toml --error 0", "--error", "1e-06 to 10; got '0'"),
    ("render thin.toml --time -1", "--time", "got '-1'"),
    ("render thin.toml --output a.png", "--output", ".exr file; got a.png"),
    ("render thin.toml --colour-space spectral --denoise", "--denoise", "spectral"),
    ("render thin.toml --solver shells", "--solver", '"trace"'),
    ("sky --position 1,2", "--position", "three numbers; got [1.0, 2.0]"),
    ("sky --position 1,2,3 --altitude 4", "--altitude", "beside --position"),
    (
        "sky thin.toml --position 1,0,3 --no-sun",
        "--position",
        "straight above the origin",
    ),
    ("radiance", "SCENE", "requires"),
    ("radiance thin.toml --solver mc", "--solver", '"single"'),
    ("radiance thin.toml --view-zenith 0,190", "--view-zenith", "0 to 180; got '190'"),
    ("radiance thin.toml --altitude -3", "--altitude", "got '-3'"),
    ("radiance thin.toml --output none/a.csv", "--output", "folder that exists"),
    ("radiance thin.toml --output .", "--output", "a file that one may replace"),
    ("radiance thin.toml more", "more", "Unused"),
    ("optical-depth thin.toml --wavelength 50", "--wavelength", "got '50'"),
    ("scene --output scene.txt", "--output", ".toml file; got scene.txt"),
    ("radiance lamp.toml", "lamp.toml: `light[0]` must be a sun", "got Lamp"),
    ("radiance dark.toml", "dark.toml: `light[0]` must be a sun", "got Lamp"),
    ("sky lamp.toml", "lamp.toml: `light[0]` must be a sun", "got Lamp"),
    ("sky dark.toml --sun-elevation 9", "sun", "alone to be moved; got 0"),
    ("sky ball.toml", "ball.toml: `surface` must be empty", "got 1"),
    ("render lamp.toml --solver march", "lamp.toml: `light[0]` must be", "got Lamp"),
    ("render thin.toml --steps fixed", "--steps", "for --solver march"),
    ("render thin.toml --step-count 9", "--step-count", "for --solver march"),
    ("render thin.toml --solver march --step-count 0", "--step-count", "from 1 to"),
    ("render thin.toml --solver march --tolerance 1", "--tolerance", "adaptive"),
    ("render thin.toml --solver march --steps skipping", "medium[0]", "in a box"),
    ("render thin.toml --wavelength 550", "--wavelength", "two or more"),
]


@pytest.mark.parametrize(("command", "name", "rest"), BAD)
def test_bad_input_is_refused_in_one_line(capsys, folder, command, name, rest):
    dark = f"{THIN.split('[sun]')[0]}{THIN[THIN.index('[[medium]]') :]}"
    scenes = {"lamp": THIN + LAMP, "dark": dark + LAMP, "ball": THIN + BALL}
    for kind, text in scenes.items():
        (folder / f"{kind}.toml").write_text(text)
    out, err = run(capsys, command, 2)
    assert out == "" and err.count("\n") == 1 and err.startswith("atmos: ")
    assert name in err and rest in err
    assert not os.path.exists("sky.exr")


def shell(command, **environment):
    code = f"import sys; from atmos.cli import main; sys.exit(main({command.split()}))"
    return subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        env=os.environ | environment,
    )


def test_help_says_what_there_is_and_in_what_unit(capsys):
    out, _ = run(capsys, "sky --help", 0)
    assert "--sun-elevation" in out and "DEGREES" in out
    out, _ = run(capsys, "--version", 0)
    assert re.fullmatch(r"\d+\.\d+\.\d+\n", out)


@pytest.mark.parametrize("place", ["cache", "thin.toml/cache"])
def test_a_cache_that_cannot_be_written_does_no_harm(place):
    found = shell("optical-depth thin.toml --wavelength 500", ATMOS_CACHE=place)
    assert (found.returncode, found.stderr) == (0, "")
    assert math.isclose(float(found.stdout.split(",")[-1]), DEPTH, rel_tol=1e-6)
    assert os.path.isdir("cache/jax") == (place == "cache")


def test_a_bad_file_is_one_line_in_a_shell_too():
    Path("bad.toml").write_text(THIN.replace("1e3", "-1e3"))
    found = shell("radiance bad.toml")
    assert found.returncode == 2 and found.stdout == ""
    assert found.stderr.count("\n") == 1
    assert "bad.toml: `medium[0].profile.top - bottom` must be above 0" in found.stderr
