"""What solvers have in common that find diffuse light as a field."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..light import Sun
from ..quantity import Direction, dot, Irradiance, Number, Position, Wavelength
from ..scene import Scene
from ..transport import columns, contract, extinctions
from ._azimuths import drawn
from ._base import AbstractSolver
from ._field import AbstractField
from ._peaks import Peaks
from ._sight import sight
from .single_scattering import SingleScattering


class Diffused(eqx.Module):
    """Diffuse light, and the forward peaks of media that it does not notice.

    `error` is what share of the light's first order is missing in the whole. Without
    `peaks` these are taken as not scattered at all.
    """

    field: AbstractField
    peaks: Peaks | None
    error: Number


class Fluxes(eqx.Module):
    """The light that crosses a level plane, in W m^-2 nm^-1."""

    up: Irradiance
    diffuse: Irradiance
    direct: Irradiance


class AbstractDiffuse(AbstractSolver):
    """A solver that finds diffuse light as a field, for light that turned again.

    What turned once is added in the round and with the peaks of phase functions
    (Nakajima and Tanaka 1988), and so is what peaks alone turned more than once. A line
    of sight takes `nodes` places in each of `pieces` pieces.
    """

    pieces: eqx.AbstractVar[int]
    nodes: eqx.AbstractVar[int]
    single: eqx.AbstractVar[SingleScattering]

    def scattered(
        self,
        prepared: Diffused,
        scene: Scene,
        light: Sun,
        wavelength: Wavelength,
        position: Position,
        direction: Direction,
    ) -> Float[Array, "part wl"]:
        towards = light.direction[None]
        look = wavelength, position, direction
        return self.scattered_from(prepared, scene, light, towards, *look)[0]

    def scattered_from(
        self,
        prepared: Diffused,
        scene: Scene,
        light: Sun,
        towards: Float[Array, "light 3"],
        wavelength: Wavelength,
        position: Position,
        direction: Direction,
        every: int = 1,
    ) -> Float[Array, "light part wl"]:
        field, peaks = prepared.field, prepared.peaks
        look = position, direction
        line = sight(scene, *look, field.mixture.extinction, self.pieces)
        fewer = field.mixture if peaks is None else peaks.within

        def once(towards):
            stands = dataclasses.replace(light, direction=towards)
            lit = scene, fewer.extinction, stands, wavelength
            return self.single.march(*lit, *look)

        found = drawn(once, towards, every)
        more = jnp.zeros_like(found[:, -1])
        if peaks is not None:
            known = scene, light, towards, wavelength, line
            more = peaks.scattered(*known, jnp.sum(found[:, :-1], 1), every)
        known = scene, light, towards, wavelength, line, found
        again = field.gather(*known, nodes=self.nodes)
        found = found.at[:, -1].add(more + again[:, 0])
        return jnp.concatenate([found, again[:, 1:]], 1)

    def fluxes(
        self,
        prepared: Diffused,
        scene: Scene,
        light: Sun,
        wavelength: Wavelength,
        position: Position,
    ) -> Fluxes:
        """What crosses a level plane at a place, by one light."""
        point = scene.geometry.locate(position)
        rise = jnp.maximum(dot(point.up, light.direction), 0.0)
        irradiance = light.irradiance.evaluate(wavelength)
        up, down = prepared.field.fluxes(scene, light, point)
        path = scene.geometry.path(point, light.direction)
        found = columns(scene, path, path.span(scene.top).far, nodes=16)
        passed = lambda x: rise * jnp.exp(-contract("m,ml->l", found, x))
        direct = passed(extinctions(scene, wavelength))
        # What went on in the forward peak is no more direct.
        ahead = passed(prepared.field.mixture.extinction) - direct
        return Fluxes(up * irradiance, (down + ahead) * irradiance, direct * irradiance)
