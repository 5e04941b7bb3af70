"""The numbers that a fitted sky is told, brought into its ranges."""

from typing import Any

import jax
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, ArrayLike, Float

from ..quantity import as_float
from ..spectrum import AbstractSpectrum, as_spectrum
from ._fitted import AbstractFittedSky
from ._range import AbstractBeyond


def set_parameters(
    sky: AbstractFittedSky,
    beyond: AbstractBeyond,
    wavelength: ArrayLike,
    ground: ArrayLike | AbstractSpectrum,
    **values: ArrayLike,
) -> None:
    """Gives a sky its parameters, brought into its ranges or refused.

    All numbers take on the precision of `wavelength`, which itself stays as it is:
    beyond its range the spectrum is that of the edge.
    """
    nm = as_float(wavelength)
    if nm.ndim != 1:
        raise ValueError(f"`wavelength` must be one-dimensional; got shape {nm.shape}.")
    beyond.admit("wavelength", nm, sky.ranges["wavelength"])
    albedo = jax.tree.map(lambda x: x.astype(nm.dtype), as_spectrum(ground))
    _check_albedo(albedo.evaluate(nm))
    found: dict[str, Any] = {"wavelength": nm, "ground": albedo}
    for name, given in values.items():
        number = as_float(given).astype(nm.dtype)
        if number.shape != ():
            raise ValueError(f"`{name}` must be one number; got {number.shape}.")
        if name in sky.ranges:
            number = beyond.admit(name, number, sky.ranges[name])
        found[name] = number
    for name, value in found.items():
        setattr(sky, name, value)


def _check_albedo(values: Float[Array, "*n"]) -> None:
    if isinstance(values, Tracer):
        return
    numbers = np.asarray(values)
    outside = ~((numbers >= 0.0) & (numbers <= 1.0))
    if np.any(outside):
        got = numbers[outside][0]
        raise ValueError(f"`ground` must lie between 0 and 1; got {got:g}.")
