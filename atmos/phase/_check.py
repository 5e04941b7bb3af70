import math

import numpy as np
from jax.core import Tracer

from ..spectrum import AbstractSpectrum, Constant, Tabulated


def check_between(
    name: str, spectrum: AbstractSpectrum, low: float, high: float = math.inf
) -> None:
    """Refuses a parameter that is known to leave its range at some wavelength.

    Raises `ValueError` unless numbers and tables lie within `low` and `high`, and are
    finite. A formula, such as a power law, is not known before its wavelengths are.
    """
    if isinstance(spectrum, Constant):
        known = [spectrum.value]
    elif isinstance(spectrum, Tabulated):
        known = [spectrum.values, spectrum.below, spectrum.above]
    else:
        known = []
    for values in known:
        if values is None or isinstance(values, Tracer):
            continue
        values = np.atleast_1d(np.asarray(values))
        inside = (values >= low) & (values <= high) & np.isfinite(values)
        if not np.all(inside):
            rule = f"at least {low:g}" if high == math.inf else f"{low} to {high}"
            raise ValueError(f"`{name}` must be {rule}; got {values[~inside][0]!s}.")
