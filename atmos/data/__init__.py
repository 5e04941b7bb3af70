"""Small tables, each a CSV file that says on top what its figures are and whose."""

from importlib import resources

import numpy as np


def read(name: str) -> np.ndarray:
    """The table in `name`.csv, one record per row; a blank among numbers is NaN."""
    lines = resources.files(__name__).joinpath(f"{name}.csv").read_text().splitlines()
    lines = [line for line in lines if not line.startswith("#")]
    return np.genfromtxt(lines, delimiter=",", names=True, dtype=None, encoding=None)
