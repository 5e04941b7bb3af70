"""From spectra to colour: CIE XYZ, linear colour spaces, and a preview for the eye.

XYZ is absolute: Y is the luminance in cd m^-2. The values of a colour space, those that
go into files, are XYZ divided by 683 lm/W and seen through a matrix: radiances in
W m^-2 sr^-1, weighted as the eye weighs them. (1, 1, 1) is then always the white D65 of
683 cd m^-2, in CIE XYZ the equal-energy white of that luminance.
"""

import abc

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, ArrayLike, Float, UInt8

from .quantity import Number, Wavelength
from .reference import matching_functions, rgb_tables, RGBTables


EFFICACY = 683.0  # lm W^-1, of light of 555 nm
D65 = (0.3127, 0.3290)  # x, y of the daylight that is to look neutral
_KNEE = 0.5


def response(wavelength: Wavelength) -> Float[Array, "wl 3"]:
    """The weights that turn radiances into CIE 1931 XYZ: `radiance @ response`.

    Radiance in W m^-2 sr^-1 nm^-1 gives Y in cd m^-2, irradiance gives lux. Each
    wavelength stands for the band to the midpoints of its neighbours (the first and the
    last reach outwards as far as inwards); the matching functions are summed over that
    band at 1 nm, and scaled so that light of one radiance at all wavelengths has the
    XYZ of the full sums from 360 to 830 nm.

    Raises `ValueError` unless there are two or more rising wavelengths whose bands hold
    90 % of each matching function.
    """
    if not isinstance(wavelength, Tracer):
        _check(np.asarray(wavelength, float))
    return _response(wavelength)


@jax.jit
def _response(wavelength: Wavelength) -> Float[Array, "wl 3"]:
    nm, observer = matching_functions()
    first, last = wavelength[:2], wavelength[-2:]
    edges = jnp.concatenate(
        [
            1.5 * first[:1] - 0.5 * first[1:],
            0.5 * (wavelength[1:] + wavelength[:-1]),
            1.5 * last[1:] - 0.5 * last[:1],
        ]
    )
    cells = jnp.asarray(nm, wavelength.dtype)[None, :]
    low = jnp.maximum(edges[:-1, None], cells - 0.5)
    high = jnp.minimum(edges[1:, None], cells + 0.5)
    observed = jnp.asarray(observer, wavelength.dtype)
    weights = jnp.matmul(jnp.maximum(high - low, 0.0), observed, precision="highest")
    whole = jnp.sum(observed, 0) / jnp.sum(weights, 0)
    return EFFICACY * weights * whole[None, :]


def has_colour(wavelength: Float[np.ndarray, "wl"]) -> bool:
    """Whether the bands of two or more wavelengths cover what the eye sees.

    That is 90 % of each of the three matching functions: about 430 to 670 nm.
    """
    nm, observer = matching_functions()
    low = 1.5 * wavelength[0] - 0.5 * wavelength[1]
    high = 1.5 * wavelength[-1] - 0.5 * wavelength[-2]
    seen = observer[(nm >= low) & (nm <= high)].sum(0) / observer.sum(0)
    return bool(np.all(seen >= 0.9))


def to_xyz(
    radiance: Float[Array, "*batch wl"], wavelength: Wavelength
) -> Float[Array, "*batch 3"]:
    """CIE 1931 XYZ, Y in cd m^-2. Errors are those of `response`."""
    return jnp.matmul(radiance, response(wavelength), precision="highest")


class AbstractColourSpace(eqx.Module):
    """Three numbers for a colour, linear in the light.

    Being linear, a space may look at the weights themselves:
    `radiance @ space.from_xyz(response(wavelength))` is one matrix product.
    """

    @property
    @abc.abstractmethod
    def tables(self) -> RGBTables:
        """The chromaticities, and the matrix from XYZ."""

    @property
    @abc.abstractmethod
    def neutral(self) -> tuple[float, float]:
        """The x, y in this space of the light that is to look neutral, D65."""

    @property
    @abc.abstractmethod
    def signed(self) -> bool:
        """Whether visible colours may have values below 0."""

    @jax.jit
    def from_xyz(self, xyz: Float[Array, "*batch 3"]) -> Float[Array, "*batch 3"]:
        """The values of a colour; below 0 where it lies outside the gamut."""
        matrix = jnp.asarray(self.tables.matrix.T / EFFICACY, xyz.dtype)
        return jnp.matmul(xyz, matrix, precision="highest")

    @jax.jit
    def to_xyz(self, values: Float[Array, "*batch 3"]) -> Float[Array, "*batch 3"]:
        """Back from `from_xyz`: Y is in cd m^-2."""
        matrix = np.linalg.inv(self.tables.matrix.T / EFFICACY)
        return jnp.matmul(
            values, jnp.asarray(matrix, values.dtype), precision="highest"
        )

    @property
    def luminance_weights(self) -> Float[np.ndarray, "3"]:
        """The luminance of (1, 0, 0), (0, 1, 0) and (0, 0, 1), in cd m^-2.

        They add to 683. In the ACES spaces they are not those of the primaries, because
        of the adaptation (see `atmos.reference.RGBTables`).
        """
        return EFFICACY * np.linalg.inv(self.tables.matrix)[1]


class LinearRGB(AbstractColourSpace):
    """A linear RGB space, by its name in `atmos.reference.RGB_SPACES`."""

    name: str = eqx.field(static=True)

    @property
    def tables(self) -> RGBTables:
        return rgb_tables(self.name)

    @property
    def neutral(self) -> tuple[float, float]:
        x, y = self.tables.white
        return float(x), float(y)

    @property
    def signed(self) -> bool:
        return True


class CIEXYZ(AbstractColourSpace):
    """The tristimulus values X, Y, Z themselves, on the scale of the RGB spaces."""

    @property
    def tables(self) -> RGBTables:
        corners = np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]])
        return RGBTables(corners, np.full(2, 1.0 / 3.0), np.eye(3))

    @property
    def neutral(self) -> tuple[float, float]:
        return D65

    @property
    def signed(self) -> bool:
        return False


REC709 = LinearRGB("ITU-R BT.709")
ACESCG = LinearRGB("ACEScg")
ACES2065_1 = LinearRGB("ACES2065-1")
XYZ = CIEXYZ()
COLOUR_SPACES = {
    "rec709": REC709,
    "acescg": ACESCG,
    "aces2065-1": ACES2065_1,
    "xyz": XYZ,
}


@jax.jit
def automatic_exposure(xyz: Float[Array, "*batch 3"]) -> Number:
    """The exposure value (ISO 100) that suits a picture of a sky.

    A meter with the constant K = 12.5 cd s m^-2 reads EV where the luminance is
    2**(EV - 3) cd m^-2: 15 in the sun, 0 in late twilight, -6 under the stars. It is
    held to what is brighter than three quarters of what is lit: the middle of the sky,
    where the other half of the picture is ground.
    """
    luminance = xyz[..., 1].ravel()
    few = luminance[:: -(-luminance.size // 2**16)]
    lit = few > 0.0
    metered = jnp.nanpercentile(jnp.where(lit, few, jnp.nan), 75.0)
    return jnp.log2(jnp.where(jnp.any(lit), metered, 1.0)) + 3.0


@jax.jit
def preview(
    xyz: Float[Array, "*batch 3"], exposure: ArrayLike
) -> UInt8[Array, "*batch 3"]:
    """A picture to look at: sRGB of 8 bits.

    What a meter reads as `exposure` (the EV of `automatic_exposure`) becomes middle
    grey, 0.18 of white. Colours outside the gamut are drawn towards the grey of their
    own luminance until they are inside; above half of white a hyperbola bends the
    scale, so that the sun burns out softly.
    """
    gain = 0.18 * EFFICACY * jnp.exp2(3.0 - jnp.asarray(exposure, xyz.dtype))
    light = gain * REC709.from_xyz(xyz)
    grey = gain / EFFICACY * xyz[..., 1:2]
    lowest = jnp.minimum(jnp.min(light, -1, keepdims=True), 0.0)
    inside = grey + (light - grey) * jnp.where(
        lowest < 0.0, grey / (grey - lowest), 1.0
    )
    beyond = jnp.maximum(inside - _KNEE, 0.0) / (1.0 - _KNEE)
    shown = jnp.minimum(inside, _KNEE) + (1.0 - _KNEE) * beyond / (1.0 + beyond)
    shown = jnp.clip(shown, 0.0, 1.0)
    curve = 1.055 * jnp.maximum(shown, 0.0031308) ** (1.0 / 2.4) - 0.055
    encoded = jnp.where(shown <= 0.0031308, 12.92 * shown, curve)
    return jnp.floor(255.0 * encoded + 0.5).astype(jnp.uint8)


def _check(wavelength: Float[np.ndarray, "wl"]) -> None:
    rising = np.all(np.isfinite(wavelength)) and np.all(np.diff(wavelength) > 0.0)
    if wavelength.size < 2 or not rising:
        raise ValueError(
            "`wavelength` must be two or more finite, rising numbers; "
            f"got {wavelength}."
        )
    if not has_colour(wavelength):
        raise ValueError(
            "`wavelength` must cover what the eye sees, 90 % of each matching function "
            f"(about 430 to 670 nm); got {wavelength[0]:g} to {wavelength[-1]:g} nm."
        )
