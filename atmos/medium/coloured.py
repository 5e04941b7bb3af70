import numpy as np
from jaxtyping import ArrayLike

from ..phase import AbstractPhaseFunction
from ..quantity import as_float
from ..spectrum import AbstractSpectrum, as_spectrum, Product, Tabulated
from ._base import Medium
from .grid import Grid


# Red, green and blue overlap in the middle between the primaries of Rec. 709, in nm.
_EDGES = [465.0, 515.0, 565.0, 615.0]
_BANDS = [[0.0, 0.0, 0.0, 1.0], [0.0, 1.0, 1.0, 0.0], [1.0, 0.0, 0.0, 0.0]]


def coloured(
    density: Grid,
    colour: ArrayLike,
    extinction: ArrayLike | AbstractSpectrum,
    phase: AbstractPhaseFunction,
) -> tuple[Medium, ...]:
    """Media that together have the density of a grid, and another albedo in each cell.

    `extinction`, in m^-1, is where the density is 1. `colour` holds the share of it
    that scatters in red, green and blue, in an array like the grid's with a last axis
    of 3; it is the same within a band, and goes over into the next along a line. As
    effects of media add, each band is a medium that scatters and one that absorbs.
    Raises `ValueError` for colours that are not such an array of numbers from 0 to 1.
    """
    share, values = as_float(colour), density.values
    if share.shape != (*values.shape, 3):
        raise ValueError(
            f"`colour` must have the shape {(*values.shape, 3)}; got {share.shape}."
        )
    known = np.asarray(share)
    if not np.all((known >= 0.0) & (known <= 1.0)):
        first = tuple(
            int(x) for x in np.argwhere(~((known >= 0.0) & (known <= 1.0)))[0]
        )
        raise ValueError(
            f"`colour` must be from 0 to 1; got colour{list(first)} = {known[first]}."
        )
    media = []
    for i, band in enumerate(_BANDS):
        part = Tabulated(np.array(_EDGES), np.array(band), band[0], band[-1])
        part = Product(as_spectrum(extinction), part)
        scatters, absorbs = values * share[..., i], values * (1.0 - share[..., i])
        grid = lambda x: Grid(x, density.lower, density.upper)
        media.append(Medium(grid(scatters), scattering=part, phase=phase))
        media.append(Medium(grid(absorbs), absorption=part))
    return tuple(media)
