from ._base import (
    AbstractSolver as AbstractSolver,
    solve as solve,
    SolvedSky as SolvedSky,
)
from .single_scattering import QUICK as QUICK, SingleScattering as SingleScattering
