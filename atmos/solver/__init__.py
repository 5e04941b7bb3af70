from ._base import (
    AbstractSolver as AbstractSolver,
    admit as admit,
    solve as solve,
    SolvedSky as SolvedSky,
)
from .columns import Columns as Columns, Fluxes as Fluxes
from .path_tracing import (
    Estimate as Estimate,
    estimate as estimate,
    PathTracing as PathTracing,
    Tally as Tally,
)
from .shared import Shared as Shared
from .shells import Shells as Shells
from .single_scattering import QUICK as QUICK, SingleScattering as SingleScattering
