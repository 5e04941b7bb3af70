"""Densities, temperatures and colours from files: OpenVDB (.vdb) and NumPy (.npz)."""

from ._load import load as load, load_coloured as load_coloured
from ._volume import Volume as Volume
