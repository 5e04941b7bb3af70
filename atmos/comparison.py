"""Two pictures of a sky beside each other, and how they differ."""

import math
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, UInt8

from .colour import preview
from .image import letter


_DARK = 1e-3  # of bright pixels: differences are relative to that at least
_BRIGHT = 0.99  # of all that is lit so much is darker: the sun's disk is none of it
# Where the second picture is darker, alike, brighter: sRGB of 8 bits.
_DARKER, _ALIKE, _BRIGHTER = (33, 102, 172), (247, 247, 247), (178, 24, 43)
_STEPS = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0]

XYZ = Float[Array | np.ndarray, "_ _ 3"]
Weight = Float[Array | np.ndarray, "_ _"]


class Difference(NamedTuple):
    """Figures of a comparison, by solid angle.

    `mean`, `median`, `most` (95 of 100 directions differ less) and `largest` are of the
    luminance of the second picture relative to the first, the last three without their
    sign; `colour` and `most_colour` are the median and the same of the distance in the
    CIE 1976 chromaticities u', v', of which the eye tells apart about 0.004.
    """

    mean: float
    median: float
    most: float
    largest: float
    colour: float
    most_colour: float

    def __str__(self) -> str:
        return (
            f"luminance: mean {self.mean:+.2%}, median {self.median:.2%}, "
            f"95 of 100 {self.most:.2%}, largest {self.largest:.2%}; "
            f"colour: median {self.colour:.4f}, 95 of 100 {self.most_colour:.4f} u'v'"
        )


def relative(one: XYZ, other: XYZ) -> Float[np.ndarray, "height width"]:
    """How much brighter the second is, relative to the first.

    To a thousandth of its bright pixels, but for the brightest hundredth, where that is
    more: so a sun's disk hides nothing. Raises `ValueError` unless the pictures are
    alike in size, finite, and the first has light.
    """
    one, other = _checked(one, other)
    first, second = one[..., 1], other[..., 1]
    if not first.max() > 0.0:
        raise ValueError("`one` must have light somewhere; it is black.")
    return (second - first) / np.maximum(first, _DARK * _bright(first))


def compare(one: XYZ, other: XYZ, weight: Weight | None = None) -> Difference:
    """The figures of two pictures in CIE XYZ; `weight` is the solid angle of a pixel.

    Pixels of weight 0 do not count. Errors are those of `relative`.
    """
    shape = one.shape[:2]
    solid = np.ones(shape) if weight is None else np.asarray(weight, float)
    counted = np.broadcast_to(solid, shape).ravel()
    change = relative(one, other).ravel()
    one, other = _checked(one, other)
    darker = np.minimum(one[..., 1], other[..., 1]).ravel()
    lit = darker > _DARK * _bright(one[..., 1])
    apart = np.linalg.norm(_chromaticity(one) - _chromaticity(other), axis=-1).ravel()
    seen = counted * lit
    return Difference(
        mean=float(np.sum(change * counted) / np.sum(counted)),
        median=_quantile(np.abs(change), counted, 0.5),
        most=_quantile(np.abs(change), counted, 0.95),
        largest=float(np.max(np.abs(change) * (counted > 0.0))),
        colour=_quantile(apart, seen, 0.5) if seen.any() else 0.0,
        most_colour=_quantile(apart, seen, 0.95) if seen.any() else 0.0,
    )


def side_by_side(
    one: XYZ,
    other: XYZ,
    names: tuple[str, str],
    exposure: float,
    lines: tuple[str, ...] = (),
    limit: float | None = None,
) -> UInt8[np.ndarray, "rows columns 3"]:
    """Both pictures at one exposure, their relative difference, and lines of text.

    Red is where the second is brighter, blue where it is darker; the scale below runs
    to `limit` either way, or to what most of the picture keeps within.
    """
    change = relative(one, other)
    if limit is None:
        wanted = float(np.quantile(np.abs(change), 0.98))
        limit = next((x for x in _STEPS if x >= wanted), _STEPS[-1])
    height, width = change.shape
    size = max(11, min(20, width // 28))
    gap, row = size // 2, 2 * size
    shown = [preview(jnp.asarray(x), exposure) for x in (one, other)]
    panels = [*(np.asarray(x) for x in shown), _tinted(change / limit)]
    bar = _tinted(np.broadcast_to(np.linspace(-1.0, 1.0, width), (size, width)))

    text_width = max((len(x) for x in lines), default=0) * size * 6 // 10
    columns = max(3 * width + 4 * gap, text_width + 2 * gap)
    rows = row + height + gap + size + row + row * len(lines) + gap
    page = np.full((rows, columns, 3), 255, np.uint8)
    texts = {}
    titles = (*names, f"{names[1]} relative to {names[0]}")
    for i, (panel, title) in enumerate(zip(panels, titles, strict=True)):
        left = gap + i * (width + gap)
        page[row : row + height, left : left + width] = panel
        texts[left, size // 3] = _shortened(title, width, size)
    top, left = row + height + gap, gap + 2 * (width + gap)
    page[top : top + size, left : left + width] = bar
    for share, text in ((0.0, f"-{limit:.0%}"), (0.5, "0"), (1.0, f"+{limit:.0%}")):
        place = left + round(share * (width - len(text) * size * 0.6))
        texts[place, top + size + size // 4] = text
    for i, text in enumerate(lines):
        texts[gap, top + size + row + i * row] = text
    return letter(page, texts, size)


def _bright(luminance: np.ndarray) -> float:
    """The brightest pixel, but for the brightest hundredth of those that are lit."""
    lit = luminance[luminance > 0.0]
    return float(np.quantile(lit, _BRIGHT, method="higher"))


def _checked(one: XYZ, other: XYZ) -> tuple[np.ndarray, np.ndarray]:
    one, other = np.asarray(one, float), np.asarray(other, float)
    if one.shape != other.shape:
        raise ValueError(
            f"`other` must have the shape of `one`, {one.shape}; got {other.shape}."
        )
    for name, picture in {"one": one, "other": other}.items():
        if not np.all(np.isfinite(picture)):
            raise ValueError(f"`{name}` must be finite.")
    return one, other


def _chromaticity(xyz: np.ndarray) -> Float[np.ndarray, "height width 2"]:
    x, y, z = np.moveaxis(xyz, -1, 0)
    below = x + 15.0 * y + 3.0 * z
    below = np.where(below > 0.0, below, math.inf)
    return np.stack([4.0 * x / below, 9.0 * y / below], -1)


def _quantile(values: np.ndarray, weight: np.ndarray, share: float) -> float:
    order = np.argsort(values)
    total = np.cumsum(weight[order])
    at = np.searchsorted(total, share * total[-1])
    return float(values[order][min(at, values.size - 1)])


def _tinted(change: Float[np.ndarray, "height width"]) -> UInt8[np.ndarray, "..."]:
    share = np.clip(np.abs(change), 0.0, 1.0)[..., None]
    end = np.where(change[..., None] < 0.0, _DARKER, _BRIGHTER)
    return np.round(np.array(_ALIKE) * (1.0 - share) + end * share).astype(np.uint8)


def _shortened(text: str, width: int, size: int) -> str:
    most = max(4, int(width / (0.6 * size)))
    return text if len(text) <= most else text[: most - 3] + "..."
