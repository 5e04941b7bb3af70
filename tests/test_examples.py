"""The examples run, and show what they say."""

import importlib.util
import pathlib

import numpy as np


EXAMPLES = pathlib.Path(__file__).parents[1] / "examples"


def load(name):
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_skies(tmp_path):
    pictures = load("skies").main(tmp_path, 8)
    assert {x.stem for x in tmp_path.iterdir()} == {*pictures, "skies"}
    luminance = {name: np.asarray(xyz)[..., 1] for name, xyz in pictures.items()}
    assert all(np.all(np.isfinite(x) & (x >= 0.0)) for x in luminance.values())
    assert np.all(luminance["orbit"][0] == 0.0), "space above the limb is black"
    assert luminance["noon"].mean() > 5.0 * luminance["mars"][:2].mean() > 0.0
