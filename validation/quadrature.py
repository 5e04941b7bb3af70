"""Single scattering by adaptive quadrature in double precision: the judge.

It shares nothing with atmos, and knows no geometry but Pythagoras: places are distances
from the planet's centre, and whether one is in the shadow is asked place by place.
Intervals are halved until that makes no difference. The world: air, aerosol and ozone
(see `validation.single_scattering`) under a point sun of irradiance 1.
"""

from collections.abc import Callable

import numpy as np


RADIUS, TOP, ALBEDO = 6360e3, 60e3, 0.1
SCALE_HEIGHTS = np.array([8000.0, 1200.0])  # of air and aerosol
OZONE = np.array([10e3, 25e3, 40e3])  # nothing, most, nothing
SHARE, ASYMMETRY = 0.9, 0.76  # of what the aerosol takes out, scattered; mean cosine
WAVELENGTH = np.array([380.0, 500.0, 600.0, 780.0])
EXTINCTION = np.stack(
    [
        1.24062e-6 * (WAVELENGTH / 1000.0) ** -4.0,
        4.1666666667e-5 * (WAVELENGTH / 550.0) ** -0.8,
        # 300 Dobson units of the cross section of Serdyuchenko et al. 2014 at 233 K.
        np.array([1.514393e-09, 7.95352e-07, 2.697211e-06, 1.361772e-07]),
    ]
)
SCATTERING = EXTINCTION[:2] * np.array([[1.0], [SHARE]])

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(10)
_HALVINGS = 48


def densities(altitude: np.ndarray) -> np.ndarray:
    """Of air, aerosol and ozone, on the last axis."""
    thin = np.exp(-altitude[..., None] / SCALE_HEIGHTS)
    tent = 1.0 - np.abs(altitude - OZONE[1]) / (OZONE[1] - OZONE[0])
    return np.concatenate([thin, np.maximum(tent, 0.0)[..., None]], -1)


def phases(cosine: np.ndarray) -> np.ndarray:
    """Of air and aerosol, on the last axis."""
    g = ASYMMETRY
    aerosol = (1.0 - g * g) / (1.0 + g * g - 2.0 * g * cosine) ** 1.5 / (4.0 * np.pi)
    return np.stack([3.0 / (16.0 * np.pi) * (1.0 + cosine**2), aerosol], -1)


def integrate(
    function: Callable[[np.ndarray, np.ndarray], np.ndarray],
    edges: np.ndarray,
    channels: int,
    tolerance: tuple[float, float],
) -> np.ndarray:
    """Integrals, one a row of rising `edges`, of what has several channels.

    `function` takes places and the rows that they belong to. An interval is done when
    halving it changes less than the tolerance: relative to its row's sum, or absolute.
    """
    relative, absolute = tolerance
    row = np.repeat(np.arange(len(edges)), edges.shape[1] - 1)
    begin, end = edges[:, :-1].ravel(), edges[:, 1:].ravel()
    row, begin, end = (x[end > begin] for x in (row, begin, end))
    done = np.zeros((len(edges), channels))

    def gauss(begin, end, row):
        half = 0.5 * (end - begin)
        places = (begin + half)[:, None] + half[:, None] * _NODES
        values = function(places.ravel(), np.repeat(row, _NODES.size))
        values = values.reshape(*places.shape, channels)
        return np.einsum("inc,n,i->ic", values, _WEIGHTS, half)

    whole = gauss(begin, end, row)
    for _ in range(_HALVINGS):
        if not row.size:
            return done
        middle = 0.5 * (begin + end)
        one, other = gauss(begin, middle, row), gauss(middle, end, row)
        halves = one + other
        total = done.copy()
        np.add.at(total, row, halves)
        bound = np.maximum(relative * np.abs(total)[row], absolute)
        open_ = np.any(np.abs(halves - whole) > bound, -1)
        np.add.at(done, row[~open_], halves[~open_])
        row = np.tile(row[open_], 2)
        begin, end = (
            np.concatenate([begin[open_], middle[open_]]),
            np.concatenate([middle[open_], end[open_]]),
        )
        whole = np.concatenate([one[open_], other[open_]])
    raise ArithmeticError(f"{row.size} intervals do not converge.")


def columns(nearest: np.ndarray, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Of the three media, on rays that come as near as this to the planet's centre.

    The way is counted from the nearest place.
    """
    kinks = np.sqrt(np.maximum((RADIUS + OZONE) ** 2 - nearest[:, None] ** 2, 0.0))
    inner = np.concatenate([-kinks[:, ::-1], np.zeros_like(kinks[:, :1]), kinks], -1)
    edges = np.clip(inner, begin[:, None], end[:, None])
    edges = np.concatenate([begin[:, None], edges, end[:, None]], -1)
    density = lambda x, row: densities(np.hypot(nearest[row], x) - RADIUS)
    return integrate(density, edges, 3, (1e-12, 1e-6))


def radiance(altitude: np.ndarray, view: np.ndarray, sun: np.ndarray) -> np.ndarray:
    """What one sees above the origin in each direction, by wavelength.

    `altitude` may be as high as one likes; `view` and `sun` are rows of unit vectors.
    """
    eye = np.zeros_like(view)
    eye[:, 2] = RADIUS + altitude
    start = np.sum(eye * view, -1)
    nearest = np.linalg.norm(eye - start[:, None] * view, axis=-1)
    away = lambda r: np.sqrt(np.maximum(r * r - nearest * nearest, 0.0))
    grounded = (nearest < RADIUS) & (start < 0.0)
    begin = np.maximum(start, -away(RADIUS + TOP))
    end = np.where(grounded, -away(RADIUS), away(RADIUS + TOP))
    end = np.where(nearest < RADIUS + TOP, np.maximum(end, begin), begin)
    cosine = np.sum(view * sun, -1)
    turned = phases(cosine)

    def arrives(x, row):
        """What is left of the sun's light here, on its way to the eye."""
        place = eye[row] + (x - start[row])[:, None] * view[row]
        rise = np.sum(place * sun[row], -1)
        low = np.linalg.norm(place - rise[:, None] * sun[row], axis=-1)
        lit = (rise > 0.0) | (low > RADIUS)
        share = np.zeros((x.size, WAVELENGTH.size))
        last = np.sqrt(np.maximum((RADIUS + TOP) ** 2 - low[lit] ** 2, 0.0))
        passed = columns(low[lit], rise[lit], np.maximum(rise[lit], last))
        passed += columns(nearest[row[lit]], begin[row[lit]], x[lit])
        share[lit] = np.exp(-passed @ EXTINCTION)
        return share

    def source(x, row):
        density = densities(np.hypot(nearest[row], x) - RADIUS)[:, :2]
        return (density * turned[row]) @ SCATTERING * arrives(x, row)

    pieces = np.linspace(0.0, 1.0, 25) ** 2
    pieces = np.unique(np.concatenate([pieces, 1.0 - pieces]))
    edges = begin[:, None] + (end - begin)[:, None] * pieces
    total = integrate(source, edges, WAVELENGTH.size, (1e-8, 1e-16))
    row = np.nonzero(grounded & (begin <= end))[0]
    foot = eye[row] + (end - start)[row][:, None] * view[row]
    rise = np.maximum(np.sum(foot * sun[row], -1) / RADIUS, 0.0)
    total[row] += ALBEDO / np.pi * rise[:, None] * arrives(end[row], row)
    return total
