"""Pictures that grow: what they show, when they end, and that they go on unchanged."""

import contextlib
import itertools
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from atmos import checkpoint, deg, film as films
from atmos.camera import Fisheye, Perspective
from atmos.cli import _work, main
from atmos.cli._world import tracer
from atmos.colour import ACESCG, REC709, XYZ
from atmos.denoise import denoise
from atmos.film import expose, Film
from atmos.geometry import Flat
from atmos.image import read_exr
from atmos.light import Sun
from atmos.medium import Box, Medium, Uniform
from atmos.scene import Scene
from atmos.solver import PathTracing, RayMarching, solve, VolumeTracing


NM = np.array([500.0, 600.0])
SUN = Sun(np.array([0.0, 0.6, 0.8]), 1.0, 0.0)
# Light that the ground reflects, of an albedo of a half.
GROUND = 0.5 / np.pi * 0.8
EYE = np.array([0.0, -4.0, 2.0])
LEVEL = Perspective(EYE, 0.0, 0.0, 30.0 * deg, 3, 5)


@pytest.fixture(autouse=True)
def small(monkeypatch):
    """Pictures of some stretches, however small they are."""
    monkeypatch.setattr(films, "_RAYS_ON_CPU", 4)


def world(*media):
    return Scene(Flat(), 10.0, media, (SUN,), 0.5)


BARE = solve(world(), RayMarching(), NM)
SMOKE = Medium(Box(np.array([-1.0, -1.0, 1.0]), np.array([1.0, 1.0, 3.0])), 2.0, 0.1)
TRACED = solve(world(SMOKE), VolumeTracing(walks=2, paths=2, cells=4), NM)


def exposed(film, sky, stretches):
    *_, found = itertools.islice(expose(film, sky), stretches)
    return found


def test_a_pixel_on_the_horizon_has_the_share_of_the_ground_and_its_error():
    looks, blank = 32, Film.blank(LEVEL, BARE)
    assert len(blank.tallies) == 4 and blank.looks == 0.0
    film = exposed(blank, BARE, 4 * looks)
    assert film.looks == looks and film.even
    sky, horizon, ground = film.mean()
    np.testing.assert_array_equal(sky, 0.0)
    np.testing.assert_allclose(ground, GROUND, rtol=1e-12)
    # Light or dark: the error of a mean of such trials has a closed form.
    due = horizon * (GROUND - horizon) / (looks - 1.0)
    np.testing.assert_allclose(film.variance()[1], due, rtol=1e-9)
    np.testing.assert_allclose(film.variance()[[0, 2]], 0.0, atol=1e-30)
    share = horizon[:, 0] / GROUND
    assert np.all(np.abs(share - 0.5) < 4.5 * 0.5 / np.sqrt(looks))
    assert len(set(share)) > 2, "each pixel is looked at in places of its own"
    # The sky is black and does not count; the ground is known.
    relative = due[:, 0] / horizon[:, 0] ** 2
    np.testing.assert_allclose(film.error() ** 2, np.mean([*relative, *5 * [0.0]]))


def test_what_a_camera_does_not_see_is_black_and_not_looked_at():
    camera = Fisheye(EYE, 5, 360.0 * deg)
    film = exposed(Film.blank(camera, BARE), BARE, 12)
    assert len(film.tallies) == 6, "21 of 25 pixels"
    picture = film.mean()[..., 0]
    np.testing.assert_array_equal(picture[0, [0, -1]], 0.0)
    np.testing.assert_allclose(picture[0, 2], GROUND, rtol=1e-12)


def test_colours_are_sums_over_wavelengths():
    response = jnp.array([[1.0, 0.0, 2.0], [0.0, 3.0, 1.0]])
    film = Film.blank(LEVEL, BARE, response)
    *_, film = itertools.islice(expose(film, BARE, response), 8)
    np.testing.assert_allclose(film.mean()[2, 0], GROUND * np.array([1.0, 3.0, 3.0]))


def test_no_two_pixels_and_no_two_looks_have_the_same_noise():
    film = exposed(Film.blank(LEVEL, TRACED), TRACED, 8)
    assert len(np.unique(film.mean()[..., 0])) == 15
    assert np.all(film.variance()[..., 0] > 0.0)


def test_the_scene_says_which_tracer():
    fog = Medium(Uniform(1.0, 3.0), 0.5)
    assert isinstance(tracer(world(fog)), PathTracing)
    assert isinstance(tracer(world(SMOKE, fog)), VolumeTracing)


def test_a_film_from_a_checkpoint_goes_on_to_the_same_bits(tmp_path):
    path, blank = tmp_path / "x.checkpoint", Film.blank(LEVEL, TRACED)
    made = checkpoint.words(blank, TRACED, None)
    checkpoint.save(path, exposed(blank, TRACED, 6), made, 3.5)
    again, seconds = checkpoint.load(path, blank, made)
    assert seconds == 3.5 and again.looks == 1.5 and not again.even
    whole, resumed = exposed(blank, TRACED, 11), exposed(again, TRACED, 5)
    np.testing.assert_array_equal(whole.mean(), resumed.mean())
    np.testing.assert_array_equal(whole.variance(), resumed.variance())


def test_noise_is_taken_out_and_light_stays():
    pytest.importorskip("pyoidn", reason="pyoidn is not installed")
    rng = np.random.default_rng(0)
    grey = np.full((48, 64, 3), 0.25) * np.array([1.0, 1.5, 0.5])
    noisy = grey * rng.gamma(4.0, 0.25, (48, 64, 3))
    for space in (REC709, ACESCG, XYZ):
        clean = denoise(noisy, space)
        assert np.std(clean / grey) < 0.15 * np.std(noisy / grey)
        np.testing.assert_allclose(np.mean(clean, (0, 1)), grey[0, 0], rtol=0.06)
    # However dark it is, and in no light at all.
    dim = denoise(1e-12 * noisy, XYZ)
    np.testing.assert_allclose(dim, 1e-12 * clean, rtol=1e-3)
    np.testing.assert_array_equal(denoise(0.0 * noisy, XYZ), 0.0)


SCENE = """
[planet]
shape = "flat"
top = 10
ground_albedo = 0.5
[sun]
zenith = 36.86989764584402
irradiance = 1.0
angular_radius = 0.0
[camera]
kind = "perspective"
position = [0, -4, 2]
field_of_view = 30
height = 3
width = 5
[[medium]]
scattering = 0.5
absorption = 0.1
phase = { kind = "isotropic" }
profile = { kind = "box", lower = [-1, -1, 1], upper = [1, 1, 3] }
"""
BARE_SCENE = SCENE.split("[[medium]]")[0]
COMMAND = "render s.toml --colour-space spectral --wavelength 500,600 --no-preview"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ATMOS_CACHE", str(tmp_path / "cache"))
    Path("s.toml").write_text(BARE_SCENE)
    return tmp_path


def run(capsys, options, code=0):
    found = main(f"{COMMAND} {options}".split())
    shown = capsys.readouterr()
    assert found == code, shown.err
    return shown


def same(one, other):
    one, other = read_exr(one), read_exr(other)
    assert list(one.channels) == list(other.channels)
    for name, plane in one.channels.items():
        np.testing.assert_array_equal(plane, other.channels[name])


KILLED = f"""
import os, signal, sys
from atmos import checkpoint, film
from atmos.cli import _work, main
from atmos.cli._world import tracer
film._RAYS_ON_CPU, _work._EVERY, saves = 4, 0.0, []
def save(*all, keep=checkpoint.save):
    keep(*all)
    saves.append(1)
    if len(saves) == 6:
        os.kill(os.getpid(), signal.SIGKILL)
checkpoint.save = save
main("{COMMAND} --samples 48 --output b.exr".split())
"""


def test_a_render_that_was_killed_goes_on_to_the_same_picture(capsys, folder):
    Path("s.toml").write_text(SCENE)
    run(capsys, "--samples 48 --output a.exr")
    assert sorted(os.listdir()) == ["a.exr", "cache", "s.toml"]
    environment = os.environ | {"JAX_ENABLE_X64": "1"}
    killed = subprocess.run([sys.executable, "-c", KILLED], env=environment)
    assert killed.returncode == -signal.SIGKILL
    assert not os.path.exists("b.exr")
    assert os.path.exists("b.exr.checkpoint")
    run(capsys, "--samples 48 --output b.exr")
    assert not os.path.exists("b.exr.checkpoint")
    same("a.exr", "b.exr")


def march(capsys, options, code=0):
    return run(capsys, f"--solver march {options}", code)


def test_a_picture_holds_its_variance_and_says_how_it_was_made(capsys, folder):
    march(capsys, "--samples 9 --output a.exr")
    picture = read_exr("a.exr")
    assert picture.attributes["samples"] == 9
    assert picture.attributes["position"] == pytest.approx([0.0, -4.0, 2.0])
    seen, variance = (
        picture.channels[f"{x}S0.600,000000nm"][1] for x in ("", "variance.")
    )
    np.testing.assert_allclose(variance, seen * (GROUND - seen) / 8.0, rtol=1e-5)
    due = np.mean([*(variance / seen**2), *5 * [0.0]])
    np.testing.assert_allclose(picture.attributes["relativeError"] ** 2, due, rtol=1e-5)


def test_the_picture_is_done_at_an_error_or_a_time(capsys, folder):
    march(capsys, "--error 0.1 --output a.exr")
    header = read_exr("a.exr").attributes
    assert header["relativeError"] <= 0.1 and header["samples"] > 8
    # One look less would not have done.
    march(capsys, f"--samples {header['samples'] - 1} --output b.exr")
    assert read_exr("b.exr").attributes["relativeError"] > 0.1
    march(capsys, "--time 0 --output c.exr")
    assert read_exr("c.exr").attributes["samples"] == 2
    # What comes first.
    march(capsys, "--time 1000 --error 1e-6 --samples 3 --output d.exr")
    assert read_exr("d.exr").attributes["samples"] == 3


def interrupt(monkeypatch, at):
    """As Ctrl-C does, after so many stretches."""

    @contextlib.contextmanager
    def bar(name):
        told = []

        def tell(done):
            told.append(done)
            if len(told) == at:
                signal.raise_signal(signal.SIGINT)

        yield tell

    monkeypatch.setattr(_work, "progress_bar", bar)


@pytest.mark.parametrize("at", [2, 6, 9])
def test_an_interrupted_render_leaves_a_picture_and_goes_on(
    capsys, folder, monkeypatch, at
):
    before = signal.getsignal(signal.SIGINT)
    march(capsys, "--samples 4 --output a.exr")
    with monkeypatch.context() as patch:
        interrupt(patch, at)
        shown = march(capsys, "--samples 4 --output b.exr", 130)
    assert "b.exr.checkpoint lets it go on" in shown.err
    early = read_exr("b.exr")
    assert ("variance.S0.500,000000nm" in early.channels) == (at == 9)
    ground = early.channels["S0.500,000000nm"][2]
    np.testing.assert_allclose(ground, GROUND * (at > 2), rtol=1e-5)
    march(capsys, "--samples 4 --output b.exr")
    same("a.exr", "b.exr")
    assert not os.path.exists("b.exr.checkpoint")
    assert signal.getsignal(signal.SIGINT) is before


@pytest.fixture
def kept(capsys, folder, monkeypatch):
    """A checkpoint of a picture that was interrupted."""
    with monkeypatch.context() as patch:
        interrupt(patch, 6)
        march(capsys, "--samples 4 --output a.exr", 130)
    return folder / "a.exr.checkpoint"


FOREIGN = [
    ("--azimuth 3", "`camera.azimuth` is .* there and .* here"),
    ("--height 6", "`camera.height` is 3 there and 6 here"),
    ("--sun-elevation 30", r"`scene.lights\[0\].direction` is"),
    ("", r"`scene.ground.value` is .* 0.5 there and .* 0.4"),
]


def test_a_checkpoint_of_something_else_is_refused(capsys, kept):
    before, shown = kept.read_bytes(), Path("a.exr").read_bytes()
    for options, found in FOREIGN:
        if not options:
            Path("s.toml").write_text(BARE_SCENE.replace("0.5", "0.4"))
        err = march(capsys, f"--output a.exr {options}", 2).err
        assert err.count("\n") == 1
        assert "a.exr.checkpoint: serves another picture: " in err
        assert re.search(found, err), err
    assert kept.read_bytes() == before and Path("a.exr").read_bytes() == shown


@pytest.mark.parametrize("share", [0.0, 0.5, 0.999])
def test_a_checkpoint_that_is_cut_short_is_refused(capsys, kept, share):
    os.truncate(kept, int(share * os.path.getsize(kept)))
    err = march(capsys, "--output a.exr", 2).err
    assert "a.exr.checkpoint: is no checkpoint" in err and err.count("\n") == 1


def test_a_checkpoint_of_another_version_is_refused(capsys, kept, monkeypatch):
    monkeypatch.setattr(checkpoint.jax, "__version__", "0.0.1")
    err = march(capsys, "--output a.exr", 2).err
    assert "`jax` is" in err and "0.0.1 here; remove the file" in err
