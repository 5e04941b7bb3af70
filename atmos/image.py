"""Pictures on disk: OpenEXR and PNG.

A file is written whole or not at all: until it is complete, whatever was there stays.
"""

import contextlib
import math
import numbers
import os
import re
import uuid
import warnings
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
import OpenEXR
from jaxtyping import Array, Float, UInt8
from PIL import Image, ImageDraw, ImageFont, PngImagePlugin

from .colour import AbstractColourSpace, EFFICACY, has_colour, REC709, response


Attribute = str | int | float | tuple[float, ...]
FilePath = str | os.PathLike[str]

_OURS = """adoptedNeutral channels chromaticities chunkCount compression dataWindow
displayWindow emissiveUnits envmap EV lineOrder luminanceWeights name negativeValues
pixelAspectRatio pixelCentres polarisationFrame polarisationHandedness
screenWindowCenter screenWindowWidth spectralLayoutVersion spectralUnits tiles type
units version whiteLuminance""".split()
_LARGEST = {np.float16: 65504.0, np.float32: 3.4028234663852886e38}
_FRAME = {
    "polarisationFrame": "Q, S1: level minus upright; U, S2: rising to the right minus "
    "falling, as the observer sees it; upright is the vertical plane of the view",
}


class Picture(NamedTuple):
    """What an OpenEXR file holds: its channels, and the attributes of its header."""

    channels: dict[str, Float[np.ndarray, "height width"]]
    attributes: dict[str, Any]

    def stack(self, *names: str) -> Float[np.ndarray, "height width channel"]:
        """The named channels as one array."""
        return np.stack([self.channels[name] for name in names], -1)

    def spectrum(
        self, stokes: int = 0
    ) -> tuple[Float[np.ndarray, "wl"], Float[np.ndarray, "height width wl"]]:
        """The wavelengths in nm, and the radiance in W m^-2 sr^-1 nm^-1.

        With `stokes` 1 or 2 Q or U in its place, if the file has them.
        """
        spelt = re.compile(rf"S{stokes}\.(\d+(?:,\d+)?)nm")
        found = [(spelt.fullmatch(name), name) for name in self.channels]
        bands = sorted(
            (float(match[1].replace(",", ".")), name) for match, name in found if match
        )
        names = [name for _, name in bands]
        return np.array([at for at, _ in bands]), self.stack(*names)


def write_exr(
    path: FilePath,
    image: Float[Array | np.ndarray, "height width 3"],
    space: AbstractColourSpace,
    *,
    stokes: Float[Array | np.ndarray, "2 height width 3"] | None = None,
    layers: Mapping[str, Float[Array | np.ndarray, "height width 3"]] | None = None,
    half: bool = False,
    latlong: bool = False,
    attributes: Mapping[str, Attribute] | None = None,
) -> None:
    """Writes the values of a colour space, as `space.from_xyz` gives them.

    The channels are R, G, B in CIE XYZ too: the chromaticities in the header say what
    they are. `whiteLuminance` is the luminance of (1, 1, 1) in cd m^-2, and
    `luminanceWeights` are those of (1, 0, 0), (0, 1, 0), (0, 0, 1). `stokes` are Q and
    U in the same colour space, for layers of these names (Q.R and so on): through a
    polariser at an angle psi one sees (RGB + Q cos 2 psi + U sin 2 psi) / 2. Other
    `layers` have names of their own (variance.R), and are never halves. `attributes`
    come on top; numbers are kept in single precision.

    Raises `ValueError` for values that are not finite, that 16 or 32 bits cannot hold,
    or that no light has (below 0, but for colours outside the gamut of an RGB space:
    these are counted in `negativeValues`), and for attributes that a header cannot
    hold; `OSError` where the file cannot be written. Warns where `half` makes 0 of more
    than 1 % of what is not.
    """
    pixels = np.asarray(image)
    channels = _channels("image", pixels, ["R", "G", "B"], half, space.signed)
    header = _colours(space, pixels) | _projection(latlong) | _extra(attributes)
    if stokes is not None:
        for layer, plane in zip("QU", np.asarray(stokes), strict=True):
            names = [f"{layer}.{x}" for x in "RGB"]
            channels |= _channels("stokes", plane, names, half, True)
        header |= _FRAME
    _write(path, header, channels | _layers(layers, ["R", "G", "B"], space.signed))


def write_spectral_exr(
    path: FilePath,
    radiance: Float[Array | np.ndarray, "height width wl"],
    wavelength: Float[Array | np.ndarray, "wl"],
    *,
    stokes: Float[Array | np.ndarray, "2 height width wl"] | None = None,
    layers: Mapping[str, Float[Array | np.ndarray, "height width wl"]] | None = None,
    half: bool = False,
    latlong: bool = False,
    attributes: Mapping[str, Attribute] | None = None,
) -> None:
    """Writes spectral radiance, W m^-2 sr^-1 nm^-1, one channel a wavelength.

    The layout is that of Fichet, Pacanowski and Wilkie 2021 ("An OpenEXR layout for
    spectral images", JCGT 10(3)). Where the wavelengths cover what the eye sees, there
    is a preview in linear Rec.709 too, with the header of `write_exr`. `stokes` are Q
    and U, for channels S1 and S2; S3 is written too, as the layout wants it, and is 0.
    `layers` are those of `write_exr` (variance.S0.550,000000nm).
    Errors and warnings are those of `write_exr`; `wavelength` has to rise.
    """
    pixels, bands = np.asarray(radiance), np.asarray(wavelength, float)
    names = [f"S0.{f'{at:.6f}'.replace('.', ',')}nm" for at in bands]
    rising = np.all(np.isfinite(bands)) and np.all(np.diff(bands) > 0.0)
    if not rising or np.any(bands <= 0.0) or len(set(names)) < len(names):
        raise ValueError(f"`wavelength` must be positive and rise; got {bands} nm.")
    channels = _channels("radiance", pixels, names, half, False)
    if stokes is not None:
        q, u = np.asarray(stokes)
        for i, plane in enumerate((q, u, np.zeros_like(q)), 1):
            numbered = [f"S{i}{x[2:]}" for x in names]
            channels |= _channels("stokes", plane, numbered, half, True)
    header: dict[str, Any] = {
        "spectralLayoutVersion": "1.0",
        "emissiveUnits": "W.m^-2.sr^-1",
        "spectralUnits": "W m^-2 sr^-1 nm^-1",
        "EV": 0.0,
    }
    if stokes is not None:
        header |= _FRAME | {"polarisationHandedness": "right"}
    if len(bands) > 1 and has_colour(bands):
        weights = np.asarray(REC709.from_xyz(response(jnp.asarray(bands, np.float32))))
        preview = pixels @ weights.astype(pixels.dtype)
        channels |= _channels("radiance", preview, ["R", "G", "B"], half, True)
        header |= _colours(REC709, preview)
    channels |= _layers(layers, names, False)
    _write(path, header | _projection(latlong) | _extra(attributes), channels)


def write_png(
    path: FilePath,
    image: UInt8[Array | np.ndarray, "height width 3"],
    attributes: Mapping[str, str] | None = None,
) -> None:
    """Writes sRGB of 8 bits, with `attributes` as texts; `OSError` where it cannot."""
    texts = PngImagePlugin.PngInfo()
    for name, text in (attributes or {}).items():
        texts.add_itxt(name, text)
    with whole_file(path) as part:
        picture = Image.fromarray(np.ascontiguousarray(image))
        picture.save(part, "PNG", pnginfo=texts, compress_level=4)


def letter(
    image: UInt8[Array | np.ndarray, "height width 3"],
    lines: Mapping[tuple[int, int], str],
    size: int,
) -> UInt8[np.ndarray, "height width 3"]:
    """The picture with lines of black text, each at the column and row it starts at.

    `size` is that of the letters, in pixels.
    """
    picture = Image.fromarray(np.ascontiguousarray(image))
    draw, font = ImageDraw.Draw(picture), ImageFont.load_default(size)
    for place, text in lines.items():
        draw.text(place, text, fill=(0, 0, 0), font=font)
    return np.asarray(picture)


def read_exr(path: FilePath) -> Picture:
    """Reads the first part of an OpenEXR file.

    Raises `FileNotFoundError` where there is none, `ValueError` where it is something
    else or damaged.
    """
    name = os.fspath(path)
    with open(name, "rb"):
        pass
    if not OpenEXR.isOpenExrFile(name):
        raise ValueError(f"`path` must be an OpenEXR file; got '{name}'.")
    try:
        with OpenEXR.File(name, separate_channels=True) as file:
            channels = {key: plane.pixels for key, plane in file.channels().items()}
            header = dict(file.header())
    except (RuntimeError, ValueError) as error:
        raise ValueError(f"`path` must be a whole file; got '{name}'.") from error
    header.pop("channels", None)
    return Picture(channels, header)


@contextlib.contextmanager
def whole_file(path: FilePath) -> Iterator[str]:
    """Gives the name of a new file beside `path`, which becomes `path` in the end.

    If anything goes wrong before, the new file is gone and `path` as it was. Raises
    `OSError` if `path` is something else than a file, or its folder takes no files.
    """
    path = os.path.realpath(path)
    folder = os.path.dirname(path)
    writable = os.path.isfile(path) and os.access(path, os.W_OK)
    if os.path.lexists(path) and not writable:
        raise OSError(f"cannot write '{path}': it is no file that one may replace")
    part = os.path.join(folder, f".atmos-{uuid.uuid4().hex}.part")
    try:
        open(part, "xb").close()
    except OSError as error:
        reason = f"cannot write there: {error.strerror}"
        raise OSError(error.errno, reason, path) from error
    try:
        yield part
        with open(part, "rb+") as stream:
            os.fsync(stream.fileno())
        os.replace(part, path)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(part)
        raise


def _write(
    path: FilePath, header: dict[str, Any], channels: dict[str, np.ndarray]
) -> None:
    kind = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with whole_file(path) as part:
        try:
            # OpenEXR changes the dictionaries that it is given.
            OpenEXR.File(header | kind, dict(channels)).write(part)
        except RuntimeError as error:
            raise OSError(f"cannot write '{os.fspath(path)}': {error}") from error


def _channels(
    argument: str, pixels: np.ndarray, names: list[str], half: bool, signed: bool
) -> dict[str, np.ndarray]:
    if pixels.ndim != 3 or pixels.shape[-1] != len(names) or 0 in pixels.shape:
        raise ValueError(
            f"`{argument}` must have the shape (height, width, {len(names)}); "
            f"got {pixels.shape}."
        )

    def refuse(bad, rule):
        row, column, i = np.argwhere(bad)[0]
        raise ValueError(
            f"`{argument}` must {rule}; got {np.count_nonzero(bad)} such values, the "
            f"first in row {row}, column {column}, channel {names[i]}: "
            f"{pixels[row, column, i]}."
        )

    least, most = float(np.min(pixels)), float(np.max(pixels))  # NaN if any is
    if not (math.isfinite(least) and math.isfinite(most)):
        refuse(~np.isfinite(pixels), "be finite")
    if least < 0.0 and not signed:
        refuse(pixels < 0.0, "not be negative")
    kind = np.float16 if half else np.float32
    largest = max(-least, most)
    if largest > _LARGEST[kind]:
        remedy = "; write floats" if half else ""
        raise ValueError(
            f"`{argument}` must not exceed {_LARGEST[kind]:g}, the largest "
            f"{'half' if half else 'single'}-precision number; got {largest:g}{remedy}."
        )
    # OpenEXR takes the bytes as they lie, whatever the strides say.
    planes = np.ascontiguousarray(np.moveaxis(pixels, -1, 0), kind)
    if half:
        lit = np.count_nonzero(pixels)
        lost = lit - np.count_nonzero(planes)
        if lost > 0.01 * lit:
            warnings.warn(
                f"{lost} of {lit} values are too small for half precision (6e-8) and "
                "become 0; write floats.",
                stacklevel=3,
            )
    return dict(zip(names, planes, strict=True))


def _layers(
    layers: Mapping[str, Array | np.ndarray] | None, names: list[str], signed: bool
) -> dict[str, np.ndarray]:
    found = {}
    for layer, pixels in (layers or {}).items():
        named = [f"{layer}.{x}" for x in names]
        found |= _channels(f"layers[{layer}]", np.asarray(pixels), named, False, signed)
    return found


def _colours(space: AbstractColourSpace, pixels: np.ndarray) -> dict[str, Any]:
    corners = np.concatenate([*space.tables.primaries, space.tables.white])
    weights = space.luminance_weights
    return {
        "chromaticities": tuple(float(x) for x in corners),
        "whiteLuminance": EFFICACY,
        "adoptedNeutral": space.neutral,
        "luminanceWeights": tuple(float(x) for x in weights),
        "units": "W m^-2 sr^-1, as the eye weighs them: (1, 1, 1) is 683 cd/m2",
        "negativeValues": int(np.count_nonzero(pixels < 0.0)),
    }


def _projection(latlong: bool) -> dict[str, Any]:
    if not latlong:
        return {}
    return {
        "envmap": OpenEXR.ENVMAP_LATLONG,
        "pixelCentres": "at half integers: no pixel lies on a pole or on the seam",
    }


def _extra(attributes: Mapping[str, Attribute] | None) -> dict[str, Any]:
    kept = {}
    for name, value in (attributes or {}).items():
        if not 1 <= len(name.encode()) <= 255 or name in _OURS:
            raise ValueError(
                "`attributes` must have names of 1 to 255 bytes that the file itself "
                f"does not need; got '{name}'."
            )
        if isinstance(value, numbers.Integral):
            kept[name] = int(value)
            fits = -(2**31) <= value < 2**31
        elif isinstance(value, numbers.Real):
            kept[name] = float(value)
            fits = abs(float(value)) <= _LARGEST[np.float32]
        elif isinstance(value, tuple):
            kept[name] = tuple(float(x) for x in value)
            fits = len(value) in (2, 3) and bool(np.all(np.isfinite(value)))
        else:
            kept[name] = value
            fits = isinstance(value, str)
        if not fits:
            raise ValueError(
                "`attributes` must be texts, numbers of 32 bits, or two or three of "
                f"them; got {name} = {value!r}."
            )
    return kept
