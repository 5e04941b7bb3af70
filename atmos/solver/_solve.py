"""From a scene and a solver to a sky, past the checks at the door."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import ArrayLike

from ..light import Sun
from ..quantity import as_float, Wavelength
from ..scene import Scene
from ._base import AbstractSolver
from ._sky import SolvedSky


def solve(scene: Scene, solver: AbstractSolver, wavelength: ArrayLike) -> SolvedSky:
    """Finds the light in a scene, at wavelengths in nm.

    All numbers take on the precision of `wavelength`. Raises `ValueError` unless the
    wavelengths are one-dimensional, lie between 100 nm and 100 um, and every table of
    the scene covers them; and for a scene that the solver does not hold for.
    """
    scene, solver, nm = admit(scene, solver, wavelength)
    prepared = solver.found(_prepare(solver, solver.baked(scene), nm))
    return SolvedSky(scene=scene, solver=solver, wavelength=nm, prepared=prepared)


def admit(
    scene: Scene, solver: AbstractSolver, wavelength: ArrayLike
) -> tuple[Scene, AbstractSolver, Wavelength]:
    """A scene, a solver that suits it, and wavelengths, or the errors of `solve`."""
    nm = as_float(wavelength)
    if nm.ndim != 1:
        raise ValueError(f"`wavelength` must be one-dimensional; got shape {nm.shape}.")
    if isinstance(nm, Tracer):
        known = jnp.all((nm >= 100.0) & (nm <= 1e5))
        nm = eqx.error_if(nm, ~known, "`wavelength` must lie between 100 and 1e5 nm.")
    else:
        _check_wavelength(scene, np.asarray(nm))
    for i, x in enumerate(scene.media):
        if x.emission is not None and not solver.shining:
            raise ValueError(
                f"`scene.media[{i}].emission` must be None, for this solver; got "
                f"{type(x.emission).__name__}."
            )
    for i, x in enumerate(scene.lights):
        if not (isinstance(x, Sun) or solver.lamps):
            raise ValueError(
                f"`scene.lights[{i}]` must be a sun, for this solver; got "
                f"{type(x).__name__}."
            )
    if scene.surfaces and not solver.solid:
        raise ValueError(
            f"`scene.surfaces` must be empty, for this solver; got "
            f"{len(scene.surfaces)}."
        )
    with jax.ensure_compile_time_eval():  # what is not traced stays known
        scene = jax.tree.map(lambda x: x.astype(nm.dtype), scene)
    scene = solver.check(scene, nm)
    return scene, solver.suited(scene, nm), nm


@eqx.filter_jit
def _prepare(solver: AbstractSolver, scene: Scene, wavelength: Wavelength):
    return solver.prepare(scene, wavelength)


def _check_wavelength(scene: Scene, wavelength: np.ndarray) -> None:
    for value in wavelength:
        if not 100.0 <= value <= 1e5:
            raise ValueError(
                f"`wavelength` must lie between 100 and 100000 nm; got {value}."
            )
    if not wavelength.size:
        return
    known = lambda x: hasattr(type(x), "domain")
    for path, leaf in jax.tree_util.tree_leaves_with_path(scene, is_leaf=known):
        if not known(leaf) or any(isinstance(x, Tracer) for x in jax.tree.leaves(leaf)):
            continue
        low, high = leaf.domain
        if wavelength.min() < low or wavelength.max() > high:
            raise ValueError(
                f"`scene{jax.tree_util.keystr(path)}` must cover the wavelengths "
                f"{wavelength.min():g} to {wavelength.max():g} nm; it is known from "
                f"{low:g} to {high:g} nm."
            )
