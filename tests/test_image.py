import os
import re
import resource

import jax.numpy as jnp
import numpy as np
import OpenEXR
import pytest
from PIL import Image

from atmos.colour import ACES2065_1, ACESCG, REC709, response, XYZ
from atmos.image import (
    read_exr,
    whole_file,
    write_exr,
    write_png,
    write_spectral_exr,
)


RNG = np.random.default_rng(3)
IMAGE = RNG.random((5, 7, 3)).astype(np.float32) * 1e4
WAVELENGTH = np.arange(380.0, 781.0, 20.0)
SPECTRA = RNG.random((5, 7, WAVELENGTH.size)).astype(np.float32)


def test_other_layers_have_names_of_their_own_and_are_never_halves(path):
    tiny = 1e-12 * IMAGE
    write_exr(path, IMAGE, REC709, half=True, layers={"variance": tiny})
    picture = read_exr(path)
    assert picture.channels["R"].dtype == np.float16
    found = picture.stack("variance.R", "variance.G", "variance.B")
    np.testing.assert_array_equal(found, tiny)
    bands = WAVELENGTH[:2]
    write_spectral_exr(
        path, SPECTRA[..., :2], bands, layers={"variance": 2.0 * SPECTRA[..., :2]}
    )
    picture = read_exr(path)
    assert list(picture.spectrum()[0]) == list(bands)
    found = picture.channels["variance.S0.400,000000nm"]
    np.testing.assert_array_equal(found, 2.0 * SPECTRA[..., 1])
    with pytest.raises(ValueError, match=r"`layers\[variance\]` must be finite"):
        write_exr(path, IMAGE, REC709, layers={"variance": np.nan * IMAGE})


@pytest.fixture
def path(tmp_path):
    return tmp_path / "sky.exr"


def read_rgb(path):
    return read_exr(path).stack("R", "G", "B")


def test_floats_come_back_exactly(path):
    write_exr(path, IMAGE, ACESCG)
    found = read_rgb(path)
    assert found.dtype == np.float32
    np.testing.assert_array_equal(found, IMAGE)


def test_halves_come_back_as_halves(path):
    write_exr(path, IMAGE, ACESCG, half=True)
    found = read_rgb(path)
    assert found.dtype == np.float16
    np.testing.assert_array_equal(found, IMAGE.astype(np.float16))


@pytest.mark.parametrize(
    "image",
    [
        np.asfortranarray(IMAGE),
        IMAGE[::-1, ::-1],
        IMAGE.transpose(1, 0, 2),
        IMAGE[::2, 1:6, ::-1],
        np.moveaxis(np.ascontiguousarray(np.moveaxis(IMAGE, -1, 0)), 0, -1),
        IMAGE.astype(np.float64),
        np.broadcast_to(IMAGE[:1, :1], IMAGE.shape),
        jnp.asarray(IMAGE)[:, ::-1],
        IMAGE.astype(">f4"),
    ],
    ids="fortran flipped transposed cut planes double repeated jax swapped".split(),
)
def test_pixels_are_written_wherever_they_lie(path, image):
    write_exr(path, image, ACESCG)
    np.testing.assert_array_equal(read_rgb(path), np.asarray(image, np.float32))


@pytest.mark.parametrize(
    ("space", "identity"),
    [
        (REC709, "lin_rec709_scene"),
        (ACESCG, "lin_ap1_scene"),
        (ACES2065_1, "lin_ap0_scene"),
        (XYZ, None),
    ],
)
def test_the_header_says_what_the_colours_are(path, space, identity):
    write_exr(path, IMAGE, space)
    header = read_exr(path).attributes
    corners = header["chromaticities"]
    assert OpenEXR.chromaticitiesToColorInteropID(corners) == identity
    assert header["whiteLuminance"] == 683.0
    np.testing.assert_allclose(header["adoptedNeutral"], space.neutral, rtol=1e-7)
    luminance = np.asarray(space.to_xyz(jnp.asarray(IMAGE, float)))[..., 1]
    np.testing.assert_allclose(IMAGE @ header["luminanceWeights"], luminance, rtol=1e-5)
    assert header["compression"] == OpenEXR.ZIP_COMPRESSION
    assert "envmap" not in header


def test_xyz_has_the_chromaticities_of_xyz(path):
    # Red (1, 0), green (0, 1), blue (0, 0), white (1/3, 1/3), as in OpenEXR's samples.
    write_exr(path, IMAGE, XYZ)
    corners = read_exr(path).attributes["chromaticities"]
    np.testing.assert_allclose(corners, [1, 0, 0, 1, 0, 0, 1 / 3, 1 / 3], rtol=1e-7)


def test_a_dome_says_so(path):
    write_exr(path, IMAGE, ACESCG, latlong=True)
    header = read_exr(path).attributes
    assert header["envmap"] == OpenEXR.ENVMAP_LATLONG
    assert "half integers" in header["pixelCentres"]


def test_attributes_come_back(path):
    scene = 'title = "Über den Wolken"\n[sun]\nelevation = 12.5\n'
    given = {
        "scene": scene,
        "elevation": 12.5,
        "samples": 64,
        "exposure": np.float32(0.5),
        "position": (0.0, 0.0, 2.0),
        "a name of more than thirty-one letters": "long",
    }
    write_exr(path, IMAGE, ACESCG, attributes=given)
    header = read_exr(path).attributes
    for name in given.keys() - {"position"}:
        assert header[name] == given[name]
    np.testing.assert_array_equal(header["position"], given["position"])


@pytest.mark.parametrize(
    "attributes",
    [
        {"chromaticities": "mine"},
        {"": "nameless"},
        {"n" * 256: "too long"},
        {"n": 2**31},
        {"n": float("nan")},
        {"n": 1e39},
        {"n": (1.0, float("inf"))},
        {"n": (1.0, 2.0, 3.0, 4.0)},
    ],
)
def test_attributes_that_a_header_cannot_hold_are_refused(path, attributes):
    with pytest.raises(ValueError, match="`attributes` must"):
        write_exr(path, IMAGE, ACESCG, attributes=attributes)
    assert not path.exists()


def test_spectra_come_back(path):
    write_spectral_exr(path, SPECTRA, WAVELENGTH)
    wavelength, radiance = read_exr(path).spectrum()
    np.testing.assert_array_equal(wavelength, WAVELENGTH)
    np.testing.assert_array_equal(radiance, SPECTRA)


def test_spectra_are_sorted_by_number(path):
    wavelength = np.array([95.5, 380.123456, 990.0, 1000.0, 10000.0])
    write_spectral_exr(path, SPECTRA[..., :5], wavelength)
    found, radiance = read_exr(path).spectrum()
    np.testing.assert_array_equal(found, wavelength)
    np.testing.assert_array_equal(radiance, SPECTRA[..., :5])


def test_spectra_are_in_the_layout_of_fichet(path):
    write_spectral_exr(path, SPECTRA, WAVELENGTH, half=True)
    picture = read_exr(path)
    assert picture.attributes["spectralLayoutVersion"] == "1.0"
    assert picture.attributes["emissiveUnits"] == "W.m^-2.sr^-1"
    assert picture.attributes["EV"] == 0.0
    assert "S0.540,000000nm" in picture.channels
    # The expression by which the reference reader knows spectral channels.
    known = re.compile(
        r"^((S([0-3]))|T)\.(\d*,?\d*([Ee][+-]?\d+)?)"
        r"(Y|Z|E|P|T|G|M|k|h|da|d|c|m|u|n|p)?(m|Hz)$"
    )
    spectral = [name for name in picture.channels if known.match(name)]
    assert len(spectral) == WAVELENGTH.size
    assert sorted(picture.channels.keys() - spectral) == ["B", "G", "R"]


def test_spectra_come_with_a_picture_to_look_at(path):
    write_spectral_exr(path, SPECTRA, WAVELENGTH)
    expected = REC709.from_xyz(jnp.asarray(SPECTRA) @ response(jnp.float32(WAVELENGTH)))
    np.testing.assert_allclose(read_rgb(path), expected, rtol=1e-5, atol=1e-5)
    assert read_exr(path).attributes["whiteLuminance"] == 683.0


def test_what_no_eye_sees_has_no_preview(path):
    write_spectral_exr(path, SPECTRA[..., :2], np.array([900.0, 1000.0]))
    assert len(read_exr(path).channels) == 2


@pytest.mark.parametrize("wavelength", [[500.0, 500.0], [600.0, 500.0], [0.0, 500.0]])
def test_wavelengths_have_to_rise(path, wavelength):
    with pytest.raises(ValueError, match="`wavelength` must be positive and rise"):
        write_spectral_exr(path, SPECTRA[..., :2], np.array(wavelength))


@pytest.mark.parametrize("shape", [(5, 7), (5, 7, 4), (0, 7, 3)])
def test_pictures_of_another_shape_are_refused(path, shape):
    with pytest.raises((ValueError, TypeError)):
        write_exr(path, np.zeros(shape, np.float32), ACESCG)
    with pytest.raises((ValueError, TypeError)):
        write_spectral_exr(path, np.zeros(shape, np.float32), np.array([5.0, 6.0]))


def test_the_sun_does_not_fit_a_half(path):
    image = IMAGE.copy()
    image[1, 2, 0] = 2e7
    with pytest.raises(ValueError, match=r"exceed 65504, .* got 2e\+07; write floats"):
        write_exr(path, image, ACESCG, half=True)
    image[1, 2, 0] = 65504.0
    write_exr(path, image, ACESCG, half=True)
    assert read_rgb(path)[1, 2, 0] == 65504.0


def test_what_does_not_fit_a_float_is_refused(path):
    with pytest.raises(ValueError, match="single-precision"):
        write_exr(path, np.full((2, 2, 3), 1e39), ACESCG)


def test_night_in_halves_is_warned_of(path):
    with pytest.warns(UserWarning, match=r"105 of 105 values are too small .* floats"):
        write_exr(path, 1e-12 * IMAGE, ACESCG, half=True)
    write_exr(path, 0.0 * IMAGE, ACESCG, half=True)  # black is black
    write_exr(path, 1e-12 * IMAGE, ACESCG)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_numbers_that_are_none_are_refused(path, bad):
    image = IMAGE.copy()
    image[3, 4, 1] = image[4, 0, 0] = bad
    message = "finite; got 2 such values, the first in row 3, column 4, channel G"
    with pytest.raises(ValueError, match=message):
        write_exr(path, image, REC709)
    assert not path.exists()


def test_negative_light_is_refused(path):
    image, spectra = IMAGE.copy(), SPECTRA.copy()
    image[3, 4, 1] = spectra[0, 6, 2] = -1e-9
    with pytest.raises(
        ValueError, match="not be negative; got 1 such values, the first"
    ):
        write_exr(path, image, XYZ)
    with pytest.raises(ValueError, match="column 6, channel S0.420,000000nm"):
        write_spectral_exr(path, spectra, WAVELENGTH)


def test_colours_outside_the_gamut_are_kept_and_counted(path):
    image = IMAGE.copy()
    image[:2, 4, 2] = -0.09
    write_exr(path, image, REC709)
    np.testing.assert_array_equal(read_rgb(path), image)
    assert read_exr(path).attributes["negativeValues"] == 2


def only(path):
    return os.listdir(path.parent) == [path.name]


def test_an_interrupted_file_leaves_the_old_one(path):
    path.write_text("old")
    with pytest.raises(KeyboardInterrupt), whole_file(path) as part:
        with open(part, "w") as stream:
            stream.write("new, but not all of it")
        raise KeyboardInterrupt
    assert path.read_text() == "old" and only(path)


def test_a_full_disk_leaves_the_old_file(path):
    noise = RNG.random((256, 256, 3)).astype(np.float32)
    write_exr(path, IMAGE, ACESCG)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, hard))
    try:
        with pytest.raises(OSError, match="cannot write .*sky.exr"):
            write_exr(path, noise, ACESCG)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    np.testing.assert_array_equal(read_rgb(path), IMAGE)
    assert only(path)


def test_a_refused_picture_leaves_the_old_file(path):
    path.write_text("old")
    with pytest.raises(ValueError):
        write_exr(path, np.nan * IMAGE, ACESCG)
    assert path.read_text() == "old" and only(path)


def test_a_new_file_takes_the_place_of_the_old(path):
    path.write_text("old")
    write_exr(path, IMAGE, ACESCG)
    write_exr(path, 2.0 * IMAGE, ACESCG)
    np.testing.assert_array_equal(read_rgb(path), 2.0 * IMAGE)
    assert only(path)


def test_a_link_is_followed(path, tmp_path):
    target = tmp_path / "elsewhere" / "real.exr"
    target.parent.mkdir()
    path.symlink_to(target)
    target.write_text("old")
    write_exr(path, IMAGE, ACESCG)
    assert path.is_symlink()
    np.testing.assert_array_equal(read_rgb(target), IMAGE)


def test_places_that_take_no_file_are_named(tmp_path):
    with pytest.raises(FileNotFoundError, match="No such .*missing/sky.exr"):
        write_exr(tmp_path / "missing" / "sky.exr", IMAGE, ACESCG)
    (tmp_path / "file").write_text("")
    with pytest.raises(NotADirectoryError, match="file/sky.exr"):
        write_exr(tmp_path / "file" / "sky.exr", IMAGE, ACESCG)
    for nothing in tmp_path, "/dev/null":
        with pytest.raises(OSError, match="no file that one may replace"):
            write_exr(nothing, IMAGE, ACESCG)


def test_reading_what_is_no_picture(path, capfd):
    with pytest.raises(FileNotFoundError):
        read_exr(path)
    path.write_text("not a picture")
    with pytest.raises(ValueError, match="must be an OpenEXR file; got .*sky.exr"):
        read_exr(path)
    write_exr(path, IMAGE, ACESCG)
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(ValueError, match="must be a whole file; got .*sky.exr"):
        read_exr(path)
    capfd.readouterr()  # what OpenEXR itself says of it


def test_png_holds_the_bytes_and_the_words(tmp_path):
    image = RNG.integers(0, 256, (4, 6, 3)).astype(np.uint8)
    path = tmp_path / "sky.png"
    write_png(path, image[:, ::-1], {"exposure": "EV 14.2 (log mean)"})
    with Image.open(path) as picture:
        np.testing.assert_array_equal(np.asarray(picture), image[:, ::-1])
        assert picture.text["exposure"] == "EV 14.2 (log mean)"
    write_png(path, jnp.asarray(image))
    assert only(path)
    with pytest.raises(FileNotFoundError):
        write_png(tmp_path / "missing" / "sky.png", image)
