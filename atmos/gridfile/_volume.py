import dataclasses

import numpy as np
from jaxtyping import Float

from ..medium import AbstractProfile, Grid, Transformed


@dataclasses.dataclass(frozen=True)
class Volume:
    """Values in cells; the middle of cell `i` is at `matrix @ (first + i) + offset`.

    In m. What has no values outside the cells is 0 there.
    """

    values: Float[np.ndarray, "nx ny nz *channel"]
    first: tuple[int, int, int]
    matrix: Float[np.ndarray, "3 3"]
    offset: Float[np.ndarray, "3"]

    def grid(self) -> Grid:
        """The values in a grid whose unit of length is a cell."""
        lower = np.array(self.first) - 0.5
        return Grid(self.values, lower, lower + np.array(self.values.shape))

    def placed(self, grid: Grid) -> AbstractProfile:
        """A grid in cells where it stands in the world."""
        size = np.diagonal(self.matrix)
        if np.all(self.matrix == np.diag(size)) and np.all(size > 0.0):
            lower, upper = (
                np.asarray(x, float) * size + self.offset
                for x in (grid.lower, grid.upper)
            )
            return Grid(grid.values, lower, upper)
        return Transformed(grid, self.matrix, self.offset)
