import abc
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, PyTree

from ..light import Sun
from ..quantity import (
    as_float,
    Direction,
    Position,
    Radiance,
    versine,
    Wavelength,
)
from ..scene import Scene
from ..sky import AbstractSky, Grid, Panorama


class AbstractSolver(eqx.Module):
    """A way to find the light in a scene."""

    @abc.abstractmethod
    def prepare(self, scene: Scene, wavelength: Wavelength) -> PyTree[Any]:
        """What can be worked out before the first look; None if nothing."""

    @abc.abstractmethod
    def scattered(
        self,
        prepared: PyTree[Any],
        scene: Scene,
        light: Sun,
        wavelength: Wavelength,
        position: Position,
        direction: Direction,
    ) -> Float[Array, "part wl"]:
        """What one sees by one light, in parts.

        A part for each medium that scatters, which is yet to be multiplied by the
        medium's phase function towards the light, and a last one that is radiance as it
        stands.
        """


class SolvedSky(AbstractSky):
    """A scene, seen through a solver."""

    scene: Scene
    solver: AbstractSolver
    wavelength: Wavelength
    prepared: PyTree[Any]

    def radiance(self, position: Position, direction: Direction) -> Radiance:
        total = jnp.zeros_like(self.wavelength)
        for light in self.scene.lights:
            parts = self._parts(light, position, direction)
            turned = versine(direction, light.direction)
            for medium, part in zip(self.scene.scattering_media, parts, strict=False):
                total += medium.phase.evaluate(turned, self.wavelength) * part
            total += parts[-1]
        return total

    def panorama(
        self, position: Position, *, above: int = 64, below: int = 48, around: int = 33
    ) -> Panorama:
        """All that one sees from `position`, on a grid of that many directions.

        `above` and `below` count rings over and under the horizon, `around` azimuths on
        half a ring. Zenith angles and azimuths are those at the origin, so the place must
        lie straight above it: raises `ValueError` otherwise.
        """
        if not isinstance(position, jax.core.Tracer) and np.any(
            np.asarray(position)[:2] != 0.0
        ):
            raise ValueError(
                f"`position` must lie straight above the origin; got {position}."
            )
        altitude = position[2]
        below_level, first = self._edges(altitude)
        grid = Grid(first, 0.5 * jnp.pi + below_level, above, below, around)
        zeniths, azimuths = grid.zeniths(), grid.azimuths()

        def ring(light, zenith):
            east, north = light.horizontal

            def look(azimuth):
                ahead, aside = jnp.cos(azimuth), jnp.sin(azimuth)
                level = jnp.stack(
                    [east * ahead + north * aside, north * ahead - east * aside]
                )
                direction = jnp.concatenate(
                    [jnp.sin(zenith) * level, jnp.cos(zenith)[None]]
                )
                return self._parts(light, position, direction)

            return jax.vmap(look)(azimuths)

        tables = [
            jax.lax.map(lambda z, x=light: ring(x, z), zeniths, batch_size=16)
            for light in self.scene.lights
        ]
        parts = len(self.scene.scattering_media) + 1
        shape = (0, above + below, around, parts, *self.wavelength.shape)
        return Panorama(
            grid=grid,
            table=jnp.stack(tables) if tables else jnp.zeros(shape, altitude.dtype),
            light_zenith=_stack([x.zenith for x in self.scene.lights], altitude),
            light_azimuth=_stack([x.azimuth for x in self.scene.lights], altitude),
            phases=tuple(x.phase for x in self.scene.scattering_media),
            wavelength=self.wavelength,
        )

    def _edges(self, altitude):
        """How far the horizon lies below level, and the zenith angle where air begins."""
        geometry, top = self.scene.geometry, self.scene.top
        outside = altitude > top
        limb = geometry.dip(altitude, top)
        first = jnp.where(outside, 0.5 * jnp.pi + limb, 0.0)
        return geometry.dip(altitude, jnp.zeros_like(top)), first

    def _parts(self, light, position, direction):
        return self.solver.scattered(
            self.prepared, self.scene, light, self.wavelength, position, direction
        )


def _stack(numbers, like):
    return jnp.stack(numbers) if numbers else jnp.zeros(0, like.dtype)


def solve(scene: Scene, solver: AbstractSolver, wavelength: ArrayLike) -> SolvedSky:
    """Finds the light in a scene, at wavelengths in nm.

    All numbers take on the precision of `wavelength`. Raises `ValueError` unless the
    wavelengths are one-dimensional, lie between 100 nm and 100 um, and every table of the
    scene covers them.
    """
    wavelength = as_float(wavelength)
    if wavelength.ndim != 1:
        raise ValueError(
            f"`wavelength` must be one-dimensional; got shape {wavelength.shape}."
        )
    if isinstance(wavelength, jax.core.Tracer):
        wavelength = eqx.error_if(
            wavelength,
            ~jnp.all((wavelength >= 100.0) & (wavelength <= 1e5)),
            "`wavelength` must lie between 100 and 100000 nm.",
        )
    else:
        _check_wavelength(scene, np.asarray(wavelength))
    scene = jax.tree.map(lambda x: x.astype(wavelength.dtype), scene)
    return SolvedSky(
        scene=scene,
        solver=solver,
        wavelength=wavelength,
        prepared=solver.prepare(scene, wavelength),
    )


def _check_wavelength(scene: Scene, wavelength: np.ndarray) -> None:
    for value in wavelength:
        if not 100.0 <= value <= 1e5:
            raise ValueError(
                f"`wavelength` must lie between 100 and 100000 nm; got {value}."
            )
    if not wavelength.size:
        return
    known = lambda x: hasattr(x, "domain")
    for path, leaf in jax.tree_util.tree_leaves_with_path(scene, is_leaf=known):
        if not known(leaf) or any(
            isinstance(x, jax.core.Tracer) for x in jax.tree.leaves(leaf)
        ):
            continue
        low, high = leaf.domain
        if wavelength.min() < low or wavelength.max() > high:
            raise ValueError(
                f"`scene{jax.tree_util.keystr(path)}` must cover the wavelengths "
                f"{wavelength.min():g} to {wavelength.max():g} nm; it is known from "
                f"{low:g} to {high:g} nm."
            )
