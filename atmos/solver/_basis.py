"""The ordinates, and how scattering joins them, order by order of azimuth."""

import functools as ft
import math
from typing import NamedTuple

import numpy as np

from ..transport import gauss_legendre
from ._harmonics import harmonics, spin_harmonics


class Basis(NamedTuple):
    """Some orders m of azimuth, of radiance alone or of I, Q and U.

    A row is an ordinate of one of these, I first. A term is a degree l of T, and then
    one below `polarised` of E and of B, see `_harmonics`; a coefficient is alpha1 of
    each degree, and then alpha2, alpha3 and beta1 of those below `polarised`.
    """

    nodes: int
    degrees: int
    orders: np.ndarray  # m
    cosine: np.ndarray  # row
    weight: np.ndarray  # row
    functions: np.ndarray  # term, m, row
    even: np.ndarray  # term, m: alike upwards and downwards, but for the sign of U
    sums: np.ndarray  # row, row, m, coefficient: what goes from sum to sum
    differences: np.ndarray  # row, row, m, coefficient
    reach: np.ndarray  # row, m, coefficient: what a beam without polarisation sends
    degree: np.ndarray  # coefficient
    alike: np.ndarray  # coefficient, m: as `even`, of what the beam sends


@ft.cache
def basis(nodes: int, count: int, polarised: int, begin: int, end: int) -> Basis:
    """Of the orders from `begin` on, below `end`, and the degrees below `count`."""
    mu, w = gauss_legendre(nodes)
    orders = np.arange(begin, end)
    last = lambda x: np.moveaxis(x, 0, -1)[:, begin:end]  # l, m, node
    p = harmonics(mu, count)
    if 2 * count <= 3 * nodes:
        p = _orthogonal(p, w)
    p = last(p)
    degrees = [np.arange(count)] + [np.arange(polarised)] * 2
    functions, cosine, weight = p, mu, w
    if polarised:
        r, s = (last(x)[:polarised] for x in spin_harmonics(mu, count))
        none, less = np.zeros_like(p), np.zeros_like(r)
        rows = [[p, none, none], [less, r, s], [less, s, r]]
        functions = np.concatenate([np.concatenate(x, -1) for x in rows])
        cosine, weight = np.tile(mu, 3), np.tile(w, 3)
    degrees = np.concatenate(degrees)
    odd_one = np.arange(len(degrees)) >= count + polarised  # B
    even = (degrees[:, None] + orders[None] + odd_one[:, None]) % 2 == 0

    # Which terms a coefficient joins: one with itself, or T with E.
    t, e = np.arange(len(degrees)), np.arange(polarised)
    into, out_of = np.append(t, count + e), np.append(t, e)
    scale = np.sqrt(weight / cosine)
    scaled = functions * scale * np.sqrt(2.0 * degrees[:, None, None] + 1.0)
    both = np.einsum("qmi,qmj->ijmq", scaled[into], scaled[out_of])
    other = into != out_of
    both = both + np.where(other, np.swapaxes(both, 0, 1), 0.0)
    kinds = even[into].T
    twice = np.where(orders == 0, 1.0, 2.0) / (2.0 * math.pi)
    reach = np.einsum("qmi,m->imq", functions[into] * scale, twice)
    reach = reach * np.where(out_of < count, 2.0 * degrees[into] + 1.0, 0.0)
    return Basis(
        nodes,
        count,
        orders,
        cosine,
        weight,
        functions,
        even,
        both * kinds,
        both * ~kinds,
        reach,
        degrees[into],
        even[into],
    )


def _orthogonal(p: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """The nearest to harmonics [node, l, m] that are orthogonal at the nodes.

    As they are on half of the sphere where l + m is even, or odd: Gauss's rule is not
    exact for the products of the highest degrees, and what scattered twice would gain
    by it in the directions of the beam.
    """
    found = p.copy()
    root = np.sqrt(weight)[:, None]
    for m in range(p.shape[2]):
        for first in (m, m + 1):
            l = np.arange(first, p.shape[1], 2)
            norm = root * np.sqrt(2.0 * l + 1.0)
            u, _, v = np.linalg.svd(norm * p[:, l, m], full_matrices=False)
            found[:, l, m] = (u @ v) / norm
    return found
