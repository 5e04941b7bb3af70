import abc
import dataclasses
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

from ..light import AbstractLight, Sun
from ..quantity import Direction, Position, Radiance, Wavelength
from ..scene import Scene


class AbstractSolver(eqx.Module):
    """A way to find the light in a scene.

    By day, what it finds varies little between `around` azimuths on half a circle. It
    is radiance alone where `stokes` is 1, and I, Q and U where that is 3. What media
    shine of themselves is found where `shining`; elsewhere such media are refused, as
    are lights other than suns but for `lamps`, and surfaces but where `solid`.
    """

    around: ClassVar[int]
    shining: ClassVar[bool] = False
    lamps: ClassVar[bool] = False
    solid: ClassVar[bool] = False
    stokes: eqx.AbstractVar[int]

    def check(self, scene: Scene, wavelength: Wavelength) -> Scene:
        """The scene, if the method holds for it; raises `ValueError` otherwise.

        Where that hangs on numbers yet to be traced, what is made of the scene raises
        when it is run.
        """
        return scene

    def suited(self, scene: Scene, wavelength: Wavelength) -> "AbstractSolver":
        """This solver, with what it leaves open settled to suit a scene."""
        return self

    def baked(self, scene: Scene) -> Scene:
        """All of a scene that `prepare` is told: less than the whole if that will do.

        What was worked out then serves every scene that differs in the rest alone.
        """
        return scene

    @abc.abstractmethod
    def prepare(self, scene: Scene, wavelength: Wavelength) -> PyTree[Any]:
        """What can be worked out before the first look; None if nothing."""

    def found(self, prepared: PyTree[Any]) -> PyTree[Any]:
        """What `prepare` made, if it is good enough; raises `ValueError` otherwise.

        Where that hangs on numbers yet to be traced, it raises when it is run.
        """
        return prepared

    def check_panorama(self, scene: Scene, lowest: float) -> None:
        """Raises `ValueError` for a place whose horizon the method does not hold for.

        There the lowest light has this zenith angle.
        """

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
        medium's phase function towards the light, and then radiance as it stands, or
        I, Q and U as they stand.
        """

    def scattered_from(
        self,
        prepared: PyTree[Any],
        scene: Scene,
        light: Sun,
        towards: Float[Array, "light 3"],
        wavelength: Wavelength,
        position: Position,
        direction: Direction,
        every: int = 1,
    ) -> Float[Array, "light part wl"]:
        """The same for a light that stands in one of several directions instead.

        Where these lie on half a circle, from the azimuth of the view to the opposite
        one, it is enough to know for `every` so many of them what varies little.
        """
        del every

        def of(towards):
            stands = dataclasses.replace(light, direction=towards)
            look = scene, stands, wavelength, position, direction
            return self.scattered(prepared, *look)

        return jax.vmap(of)(towards)

    def emitted(
        self,
        prepared: PyTree[Any],
        scene: Scene,
        wavelength: Wavelength,
        position: Position,
        direction: Direction,
    ) -> Radiance:
        """What one sees of media that shine of themselves."""
        return jnp.zeros_like(wavelength)

    def shone(
        self,
        prepared: PyTree[Any],
        scene: Scene,
        light: AbstractLight,
        wavelength: Wavelength,
        position: Position,
        direction: Direction,
    ) -> Radiance:
        """What one sees by a light that is no sun."""
        return jnp.zeros_like(wavelength)


def check_stokes(stokes: int) -> None:
    """Raises `ValueError` for a number of Stokes parameters that is not 1 or 3."""
    if stokes not in (1, 3):
        raise ValueError(f"`stokes` must be 1 or 3; got {stokes}.")
