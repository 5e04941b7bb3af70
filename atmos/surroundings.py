"""What lies around a scene: a sky, or a picture of one."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike

from .camera import LatLong
from .image import FilePath, read_exr
from .light import Surrounding
from .render import render
from .sky import AbstractSky


def of_sky(sky: AbstractSky, position: ArrayLike, height: int = 64) -> Surrounding:
    """A sky as it is seen from one place, in so many rows of pixels.

    The disks of its lights are not in it: they stay lights of their own.
    """
    return Surrounding(render(sky, LatLong(position, height)), sky.wavelength)


def of_exr(path: FilePath, centre: ArrayLike = 0.0) -> Surrounding:
    """A spectral picture of all directions, as of a `LatLong` that looks to `centre`.

    Raises `ValueError` for a file without spectral layers, whose colours could be of
    many spectra, and for one that is not twice as wide as high.
    """
    picture = read_exr(path)
    if not any(x.startswith("S0.") for x in picture.channels):
        raise ValueError(
            "`path` must have spectral layers, such as S0.550,000000nm; got "
            f"{', '.join(sorted(picture.channels))}."
        )
    wavelength, radiance = picture.spectrum()
    height, width = radiance.shape[:2]
    if width != 2 * height:
        raise ValueError(
            f"`path` must be twice as wide as high; got {width} x {height} pixels."
        )
    return Surrounding(jnp.asarray(radiance.astype(np.float32)), wavelength, centre)
