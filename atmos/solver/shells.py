import dataclasses
import math
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.core import Tracer
from jaxtyping import Array, Float

from ..geometry import Flat
from ..optics import check_layered, layers, Mixture
from ..quantity import Wavelength
from ..scene import Scene
from ..transport import contract
from ._base import check_stokes
from ._diffuse import AbstractDiffuse, Diffused
from ._field import Field
from ._krylov import fixed_point
from ._levels import Bends
from ._once import Once
from ._peaks import Peaks
from ._rays import rays
from ._step import Suns
from ._sunlight import sunlight
from ._suns import RoundSuns
from ._sweep import Light, Sweep
from .single_scattering import SingleScattering


class Shells(AbstractDiffuse):
    """All orders of scattering in a round world, by day, in twilight and from space.

    Light is carried along straight lines from one of `layers` shells of air to the
    next, a line that turns round within each and `grounded` lines that meet the ground,
    in `azimuths` azimuths from the sun's; where the planet's shadow begins and ends is
    exact. What scatters is kept by shell, in spherical harmonics of degrees below
    `degrees`, for `suns` zenith angles of the sun from the zenith on into the night,
    relative to how bright it is there: it serves every sun and every place. Orders are
    added up by solving for their sum, until it is right to `tolerance`; a solution that
    is not after `orders` steps is refused. Phase functions are without their forward
    peaks (delta-M, Wiscombe 1977), but for light that turned once, which is added with
    them (Nakajima and Tanaka 1988), and what peaks alone turned more than once. A line
    of sight takes `nodes` places in each of `pieces` pieces.

    Raises `ValueError` for a flat world, where a medium does not depend on altitude
    alone, where media have more edges than there are layers, and where `tolerance` is
    not reached; for other `stokes` than 1 and 3, and for 3 with fewer than 3 degrees.

    With `stokes` 3 the light is polarised, which changes its radiance too.
    """

    around: ClassVar[int] = 17
    layers: int = eqx.field(static=True, default=40)
    grounded: int = eqx.field(static=True, default=10)
    azimuths: int = eqx.field(static=True, default=12)
    degrees: int = eqx.field(static=True, default=16)
    suns: int = eqx.field(static=True, default=64)
    tolerance: float = eqx.field(static=True, default=1e-5)
    orders: int = eqx.field(static=True, default=200)
    pieces: int = eqx.field(static=True, default=12)
    nodes: int = eqx.field(static=True, default=3)
    single: SingleScattering = SingleScattering()
    stokes: int = eqx.field(static=True, default=1)

    def __check_init__(self):
        check_stokes(self.stokes)
        if self.stokes == 3 and self.degrees < 3:
            raise ValueError(
                f"`degrees` must be at least 3 where `stokes` is 3; got {self.degrees}."
            )

    def check(self, scene: Scene, wavelength: Wavelength) -> Scene:
        check_layered(scene)
        if isinstance(scene.geometry, Flat):
            raise ValueError("`scene.geometry` must be round, for shells; got Flat.")
        return scene

    def baked(self, scene: Scene) -> Scene:
        return dataclasses.replace(scene, lights=())

    def prepare(self, scene: Scene, wavelength: Wavelength) -> Diffused:
        peaks = Peaks.of(scene, wavelength, self.degrees, self.stokes)
        mixed = peaks.without
        start, once = self._start(scene, wavelength, mixed)

        # First to see how bright it is, then relative to that.
        def look(rough, found):
            suns = dataclasses.replace(start.suns, rough=rough == 0)
            sweep = dataclasses.replace(start, reference=found[0], suns=suns)
            first = sweep.first(once)
            steepest = start.up[:, self.grounded - 1]
            bright = _brightness(scene, suns.zenith, steepest, first)
            reference = jnp.where(suns.rough, bright, found[0])
            return jax.lax.stop_gradient(reference), first

        none = jax.eval_shape(start.first, once)
        none = jax.tree.map(lambda x: jnp.zeros(x.shape, x.dtype), none)
        reference, first = jax.lax.fori_loop(0, 2, look, (start.reference, none))
        sweep = dataclasses.replace(start, reference=reference)
        light, error = fixed_point(
            lambda x: sweep.carry(x.moments), first, self.tolerance, self.orders
        )
        levels, suns = start.rays.altitude, start.suns.zenith
        found = light.moments, light.up, light.down, reference
        field = Field(mixed, levels, suns, *found, self.stokes)
        return Diffused(field, peaks, jnp.max(error, initial=0.0))

    def found(self, prepared: Diffused) -> Diffused:
        rule = f"`tolerance` must be reached within {self.orders} `orders`"
        error, enough = prepared.error, prepared.error <= self.tolerance
        if isinstance(error, Tracer):
            return eqx.error_if(prepared, ~enough, f"{rule}.")
        if not enough:
            raise ValueError(f"{rule}; what is missing is {float(error):.2g}.")
        return prepared

    def _start(
        self, scene: Scene, wavelength: Wavelength, mixed: Mixture
    ) -> tuple[Sweep, Once]:
        """How light is carried, for a reference that is everywhere 1."""
        cut = layers(scene, mixed.extinction, self.layers, _EVEN)
        lines = rays(scene, cut, self.grounded)
        dip = scene.geometry.dip(scene.top, jnp.zeros_like(scene.top))
        beyond = lambda dips: jnp.minimum(0.5 * math.pi + dips * dip, math.pi)
        crowd = beyond(_SETS)[None], beyond(_DARK), _CLOSE * dip
        zenith = RoundSuns(*crowd, self.suns)
        suns = Suns(zenith, jnp.zeros((), bool), self.azimuths)
        within = lambda x: contract("km,m...->k...", cut.column, x)
        depth = within(mixed.extinction)[:, None]
        thick = depth > 0.0
        share = jnp.where(thick, 1.0 / jnp.where(thick, depth, 1.0), 0.0)
        through = lambda steps: contract("ikm,ml->ikl", steps.column, mixed.extinction)
        ground = scene.ground.evaluate(wavelength)
        start = Sweep(
            rays=lines,
            suns=suns,
            up=through(lines.up),
            down=through(lines.down),
            bends=Bends.of(depth[:, 0]),
            turned=within(mixed.scattering) * share,
            polarised=within(mixed.polarised) * share[:, None],
            albedo=jnp.broadcast_to(ground, wavelength.shape),
            reference=jnp.zeros((self.layers + 1, self.suns), wavelength.dtype),
            stokes=self.stokes,
        )
        stands = zenith.zeniths(), suns.azimuth(), self.stokes
        return start, Once(scene, mixed, lines, sunlight(scene), *stands)


# Each layer has a line that turns round in it: so there are some where air is thin too.
_EVEN = 4.5
# Suns crowd where they set for the air, and end where it is night: by how far below the
# level they stand, of how far the top of the air sees below it.
_SETS, _CLOSE, _DARK = 0.7, 0.5, 3.5
# What the logarithm of brightness at most loses from one sun to the next, and while the
# sun sinks by as much as the top of the air sees below level. Light that turned once
# ends at twice that, and other light does not: relative to what is so much darker than
# itself it could not be joined by cubics.
_STEEPEST, _SINKS = 1.2, 8.0
# And from one level to the next, beside what lies between them takes.
_FADES = 1.0


def _brightness(
    scene: Scene, suns: RoundSuns, depth: Float[Array, "layer wl"], light: Light
) -> Float[Array, "level sun"]:
    """The logarithm of how bright light is, at all wavelengths taken together.

    Nowhere much less than at the levels next to it, from which light comes through the
    optical depth between them: what rounding leaves of none by night is no measure.
    """
    mean = light.moments[:, 0]
    least = float(jnp.finfo(mean.dtype).tiny) ** 0.5
    found = jnp.log(jnp.maximum(mean, least))
    found = jnp.mean(found - found[:1, :1], -1)
    dip = scene.geometry.dip(scene.top, jnp.zeros_like(scene.top))
    falls = jnp.minimum(_SINKS / dip * jnp.diff(suns.zeniths()), _STEEPEST)

    def follow(before, x):
        here = jnp.maximum(x[0], before - x[1])
        return here, here

    _, rest = jax.lax.scan(follow, found[:, 0], (found[:, 1:].T, falls))
    found = jnp.concatenate([found[:, :1], rest.T], 1)
    fades = _FADES + 2.0 * jnp.mean(depth, -1)
    _, down = jax.lax.scan(follow, found[-1], (found[:-1], fades), reverse=True)
    found = jnp.concatenate([down, found[-1:]])
    _, up = jax.lax.scan(follow, found[0], (found[1:], fades))
    return jnp.concatenate([found[:1], up])
