from ._base import AbstractPhaseFunction as AbstractPhaseFunction
from .double_henyey_greenstein import DoubleHenyeyGreenstein as DoubleHenyeyGreenstein
from .draine import CornetteShanks as CornetteShanks, Draine as Draine
from .empirical_mie import EmpiricalMie as EmpiricalMie
from .henyey_greenstein import HenyeyGreenstein as HenyeyGreenstein
from .isotropic import Isotropic as Isotropic
from .rayleigh import Rayleigh as Rayleigh
from .tabulated import Tabulated as Tabulated
