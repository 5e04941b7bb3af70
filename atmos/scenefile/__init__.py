"""A scene as a TOML file, read strictly, and written so that it reads back the same.

Lengths are in m, wavelengths in nm, coefficients in m^-1, angles in degrees. What the
tables may hold is what the classes here say; their words, and what they mean, are those
of `atmos.medium`, `atmos.phase`, `atmos.light`, `atmos.surface` and `atmos.spectrum`.
"""

from ._guide import GUIDE as GUIDE
from ._read import (
    load as load,
    load_camera as load_camera,
    parse as parse,
    parse_camera as parse_camera,
)
from ._scene import opac as opac
from ._write import dump as dump
