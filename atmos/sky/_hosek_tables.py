"""The coefficients of Hosek and Wilkie, as the package `mitsuba` ships them."""

import functools as ft
import importlib.util
import pathlib
import struct
from typing import NamedTuple

import numpy as np
from jaxtyping import Float


_FILE = pathlib.Path("data", "sunsky", "sunsky_datasets.bin")
_MAGIC = b"tensor_file\0"
_FLOAT64 = 11
_SHAPES = {
    "sky_params_spec": (10, 2, 6, 11, 9),
    "sky_rad_spec": (10, 2, 6, 11),
    "sky_params_rgb": (10, 2, 6, 3, 9),
    "sky_rad_rgb": (10, 2, 6, 3),
    "sun_rad_spec": (10, 45, 11, 4),
    "sun_ld_spec": (11, 6),
}


class Tables(NamedTuple):
    """Over turbidity 1 to 10, albedo 0 and 1, control points of the sun's elevation."""

    shape: Float[np.ndarray, "turbidity albedo control channel 9"]
    mean: Float[np.ndarray, "turbidity albedo control channel"]


class SunTables(NamedTuple):
    """Cubics in pieces of elevation, and limb darkening in powers of the cosine."""

    radiance: Float[np.ndarray, "turbidity piece channel 4"]
    limb: Float[np.ndarray, "channel 6"]


def sky_tables(kind: str) -> Tables:
    """The sky's coefficients, `kind` spec (320 to 720 nm by 40) or rgb (Rec. 709)."""
    tables = _tables()
    return Tables(tables[f"sky_params_{kind}"], tables[f"sky_rad_{kind}"])


def sun_tables() -> SunTables:
    """The sun's coefficients at the wavelengths of the spectral sky."""
    tables = _tables()
    return SunTables(tables["sun_rad_spec"], tables["sun_ld_spec"])


@ft.cache
def _tables() -> dict[str, np.ndarray]:
    found = importlib.util.find_spec("mitsuba")
    if found is None or found.origin is None:
        raise ImportError(
            "The sky of Hosek and Wilkie needs its coefficients, which the package "
            "`mitsuba` ships: pip install 'atmos[hosek]'."
        )
    file = pathlib.Path(found.origin).parent / _FILE
    try:
        tables = _read(file.read_bytes())
    except (OSError, struct.error, ValueError) as error:
        raise ImportError(
            "The sky of Hosek and Wilkie needs the coefficients that `mitsuba` 3.7 and "
            f"later ship; could not read '{file}'."
        ) from error
    for name, shape in _SHAPES.items():
        if name not in tables or tables[name].shape != shape:
            raise ImportError(f"'{file}' holds no coefficients `{name}` of {shape}.")
    return tables


def _read(content: bytes) -> dict[str, np.ndarray]:
    """The tables of double precision in a tensor file.

    A magic word, the version in two bytes, and the number of fields. Each has its name
    after its length, its rank, a byte for the kind of number, where it starts and its
    shape. All numbers are little-endian.
    """
    if not content.startswith(_MAGIC):
        raise ValueError("no tensor file")
    place = len(_MAGIC) + 2
    tables = {}

    def take(kind):
        nonlocal place
        values = struct.unpack_from(f"<{kind}", content, place)
        place += struct.calcsize(f"<{kind}")
        return values

    (count,) = take("I")
    for _ in range(count):
        (length,) = take("H")
        (name,) = take(f"{length}s")
        rank, kind = take("HB")
        (start,) = take("Q")
        shape = take(f"{rank}Q")
        if kind == _FLOAT64:
            size = int(np.prod(shape))
            values = np.frombuffer(content, "<f8", size, start).reshape(shape)
            tables[name.decode()] = values
    return tables
