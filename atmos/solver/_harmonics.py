"""Functions of direction in which scattering is diagonal.

For radiance these are associated Legendre functions. Q and U of light that travels at
an angle theta from the zenith turn with the vertical plane that they are counted from:
for them they are Wigner's functions d^l_(n,m)(theta) with n = 2 and -2, the generalised
spherical functions. Of a field that is alike to the left and the right of the sun,

    I = sum (l + 1/2) T_lm P_lm cos(m phi),
    Q = sum (l + 1/2) (E_lm R_lm + B_lm S_lm) cos(m phi),
    U = sum (l + 1/2) (E_lm S_lm + B_lm R_lm) sin(m phi),

with P of `harmonics`, R and S of `spin_harmonics` of the cosine of theta, phi the
azimuth from the sun's clockwise seen from above, and Q and U as in `atmos.polarisation`
(Siewert 1982). With I_m and Q_m what goes with cos(m phi), and U_m with sin(m phi), the
moments are integrals over that cosine from -1 to 1,

    T of I_m P,  E of Q_m R + U_m S,  B of Q_m S + U_m R.

Scattering turns those of each l and m into

    (alpha1 T + beta1 E, beta1 T + alpha2 E, alpha3 B),

with the moments of a phase function, times its coefficient. A beam without polarisation
has T alone: P_lm of its own direction times 1 / (2 pi), or 1 / pi where m > 0, for an
irradiance of 1. Reversed directions give (-1)^(l + m) times P, R and -S.
"""

import functools as ft
import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float


@ft.cache
def pairs(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Degrees l below `count` and orders m up to l, by degree."""
    return np.tril_indices(count)


def harmonics(cosine: Array | np.ndarray, count: int) -> Any:
    """Associated Legendre functions of degree and order below `count`: [..., l, m].

    Normalised by ((l - m)! / (l + m)!)^(1/2), without the sign (-1)^m: Wigner's
    d^l_(0,m). Of NumPy's arrays they are one of NumPy's.
    """
    xp = np if isinstance(cosine, np.ndarray) else jnp
    x = cosine[..., None]
    m = np.arange(count)
    row_of = lambda values: np.asarray(values, x.dtype)[(None,) * (x.ndim - 1)]
    sine = _sine(xp, x)
    edge = xp.ones_like(x)
    row = edge * row_of(m == 0)
    before, rows = xp.zeros_like(row), [row]
    for l in range(count - 1):
        edge = edge * sine * row_of([math.sqrt((2 * l + 1) / (2 * l + 2))])
        scale = np.sqrt(np.maximum((l + 1) ** 2 - m * m, 1.0))
        ahead = row_of((2 * l + 1) / scale * (m <= l))
        back = row_of(np.sqrt(np.maximum(l * l - m * m, 0.0)) / scale)
        row, before = ahead * x * row - back * before + edge * row_of(m == l + 1), row
        rows.append(row)
    return xp.stack(rows, -2)


def legendre(versine: Float[Array, "*n"], count: int) -> Float[Array, "l *n"]:
    """What moments weigh in a phase function: Legendre polynomials, (2l + 1) / (4 pi).

    Of a cosine that is told by one minus it.
    """

    def following(state, l):
        # By its distance from the last one, exact where the versine is small.
        known, step = state
        step = (l * step - (2.0 * l + 1.0) * versine * known) / (l + 1.0)
        return (known + step, step), (2.0 * l + 1.0) * known

    start = jnp.ones_like(versine), jnp.zeros_like(versine)
    degrees = jnp.arange(count, dtype=versine.dtype)
    _, found = jax.lax.scan(following, start, degrees)
    return found / (4.0 * math.pi)


def second_order(versine: Float[Array, "*n"], count: int) -> Float[Array, "l *n"]:
    """What moments weigh in polarisation: `harmonics` of order 2, (2l + 1) / (4 pi).

    Of a cosine that is told by one minus it.
    """
    cosine, none = 1.0 - versine, jnp.zeros_like(versine)
    known, before = math.sqrt(0.375) * versine * (2.0 - versine), none
    rows = [none, none]
    for l in range(2, count):
        rows.append((2.0 * l + 1.0) / (4.0 * math.pi) * known)
        ahead, back = (math.sqrt(x * x - 4.0) for x in (l + 1.0, l))
        step = ((2.0 * l + 1.0) * cosine * known - back * before) / ahead
        known, before = step, known
    return jnp.stack(rows)[:count]


def spin_harmonics(cosine: Array | np.ndarray, count: int) -> tuple[Any, Any]:
    """R and S: half the sum and half the difference of d^l_(2,m) and d^l_(-2,m).

    Of degree and order below `count`, each [..., l, m]; 0 below degree 2. R + S and
    R - S of order 2 are d^l_22 and d^l_2-2 of an angle of scattering, and `harmonics`
    of order 2 is d^l_02.
    """
    xp = np if isinstance(cosine, np.ndarray) else jnp
    x = cosine[..., None]
    if not count:
        none = xp.zeros((*cosine.shape, 0, 0), cosine.dtype)
        return none, none
    sine = _sine(xp, x)
    both = [_spin(xp, x, sine, n, count) for n in (2, -2)]
    return 0.5 * (both[0] + both[1]), 0.5 * (both[0] - both[1])


def _spin(xp: Any, x: Any, sine: Any, n: int, count: int) -> Any:
    """Wigner's d^l_(n,m) of n = 2 or -2, by the three-term recurrence in l."""
    m = np.arange(count)
    row_of = lambda values: np.asarray(values, x.dtype)[(None,) * (x.ndim - 1)]
    half = 0.5 + (0.25 * n) * x
    edge = half * half
    zero = edge * row_of(0.0 * m)
    row = zero + math.sqrt(0.375) * sine * sine * row_of(m == 0)
    row = row - (0.5 * n) * sine * half * row_of(m == 1) + edge * row_of(m == 2)
    before, rows = zero, [zero, zero, row][:count]
    for l in range(2, count - 1):
        ratio = math.sqrt((2 * l + 2) * (2 * l + 1) / ((l + 3) * (l - 1)))
        edge = edge * sine * row_of([0.5 * ratio])
        scale = np.sqrt(np.maximum((l + 1) ** 2 - m * m, 1.0) * ((l + 1) ** 2 - 4))
        inside = (2 * l + 1) / (l * scale) * (m <= l)
        back = np.sqrt(np.maximum(l * l - m * m, 0.0) * (l * l - 4))
        back = row_of((l + 1) / l * back / scale)
        ahead = row_of(l * (l + 1) * inside) * x - row_of(n * m * inside)
        row, before = ahead * row - back * before + edge * row_of(m == l + 1), row
        rows.append(row)
    return xp.stack(rows, -2)


def _sine(xp: Any, x: Any) -> Any:
    inside = x * x < 1.0
    return xp.where(inside, xp.sqrt(xp.where(inside, 1.0 - x * x, 1.0)), 0.0)
