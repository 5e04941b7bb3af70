import math
from typing import Annotated, Any, ClassVar

import msgspec
import numpy as np

from .. import spectrum
from ..phase._check import check_between
from ..quantity import deg
from ..rays import decimals
from ._errors import refuse, renamed, under


Above0 = Annotated[float, msgspec.Meta(gt=0)]
AtLeast0 = Annotated[float, msgspec.Meta(ge=0)]
Turn = Annotated[float, msgspec.Meta(ge=-360, le=360)]
Wavelength = Annotated[float, msgspec.Meta(ge=100, le=1e5)]


class Table(msgspec.Struct, forbid_unknown_fields=True):
    """A table of the file, its keys in the order of the fields of what it makes."""

    makes: ClassVar[type | None] = None

    def build(self) -> Any:
        """Makes it; raises `ValueError` naming the key, the rule and the value."""
        assert self.makes is not None
        parts = [build(name, getattr(self, name)) for name in self.__struct_fields__]
        with renamed(self.makes, self.__struct_fields__):
            return self.makes(*parts)


class Kind(Table, tag_field="kind"):
    """A table that says in `kind` what it is."""


def build(key: str, value: Any) -> Any:
    """What the value of a key stands for."""
    with under(key):
        return value.build() if isinstance(value, Table) else _array(value)


def _array(value: Any) -> Any:
    return np.array(value) if isinstance(value, list | tuple) else value


def within(
    key: str, value: Any, low: float, high: float = math.inf
) -> spectrum.AbstractSpectrum:
    """The spectrum that the value of a key stands for, if it keeps within bounds."""
    found = spectrum.as_spectrum(build(key, value))
    leading = found
    if isinstance(found, spectrum.PowerLaw):
        leading, high = spectrum.Constant(found.value), math.inf
    elif isinstance(found, spectrum.BandAverage):
        leading = spectrum.Tabulated(found.knots, found.values)
    check_between(key, leading, low, high)
    return found


def unit(key: str, value: tuple[float, float, float]) -> np.ndarray:
    """The direction that the value of a key points in, whatever its length."""
    length = np.linalg.norm(value)
    if length == 0.0:
        refuse(key, "must point somewhere", list(value))
    return np.array(value) / length


def degrees(angle: object) -> float:
    """With no more decimals than it takes to make the angle of it again."""
    wanted = np.asarray(angle)
    found = math.degrees(float(wanted))
    return round(found, decimals(lambda n: round(found, n) * deg, wanted))
