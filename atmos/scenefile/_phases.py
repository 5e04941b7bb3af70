import numpy as np

from .. import phase
from ._base import Kind, Wavelength
from ._errors import refuse
from ._spectra import MoleculesDepolarise, Spectrum


class Isotropic(Kind, tag="isotropic"):
    makes = phase.Isotropic


class Rayleigh(Kind, tag="rayleigh"):
    makes = phase.Rayleigh
    depolarisation: Spectrum | MoleculesDepolarise = 0.0


class HenyeyGreenstein(Kind, tag="henyey_greenstein"):
    makes = phase.HenyeyGreenstein
    g: Spectrum


class DoubleHenyeyGreenstein(Kind, tag="double_henyey_greenstein"):
    makes = phase.DoubleHenyeyGreenstein
    forward: Spectrum
    backward: Spectrum
    weight: Spectrum


class Draine(Kind, tag="draine"):
    makes = phase.Draine
    g: Spectrum
    alpha: Spectrum


class CornetteShanks(Kind, tag="cornette_shanks"):
    g: Spectrum

    def build(self) -> phase.Draine:
        return Draine(self.g, 1.0).build()


class EmpiricalMie(Kind, tag="empirical_mie"):
    makes = phase.EmpiricalMie
    z: Spectrum


class Angles(Kind, tag="table"):
    """A row of `value` for each cosine: a number, or one for each wavelength."""

    cosine: list[float]
    value: list[float | list[float]]
    wavelength: list[Wavelength] | None = None

    def build(self) -> phase.Tabulated:
        try:
            value = np.array(self.value, float)
        except ValueError:
            refuse("value", "must have rows that are alike in length")
        bands = None if self.wavelength is None else np.array(self.wavelength)
        return phase.Tabulated(np.array(self.cosine), value, bands)


Phase = (
    Isotropic
    | Rayleigh
    | HenyeyGreenstein
    | DoubleHenyeyGreenstein
    | Draine
    | CornetteShanks
    | EmpiricalMie
    | Angles
)
