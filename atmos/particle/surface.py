"""The albedo of ready-made grounds."""

import numpy as np

from .. import data
from ..spectrum import Tabulated


NAMES: tuple[str, ...] = (data.read("ground_albedo").dtype.names or ())[1:]


def albedo(name: str) -> Tabulated:
    """The albedo of a ground; beyond what was measured, that of the nearest wavelength.

    Raises `ValueError` unless `name` is one of `NAMES`.
    """
    if name not in NAMES:
        raise ValueError(f"`name` must be one of {', '.join(NAMES)}; got {name!r}.")
    table = data.read("ground_albedo")
    known = np.isfinite(table[name])
    knots, values = table["wavelength"][known], table[name][known]
    return Tabulated(knots, values, below=values[0], above=values[-1])
