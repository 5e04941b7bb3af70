"""What lies in a scene as what stands in a file."""

import dataclasses
import math
from typing import Any

import equinox as eqx
import jax
import numpy as np

from .. import medium, particle, phase, spectrum
from ..particle import ozone
from ..particle.surface import albedo, NAMES
from ..reference import solar_irradiance
from ..surface import Lambertian
from ._base import Kind
from ._errors import short
from ._phases import Angles
from ._spectra import Molecules, MoleculesDepolarise, Ozone, Solar, Tabulated
from ._surfaces import Lambertian as Diffuse


def number(value: Any) -> Any:
    """Nested lists of the shortest numbers that are these in their own precision."""
    array = np.asarray(value)
    if array.ndim:
        return [number(x) for x in array]
    single: Any = array[()]
    return float(np.format_float_scientific(single))


_WRITTEN: dict[type, type[Kind]] = {
    x.makes: x for x in Kind.__subclasses__() if x.makes is not None
}


def table(value: Any) -> Any:
    """What lies in a scene as a table, or as a number; `ValueError` without words."""
    if isinstance(value, spectrum.Constant):
        return number(value.value)
    if isinstance(value, int):
        return value
    if isinstance(value, medium.Glow):
        return table(value.spectrum)
    if isinstance(value, Lambertian):
        return Diffuse(albedo_written(value.albedo))
    if isinstance(value, eqx.Module) and type(value) in _WRITTEN:
        fields = [getattr(value, x.name) for x in dataclasses.fields(value)]
        return _WRITTEN[type(value)](*map(table, fields))
    if isinstance(value, spectrum.Tabulated):
        knots, values = number(value.knots), number(value.values)
        below, above = (
            None if x is None else number(x) for x in (value.below, value.above)
        )
        if below == values[0] and above == values[-1]:
            return Tabulated(knots, values, outside="hold")
        return Tabulated(knots, values, below=below, above=above)
    if isinstance(value, spectrum.BandAverage):
        return _solar(value) or Tabulated(
            *map(number, (value.knots, value.values)),
            bandwidth=number(value.bandwidth),
        )
    if isinstance(value, particle.Scattering):
        gas, co2 = _of_gas(value.gas)
        return Molecules(gas, number(value.number_density), co2)
    if isinstance(value, particle.Depolarisation):
        return MoleculesDepolarise(*_of_gas(value.gas))
    if isinstance(value, phase.Tabulated):
        cosine = (1.0 - np.asarray(value.versine, float))[::-1]
        rows = np.asarray(value.value)[::-1]
        if value.wavelength is None:
            return Angles(number(cosine), number(rows[:, 0]))
        return Angles(number(cosine), number(rows), number(value.wavelength))
    if isinstance(value, spectrum.Product):
        return _product(value)
    if isinstance(value, jax.Array | np.ndarray):
        return number(value)
    raise ValueError(
        f"must be something that a scene file has words for; got {short(value)}."
    )


def _of_gas(gas: particle.AbstractGas) -> tuple[Any, float | None]:
    if isinstance(gas, particle.Air):
        return "air", number(gas.co2)
    if isinstance(gas, particle.CarbonDioxide):
        return "carbon_dioxide", None
    raise ValueError(f"`gas` must be one that a scene file knows; got {gas!r}")


def _product(value: spectrum.Product) -> Any:
    factor, other = value.one, value.other
    if isinstance(other, spectrum.Constant):
        factor, other = other, factor
    if isinstance(factor, spectrum.Constant):
        times: Any = lambda x: None if x is None else factor.value * x
        if alike(other, ozone.cross_section()):
            return Ozone(number(factor.value))
        if isinstance(other, spectrum.Constant):
            return number(times(other.value))
        if isinstance(other, spectrum.PowerLaw):
            return table(dataclasses.replace(other, value=times(other.value)))
        if isinstance(other, spectrum.Tabulated):
            return table(
                spectrum.Tabulated(
                    other.knots,
                    times(other.values),
                    *map(times, (other.below, other.above)),
                )
            )
    raise ValueError(
        f"must be something that a scene file has words for; got {short(value)}."
    )


def _solar(value: spectrum.BandAverage) -> Solar | None:
    """The sun's spectrum, if it is that."""
    knots, irradiance = solar_irradiance()
    if value.knots.shape != knots.shape:
        return None
    bandwidth, total = number(value.bandwidth), np.sum(np.asarray(value.values, float))
    distance = math.sqrt(np.sum(irradiance) / total) if total > 0.0 else 0.0
    for digits in range(3, 10):
        found = Solar(bandwidth, round(distance, digits))
        if found.distance > 0.0 and alike(value, found.build()):
            return found
    return None


def albedo_written(value: spectrum.AbstractSpectrum) -> Any:
    """An albedo by name, if it has one."""
    for name in NAMES:
        if alike(value, albedo(name)):
            return name
    return table(value)


def alike(a: Any, b: Any) -> bool:
    """Whether these are the same, but for the rounding of numbers."""
    if jax.tree.structure(a) != jax.tree.structure(b):
        return False
    for x, y in zip(jax.tree.leaves(a), jax.tree.leaves(b), strict=True):
        near = 4.0 * float(max(np.finfo(x.dtype).eps, np.finfo(y.dtype).eps))
        x, y = np.asarray(x, float), np.asarray(y, float)
        if x.shape != y.shape or not np.allclose(x, y, rtol=near, atol=0.0):
            return False
    return True
