"""Laws that every phase function obeys. A new one is tried by adding it to `ALL`."""

from fractions import Fraction

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss, legvander
from scipy.stats import chi2

from atmos import phase, spectrum
from atmos.phase.draine import cumulative, lobe_share
from atmos.phase.henyey_greenstein import quantile
from atmos.quantity import versine


def table(*columns):
    return phase.Tabulated(*(np.array(x, float) for x in columns))


def curve(knots, values, **beyond):
    return spectrum.Tabulated(np.array(knots, float), np.array(values, float), **beyond)


# Tables of one length, so that they share what is compiled.
peak = np.concatenate([[0.0], np.geomspace(1e-8, 2.0, 9)])
gaps = [-1.0, -0.9, -0.8, -0.5, -0.2, 0.0, 0.5, 0.8, 0.9, 1.0]
ramp = [[0.0, 100.0], [1.0, 300.0], [1.5, 0.0], [9.0, 100.0]]
red_to_blue = curve([300.0, 600.0, 800.0], [-0.9, 0.5, 0.9])

ALL = {
    "isotropic": phase.Isotropic(),
    "rayleigh": phase.Rayleigh(),
    "rayleigh air": phase.Rayleigh(0.0279),
    "rayleigh depolarised": phase.Rayleigh(0.5),
    "hg 0": phase.HenyeyGreenstein(0.0),
    "hg 1e-8": phase.HenyeyGreenstein(1e-8),
    "hg 0.76": phase.HenyeyGreenstein(0.76),
    "hg 0.999": phase.HenyeyGreenstein(0.999),
    "hg -0.999": phase.HenyeyGreenstein(-0.999),
    "hg 0.99999": phase.HenyeyGreenstein(0.99999),
    "hg by wavelength": phase.HenyeyGreenstein(red_to_blue),
    "double hg": phase.DoubleHenyeyGreenstein(0.85, -0.4, 0.9),
    "double hg narrow": phase.DoubleHenyeyGreenstein(0.999, -0.999, 0.5),
    "double hg single": phase.DoubleHenyeyGreenstein(0.0, 0.9, 1.0),
    "draine 0 0": phase.Draine(0.0, 0.0),
    "draine 1e-8 0.5": phase.Draine(1e-8, 0.5),
    "draine 0.6 10": phase.Draine(0.6, 10.0),
    "draine 0.3 1e6": phase.Draine(0.3, 1e6),
    "cornette-shanks 0": phase.CornetteShanks(0.0),
    "cornette-shanks 0.8": phase.CornetteShanks(0.8),
    "cornette-shanks 0.999": phase.CornetteShanks(0.999),
    "cornette-shanks -0.999": phase.CornetteShanks(-0.999),
    "empirical mie 0": phase.EmpiricalMie(0.0),
    "empirical mie 0.5": phase.EmpiricalMie(0.5),
    "empirical mie hazy": phase.EmpiricalMie.hazy(),
    "empirical mie murky": phase.EmpiricalMie.murky(),
    "table flat": table(np.linspace(-1.0, 1.0, 10), np.full(10, 3.0)),
    "table with gaps": table(gaps, [0, 0, 1, 1, 2, 5, 0, 0, 0, 2]),
    "table narrow": table((1.0 - peak)[::-1], (1.0 / (peak + 1e-8))[::-1]),
    "table by wavelength": table([-1, -0.2, 0.9, 1], ramp, [300.0, 800.0]),
}
each = pytest.mark.parametrize("function", ALL.values(), ids=ALL)
wavelength = jnp.array([400.0, 550.0, 700.0])
dtypes = pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])


def in_dtype(tree, dtype):
    return jax.tree.map(lambda x: x.astype(dtype), tree)


@eqx.filter_jit
def evaluate(function, versines):
    at = wavelength.astype(versines.dtype)
    return jax.vmap(function.evaluate, (0, None))(versines, at)


@eqx.filter_jit
def moments(function, dtype=jnp.float64):
    return function.moments(24, wavelength.astype(dtype))


@eqx.filter_jit
def draw(function, dtype=jnp.float64):
    keys = jax.random.split(jax.random.key(0), 100_000)
    return jax.vmap(function.sample, (0, None))(keys, wavelength.astype(dtype))


# A quadrature that knows nothing of the functions but where they may have peaks or
# kinks: Gauss in panels that grow from either end.
narrow = np.geomspace(1e-15, 1.0, 120)
kinks = [np.asarray(f.versine) for f in ALL.values() if hasattr(f, "versine")]
edges = np.concatenate([narrow, 2.0 - narrow, np.linspace(0.0, 2.0, 101), *kinks])
edges = np.unique(edges)
nodes, weights = leggauss(8)
wide = np.diff(edges)[:, None]
points = jnp.asarray(edges[:-1, None] + 0.5 * wide * (1.0 + nodes)).ravel()
areas = np.pi * wide * weights


def shares(function):
    """The light that goes into each panel, at each wavelength."""
    values = np.asarray(evaluate(function, points))
    return np.sum(areas[:, :, None] * values.reshape(*areas.shape, -1), 1)


@each
def test_all_light_goes_somewhere(function):
    np.testing.assert_allclose(shares(function).sum(0), 1.0, rtol=1e-9)


@each
def test_moments_are_integrals_of_the_function(function):
    values = np.asarray(evaluate(function, points))
    legendre = legvander(1.0 - np.asarray(points), 23) * areas.reshape(-1, 1)
    np.testing.assert_allclose(moments(function), legendre.T @ values, atol=1e-9)


@each
@dtypes
def test_samples_follow_the_function(function, dtype):
    total = np.cumsum(np.append(0.0, shares(function)[:, 0]))
    cuts = np.searchsorted(total, np.linspace(0.0, 1.0, 61)[1:-1])
    if dtype == jnp.float32:  # its grid is too coarse for a peak behind
        cuts = cuts[edges[cuts] < 2.0 - 1e-4]
    cuts = np.unique(np.concatenate([[0], cuts, [len(edges) - 1]]))
    drawn = np.asarray(draw(in_dtype(function, dtype), dtype), float)
    assert drawn.min() >= 0.0 and drawn.max() <= 2.0
    seen, _ = np.histogram(drawn, edges[cuts])
    due = len(drawn) * np.diff(total[cuts])
    assert np.all(due > 100.0)
    assert chi2.sf(np.sum((seen - due) ** 2 / due), len(due) - 1) > 1e-4


@each
def test_the_mean_cosine_of_samples_is_the_first_moment(function):
    cosine = 1.0 - np.asarray(draw(function))
    error = cosine.std() / np.sqrt(len(cosine))
    assert abs(cosine.mean() - float(moments(function)[1, 0])) < 4.0 * error


@each
def test_no_direction_gets_negative_light(function):
    assert np.all(np.asarray(evaluate(function, points)) >= 0.0)


@each
def test_what_is_alike_at_all_wavelengths_has_length_one(function):
    length = evaluate(function, points[:2]).shape[1]
    varied = not all(x.ndim == 0 for x in jax.tree.leaves(function))
    varied &= getattr(function, "wavelength", 0) is not None
    assert length == (3 if varied else 1)
    assert moments(function).shape == (24, length)


@eqx.filter_jit
def slopes(function, versines):
    def total(both, at):
        function, angle = both
        return jnp.sum(function.evaluate(angle, at))

    at = wavelength.astype(versines.dtype)
    return jax.vmap(lambda v: jax.grad(total)((function, v), at))(versines)


@eqx.filter_jit
def drift(function, dtype):
    """The gradients of something made of samples, and of something made of moments."""
    at = wavelength.astype(dtype)
    keys = jax.random.split(jax.random.key(1), 100)

    def drawn(function):
        return jnp.sum(jax.vmap(function.sample, (0, None))(keys, at))

    def meant(function):
        return jnp.sum(function.moments(6, at))

    return jax.grad(drawn)(function), jax.grad(meant)(function)


@each
@dtypes
def test_values_and_gradients_are_finite_at_the_edges(function, dtype):
    function = in_dtype(function, dtype)
    at = jnp.array([0.0, 1e-12, 1e-6, 1.0, 1.999999, 2.0], dtype)
    found = evaluate(function, at), slopes(function, at)
    for x in jax.tree.leaves(found):
        assert x.dtype == dtype and bool(jnp.all(jnp.isfinite(x)))


@each
def test_samples_and_moments_have_finite_gradients(function):
    function = in_dtype(function, jnp.float32)
    for x in jax.tree.leaves(drift(function, jnp.float32)):
        assert x.dtype == jnp.float32 and bool(jnp.all(jnp.isfinite(x)))


@each
def test_gradients_are_differences(function):
    at = jnp.array([0.11, 0.3, 0.7, 1.21, 1.7, 1.99])
    tilt = jax.tree.map(jnp.cos, function)
    h = 1e-7

    def moved(h):
        return evaluate(jax.tree.map(lambda x, dx: x + h * dx, function, tilt), at)

    def turned(h):
        return evaluate(function, at + h)

    by_function, by_versine = slopes(function, at)
    along = jax.tree.map(lambda d, t: d.reshape(6, -1) @ t.ravel(), by_function, tilt)
    found = sum(jax.tree.leaves(along), jnp.zeros(6))
    for slope, change in (found, moved), (by_versine, turned):
        expected = jnp.sum(change(h) - change(-h), 1) / (2.0 * h)
        np.testing.assert_allclose(slope, expected, rtol=1e-5, atol=1e-7)


@each
def test_single_precision_keeps_five_digits(function):
    single = in_dtype(function, jnp.float32)
    angle = jnp.concatenate([jnp.geomspace(1e-7, 3.0, 200), jnp.array([0.0, jnp.pi])])
    angle = jnp.concatenate([angle, jnp.pi - angle])
    at = (2.0 * jnp.sin(0.5 * angle) ** 2).astype(jnp.float32)
    exact = evaluate(in_dtype(single, jnp.float64), at.astype(jnp.float64))
    np.testing.assert_allclose(evaluate(single, at), exact, rtol=2e-5, atol=1e-8)
    np.testing.assert_allclose(
        moments(single, jnp.float32),
        moments(in_dtype(single, jnp.float64)),
        atol=1e-5,
    )


@pytest.mark.parametrize("g", [-0.9, 0.76, 0.9, 0.99, 0.999])
def test_the_halo_around_a_narrow_peak_survives_single_precision(g):
    angle = np.geomspace(1e-6, 1.0, 100)
    ahead = np.zeros((100, 3))
    ahead[:, 2] = 1.0
    seen = np.stack([np.sin(angle), np.zeros(100), np.cos(angle)], 1)
    apart = jax.vmap(versine)(*(jnp.asarray(x, jnp.float32) for x in (seen, ahead)))
    function = in_dtype(phase.HenyeyGreenstein(g), jnp.float32)
    spread = (1.0 - g) ** 2 + 4.0 * g * np.sin(0.5 * angle) ** 2
    exact = 0.25 / np.pi * (1.0 - g**2) / spread**1.5
    np.testing.assert_allclose(evaluate(function, apart)[:, 0], exact, rtol=3e-4)


def textbook_versine(u, g):
    """Henyey-Greenstein's inverse distribution in exact fractions."""
    u, g = Fraction(float(u)), Fraction(float(g))
    if g == 0:
        return float(2 - 2 * u)
    root = (1 - g * g) / (1 - g + 2 * g * u)
    return float(1 - (1 + g * g - root * root) / (2 * g))


@pytest.mark.parametrize("g", [-0.999, -0.5, 0.0, 1e-8, 1e-4, 0.5, 0.999, 0.9999999])
@pytest.mark.parametrize("dtype, rtol", [(jnp.float32, 1e-6), (jnp.float64, 2e-15)])
def test_henyey_greenstein_is_sampled_by_the_textbook(g, dtype, rtol):
    ends = 2.0 ** -np.arange(1.0, 24.0)
    u = np.concatenate([np.linspace(0.0, 1.0, 101), ends, 1.0 - ends]).astype(dtype)
    g = np.asarray(g, dtype)
    found = jax.vmap(quantile, (0, None))(jnp.asarray(u), jnp.asarray(g))
    exact = [textbook_versine(x, g) for x in u]
    np.testing.assert_allclose(found, exact, rtol=rtol)


@pytest.mark.parametrize("make", [phase.HenyeyGreenstein, phase.CornetteShanks])
def test_sampling_is_continuous_where_the_lobe_is_round(make):
    near = [np.asarray(draw(make(g))) for g in (-1e-8, 0.0, 1e-8)]
    for a, b in (near[:2], near[1:]):
        assert 0.0 < np.max(np.abs(a - b)) < 3e-8


draine_share = jax.jit(jax.vmap(lobe_share, (0, None, None)))
draine_cumulative = jax.jit(jax.vmap(cumulative, (0, None, None)))
draines = pytest.mark.parametrize("alpha", [0.0, 1e-8, 1.0, 10.0, 1e6])
lobes = pytest.mark.parametrize("g", [-0.999, -0.5, 0.0, 1e-8, 0.3, 0.9, 0.999])


@draines
@lobes
def test_draine_is_sampled_to_rounding(g, alpha):
    ends = np.geomspace(1e-6, 0.5, 60)
    u = jnp.asarray(np.unique(np.concatenate([[0.0, 1.0], ends, 1.0 - ends])))
    g, alpha = jnp.asarray(g), jnp.asarray(alpha)
    cuts = jax.vmap(quantile, (0, None))(draine_share(u, g, alpha), g)
    x, w = leggauss(16)
    panels = -jnp.diff(cuts)[:, None]
    inner = cuts[1:, None] + 0.5 * panels * (1.0 + x)[None]
    values = jax.vmap(phase.Draine(g, alpha).evaluate, (0, None))(
        inner.ravel(), wavelength
    ).reshape(inner.shape)
    light = jnp.sum(jnp.pi * panels * w[None] * values, 1)
    # A peak behind is no better known than two is, to a rounding of the versine.
    behind = float(jnp.max(values[:60])) * 2e-15
    np.testing.assert_allclose(light, jnp.diff(u), atol=2e-11 + 2.0 * np.pi * behind)
    assert cuts[0] == 2.0 and cuts[-1] == 0.0

    single = [x.astype(jnp.float32) for x in (u, g, alpha)]
    share = draine_share(*single).astype(jnp.float64)
    g, alpha = (x.astype(jnp.float64) for x in single[1:])
    back, _ = draine_cumulative(share, g, alpha)
    np.testing.assert_allclose(back, single[0].astype(jnp.float64), atol=1e-6)


def test_draine_samples_move_as_the_equation_they_solve():
    u, g, alpha = jnp.asarray(0.37), jnp.asarray(0.6), jnp.asarray(2.0)
    found = jax.grad(lobe_share, (0, 1, 2))(u, g, alpha)
    for i, slope in enumerate(found):
        h = 1e-6 * np.eye(3)[i]
        up, down = (
            lobe_share(u + s * h[0], g + s * h[1], alpha + s * h[2]) for s in (1, -1)
        )
        np.testing.assert_allclose(slope, (up - down) / 2e-6, rtol=1e-6)


def assert_alike(one, other):
    at = jnp.linspace(0.0, 2.0, 50)
    np.testing.assert_allclose(evaluate(one, at), evaluate(other, at), rtol=1e-14)
    np.testing.assert_allclose(moments(one), moments(other), atol=1e-14)


def test_rayleigh_is_draine_without_a_lobe():
    assert_alike(phase.Rayleigh(), phase.Draine(0.0, 1.0))


def test_depolarised_rayleigh_is_draine_without_a_lobe():
    # Chandrasekhar's (1 - gamma) / (1 + 3 gamma), with gamma = rho / (2 - rho).
    gamma = 0.2 / (2.0 - 0.2)
    alpha = (1.0 - gamma) / (1.0 + 3.0 * gamma)
    assert_alike(phase.Rayleigh(0.2), phase.Draine(0.0, alpha))


def test_chandrasekhars_rayleigh():
    gamma = 0.0279 / (2.0 - 0.0279)
    cosine = np.linspace(-1.0, 1.0, 50)
    expected = 3.0 / (16.0 * np.pi * (1.0 + 2.0 * gamma))
    expected *= (1.0 + 3.0 * gamma) + (1.0 - gamma) * cosine**2
    found = evaluate(phase.Rayleigh(0.0279), jnp.asarray(1.0 - cosine))[:, 0]
    np.testing.assert_allclose(found, expected, rtol=1e-14)


@pytest.mark.parametrize("g", [-0.9, 0.0, 0.7])
def test_draine_without_alpha_is_henyey_greenstein(g):
    assert_alike(phase.Draine(g, 0.0), phase.HenyeyGreenstein(g))
    draine, lobe = draw(phase.Draine(g, 0.0)), draw(phase.HenyeyGreenstein(g))
    np.testing.assert_array_equal(draine, lobe)


@pytest.mark.parametrize("g, alpha", [(0.5, 3.0), (-0.8, 1.0), (0.95, 0.2)])
def test_draines_mean_cosine(g, alpha):
    mean = g * (1.0 + alpha * (3.0 + 2.0 * g * g) / 5.0)
    mean /= 1.0 + alpha * (1.0 + 2.0 * g * g) / 3.0
    assert abs(moments(phase.Draine(g, alpha))[1, 0] - mean) < 1e-14


def test_cornette_and_shanks_as_published():
    g, cosine = 0.7, np.linspace(-1.0, 1.0, 50)
    expected = 0.375 / np.pi * (1.0 - g * g) / (2.0 + g * g) * (1.0 + cosine**2)
    expected /= (1.0 + g * g - 2.0 * g * cosine) ** 1.5
    found = evaluate(phase.CornetteShanks(g), jnp.asarray(1.0 - cosine))[:, 0]
    np.testing.assert_allclose(found, expected, rtol=1e-13)


def test_the_double_lobe_is_a_sum():
    one, other = phase.HenyeyGreenstein(0.8), phase.HenyeyGreenstein(-0.3)
    both = evaluate(phase.DoubleHenyeyGreenstein(0.8, -0.3, 0.7), points)
    apart = 0.7 * evaluate(one, points) + 0.3 * evaluate(other, points)
    np.testing.assert_allclose(both, apart, rtol=1e-14)


@pytest.mark.parametrize("name, z", [("hazy", 8.0), ("murky", 32.0)])
def test_empirical_mie_as_published(name, z):
    function = getattr(phase.EmpiricalMie, name)()
    cosine = np.linspace(-1.0, 1.0, 50)
    expected = 0.5 + 0.5 * (z + 1.0) * (0.5 + 0.5 * cosine) ** z
    found = evaluate(function, jnp.asarray(1.0 - cosine))[:, 0]
    np.testing.assert_allclose(found, 0.25 / np.pi * expected, rtol=1e-13)
    assert abs(moments(function)[1, 0] - 0.5 * z / (z + 2.0)) < 1e-15


def test_a_ramp_has_mean_cosine_one_third():
    ramp = table([-1.0, 1.0], [0.0, 7.0])
    expected = np.zeros((24, 1))
    expected[:2, 0] = 1.0, 1.0 / 3.0
    np.testing.assert_allclose(moments(ramp), expected, atol=1e-15)
    assert abs(evaluate(ramp, jnp.zeros(1))[0, 0] - 0.5 / np.pi) < 1e-15


def test_a_table_keeps_its_peak_in_single_precision():
    cosine = 1.0 - np.array([2.0, 1.0, 1e-3, 1e-6, 1e-9, 0.0])
    value = np.array([1.0, 1.0, 1.0, 1e3, 1e6, 2e6], np.float32)
    tabulated = phase.Tabulated(cosine, value)
    assert tabulated.versine.dtype == jnp.float32
    at = jnp.array([0.0, 1e-9, 0.5e-6, 1e-6, 1.0], jnp.float32)
    found = evaluate(tabulated, at)[:, 0]
    line = 1e3 + (1e6 - 1e3) * 0.5e-6 / (1e-6 - 1e-9)
    np.testing.assert_allclose(found / found[-1], [2e6, 1e6, line, 1e3, 1.0], rtol=1e-5)


@dtypes
def test_a_table_that_is_dense_ahead_keeps_a_narrow_lobe(dtype):
    """Angles spaced as a square: with even ones the peak of g 0.98 is lost."""
    angle = np.pi * np.linspace(0.0, 1.0, 600) ** 2
    g, versines = 0.98, 2.0 * np.sin(0.5 * angle) ** 2
    lobe = lambda x: (1.0 - g * g) / ((1.0 - g) ** 2 + 2.0 * g * x) ** 1.5 / (4 * np.pi)
    cosine = 1.0 - versines[::-1]
    tabulated = phase.Tabulated(cosine, lobe(versines)[::-1].astype(dtype))
    known = np.asarray(moments(tabulated, dtype))[:4, 0]
    np.testing.assert_allclose(known, g ** np.arange(4), rtol=1e-4)
    between = 2.0 * np.sin(0.25 * (angle[1:] + angle[:-1])) ** 2
    found = evaluate(tabulated, jnp.asarray(between, dtype))[:, 0]
    np.testing.assert_allclose(found, lobe(between), rtol=2e-3)


def test_angles_that_single_precision_cannot_tell_apart_are_one():
    behind = -1.0 + 1e-9 * np.arange(9.0)
    tabulated = in_dtype(table([*behind, 1.0], np.arange(10.0)), jnp.float32)
    at = jnp.array([0.0, 1e-6, 0.5, 1.0, 1.999999, 2.0], jnp.float32)
    found = [evaluate(tabulated, at), slopes(tabulated, at)]
    found += [draw(tabulated, jnp.float32), moments(tabulated, jnp.float32)]
    assert all(bool(jnp.all(jnp.isfinite(x))) for x in jax.tree.leaves(found))


def test_a_table_that_is_dark_at_its_ends_is_sampled_to_the_ends():
    tent = table([-1.0, -0.5, 0.5, 0.8, 1.0], [0.0, 0.0, 1.0, 0.0, 0.0])

    def quantile(u):
        return tent._quantile(u, tent.value[:, 0])

    drawn = [float(quantile(jnp.asarray(u))) for u in (0.0, 0.15 / 0.65, 0.5, 1.0)]
    slope = jax.grad(quantile)(jnp.asarray(0.0))
    np.testing.assert_allclose(drawn[:2], [0.2, 0.5], rtol=1e-15)
    assert 0.5 < drawn[2] < 1.5 and 1.5 <= drawn[3] <= 2.0
    assert bool(jnp.isfinite(slope))


def test_each_wavelength_of_a_table_is_normalised_before_they_are_mixed():
    tabulated = ALL["table by wavelength"]
    alone = [table([-1, -0.2, 0.9, 1], [row[i] for row in ramp]) for i in (0, 1)]
    at = jnp.linspace(0.0, 2.0, 9)
    near, far = (evaluate(function, at) for function in alone)
    expected = np.asarray(near) * [[0.8, 0.5, 0.2]] + np.asarray(far) * [
        [0.2, 0.5, 0.8]
    ]
    np.testing.assert_allclose(evaluate(tabulated, at), expected, rtol=1e-13)


def test_a_table_is_not_known_beyond_its_wavelengths():
    tabulated = ALL["table by wavelength"]
    assert tabulated.domain == (300.0, 800.0)
    beyond = jnp.array([500.0, 801.0])
    with pytest.raises(ValueError, match="`wavelength` must lie within.*800.*got 801"):
        tabulated.evaluate(jnp.asarray(1.0), beyond)
    with pytest.raises(ValueError, match="`wavelength`"):
        tabulated.moments(3, beyond)
    hidden = eqx.filter_jit(tabulated.evaluate)(jnp.asarray(1.0), beyond)
    assert jnp.array_equal(jnp.isnan(hidden), jnp.array([False, True]))


BAD = [
    (lambda: phase.HenyeyGreenstein(1.2), "`g` must be .*; got 1.2"),
    (lambda: phase.HenyeyGreenstein(1.0), "`g` must be .*; got 1.0"),
    (lambda: phase.HenyeyGreenstein(-1.0), "`g` must be .*; got -1.0"),
    (lambda: phase.HenyeyGreenstein(np.nan), "`g` must be .*; got nan"),
    (
        lambda: phase.HenyeyGreenstein(curve([400, 700], [0.5, 1.5])),
        "`g` must be .*; got 1.5",
    ),
    (
        lambda: phase.HenyeyGreenstein(curve([4, 7], [0.5, 0.5], below=3)),
        "`g` must be .*; got 3",
    ),
    (lambda: phase.DoubleHenyeyGreenstein(2.0, 0.0, 0.5), "`forward`.*got 2.0"),
    (lambda: phase.DoubleHenyeyGreenstein(0.5, -2.0, 0.5), "`backward`.*got -2.0"),
    (lambda: phase.DoubleHenyeyGreenstein(0.5, -0.2, 1.5), "`weight`.*got 1.5"),
    (lambda: phase.Draine(1.0, 0.0), "`g` must be .*; got 1.0"),
    (lambda: phase.Draine(0.5, -1.0), "`alpha` must be at least 0; got -1.0"),
    (lambda: phase.Draine(0.5, np.inf), "`alpha` must be .*; got inf"),
    (lambda: phase.CornetteShanks(-1.1), "`g` must be .*; got -1.1"),
    (lambda: phase.EmpiricalMie(-0.5), "`z` must be at least 0; got -0.5"),
    (lambda: phase.Rayleigh(0.6), "`depolarisation` must be 0.0 to 0.5; got 0.6"),
    (lambda: phase.Rayleigh(-0.1), "`depolarisation` .*got -0.1"),
    (lambda: table([-1, 0.9], [1, 1]), "`cosine` must rise from -1 to 1"),
    (lambda: table([-1, 0, 0, 1], [1, 1, 1, 1]), "`cosine` must rise"),
    (lambda: table([1, -1], [1, 1]), "`cosine` must rise"),
    (lambda: table([-1, 1], [1, 1, 1]), r"`value` must have.*\(3,\)"),
    (lambda: table([1], [1]), "two or more `cosine`"),
    (lambda: table([-1, 1], [1, -2]), "at least 0; got -2"),
    (lambda: table([-1, 1], [1, np.inf]), "`value`.*got inf"),
    (lambda: table([-1, 1], [0, 0]), "`value` must be above 0 somewhere"),
    (lambda: table([-1, 1], [[1, 0], [1, 0]], [400, 700]), "above 0 somewh"),
    (lambda: table([-1, 1], [[1, 1], [1, 1]]), "`value` must have"),
    (lambda: table([-1, 1], [1, 1], [400, 700]), "`value` must have"),
    (lambda: table([-1, 1], [[1, 1], [1, 1]], [7, 4]), "`wavelength` must"),
]


@pytest.mark.parametrize("make, message", BAD, ids=[message for _, message in BAD])
def test_bad_parameters_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_parameters_that_are_traced_are_not_refused():
    def ahead(g, alpha, value):
        tabulated = phase.Tabulated(np.array([-1.0, 1.0]), value)
        total = phase.Draine(g, alpha).evaluate(jnp.zeros(()), wavelength)
        return (total + tabulated.evaluate(jnp.zeros(()), wavelength))[0]

    slopes = jax.jit(jax.grad(ahead, (0, 1, 2)))(0.5, 1.0, jnp.array([1.0, 2.0]))
    assert all(bool(jnp.all(jnp.isfinite(x))) for x in slopes)
