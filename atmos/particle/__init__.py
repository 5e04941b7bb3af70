from .aerosol import Aerosol as Aerosol
from .air import Air as Air
from .carbon_dioxide import CarbonDioxide as CarbonDioxide
from .gas import (
    AbstractGas as AbstractGas,
    Depolarisation as Depolarisation,
    Scattering as Scattering,
)
