"""Ozone: the gas that keeps twilight blue, and the ultraviolet out."""

from .. import data
from ..spectrum import Tabulated


# Molecules in a column of one Dobson unit, 0.01 mm of ozone at 0 degrees Celsius and
# 1013.25 hPa: m^-2.
DOBSON = 2.6867e20


def cross_section() -> Tabulated:
    """What one molecule of ozone absorbs at 233 K, in m^2.

    Known from 280 nm; nothing beyond 1000 nm, where all the ozone above us has an
    optical depth of 1e-4. The Huggins bands, below 360 nm, weaken by a few per cent
    from 243 K to 223 K; the Chappuis bands, in the visible, do not. Times a number
    density in m^-3 it is an absorption coefficient; single precision holds both.
    """
    table = data.read("ozone")
    return Tabulated(table["wavelength"], table["cross_section"], above=0.0)
