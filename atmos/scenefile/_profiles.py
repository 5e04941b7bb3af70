from .. import medium
from ._base import Above0, AtLeast0, Kind


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


class Ball(Kind, tag="ball"):
    makes = medium.Ball
    centre: tuple[float, float, float]
    radius: Above0


class Grid(Kind, tag="grid"):
    makes = medium.Grid
    values: list[list[list[AtLeast0]]]
    lower: tuple[float, float, float]
    upper: tuple[float, float, float]


Profile = Exponential | Tent | Uniform | Levels | StandardAtmosphere | Ball | Grid
