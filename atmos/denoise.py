"""Noise taken out of a picture, by what pictures usually look like.

That is Intel's Open Image Denoise, of the package `pyoidn`: `pip install
'atmos[denoise]'` brings it.
"""

import importlib
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .colour import AbstractColourSpace, ACESCG


def denoiser() -> Any:
    """The package; raises `ImportError` where it is not installed."""
    try:
        return importlib.import_module("pyoidn")
    except ImportError as error:
        raise ImportError(
            "Denoising needs the package `pyoidn`: pip install 'atmos[denoise]'."
        ) from error


def denoise(
    image: Float[np.ndarray, "height width 3"], space: AbstractColourSpace
) -> Float[np.ndarray, "height width 3"]:
    """The values of a colour space as they would be without noise.

    A guess, which is no longer right on average; linear in the light. Raises the error
    of `denoiser`.
    """
    pyoidn = denoiser()
    # Hardly anything lies outside this gamut: it needs no numbers below 0.
    light = ACESCG.from_xyz(space.to_xyz(jnp.asarray(image, np.float32)))
    light = np.maximum(np.asarray(light), 0.0)
    lit = light[light > 0.0]
    if not lit.size:
        return image
    # Whatever the unit, it is given numbers about 1.
    scale = np.mean(lit)
    clean = pyoidn.denoise(np.ascontiguousarray(light / scale), hdr=True)
    clean = jnp.asarray(np.maximum(clean, 0.0) * scale)
    values = np.asarray(space.from_xyz(ACESCG.to_xyz(clean)), image.dtype)
    return values if space.signed else np.maximum(values, 0.0)
