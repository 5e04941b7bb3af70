"""What takes part in the chart: methods of atmos, fitted skies, programs of others.

Each answers the problems of a class, and says how long a spectral dome takes: all
directions of a picture of 1024 x 512, at 41 wavelengths.
"""

import abc
import dataclasses
import functools as ft
import hashlib
import importlib.metadata
import importlib.util
import math
import pathlib
import statistics
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

import atmos
from atmos import camera, deg, light, render
from atmos.geometry import Flat
from atmos.sky import (
    AbstractFittedSky,
    AbstractPanorama,
    AbstractSky,
    Clamp,
    Hosek,
    Preetham,
)
from atmos.solver import (
    AbstractSolver,
    Bruneton,
    Columns,
    QUICK,
    Shared,
    Shells,
    SingleScattering,
)

from . import peers
from .contest import NM, Problem, Score, score
from .peers import Peer, View


HEIGHT = 512
TURBIDITIES = [1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0]
# As many directions as a table of atmos has; between them a peer's dome is looked up.
RINGS = np.concatenate([np.linspace(0.0, 89.5, 48), np.linspace(90.5, 180.0, 32)])
AROUND = np.linspace(0.0, 180.0, 9)


class Times(NamedTuple):
    """Seconds: the median of runs, the quickest, the slowest; the first, apart."""

    median: float
    low: float
    high: float
    first: float

    def then(self, other: "Times") -> "Times":
        """Of one after the other."""
        return Times(*(x + y for x, y in zip(self, other, strict=True)))

    def scaled(self, factor: float) -> "Times":
        return Times(*(factor * x for x in self))


class Effort(NamedTuple):
    """How often something is timed at most, and for how many seconds."""

    runs: int
    seconds: float


class Result(NamedTuple):
    """`note` says how the time was come by, where it was not simply taken."""

    setting: str
    times: Times
    score: Score
    note: str = ""


class Refused(Exception):
    """A method does not hold for a class of scenes."""


def timed(work: Callable[[], Any], effort: Effort) -> tuple[Any, Times]:
    """What it makes, and how long that takes; what compiles is in the first run."""
    times: list[float] = []
    while len(times) < 2 or (
        len(times) <= effort.runs and sum(times[1:]) < effort.seconds
    ):
        start = time.perf_counter()
        made = jax.block_until_ready(work())
        times.append(time.perf_counter() - start)
    first, *later = times
    return made, Times(statistics.median(later), min(later), max(later), first)


class AbstractEntrant(abc.ABC):
    """A method at one setting, or at several that share their work."""

    method: str
    setting: str = ""  # where it is not chosen to suit the class

    @property
    @abc.abstractmethod
    def edition(self) -> str:
        """Changes whenever its figures may."""

    @abc.abstractmethod
    def results(self, problems: list[Problem], effort: Effort) -> Iterator[Result]:
        """Raises `Refused` where it does not hold."""


@ft.cache
def sources() -> str:
    """A number that changes with the code of atmos."""
    root = pathlib.Path(atmos.__file__).parent
    digest = hashlib.sha256()
    for path in sorted([*root.rglob("*.py"), *root.rglob("*.csv")]):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def looked(sky: AbstractSky, view: View, sun: float) -> np.ndarray:
    """Radiances as a picture in rows has them: [zenith, azimuth, wl]."""
    table = sky.panorama(jnp.array([0.0, 0.0, view.altitude], jnp.float32))
    angles = np.radians(view.zeniths)[:, None], sun + np.radians(view.azimuths)[None]
    found = _looked(table, *(jnp.asarray(x, jnp.float32) for x in angles))
    return np.asarray(found, float)


@eqx.filter_jit
def _looked(table: AbstractPanorama, zenith: Array, azimuth: Array) -> Array:
    return table.radiance(zenith, azimuth)


def dome(sky: AbstractSky, altitude: float):
    at = jnp.array([0.0, 0.0, altitude], jnp.float32)
    return render(sky, camera.LatLong(at, HEIGHT))


def among(wavelength: np.ndarray) -> np.ndarray:
    """Where wavelengths are in those of a dome."""
    return np.array([int(np.argmin(np.abs(NM - x))) for x in wavelength])


class Solver(AbstractEntrant):
    """A solver of atmos; what serves all suns is shown as if it were kept, too."""

    def __init__(self, method: str, setting: str, solver: AbstractSolver):
        self.method, self.setting, self.solver = method, setting, solver
        self._kept: dict[str, tuple[AbstractSky, Times]] = {}

    @property
    def edition(self) -> str:
        return sources()

    def results(self, problems: list[Problem], effort: Effort) -> Iterator[Result]:
        first = problems[0]
        sky, solving = self._solved(first, effort)
        _, drawing = timed(lambda: dome(sky, first.view.altitude), effort)
        found = []
        for x in problems:
            if x.scene is not first.scene:
                sky, _ = self._solved(x, Effort(1, 0.0))
                first = x
            seen = looked(sky, x.view, float(x.scene.lights[0].azimuth))
            found.append(seen[..., among(x.wavelength)])
        figures = score(problems, found)
        yield Result(self.setting, solving.then(drawing), figures)
        if self._serves_all(first) and solving.median > 0.05 * drawing.median:
            setting = f"{self.setting}, kept"
            yield Result(setting, drawing, figures, "solved before, for all suns")

    def _serves_all(self, problem: Problem) -> bool:
        return not self.solver.baked(problem.scene).lights

    def _solved(self, problem: Problem, effort: Effort) -> tuple[AbstractSky, Times]:
        whole = self._serves_all(problem)
        if not whole or problem.world not in self._kept:
            try:
                work = lambda: atmos.solve(problem.scene, self.solver, NM)
                found = timed(work, effort)
            except ValueError as why:
                raise Refused(str(why)) from None
            if not whole:
                return found
            self._kept[problem.world] = found
        sky, times = self._kept[problem.world]
        scene = jax.tree.map(lambda x: x.astype(NM.dtype), problem.scene)
        return dataclasses.replace(sky, scene=scene), times


class Fitted(AbstractEntrant):
    """A fitted sky, at the turbidity that suits it best."""

    def __init__(self, method: str, kind: type[AbstractFittedSky], most: float):
        self.method, self._kind, self._most = method, kind, most

    @property
    def edition(self) -> str:
        return sources()

    def results(self, problems: list[Problem], effort: Effort) -> Iterator[Result]:
        check_clear_day(problems)
        trials = [x for x in TURBIDITIES if x <= self._most]
        best = min(trials, key=lambda x: self._score(problems, x).median)
        work = lambda: dome(self._sky(problems[0], best), 0.0)
        _, times = timed(work, effort)
        yield Result(f"turbidity {best:g}", times, self._score(problems, best))

    def _sky(self, problem: Problem, turbidity: float) -> AbstractFittedSky:
        sun, ground = problem.scene.lights[0], problem.scene.ground
        angles = float(sun.zenith), float(sun.azimuth)
        return self._kind(*angles, turbidity, NM, ground, beyond=Clamp())

    def _score(self, problems: list[Problem], turbidity: float) -> Score:
        known = self._kind.ranges.get("wavelength")
        within = lambda nm: (nm > 0.0) if known is None else (nm <= known.high)
        found = []
        for x in problems:
            sky, azimuth = self._sky(x, turbidity), float(x.scene.lights[0].azimuth)
            seen = looked(sky, x.view, azimuth)[..., among(x.wavelength)]
            found.append(seen / sunlight(x.wavelength))
        return score(problems, found, within)


class Sunsky(AbstractEntrant):
    """Mitsuba's emitter, which knows 320 to 720 nm, asked for every direction."""

    method = "mitsuba sunsky"

    @staticmethod
    def runs() -> bool:
        """Asked of another process, as an LLVM that it cannot use ends that."""
        code = (
            "import drjit, mitsuba; mitsuba.set_variant('llvm_ad_spectral');"
            "sky = mitsuba.load_dict({'type': 'sunsky', 'sun_scale': 0.0});"
            "seen = drjit.zeros(mitsuba.SurfaceInteraction3f, 4);"
            "seen.wi = [0.0, 0.0, -1.0]; seen.wavelengths = 4 * [500.0];"
            "drjit.eval(sky.eval(seen))"
        )
        run = [sys.executable, "-c", code]
        return subprocess.run(run, capture_output=True).returncode == 0

    @property
    def edition(self) -> str:
        return importlib.metadata.version("mitsuba")

    def results(self, problems: list[Problem], effort: Effort) -> Iterator[Result]:
        check_clear_day(problems)
        best = min(TURBIDITIES, key=lambda x: self._score(problems, x).median)
        emitter = self._emitter(problems[0], best)
        picture = camera.LatLong(jnp.zeros(3), HEIGHT)
        angles = np.broadcast_arrays(*(np.asarray(x) for x in picture.angles()))
        rays = towards(*(x.ravel() for x in angles))
        _, times = timed(lambda: self._look(emitter, rays, NM), effort)
        yield Result(f"turbidity {best:g}", times, self._score(problems, best))

    def _emitter(self, problem: Problem, turbidity: float):
        import mitsuba

        mitsuba.set_variant("llvm_ad_spectral")
        sun, nm = problem.scene.lights[0], jnp.array([550.0])
        return mitsuba.load_dict(
            {
                "type": "sunsky",
                "turbidity": turbidity,
                "albedo": float(problem.scene.ground.evaluate(nm)[0]),
                "sun_direction": np.asarray(sun.direction, float).tolist(),
                "sun_scale": 0.0,
            }
        )

    def _look(self, emitter, rays: np.ndarray, wavelength: np.ndarray) -> np.ndarray:
        import drjit
        import mitsuba

        seen = drjit.zeros(mitsuba.SurfaceInteraction3f, len(rays))
        seen.wi = mitsuba.Vector3f(*np.ascontiguousarray(-rays.T))
        bands = []
        for first in range(0, len(wavelength), 4):
            four = np.resize(wavelength[first : first + 4], 4)
            seen.wavelengths = [drjit.opaque(mitsuba.Float, float(x)) for x in four]
            bands.append(np.array(emitter.eval(seen)))
        return np.concatenate(bands)[: len(wavelength)].T

    def _score(self, problems: list[Problem], turbidity: float) -> Score:
        found = []
        for x in problems:
            emitter = self._emitter(x, turbidity)
            sun = float(x.scene.lights[0].azimuth)
            zenith, azimuth = np.meshgrid(
                np.radians(x.view.zeniths),
                sun + np.radians(x.view.azimuths),
                indexing="ij",
            )
            rays = towards(zenith.ravel(), azimuth.ravel())
            nm = np.minimum(x.wavelength, 719.9)
            seen = self._look(emitter, rays, nm).reshape(x.truth.shape)
            found.append(seen / sunlight(x.wavelength))
        return score(problems, found, lambda nm: nm <= 720.0)


class Other(AbstractEntrant):
    """A peer: it is asked for a table of directions, at one wavelength and at five."""

    def __init__(self, peer: Peer):
        self.method, self.setting, self._peer = peer.method, peer.setting, peer

    @property
    def edition(self) -> str:
        text = pathlib.Path(peers.__file__).read_bytes()
        return self._peer.version + hashlib.sha256(text).hexdigest()[:8]

    def results(self, problems: list[Problem], effort: Effort) -> Iterator[Result]:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of albedos next to 1
            yield self._result(problems, effort)

    def _result(self, problems: list[Problem], effort: Effort) -> Result:
        peer, found = self._peer, []
        for x in problems:
            zenith = float(x.scene.lights[0].zenith) / deg
            if zenith > peer.lowest_sun:
                raise Refused(f"for suns up to {peer.lowest_sun:g} degrees")
            round_only = not peer.flat and isinstance(x.scene.geometry, Flat)
            if round_only:
                raise Refused("of a round world")
            try:
                look = peer.look(x.scene, x.wavelength.astype(float), x.view)
                found.append(look())
            except (RuntimeError, ValueError) as why:
                raise Refused(f"{x.name}: {why}") from None
        figures = score(problems, found)
        x = problems[0]
        view, many = View(x.view.altitude, RINGS, AROUND), [380.0, 450.0, 550.0, 650.0]
        look = lambda nm: timed(peer.look(x.scene, np.array(nm), view), effort)[1]
        one, four = look([550.0]), look(many)
        each = max(four.median - one.median, 0.0) / (len(many) - 1)
        whole = one.median + each * (len(NM) - 1)
        _, spreading = timed(spread, effort)
        times = four.scaled(whole / four.median).then(spreading)
        note = f"of {RINGS.size * AROUND.size} directions, from 1 and {len(many)} nm"
        return Result(peer.setting, times, figures, note)


def spread() -> np.ndarray:
    """What it takes to look up a dome in a table: two products of matrices."""
    table = np.ones((len(RINGS), len(AROUND), len(NM)), np.float32)
    down = np.full((HEIGHT, len(RINGS)), 1.0 / len(RINGS), np.float32)
    across = np.full((2 * HEIGHT, len(AROUND)), 1.0 / len(AROUND), np.float32)
    return across @ np.tensordot(down, table, 1)


def check_clear_day(problems: list[Problem]) -> None:
    for x in problems:
        if isinstance(x.scene.geometry, Flat) or x.view.altitude > 1000.0:
            raise Refused("of clear skies from the ground")
        if x.scene.lights[0].zenith > 0.5 * math.pi:
            raise Refused("of suns above the horizon")


def sunlight(wavelength: np.ndarray) -> np.ndarray:
    return np.asarray(light.sunlight(10.0).evaluate(jnp.asarray(wavelength)), float)


def towards(zenith: np.ndarray, azimuth: np.ndarray) -> np.ndarray:
    level = np.sin(zenith)
    parts = [level * np.sin(azimuth), level * np.cos(azimuth), np.cos(zenith)]
    return np.stack(parts, -1)


def ours(quick: bool) -> Iterator[AbstractEntrant]:
    yield Solver("single", "7 nodes", QUICK)
    if not quick:
        yield Solver("single", "10 nodes", SingleScattering())
        coarse = Shared(layers=16, suns=16, pieces=6, single=QUICK)
        yield Solver("shared", "16 layers", coarse)
    yield Solver("shared", "32 layers", Shared())
    coarse = Bruneton(
        layers=16,
        views=10,
        azimuths=6,
        suns=24,
        orders=5,
        degrees=8,
        steps=10,
        single=QUICK,
    )
    yield Solver("bruneton", "16 layers, 5 orders", coarse)
    if not quick:
        yield Solver("bruneton", "32 layers, 6 orders", Bruneton())
    coarse = Columns(streams=8, layers=30, suns=8, pieces=8, nodes=2, single=QUICK)
    yield Solver("columns", "8 streams, 30 layers", coarse)
    for streams in [16] if quick else [8, 16, 32]:
        yield Solver("columns", f"{streams} streams", Columns(streams=streams))
    coarse = Shells(
        layers=20, grounded=6, azimuths=8, degrees=8, suns=32, pieces=8, single=QUICK
    )
    yield Solver("shells", "20 layers", coarse)
    if not quick:
        yield Solver("shells", "40 layers", Shells())


def entrants(quick: bool) -> tuple[list[AbstractEntrant], list[str]]:
    """All that take part, and what is missing."""
    found, missing = list(ours(quick)), peers.missing()
    found.append(Fitted("Preetham", Preetham, 6.0))
    if importlib.util.find_spec("mitsuba") is None:
        missing += ["mitsuba (sunsky, and Hosek's coefficients)"]
    else:
        found.append(Fitted("Hosek", Hosek, 10.0))
        if Sunsky.runs():
            found.append(Sunsky())
        else:
            missing.append("mitsuba's sunsky (it wants LLVM 16 or newer)")
    found += [Other(x) for x in peers.peers(quick)]
    return found, missing
