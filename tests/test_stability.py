"""Places where sky renderers were caught being wrong, that no other file looks at.

Random skies are tried beside each solver and model: `pytest -k random`.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from atmos.geometry import Flat, Point
from atmos.light import Sun
from atmos.medium import Exponential, HeightFog, Medium, StandardAtmosphere, Tent
from atmos.phase import HenyeyGreenstein, Rayleigh
from atmos.scene import Scene
from atmos.solver import SingleScattering, solve
from atmos.spectrum import BandAverage, planck, PowerLaw, Tabulated


KNOTS = np.array([400.0, 500.0, 600.0])
SPECTRA = {
    "power law": PowerLaw(1.0, -4.0, 550.0),
    "table": Tabulated(KNOTS, np.array([1.0, 3.0, 2.0])),
    "table with ends": Tabulated(KNOTS, np.array([1.0, 3.0, 2.0]), 0.0, 0.0),
    "bands": BandAverage(KNOTS, np.array([1.0, 3.0, 2.0]), 10.0),
}
PROFILES = {
    "exponential": Exponential(8e3),
    "tent": Tent(25e3, 15e3),
    "standard atmosphere": StandardAtmosphere(),
    "fog": HeightFog(50.0, 20.0),
}


@pytest.mark.parametrize("name", SPECTRA)
def test_a_wavelength_that_is_no_number_is_not_that_of_the_nearest(name):
    found = SPECTRA[name].evaluate(jnp.array([np.nan, 450.0]))
    assert np.isnan(found[0]) and np.isfinite(found[1])


@pytest.mark.parametrize("name", PROFILES)
def test_an_altitude_that_is_no_number_is_not_the_nearest(name):
    up = jnp.array([0.0, 0.0, 1.0])
    look = lambda z: PROFILES[name].density(Point(z * up, z, up))
    assert np.isnan(look(jnp.array(np.nan)))
    assert np.isfinite(look(jnp.array(100.0)))


@pytest.mark.parametrize("function", [HenyeyGreenstein(0.7), Rayleigh()])
def test_an_angle_that_is_no_number_has_no_brightness(function):
    assert np.all(np.isnan(function.evaluate(jnp.array(np.nan), jnp.array([500.0]))))


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_a_black_body_is_finite_at_every_temperature(dtype):
    nm = jnp.array([200.0, 550.0, 5e4], dtype)
    look = jax.jit(jax.vmap(jax.value_and_grad(lambda t: jnp.sum(planck(nm, t)))))
    found, slope = look(jnp.array([0.0, 1e-6, 1.0, 300.0, 1e4, 1e8], dtype))
    for x in (found, slope):
        assert np.all(np.isfinite(x) & (x >= 0.0))
        assert np.all(np.diff(x[3:]) >= 0.0)


@pytest.mark.parametrize("nm", [[399.0, 500.0], [500.0, 601.0]])
def test_a_table_that_ends_before_the_picture_is_refused(nm):
    """A table of ozone that ended at 519 nm once made the rest of a sky green."""
    gas = Medium(Exponential(8e3), absorption=SPECTRA["table"])
    sun = Sun(np.array([0.0, 0.0, 1.0]), 1.0, 0.0)
    scene = Scene(Flat(), 1e5, (gas,), (sun,), 0.0)
    with pytest.raises(ValueError, match="must cover .* known from 400 to 600 nm"):
        solve(scene, SingleScattering(), np.array(nm))
