"""Single scattering worked out the slow way, to judge the quick one by.

Nothing is shared with the package: places are distances from the planet's centre, the
way along a ray is counted from where it is nearest to the centre, edges are found by
bisection, and sums are taken by tanh-sinh (along the view) and by Gauss in many panels
(on the way to the sun). The world: air, dust and ozone under a sun of unit irradiance.
"""

import numpy as np


RADIUS, TOP, ALBEDO = 6360e3, 60e3, 0.1
SHARE, ASYMMETRY = 0.9, 0.76  # of the dust: what it scatters of what it takes out
OZONE = (10e3, 25e3, 40e3)

# Between these no density changes by more than a factor of 10 that matters.
_LEVELS = np.array([0, 1, 2, 4, 6, 8, 10, 15, 20, 25, 32, 40, 50, 60]) * 1e3
_GAUSS = np.polynomial.legendre.leggauss(16)
_T = np.linspace(-3.1, 3.1, 63)
_PLACES = 0.5 + 0.5 * np.tanh(0.5 * np.pi * np.sinh(_T))
_STEP = 0.25 * np.pi * (_T[1] - _T[0])
_SHARES = _STEP * np.cosh(_T) / np.cosh(0.5 * np.pi * np.sinh(_T)) ** 2


def densities(altitude):
    """Of air, dust and ozone, on the last axis."""
    bottom, centre, top = OZONE
    ozone = np.minimum(
        (altitude - bottom) / (centre - bottom), (top - altitude) / (top - centre)
    )
    air, dust = np.exp(-altitude / 8000.0), np.exp(-altitude / 1200.0)
    return np.stack([air, dust, np.maximum(ozone, 0.0)], -1)


def extinctions(wavelength):
    """Of air, dust and ozone (1/m), on the last axis."""
    air = 1.24062e-6 * (wavelength / 1000.0) ** -4.0
    dust = 4.1666666667e-5 * (wavelength / 550.0) ** -0.8
    ozone = 2e-6 * np.exp(-(((wavelength - 600.0) / 70.0) ** 2))
    return np.stack([air, dust, ozone], -1)


def columns(nearest, begin, end):
    """From `begin` to `end`, counted from the nearest place, given its altitude."""
    away = (_LEVELS - nearest[:, None]) * (_LEVELS + nearest[:, None] + 2.0 * RADIUS)
    away = np.sqrt(np.maximum(away, 0.0))
    begin, end = begin[:, None], np.maximum(end, begin)[:, None]
    edges = np.concatenate([-away[:, ::-1], away], 1)
    edges = np.concatenate([begin, np.clip(edges, begin, end), end], 1)
    middle, half = 0.5 * (edges[:, 1:] + edges[:, :-1]), 0.5 * np.diff(edges)
    ray, panel = np.nonzero(half)
    middle, half = middle[ray, panel][:, None], half[ray, panel][:, None]
    nodes, weights = _GAUSS
    x, b = middle + half * nodes, RADIUS + nearest[ray][:, None]
    altitude = nearest[ray][:, None] + x * x / (b + np.sqrt(b * b + x * x))
    total = np.zeros((len(nearest), 3))
    np.add.at(
        total, ray, np.einsum("pnm,n,p->pm", densities(altitude), weights, half[:, 0])
    )
    return total


def _edges(function, x):
    """Where a function of the way changes its sign."""
    values = function(x)
    (at,) = np.nonzero(values[1:] * values[:-1] < 0.0)
    low, high, sign = x[at], x[at + 1], np.sign(values[at])
    for _ in range(60):
        middle = 0.5 * (low + high)
        same = np.sign(function(middle)) == sign
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return 0.5 * (low + high)


def gather(altitude, view, sun):
    """All that a wavelength is not needed for, seen from above the origin.

    Columns from the eye over each scattering place to the sun, and the amounts of what
    scatters there; the same for the ground (columns and cosine), if it is seen and lit.
    """
    nothing = np.zeros((0, 3)), np.zeros((0, 3)), None
    r, level = RADIUS + altitude, np.hypot(view[0], view[1])
    start = r * view[2]
    nearest = altitude * level - RADIUS * view[2] ** 2 / (1.0 + level)
    away = lambda a: np.sqrt(max((a - nearest) * (a + nearest + 2.0 * RADIUS), 0.0))
    if nearest >= TOP or (altitude >= TOP and start >= 0.0):
        return nothing
    grounded = nearest < 0.0 and start < 0.0
    begin = -away(TOP) if altitude > TOP else start
    end = -away(0.0) if grounded else away(TOP)

    def height(x):
        b = RADIUS + nearest
        return nearest + x * x / (b + np.sqrt(b * b + x * x))

    def place(x):
        return np.array([0.0, 0.0, r]) + (x - start)[:, None] * view

    def towards_sun(x):
        """The way from the place nearest to the centre, and the altitude there."""
        at = place(x)
        across = np.linalg.norm(np.cross(at, sun), axis=-1)
        return at @ sun, across - RADIUS

    def clearance(x):
        rise, nearest = towards_sun(x)
        return np.where(rise < 0.0, nearest, height(x))

    grid = begin + (end - begin) * np.linspace(0.0, 1.0, 3001) ** 2
    grid = np.unique(np.concatenate([grid, begin + end - grid]))
    edges = [_edges(lambda x, l=l: clearance(x) - l, grid) for l in (0.0, *OZONE)]
    away = [w for l in _LEVELS for w in (away(l), -away(l))]
    edges = np.concatenate([*edges, away, [0.0, begin, end]])
    edges = np.unique(edges[(edges >= begin) & (edges <= end)])
    middle, length = 0.5 * (edges[1:] + edges[:-1]), np.diff(edges)
    lit = clearance(middle) > 0.0
    x = (edges[:-1] + length * _PLACES[:, None])[:, lit].ravel()
    amounts = densities(height(x)) * (_SHARES[:, None] * length)[:, lit].reshape(-1, 1)

    def to_sun(x):
        rise, nearest = towards_sun(x)
        last = (TOP - nearest) * (TOP + nearest + 2.0 * RADIUS)
        return columns(nearest, rise, np.sqrt(np.maximum(last, 0.0)))

    from_eye = lambda x: columns(np.full_like(x, nearest), np.full_like(x, begin), x)
    ground = None
    foot = np.array([end])
    if grounded and towards_sun(foot)[0][0] > 0.0:
        ground = from_eye(foot) + to_sun(foot), towards_sun(foot)[0][0] / RADIUS
    return from_eye(x) + to_sun(x), amounts, ground


def phases(cosine):
    """Of air and dust."""
    g = ASYMMETRY
    dust = (1.0 - g * g) / (1.0 + g * g - 2.0 * g * cosine) ** 1.5 / (4.0 * np.pi)
    return np.stack([3.0 / (16.0 * np.pi) * (1.0 + cosine**2), dust], -1)


WORLDS = {"pure": (1, 0, 0), "hazy": (1, 1, 0), "full": (1, 1, 1)}


def radiances(altitudes, views, suns, wavelength, worlds=WORLDS):
    """The light that turned once, in worlds with so much of air, dust and ozone."""
    found = {name: [] for name in worlds}
    views, suns = np.asarray(views, float), np.asarray(suns, float)
    for altitude, view, sun in zip(altitudes, views, suns, strict=True):
        view, sun = (x / np.linalg.norm(x) for x in (view, sun))
        ways, amounts, ground = gather(altitude, view, sun)
        for name, present in worlds.items():
            extinction = extinctions(wavelength) * np.asarray(present, float)
            scattering = extinction[:, :2] * [1.0, SHARE] * phases(view @ sun)
            arrives = np.exp(-ways @ extinction.T)
            total = np.einsum("pm,pl,lm->l", amounts[:, :2], arrives, scattering)
            if ground is not None:
                way, rise = ground
                total += ALBEDO / np.pi * rise * np.exp(-way @ extinction.T)[0]
            found[name].append(total)
    return {name: np.array(total) for name, total in found.items()}
