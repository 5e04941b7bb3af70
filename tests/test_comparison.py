import jax.numpy as jnp
import numpy as np
import pytest

from atmos.colour import REC709
from atmos.comparison import compare, relative, side_by_side


GREY = np.array([[[0.9505, 1.0, 1.089]]]) * np.linspace(1.0, 2.0, 20).reshape(4, 5, 1)


def test_a_picture_does_not_differ_from_itself():
    assert tuple(compare(GREY, GREY)) == (0.0,) * 6


def test_a_brighter_picture_differs_by_how_much_brighter_it_is():
    found = compare(GREY, 1.25 * GREY)
    np.testing.assert_allclose(found[:4], 0.25, rtol=1e-12)
    np.testing.assert_allclose(found[4:], 0.0, atol=1e-12)
    assert "mean +25.00%" in str(found)


def test_figures_count_solid_angles():
    other, weight = GREY.copy(), np.ones((4, 5))
    other[0] *= 3.0
    weight[0] = 0.0
    assert tuple(compare(GREY, other, weight)) == (0.0,) * 6
    weight[0] = 1.0
    found = compare(GREY, other, weight)
    np.testing.assert_allclose(found.mean, 2.0 / 4.0)
    np.testing.assert_allclose(found[1:4], [0.0, 2.0, 2.0])


def test_what_is_dark_is_relative_to_a_thousandth_of_what_is_bright():
    one, other = GREY.copy(), GREY.copy()
    one[0, 0], other[0, 0] = 0.0, 1e-3 * GREY[0, 0]
    np.testing.assert_allclose(relative(one, other)[0, 0], 0.5)


def test_a_sun_in_both_pictures_does_not_hide_how_their_skies_differ():
    one = np.tile(GREY, (30, 30, 1))
    other = 1.25 * one
    one[50, 60] = other[50, 60] = 1e6 * GREY[0, 0]
    found = compare(one, other)
    np.testing.assert_allclose([found.median, found.most], 0.25, rtol=1e-12)
    assert relative(one, other)[50, 60] == 0.0


def test_colours_differ_as_the_cie_says():
    # Rec. 709's red, x 0.64, y 0.33, and D65: u', v' are 0.4507, 0.5229 and 0.1978,
    # 0.4683 (CIE 15).
    red = np.asarray(REC709.to_xyz(jnp.array([1.0, 0.0, 0.0])))
    white = np.asarray(REC709.to_xyz(jnp.ones(3)))
    found = compare(np.tile(white, (2, 2, 1)), np.tile(red, (2, 2, 1)))
    distance = np.hypot(0.4507 - 0.1978, 0.5229 - 0.4683)
    np.testing.assert_allclose([found.colour, found.most_colour], distance, rtol=1e-3)


def test_the_page_shows_red_where_the_second_is_brighter():
    shape = (32, 64, 3)
    one = np.ones(shape) * 1e4
    other = one * np.where(np.arange(64) < 32, 0.5, 1.5)[None, :, None]
    page = side_by_side(one, other, ("a", "b"), 15.0, ("a line",), 0.5)
    assert page.dtype == np.uint8 and page.shape[1] > 3 * 64
    panel = page[:, -(64 + 5) : -5].astype(int)
    middle = panel[22:54]
    assert np.all(middle[4, 10] == (33, 102, 172))
    assert np.all(middle[4, 50] == (178, 24, 43))


def test_pictures_that_cannot_be_compared_are_refused():
    with pytest.raises(ValueError, match="`other` must have the shape of `one`"):
        compare(GREY, GREY[:2])
    with pytest.raises(ValueError, match="`one` must have light"):
        relative(0.0 * GREY, GREY)
    with pytest.raises(ValueError, match="`other` must be finite"):
        relative(GREY, GREY * np.nan)
