import abc
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Integer, PyTree, Scalar

from ..light import AbstractLight
from ..quantity import Direction, Number, Position, Wavelength
from ..scene import Scene
from ._base import AbstractSolver
from ._sky import SolvedSky
from ._walk import Walk
from .single_scattering import SingleScattering


class Tally(eqx.Module):
    """The mean of independent trials, and how much they scatter about it.

    `squares` is the sum of the squared distances from the mean. Of even light, what
    comes `late` comes by paths that were so long that they were ended by chance.
    """

    count: Number
    mean: Float[Array, "*batch wl"]
    squares: Float[Array, "*batch wl"]
    late: Float[Array, "*batch"] | float = 0.0

    @classmethod
    def of(cls, trials: Float[Array, "trial *batch wl"]) -> "Tally":
        mean = jnp.mean(trials, 0)
        squares = jnp.sum((trials - mean[None]) ** 2, 0)
        return cls(jnp.asarray(trials.shape[0], mean.dtype), mean, squares)

    def join(self, other: "Tally") -> "Tally":
        """That of both together (Chan, Golub and LeVeque 1983)."""
        count = self.count + other.count
        part = other.count / count
        apart = other.mean - self.mean
        squares = self.squares + other.squares + self.count * part * apart * apart
        return Tally(count, self.mean + part * apart, squares)

    @property
    def standard_error(self) -> Float[Array, "*batch wl"]:
        return jnp.sqrt(self.squares / (self.count * (self.count - 1.0)))


def joined(
    trials: Callable[[Integer[Array, ""]], Float[Array, "trial look wl"]],
    first: Integer[Scalar, ""],
    blocks: Integer[Scalar, ""],
    dark: Float[Array, "look wl"],
) -> Tally:
    """That of so many blocks of trials, from the `first` on."""
    none = Tally(jnp.zeros_like(dark, shape=()), dark, dark)
    more = lambda i, tally: tally.join(Tally.of(trials(first + i)))
    return jax.lax.fori_loop(0, blocks, more, none)


def ended(onwards: Callable[[Walk], Walk], paths: Walk) -> Walk:
    """Paths, gone on with until none of them is left."""
    return jax.lax.while_loop(lambda x: jnp.any(x.left > 0), onwards, paths)


class AbstractTracing(AbstractSolver):
    """Light by random paths: right on average, with a standard error.

    Light that turned once comes from `single`, exactly; with None it is traced too.
    """

    single: eqx.AbstractVar[SingleScattering | None]

    @abc.abstractmethod
    def tally(
        self,
        prepared: PyTree[Any],
        scene: Scene,
        light: AbstractLight | None,
        wavelength: Wavelength,
        positions: Float[Array, "look 3"],
        directions: Float[Array, "look 3"],
        first: Integer[Scalar, ""] | int = 0,
    ) -> Tally:
        """What the paths find in each direction, in blocks from the `first` on.

        Of one light; or, with None, of the media that shine.
        """


class Estimate(eqx.Module):
    """A radiance, how far it is likely to be off, and what comes `late` (`Tally`)."""

    mean: Float[Array, "*look wl"]
    standard_error: Float[Array, "*look wl"]
    late: Float[Array, "*look"]


@eqx.filter_jit
def estimate(sky: SolvedSky, position: Position, direction: Direction) -> Estimate:
    """What one sees, with its standard error.

    Raises `ValueError` for a sky that is not path traced.
    """
    found = estimates(sky, position[None], direction[None])
    return jax.tree.map(lambda x: x[0], found)


@eqx.filter_jit
def estimates(
    sky: SolvedSky,
    positions: Float[Array, "look 3"],
    directions: Float[Array, "look 3"],
) -> Estimate:
    """The same of many looks together, which takes less time than one by one."""
    solver = sky.solver
    if not isinstance(solver, AbstractTracing):
        raise ValueError(f"`sky` must be traced by paths; got {type(solver).__name__}.")
    total = jnp.zeros((*positions.shape[:1], *sky.wavelength.shape), directions.dtype)
    mean, variance, late = total, total, total[:, 0]
    lights: list[AbstractLight | None] = list(sky.scene.lights)
    if any(x.emission is not None for x in sky.scene.media):
        lights.append(None)
    for light in lights:
        tally = solver.tally(
            sky.prepared,
            sky.scene,
            light,
            sky.wavelength,
            positions,
            directions,
        )
        mean += tally.mean
        variance += tally.standard_error**2
        late += tally.late / len(lights)
    if solver.single is not None:
        once = SolvedSky(
            scene=sky.scene,
            solver=solver.single,
            wavelength=sky.wavelength,
            prepared=None,
        )
        mean += jax.vmap(once.radiance)(positions, directions)
    return Estimate(mean, jnp.sqrt(variance), late)
