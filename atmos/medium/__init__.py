from ._base import (
    AbstractLocal as AbstractLocal,
    AbstractProfile as AbstractProfile,
    check_above_zero as check_above_zero,
    Medium as Medium,
    of_extinction as of_extinction,
)
from ._emission import AbstractEmission as AbstractEmission
from .ball import Ball as Ball
from .box import Box as Box
from .coloured import coloured as coloured
from .everywhere import Everywhere as Everywhere
from .exponential import Exponential as Exponential
from .glow import Glow as Glow
from .grid import Grid as Grid
from .height_fog import HeightFog as HeightFog
from .noise import Noise as Noise
from .product import Product as Product
from .puff import Puff as Puff
from .sampled import sampled as sampled
from .standard_atmosphere import (
    SEA_LEVEL as SEA_LEVEL,
    StandardAtmosphere as StandardAtmosphere,
)
from .tabulated import Tabulated as Tabulated
from .tent import Tent as Tent
from .thermal import Thermal as Thermal
from .transformed import Transformed as Transformed
from .uniform import Uniform as Uniform
