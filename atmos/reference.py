"""The tables of colour and of the sun, as the package `colour-science` ships them.

Importing that package takes seconds, so what atmos needs of it is read once and kept in
the user's cache folder (or in the folder that the environment variable `ATMOS_CACHE`
names). A cache that cannot be read or written is no error: the tables are read anew.
"""

import contextlib
import functools as ft
import importlib.metadata
import os
import pathlib
import tempfile
import warnings
from typing import NamedTuple

import numpy as np
import platformdirs
from jaxtyping import Float


RGB_SPACES = ("ITU-R BT.709", "ACEScg", "ACES2065-1")

_EDITION = 1  # to be raised whenever `_read` gives other tables
_SHAPES = {
    "cmf_wavelength": (471,),
    "cmf": (471, 3),
    "sun_wavelength": (2002,),
    "sun": (2002,),
    **{f"{name} primaries": (3, 2) for name in RGB_SPACES},
    **{f"{name} white": (2,) for name in RGB_SPACES},
    **{f"{name} matrix": (3, 3) for name in RGB_SPACES},
}


class RGBTables(NamedTuple):
    """The chromaticities x, y of red, green, blue and white, and the matrix from XYZ.

    The matrix is made of these chromaticities. It takes the white D65 to (1, 1, 1):
    where a space has another white (the ACES spaces, about D60) the tristimulus values
    are adapted from D65 by the Bradford transform first. So do OpenColorIO's ACES
    configurations ("CIE-XYZ-D65_BFD"): the same light then looks the same in whichever
    space it was written.
    """

    primaries: Float[np.ndarray, "3 2"]
    white: Float[np.ndarray, "2"]
    matrix: Float[np.ndarray, "3 3"]


def matching_functions() -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n 3"]]:
    """Wavelengths, 360 to 830 nm by 1 nm, and there the CIE 1931 2-degree observer."""
    tables = _tables()
    return tables["cmf_wavelength"], tables["cmf"]


def solar_irradiance() -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:
    """The sun outside the air, at its mean distance, from ASTM G173-03.

    Wavelengths from 280 to 4000 nm (0.5 nm apart below 400 nm, then 1 nm, 5 nm from
    1705 nm on), and the irradiance in W m^-2 nm^-1.
    """
    tables = _tables()
    return tables["sun_wavelength"], tables["sun"]


def rgb_tables(name: str) -> RGBTables:
    """What defines one of `RGB_SPACES`, named as `colour-science` names it."""
    tables = _tables()
    return RGBTables(*(tables[f"{name} {part}"] for part in RGBTables._fields))


def cache_folder() -> pathlib.Path:
    """Where things are kept that can be made again; it need not exist."""
    chosen = os.environ.get("ATMOS_CACHE")
    return pathlib.Path(chosen or platformdirs.user_cache_dir("atmos"))


@ft.cache
def _tables() -> dict[str, np.ndarray]:
    file = _file()
    tables = _load(file)
    if tables is None:
        tables = _read()
        with contextlib.suppress(OSError):
            _save(file, tables)
    for table in tables.values():
        table.setflags(write=False)
    return tables


def _file() -> pathlib.Path:
    version = importlib.metadata.version("colour-science")
    return cache_folder() / f"colour-science-{version}-{_EDITION}.npz"


def _load(file: pathlib.Path) -> dict[str, np.ndarray] | None:
    try:
        with open(file, "rb") as stream, np.load(stream, allow_pickle=False) as kept:
            tables = {name: kept[name] for name in _SHAPES}
        whole = all(
            tables[name].shape == shape and np.all(np.isfinite(tables[name]))
            for name, shape in _SHAPES.items()
        )
    except Exception:  # a damaged archive raises nearly anything
        return None
    return tables if whole else None


def _save(file: pathlib.Path, tables: dict[str, np.ndarray]) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    handle, part = tempfile.mkstemp(dir=file.parent, suffix=".part")
    try:
        with os.fdopen(handle, "wb") as stream:
            np.savez(stream, **tables)  # type: ignore[arg-type]
        os.replace(part, file)
    except BaseException:
        os.unlink(part)
        raise


def _read() -> dict[str, np.ndarray]:
    # The package warns about matplotlib, which no table needs, and changes how NumPy
    # prints numbers.
    with warnings.catch_warnings(), np.printoptions():
        warnings.simplefilter("ignore")
        import colour
        from colour.adaptation import matrix_chromatic_adaptation_VonKries
        from colour.plotting.datasets.astm_g_173 import SD_ASTMG173_ETR

        observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
        tables = {
            "cmf_wavelength": observer.wavelengths,
            "cmf": observer.values,
            "sun_wavelength": SD_ASTMG173_ETR.wavelengths,
            "sun": SD_ASTMG173_ETR.values,
        }
        daylight = colour.xy_to_XYZ(colour.RGB_COLOURSPACES[RGB_SPACES[0]].whitepoint)
        for name in RGB_SPACES:
            space = colour.RGB_COLOURSPACES[name]
            adapt = matrix_chromatic_adaptation_VonKries(
                daylight, colour.xy_to_XYZ(space.whitepoint), transform="Bradford"
            )
            to_xyz = colour.normalised_primary_matrix(space.primaries, space.whitepoint)
            tables[f"{name} primaries"] = space.primaries
            tables[f"{name} white"] = space.whitepoint
            tables[f"{name} matrix"] = np.linalg.solve(to_xyz, adapt)
    return {name: np.array(table, float) for name, table in tables.items()}
