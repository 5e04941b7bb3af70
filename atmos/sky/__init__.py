from ._base import AbstractPanorama as AbstractPanorama, AbstractSky as AbstractSky
from ._fitted import AbstractFittedSky as AbstractFittedSky
from ._range import (
    AbstractBeyond as AbstractBeyond,
    Clamp as Clamp,
    Range as Range,
    Refuse as Refuse,
)
from .cie import (
    AbstractScale as AbstractScale,
    CIE as CIE,
    HorizontalIlluminance as HorizontalIlluminance,
    ZenithLuminance as ZenithLuminance,
)
from .hosek import Hosek as Hosek
from .hosek_rgb import HosekRGB as HosekRGB
from .panorama import (
    fine_enough as fine_enough,
    Grid as Grid,
    Panorama as Panorama,
    Resolution as Resolution,
)
from .perez import Perez as Perez
from .preetham import Preetham as Preetham
