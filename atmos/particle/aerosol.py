"""Aerosols: how much, of what, how high; named mixtures, and haze by visibility."""

import math

import equinox as eqx
from jax.core import Tracer
from jaxtyping import Array, ArrayLike

from .. import data
from ..phase import DoubleHenyeyGreenstein
from ..phase._check import check_between
from ..quantity import as_float, km, Length, Number
from ..spectrum import (
    AbstractSpectrum,
    as_spectrum,
    Complement,
    PowerLaw,
    Product,
    Tabulated,
)


# What air alone takes from 550 nm light at the ground, in m^-1.
MOLECULES = 1.149e-5

# Of a black object, 2 % of contrast is what is left at the visibility: -ln(0.02).
KOSCHMIEDER = 3.912

NAMES: tuple[str, ...] = tuple(str(name) for name in data.read("aerosol_opac")["name"])


class Aerosol(eqx.Module):
    """Particles whose density falls exponentially with altitude.

    `optical_depth` is that of the whole column at 550 nm, and goes with the wavelength
    to the power `-angstrom_exponent`; `scale_height` is in m.
    """

    optical_depth: Number = eqx.field(converter=as_float)
    scale_height: Length = eqx.field(converter=as_float)
    angstrom_exponent: Number = eqx.field(converter=as_float)
    single_scattering_albedo: AbstractSpectrum = eqx.field(converter=as_spectrum)
    asymmetry: AbstractSpectrum = eqx.field(converter=as_spectrum)

    def __check_init__(self):
        _check_at_least_0("optical_depth", self.optical_depth)
        _check_above_0("scale_height", self.scale_height)
        check_between(
            "single_scattering_albedo", self.single_scattering_albedo, 0.0, 1.0
        )
        check_between("asymmetry", self.asymmetry, -1.0, 1.0)

    def extinction(self) -> AbstractSpectrum:
        """The extinction coefficient at the ground, in m^-1."""
        at_550_nm = self.optical_depth / self.scale_height
        return PowerLaw(at_550_nm, -self.angstrom_exponent)

    def scattering(self) -> AbstractSpectrum:
        """The scattering coefficient at the ground, in m^-1."""
        return Product(self.extinction(), self.single_scattering_albedo)

    def absorption(self) -> AbstractSpectrum:
        """The absorption coefficient at the ground, in m^-1."""
        return Product(self.extinction(), Complement(self.single_scattering_albedo))


def opac(name: str) -> Aerosol:
    """An aerosol type of OPAC (Hess, Koepke, Schult 1998), at 80 % relative humidity.

    The scale height is the one that gives both the optical depth and the extinction at
    the ground of the source, whose profiles have several layers; the exponent is the
    mean over 350 to 800 nm of the source's two.

    Raises `ValueError` unless `name` is one of `NAMES`.
    """
    if name not in NAMES:
        raise ValueError(f"`name` must be one of {', '.join(NAMES)}; got {name!r}.")
    row = data.read("aerosol_opac")[NAMES.index(name)]
    ultraviolet, visible = math.log(500.0 / 350.0), math.log(800.0 / 500.0)
    exponent = row["angstrom_uv"] * ultraviolet + row["angstrom_visible"] * visible
    return Aerosol(
        optical_depth=row["optical_depth"],
        scale_height=row["optical_depth"] / row["extinction"] * km,
        angstrom_exponent=exponent / (ultraviolet + visible),
        single_scattering_albedo=row["single_scattering_albedo"],
        asymmetry=row["asymmetry"],
    )


def martian_dust(optical_depth: ArrayLike = 0.5) -> Aerosol:
    """The dust of Mars outside storms: it absorbs blue light, and dims all alike.

    `optical_depth` is 0.2 to 0.8 over the year; the dust is mixed with the air as a gas
    would be.
    """
    return Aerosol(
        optical_depth=optical_depth,
        scale_height=11.0 * km,
        angstrom_exponent=-0.13,
        single_scattering_albedo=_dust("single_scattering_albedo"),
        asymmetry=_dust("asymmetry"),
    )


def martian_dust_phase() -> DoubleHenyeyGreenstein:
    """How the dust of Mars spreads light: brighter and narrower ahead in the blue."""
    return DoubleHenyeyGreenstein(_dust("forward"), _dust("backward"), _dust("weight"))


def surface_extinction(visibility: ArrayLike) -> Number:
    """The extinction of aerosol at 550 nm that leaves a `visibility` in m, in m^-1.

    Koschmieder (1924), at 2 % of contrast, less what air takes by itself. Raises
    `ValueError` unless the visibility is above 0 and below that of pure air, 340 km.
    """
    visibility = as_float(visibility)
    _check_above_0("visibility", visibility)
    if not (isinstance(visibility, Tracer) or visibility < KOSCHMIEDER / MOLECULES):
        raise ValueError(
            "`visibility` must be below that of pure air, "
            f"{KOSCHMIEDER / MOLECULES:.0f} m; got {visibility}."
        )
    return KOSCHMIEDER / visibility - MOLECULES


def optical_depth(visibility: ArrayLike, scale_height: ArrayLike) -> Number:
    """The aerosol's vertical optical depth at 550 nm; both lengths are in m."""
    return surface_extinction(visibility) * as_float(scale_height)


def _dust(column: str) -> Tabulated:
    table = data.read("mars_dust")
    values = table[column]
    return Tabulated(table["wavelength"], values, below=values[0], above=values[-1])


def _check_at_least_0(name: str, value: Array) -> None:
    if not (isinstance(value, Tracer) or 0.0 <= float(value) < math.inf):
        raise ValueError(f"`{name}` must be 0 or more and finite; got {value}.")


def _check_above_0(name: str, value: Array) -> None:
    if not (isinstance(value, Tracer) or 0.0 < float(value) < math.inf):
        raise ValueError(f"`{name}` must be above 0 and finite; got {value}.")
