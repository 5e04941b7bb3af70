from ._base import (
    AbstractProfile as AbstractProfile,
    Medium as Medium,
    of_extinction as of_extinction,
)
from .ball import Ball as Ball
from .exponential import Exponential as Exponential
from .grid import Grid as Grid
from .standard_atmosphere import (
    SEA_LEVEL as SEA_LEVEL,
    StandardAtmosphere as StandardAtmosphere,
)
from .tabulated import Tabulated as Tabulated
from .tent import Tent as Tent
from .uniform import Uniform as Uniform
