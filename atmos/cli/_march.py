"""What the options say of marching along rays."""

import dataclasses
from typing import Annotated, Literal

from ..solver import (
    AbstractSteps,
    Adaptive,
    Fixed,
    Jittered,
    RayMarching,
    ShadowCache,
    ShadowRays,
    Skipping,
)
from ._app import option, real, refuse, whole


_COUNT, _CELLS = 256, 96


@dataclasses.dataclass(frozen=True)
class March:
    """How rays are marched along, and how shadows fall."""

    steps: Annotated[
        Literal["jittered", "fixed", "skipping", "adaptive"] | None,
        option(
            "Where the steps look: jittered, anywhere in each, so that what is missed "
            "becomes noise; fixed, in the middle; skipping, there too but only where "
            "something is, for what lies in boxes; adaptive, as narrow as --tolerance "
            "asks for.  [default: jittered]"
        ),
    ] = None
    step_count: Annotated[
        int | None,
        whole(
            "Steps along a ray; adaptive ones to begin with.  [default: 256; adaptive "
            "48]",
            1,
            10**5,
        ),
    ] = None
    tolerance: Annotated[
        float | None,
        real(
            "The error of adaptive steps at most, a share of the radiance.  [default: "
            "0.001]",
            1e-6,
            1.0,
            "",
        ),
    ] = None
    shadows: Annotated[
        Literal["cache", "rays"] | None,
        option(
            "How dim the light is: looked up in a grid through which lines to it run, "
            "or found along a ray from each place, which is sharper and slow.  "
            "[default: cache]"
        ),
    ] = None

    def check(self, solver: str) -> None:
        """Refuses what only marching heeds, or only steps of another kind."""
        for name, value in dataclasses.asdict(self).items():
            if value is not None and solver != "march":
                refuse(f"--{name.replace('_', '-')}", "is for --solver march")
        if self.tolerance is not None and self.steps != "adaptive":
            refuse("--tolerance", "is for --steps adaptive")

    def solver(self) -> RayMarching:
        """The solver that the options describe."""
        rays = self.shadows == "rays"
        return RayMarching(self._steps(), ShadowRays() if rays else ShadowCache(_CELLS))

    def _steps(self) -> AbstractSteps:
        if self.steps == "adaptive":
            given = {"tolerance": self.tolerance, "count": self.step_count}
            return Adaptive(**{k: x for k, x in given.items() if x is not None})
        kinds = {"fixed": Fixed, "skipping": Skipping}
        return kinds.get(self.steps or "", Jittered)(self.step_count or _COUNT)
