from ._base import AbstractSolver as AbstractSolver
from ._diffuse import Fluxes as Fluxes
from ._shadows import (
    AbstractShadows as AbstractShadows,
    ShadowCache as ShadowCache,
    ShadowRays as ShadowRays,
)
from ._skipping import Skipping as Skipping
from ._sky import SolvedSky as SolvedSky
from ._solve import admit as admit, solve as solve
from ._steps import (
    AbstractSteps as AbstractSteps,
    Adaptive as Adaptive,
    Fixed as Fixed,
    Jittered as Jittered,
)
from ._tally import (
    AbstractTracing as AbstractTracing,
    Estimate as Estimate,
    estimate as estimate,
    estimates as estimates,
    Tally as Tally,
)
from .bruneton import Bruneton as Bruneton
from .columns import Columns as Columns
from .path_tracing import PathTracing as PathTracing
from .ray_marching import RayMarching as RayMarching
from .shared import Shared as Shared
from .shells import Shells as Shells
from .single_scattering import QUICK as QUICK, SingleScattering as SingleScattering
from .volume_tracing import VolumeTracing as VolumeTracing
