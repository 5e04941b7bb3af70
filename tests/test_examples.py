"""The examples run, and show what they say."""

import importlib.util
import pathlib
import re

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from atmos import colour, polarisation, render, solve
from atmos.scenefile import parse, parse_camera
from atmos.solver import QUICK, SingleScattering
from atmos.transport import direct_irradiance


EXAMPLES = pathlib.Path(__file__).parents[1] / "examples"


def load(name):
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_skies(tmp_path):
    skies = load("skies")
    # By day and by light that turned once: the others are the same lines of code.
    day = ["noon", "sunset", "mars", "orbit"]
    wanted = [x for x in skies.skies(8) if x[0] in day]
    pictures = skies.main(tmp_path, wanted, QUICK)
    assert {x.stem for x in tmp_path.iterdir()} == {*pictures, "skies"}
    luminance = {name: np.asarray(xyz)[..., 1] for name, xyz in pictures.items()}
    assert all(np.all(np.isfinite(x) & (x >= 0.0)) for x in luminance.values())
    assert np.all(luminance["orbit"][0] == 0.0), "space above the limb is black"

    _, scene, camera = next(x for x in skies.skies(8) if x[0] == "noon")
    (sun,), nm = scene.lights, skies.WAVELENGTH.astype(float)
    beam = eqx.filter_jit(direct_irradiance)(scene, sun, camera.position, nm)
    radiance = scene.ground.evaluate(nm) / jnp.pi * jnp.cos(sun.zenith) * beam
    due = radiance @ colour.response(nm)[:, 1]
    seen = luminance["noon"][-1]
    assert np.allclose(seen, due, rtol=2e-3), "the ground below reflects the sun"


def test_polarisation(tmp_path):
    found = load("polarisation").main(tmp_path, 9, SingleScattering(stokes=3))
    assert (tmp_path / "polarisation.png").exists()
    degree = np.asarray(polarisation.degree(found[-1]))
    assert degree[4, 4] > 0.7, "straight up, across the light of a low sun"
    assert degree[4, 4] > 2.0 * max(degree[0, 4], degree[8, 4])


def test_volumes():
    volumes = load("volumes")
    scenes = {name: make(8) for name, make in volumes.PICTURES.items()}
    # All of them are built; one is looked at, as each takes long to compile.
    scene, solver, camera = scenes["fire"]
    sky = solve(scene, solver, volumes.WAVELENGTH)
    xyz = np.asarray(render(sky, camera(8), colour.response(volumes.WAVELENGTH)))
    assert np.all(np.isfinite(xyz) & (xyz >= 0.0))
    assert np.all(xyz[0, 0] == 0.0), "there is no air beside the smoke"
    red, _, blue = xyz.reshape(-1, 3)[np.argmax(xyz[..., 1])]
    assert red > 3.0 * blue, "fire is yellow"


def test_the_spot_shines_on_the_ball_through_the_smoke():
    scene = parse((EXAMPLES / "lamp.toml").read_text())
    (spot,), (ball,), (smoke,) = scene.lights, scene.surfaces, scene.media
    reach = ball.shape.meet(spot.position, spot.direction, jnp.array(False))
    top = (smoke.profile.upper[2] - spot.position[2]) / spot.direction[2]
    assert 0.0 < top < reach < 6.0
    values = np.asarray(smoke.profile.values)
    assert 0.3 < values.mean() < 0.7 and values.std() > 0.1


def test_the_sun_finds_gaps_in_the_deck_and_shines_between_the_clouds():
    for name, least, most in (
        ("crepuscular", 0.6, 0.97),
        ("field", 0.1, 0.4),
        ("orbit", 0.1, 0.5),
    ):
        text = (EXAMPLES / f"{name}.toml").read_text()
        # Over 500 km the planet falls away by more than the height of clouds.
        levels = 20 if name == "orbit" else 4
        coarse = re.sub(r"cells = .*", f"cells = [60, 60, {levels}]", text)
        cover = np.any(np.asarray(parse(coarse).media[-1].profile.values) > 0.0, 2)
        assert least < np.mean(cover) < most
        # The field is seen from above it, the deck from below.
        above = (
            parse_camera(coarse).position[2] > parse(coarse).media[-1].profile.upper[2]
        )
        assert above == (name != "crepuscular")


def test_the_edge_of_the_planet_crosses_the_picture_from_orbit():
    text = re.sub(
        r"cells = .*", "cells = [1, 1, 1]", (EXAMPLES / "orbit.toml").read_text()
    )
    scene, camera = parse(text), parse_camera(text)
    here = scene.geometry.locate(camera.position)
    assert np.isclose(here.altitude, 400e3, atol=1e3)
    middle = 0.5 * camera.width
    for y, due in ((1.0, False), (camera.height - 1.0, True)):
        look = camera.direction(jnp.asarray(middle), jnp.asarray(y))
        path = scene.geometry.path(here, look).enter(scene.top)
        assert bool(path.span(scene.top).grounded) == due, "space above, sea below"


@pytest.mark.parametrize("name", ["cumulus", "fire"])
def test_scene_files(name):
    text = (EXAMPLES / f"{name}.toml").read_text()
    coarse = re.sub(r"cells = .*", "cells = [20, 20, 20]", text)
    camera = parse_camera(coarse)
    assert (camera.height, float(camera.azimuth)) == (240, 0.0)
    for medium in parse(coarse).media:
        if hasattr(medium.profile, "values"):
            values = np.asarray(medium.profile.values)
            assert 0.02 < np.mean(values > 0.0) < 0.8
            # Its box does not cut it, but for the flat base of a cloud.
            for side in (values[[0, -1]], values[:, [0, -1]], values[..., -1]):
                assert np.all(side == 0.0)
