import math
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

from ..geometry import AbstractPath, Point
from ..light import Sun
from ..quantity import (
    Direction,
    dot,
    Length,
    Position,
    Radiance,
    versine,
    Wavelength,
)
from ..scene import Scene
from ..transport import enter, extinctions
from ._base import AbstractSolver
from ._ray import cut, Found, Ray, total
from ._shadows import AbstractShadows, ShadowRays
from ._steps import AbstractSteps, Fixed


class RayMarching(AbstractSolver):
    """Light that turned once, and light of media that shine, in any media.

    The ray is marched along by `steps`, and light is dimmed on its way there as
    `shadows` say; within a step both are as in one place of it. Gradients are those of
    the sum over steps, by reverse mode.
    """

    around: ClassVar[int] = 17
    shining: ClassVar[bool] = True
    steps: AbstractSteps = Fixed()
    shadows: AbstractShadows = ShadowRays()
    stokes: int = eqx.field(static=True, init=False, default=1)

    def prepare(self, scene: Scene, wavelength: Wavelength) -> PyTree[Any]:
        return self.steps.prepare(scene, wavelength), self.shadows.prepare(scene)

    def scattered(
        self,
        prepared: PyTree[Any],
        scene: Scene,
        light: Sun,
        wavelength: Wavelength,
        position: Position,
        direction: Direction,
    ) -> Float[Array, "part wl"]:
        ray, found = self._lit(prepared, scene, light, wavelength, position, direction)
        irradiance = light.irradiance.evaluate(wavelength)
        air = [
            x.scattering.evaluate(wavelength) * irradiance * part
            for x, part in zip(scene.scattering_media, found.light, strict=True)
            if x.scattering is not None
        ]
        return jnp.stack([*air, jnp.exp(-ray.depth(found)) * ray.behind])

    def error(
        self,
        prepared: PyTree[Any],
        scene: Scene,
        light: Sun,
        wavelength: Wavelength,
        position: Position,
        direction: Direction,
    ) -> Radiance:
        """How far what one sees by one light may be off for the steps' length.

        0 unless steps are adaptive: others do not know.
        """
        looks = prepared, scene, light, wavelength, position, direction
        return self._lit(*looks)[1].error

    def emitted(
        self,
        prepared: PyTree[Any],
        scene: Scene,
        wavelength: Wavelength,
        position: Position,
        direction: Direction,
    ) -> Radiance:
        def source(at: Length, point: Point, here: Float[Array, "medium"]):
            total = jnp.zeros_like(wavelength)
            for density, x in zip(here, scene.media, strict=True):
                if x.emission is not None:
                    absorption = x.absorption.evaluate(wavelength)
                    shines = x.emission.evaluate(point, absorption, wavelength)
                    total += density * shines
            return total[None]

        path, far, _ = enter(scene, position, direction)
        dark = jnp.zeros_like(wavelength)
        none = jnp.zeros_like(far)[None]
        world = prepared, scene, path, far, none, wavelength
        ray = self._ray(*world, source, dark[None] + 1.0, dark)
        return self.steps.march(ray).light[0]

    def _lit(
        self,
        prepared: PyTree[Any],
        scene: Scene,
        light: Sun,
        wavelength: Wavelength,
        position: Position,
        direction: Direction,
    ) -> tuple[Ray, Found]:
        path, far, grounded = enter(scene, position, direction)
        extinction = extinctions(scene, wavelength)
        irradiance = light.irradiance.evaluate(wavelength)
        dark = path.shadow(light.direction, jnp.zeros_like(far))
        turns = [i for i, x in enumerate(scene.media) if x.scattering is not None]

        columns = self.shadows.towards(prepared[1], scene, light)

        def arrives(point: Point):
            return jnp.exp(-total(columns(point), extinction))

        def source(at: Length, point: Point, here: Float[Array, "medium"]):
            lit = (at < dark[0]) | (at > dark[1])
            some = jnp.where(lit, arrives(point), 0.0)
            none = jnp.zeros((0, *wavelength.shape), wavelength.dtype)
            parts = [here[i] * some for i in turns]
            return jnp.stack(parts) if parts else none

        turned = versine(direction, light.direction)
        weights = [
            x.scattering.evaluate(wavelength)
            * x.phase.evaluate(turned, wavelength)
            * irradiance
            for x in scene.scattering_media
            if x.scattering is not None
        ]
        wide = lambda x: jnp.broadcast_to(x, wavelength.shape)
        none = jnp.zeros((0, *wavelength.shape), wavelength.dtype)
        foot = path.at(far)
        foot = Point(foot.position, jnp.zeros_like(far), foot.up)
        rise = jnp.maximum(dot(foot.up, light.direction), 0.0)
        albedo = scene.ground.evaluate(wavelength)
        ground = albedo / math.pi * rise * arrives(foot) * irradiance
        ray = self._ray(
            prepared,
            scene,
            path,
            far,
            dark,
            wavelength,
            source,
            jnp.stack([wide(x) for x in weights]) if weights else none,
            jnp.where(grounded, ground, 0.0),
        )
        return ray, self.steps.march(ray)

    def _ray(
        self,
        prepared: PyTree[Any],
        scene: Scene,
        path: AbstractPath,
        far: Length,
        others: Float[Array, "other"],
        wavelength: Wavelength,
        source: Any,
        weights: Float[Array, "part wl"],
        behind: Radiance,
    ) -> Ray:
        return Ray(
            scene=scene,
            path=path,
            cuts=cut(scene, path, far, others, self.steps.pieces),
            extinction=extinctions(scene, wavelength),
            source=source,
            weights=weights,
            behind=behind,
            prepared=prepared[0],
        )
