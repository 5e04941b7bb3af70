from __future__ import annotations

import contextlib
import dataclasses
import os
from collections.abc import Iterator
from contextvars import ContextVar
from typing import Annotated

import msgspec
import numpy as np

from .. import gridfile, medium
from ._base import Above0, AtLeast0, build, Kind
from ._errors import refuse, under


# Where files that a scene names are looked for.
FOLDER: ContextVar[str] = ContextVar("FOLDER", default=".")
Place = tuple[float, float, float]
Octaves = Annotated[int, msgspec.Meta(ge=1, le=16)]
Cells = Annotated[int, msgspec.Meta(ge=1, le=1024)]
Seed = Annotated[int, msgspec.Meta(ge=0, lt=2**31)]


class Exponential(Kind, tag="exponential"):
    makes = medium.Exponential
    scale_height: Above0


class Tent(Kind, tag="tent"):
    makes = medium.Tent
    centre: float
    half_width: Above0


class Uniform(Kind, tag="uniform"):
    makes = medium.Uniform
    bottom: float
    top: float


class Levels(Kind, tag="table"):
    makes = medium.Tabulated
    altitude: list[float]
    value: list[AtLeast0]


class StandardAtmosphere(Kind, tag="standard_atmosphere"):
    makes = medium.StandardAtmosphere


class HeightFog(Kind, tag="height_fog"):
    makes = medium.HeightFog
    top: float
    scale_height: Above0


class Everywhere(Kind, tag="everywhere"):
    makes = medium.Everywhere


class Ball(Kind, tag="ball"):
    makes = medium.Ball
    centre: Place
    radius: Above0


class Box(Kind, tag="box"):
    makes = medium.Box
    lower: Place
    upper: Place


class Noise(Kind, tag="noise"):
    makes = medium.Noise
    size: Above0
    level: float = 0.0
    softness: Above0 = 0.5
    octaves: Octaves = 5
    seed: Seed = 0


class Puff(Kind, tag="puff"):
    makes = medium.Puff
    centre: Place
    radius: Above0
    size: Above0
    roughness: AtLeast0 = 0.8
    softness: Above0 = 0.2
    octaves: Octaves = 5
    seed: Seed = 0


class Grid(Kind, tag="grid"):
    makes = medium.Grid
    values: list[list[list[AtLeast0]]]
    lower: Place
    upper: Place

    def build(self) -> medium.Grid:
        columns = {len(x) for x in self.values}
        rows = {len(y) for x in self.values for y in x}
        for lengths in (columns, rows):
            if len(lengths) > 1:
                rule = "must have as many numbers in each row as in others"
                refuse("values", rule, sorted(lengths))
        return super().build()


@contextlib.contextmanager
def located(name: str) -> Iterator[str]:
    """Where a file is that a scene names; that it cannot be read is a `ValueError`."""
    try:
        yield os.path.join(FOLDER.get(), name)
    except OSError as error:
        raise ValueError(f"{name}: cannot be read: {error.strerror}.") from error


class File(Kind, tag="file"):
    """The grid of a name in an OpenVDB file or a NumPy archive, times `factor`."""

    file: str
    grid: str
    factor: AtLeast0 = 1.0

    def build(self) -> medium.AbstractProfile:
        with under("file"), located(self.file) as path:
            found = gridfile.load(path, self.grid)
        return found if self.factor == 1.0 else _scaled(found, self.factor)


def _scaled(found: medium.AbstractProfile, factor: float) -> medium.AbstractProfile:
    if isinstance(found, medium.Transformed):
        return dataclasses.replace(found, of=_scaled(found.of, factor))
    assert isinstance(found, medium.Grid)
    return dataclasses.replace(found, values=found.values * factor)


class Transformed(Kind, tag="transformed"):
    """`of`, turned and stretched by the rows of `matrix`, and moved by `offset`."""

    makes = medium.Transformed
    of: Profile
    matrix: tuple[Place, Place, Place] = (
        (1.0, 0.0, 0.0),
        (0.0, 1.0, 0.0),
        (0.0, 0.0, 1.0),
    )
    offset: Place = (0.0, 0.0, 0.0)


class Sampled(Kind, tag="sampled"):
    """A grid of what a profile is in the middles of so many cells."""

    of: Profile
    lower: Place
    upper: Place
    cells: tuple[Cells, Cells, Cells]

    def build(self) -> medium.Grid:
        box = np.array(self.lower), np.array(self.upper)
        return medium.sampled(build("of", self.of), *box, self.cells)


class Product(Kind, tag="product"):
    makes = medium.Product
    one: Profile
    other: Profile


class Blackbody(Kind, tag="blackbody"):
    """What is absorbed shines, as warm as a profile says, in K."""

    makes = medium.Thermal
    temperature: Profile


Profile = (
    Exponential
    | Tent
    | Uniform
    | Levels
    | StandardAtmosphere
    | HeightFog
    | Everywhere
    | Ball
    | Box
    | Noise
    | Puff
    | Grid
    | File
    | Transformed
    | Sampled
    | Product
)
