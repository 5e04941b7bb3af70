"""The spectra of daylight, by chromaticity (CIE 15; Judd, MacAdam, Wyszecki 1964)."""

import functools as ft

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .. import data
from ..quantity import dot, Number, Spectral, Wavelength
from ..reference import matching_functions
from ..transport import contract
from ._fitted import straight
from ._range import Range


DAYLIGHT = Range(380.0, 780.0, " nm")
TEMPERATURES = Range(4000.0, 25000.0, " K")
D65 = 6504.0  # K
_EFFICACY = 683.0  # lm W^-1, of light of 555 nm


@ft.cache
def _components() -> tuple[np.ndarray, np.ndarray]:
    table = data.read("daylight")
    return table["wavelength"].astype(float), np.stack(
        [table[x] for x in ("s0", "s1", "s2")]
    )


@ft.cache
def luminances() -> Float[np.ndarray, "3"]:
    """The luminance of each component, were it in W m^-2 sr^-1 nm^-1, in cd m^-2."""
    at, values = _components()
    nm, observer = matching_functions()
    known = (nm >= at[0]) & (nm <= at[-1])
    fine = np.stack([np.interp(nm[known], at, x) for x in values])
    return _EFFICACY * fine @ observer[known, 1]


def components(wavelength: Wavelength) -> Float[Array, "3 wl"]:
    """S0, S1 and S2; beyond 380 to 780 nm as at the edge."""
    at, values = _components()
    weights = straight(at, wavelength)
    return contract("kn,nl->kl", jnp.asarray(values, wavelength.dtype), weights)


def mixture(x: Number, y: Number) -> Float[Array, "3"]:
    """How much of each component makes daylight of a chromaticity; the first is 1."""
    below = 0.0241 + 0.2562 * x - 0.7341 * y
    m1 = (-1.3515 - 1.7703 * x + 5.9114 * y) / below
    m2 = (0.0300 - 31.4424 * x + 30.0717 * y) / below
    return jnp.stack([jnp.ones_like(m1), m1, m2])


def locus(temperature: Number) -> tuple[Number, Number]:
    """The chromaticity of daylight of a correlated colour temperature, in K."""
    t = 1000.0 / temperature
    warm = ((-4.6070 * t + 2.9678) * t + 0.09911) * t + 0.244063
    cool = ((-2.0064 * t + 1.9018) * t + 0.24748) * t + 0.237040
    x = jnp.where(temperature <= 7000.0, warm, cool)
    return x, (-3.000 * x + 2.870) * x - 0.275


def spectrum(temperature: Number, wavelength: Wavelength) -> Spectral:
    """Daylight of 1 cd m^-2, in W m^-2 sr^-1 nm^-1."""
    mixed = mixture(*locus(temperature))
    light = dot(mixed, jnp.asarray(luminances(), mixed.dtype))
    return contract("k,kl->l", mixed / light, components(wavelength))
