from ._base import AbstractPhaseFunction as AbstractPhaseFunction
from .isotropic import Isotropic as Isotropic
