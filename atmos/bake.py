"""What a solver worked out for a sky, in a file, so that the next one starts at once.

The file is one of `atmos.archive`. It holds the arrays of `SolvedSky.prepared`, each
named by the way to it, such as `prepared.field.moments`. A bake serves nothing but what
it was made of, to the last bit: the same solver with all its settings, the same
wavelengths in the same precision, and the same scene but for what the solver's `baked`
leaves out.
"""

import os
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.tree_util import keystr, tree_leaves_with_path
from jaxtyping import ArrayLike

from . import archive
from .scene import Scene
from .solver import AbstractSolver, admit, SolvedSky


KIND = archive.Kind("bake", 3, "sky")


def save(sky: SolvedSky, path: str | os.PathLike[str]) -> None:
    """Keeps what was worked out for a sky in a file.

    It is written whole, or whatever was there stays. Raises `ValueError` for a solver
    that works nothing out before the first look, `OSError` where the file cannot be
    written.
    """
    arrays: dict[str, Any] = {name: np.asarray(x) for name, x in _named(sky.prepared)}
    if not arrays:
        raise ValueError(
            f"`sky` must hold what takes time to work out; {type(sky.solver).__name__} "
            "works nothing out before the first look."
        )
    archive.write(path, KIND, _made(sky.scene, sky.solver, sky.wavelength), arrays)


def load(
    path: str | os.PathLike[str],
    scene: Scene,
    solver: AbstractSolver,
    wavelength: ArrayLike,
) -> SolvedSky:
    """The sky that `solve` would find, from a file that `save` made for the same.

    Raises `ValueError` naming the file where it is something else, cut short or
    damaged, or serves another sky, and then says what differs; `OSError` where it
    cannot be read; and the errors of `solve`.
    """
    scene, solver, nm = admit(scene, solver, wavelength)
    arrays = archive.read(path, KIND, _made(scene, solver, nm))

    # What `prepare` would make of it, without the work.
    empty = eqx.filter_eval_shape(solver.prepare, solver.baked(scene), nm)
    wanted = dict(_named(empty))
    kind = lambda x: None if x is None else f"{x.dtype}{list(x.shape)}"
    for key in [*wanted, *arrays]:
        archive.compare(path, KIND, key, *map(kind, (arrays.get(key), wanted.get(key))))
    leaves = [jnp.asarray(arrays[key]) for key in wanted]
    prepared = jax.tree.unflatten(jax.tree.structure(empty), leaves)
    return SolvedSky(scene=scene, solver=solver, wavelength=nm, prepared=prepared)


def _named(prepared: Any) -> list[tuple[str, Any]]:
    found = tree_leaves_with_path(prepared)
    return [(f"prepared{keystr(path)}", x) for path, x in found]


def _made(scene: Scene, solver: AbstractSolver, wavelength: Any) -> dict[str, str]:
    """What a bake hangs on, in words."""
    scene = solver.baked(scene)
    return archive.words(wavelength=wavelength, solver=solver, scene=scene)
