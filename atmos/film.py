"""Pictures that grow: looks added to looks, until there are enough of them.

Each look goes through a random place of its pixel, and with random numbers of its own
where the solver has any. All is decided by how many looks there were before, so that a
picture that was interrupted goes on to the same bits.
"""

import collections
import dataclasses
import itertools
import math
import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int, Integer, Scalar

from .camera import AbstractCamera
from .render import Response
from .solver import AbstractSolver, AbstractTracing, estimates, SolvedSky, Tally


# Pixels that are looked at together, and that are waited for. On a CPU as many as keep
# it busy: the longest paths are waited for, and so is whoever wants to stop.
_RAYS, _RAYS_ON_CPU = 2**16, 2**12


@dataclasses.dataclass(frozen=True)
class Film:
    """What has been seen through a camera so far: one tally for each stretch of pixels.

    Stretches are alike in size; the last is filled up with the last pixel. One after
    the other is looked at, and after the last the first again. Tallies have a channel
    more than the picture, for what comes late.
    """

    camera: AbstractCamera
    tallies: tuple[Tally, ...]

    @classmethod
    def blank(
        cls, camera: AbstractCamera, sky: SolvedSky, response: Response | None = None
    ) -> "Film":
        """Nothing has been seen yet. Channels are those of `render`."""
        dtype = sky.wavelength.dtype
        camera = jax.tree.map(lambda x: x.astype(dtype), camera)
        count = int(np.count_nonzero(_sees(camera)))
        most = _RAYS_ON_CPU if jax.default_backend() == "cpu" else _RAYS
        stretches = -(-count // most)
        channels = sky.wavelength.size if response is None else response.shape[1]
        dark = jnp.zeros((-(-count // stretches), channels + 1), dtype)
        none = Tally(jnp.zeros((), dtype), dark, dark)
        return cls(camera, (none,) * stretches)

    @property
    def looks(self) -> float:
        """How often a pixel has been looked at, on average."""
        return sum(float(x.count) for x in self.tallies) / len(self.tallies)

    @property
    def even(self) -> bool:
        """Whether all pixels have been looked at equally often."""
        return self.looks == math.floor(self.looks)

    def mean(self) -> Float[np.ndarray, "height width channel"]:
        """The picture: black where nothing has been seen yet."""
        return self._laid_out([np.asarray(x.mean)[:, :-1] for x in self.tallies])

    @property
    def late(self) -> float:
        """What share of even light comes by paths that were ended for their length.

        On average over the pixels. Such light is seldom found, and then bright.
        """
        return float(
            np.mean([np.mean(np.asarray(x.mean)[:, -1]) for x in self.tallies])
        )

    def variance(self) -> Float[np.ndarray, "height width channel"]:
        """The square of the standard error; NaN before the second look."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return self._laid_out([_variance(x)[:, :-1] for x in self.tallies])

    def error(self) -> float:
        """How far the picture is likely to be off, relative: a standard error.

        The root mean square, over all pixels that are not black, of a pixel's standard
        error over its mean, each as the length of the vector of its channels; a mean
        below a hundredth of the average of these pixels counts as that. 0 for a black
        picture, infinite before the second look.
        """
        if self.looks < 2.0:
            return math.inf
        squared = np.sum(np.square(self.mean(), dtype=float), -1)
        variance = np.sum(self.variance(), -1, dtype=float)
        lit = (squared > 0.0) | (variance > 0.0)
        if not np.any(lit):
            return 0.0
        least = 0.01 * np.mean(np.sqrt(squared[lit]))
        relative = variance[lit] / np.maximum(squared[lit], max(least**2, 1e-300))
        return math.sqrt(np.mean(relative))

    def _laid_out(
        self, stretches: list[np.ndarray]
    ) -> Float[np.ndarray, "height width channel"]:
        seen = np.concatenate(stretches)
        size = self.camera.height, self.camera.width
        image = np.zeros((math.prod(size), seen.shape[-1]), seen.dtype)
        pixels = np.flatnonzero(_sees(self.camera))
        image[pixels] = seen[: pixels.size]
        return image.reshape(*size, -1)


def expose(
    film: Film, sky: SolvedSky, response: Response | None = None
) -> Iterator[Film]:
    """Looks at the sky through the film's camera, again and again without end.

    Gives the film after each stretch of pixels; all cores of a CPU work on the next.
    """
    if response is not None:
        response = response.astype(sky.wavelength.dtype)
    tallies = list(film.tallies)
    size = tallies[0].mean.shape[0]
    pixels = np.flatnonzero(_sees(film.camera)).astype(np.int32)
    pixels = np.pad(pixels, (0, len(tallies) * size - pixels.size), mode="edge")

    def seen(number):
        index, which = divmod(number, len(tallies))
        part = jnp.asarray(pixels[which * size : (which + 1) * size])
        look = sky, film.camera, part, jnp.int32(index), response
        return jax.block_until_ready(_look(*look))

    for number, found in _in_turn(seen, round(film.looks * len(tallies))):
        which = number % len(tallies)
        tallies[which] = jax.block_until_ready(_join(tallies[which], found))
        yield dataclasses.replace(film, tallies=tuple(tallies))


def _in_turn(work: Callable[[int], Array], first: int) -> Iterator[tuple[int, Array]]:
    """What is worked out for one number after the other, without end."""
    # The first compiles what the others use.
    yield first, work(first)
    workers = (os.cpu_count() or 1) if jax.default_backend() == "cpu" else 1
    pool, ahead = ThreadPoolExecutor(workers), collections.deque()
    try:
        for number in itertools.count(first + 1):
            ahead.append((number, pool.submit(work, number)))
            if len(ahead) > workers:
                done, found = ahead.popleft()
                yield done, found.result()
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


_join = eqx.filter_jit(lambda tally, seen: tally.join(Tally.of(seen[None])))


@eqx.filter_jit
def _look(
    sky: SolvedSky,
    camera: AbstractCamera,
    pixels: Int[Array, "pixel"],
    index: Integer[Scalar, ""],
    response: Response | None,
) -> Float[Array, "pixel number"]:
    dtype = sky.wavelength.dtype
    key = jax.random.fold_in(jax.random.key(0), index)

    def towards(pixel):
        u = jax.random.uniform(jax.random.fold_in(key, pixel), (2,), dtype)
        x, y = pixel % camera.width, pixel // camera.width
        return camera.direction(x.astype(dtype) + u[0], y.astype(dtype) + u[1])

    directions = jax.vmap(towards)(pixels)
    positions = jnp.broadcast_to(camera.position, directions.shape)
    solver = _shuffled(sky.solver, index, pixels[0])
    anew = dataclasses.replace(sky, solver=solver)
    if isinstance(solver, AbstractTracing):
        found = estimates(anew, positions, directions)
        seen, late = found.mean, found.late
    else:
        seen = jax.vmap(anew.radiance)(positions, directions)
        late = jnp.zeros_like(seen[:, 0])
    if response is not None:
        seen = jnp.matmul(seen, response, precision="highest")
    return jnp.concatenate([seen, late[:, None]], 1)


def _shuffled(solver: AbstractSolver, *numbers: Integer[Scalar, ""]) -> AbstractSolver:
    """The solver with other random numbers, if it has any."""

    def anew(x):
        if jnp.issubdtype(x.dtype, jax.dtypes.prng_key):
            for number in numbers:
                x = jax.random.fold_in(x, number)
        return x

    return jax.tree.map(anew, solver)


def _sees(camera: AbstractCamera) -> np.ndarray:
    """Which pixels belong to the picture, row after row."""
    sees = np.broadcast_to(camera.sees(), (camera.height, camera.width))
    return sees.ravel()


def _variance(tally: Tally) -> np.ndarray:
    count = float(tally.count)
    return np.asarray(tally.squares) / np.maximum(count * (count - 1.0), 0.0)
