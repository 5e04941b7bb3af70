"""A picture that is not done yet, in a file, from which it goes on to the same bits.

The file is one of `atmos.archive`. It holds the tallies of a `Film`, an axis for the
stretches first, as `count`, `mean` and `squares`; and `seconds`, the time it took.
"""

import os

import jax
import jax.numpy as jnp
import numpy as np

from . import archive
from .film import Film
from .render import Response
from .solver import SolvedSky, Tally


KIND = archive.Kind("checkpoint", 1, "picture")


def words(film: Film, sky: SolvedSky, response: Response | None) -> dict[str, str]:
    """All that the bits of a picture hang on.

    Other versions of JAX and other devices round in other ways.
    """
    made = archive.words(
        scene=sky.scene,
        solver=sky.solver,
        wavelength=sky.wavelength,
        camera=film.camera,
        response=response,
    )
    return made | {
        "stretches": repr([x.mean.shape for x in film.tallies]),
        "jax": jax.__version__,
        "device": f"{jax.default_backend()}, {jax.devices()[0].device_kind}",
    }


def save(
    path: str | os.PathLike[str], film: Film, made: dict[str, str], seconds: float
) -> None:
    """Keeps a film, of which `words` are made, in a file, whole or not at all.

    Raises `OSError` where it cannot.
    """
    arrays = {
        name: np.stack([np.asarray(getattr(x, name)) for x in film.tallies])
        for name in _FIELDS
    }
    archive.write(path, KIND, made, arrays | {"seconds": np.array(seconds)})


def load(
    path: str | os.PathLike[str], blank: Film, made: dict[str, str]
) -> tuple[Film, float]:
    """The film that `save` kept of the same picture, and the seconds it took.

    Raises the errors of `archive.read`.
    """
    arrays = archive.read(path, KIND, made)
    rows = zip(*(arrays[x] for x in _FIELDS), strict=True)
    tallies = tuple(Tally(*map(jnp.asarray, row)) for row in rows)
    return Film(blank.camera, tallies), float(arrays["seconds"])


_FIELDS = ("count", "mean", "squares")
