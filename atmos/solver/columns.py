import dataclasses
import math
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.core import Tracer

from ..geometry import Flat
from ..optics import check_layered, layers, mixture, overhead
from ..quantity import deg, Number, Wavelength
from ..scene import Scene
from ._base import check_stokes
from ._chosen import Chosen, misfit
from ._diffuse import AbstractDiffuse, Diffused
from ._field import Field, Ground
from ._follow import follow, thin
from ._interpolated import Glow, Interpolated
from ._ordinates import solve_column
from ._peaks import Peaks
from ._stack import Stack
from ._suns import AbstractSuns, CLOSE, FlatSuns, RoundSuns
from .single_scattering import SingleScattering


# The largest zenith angle of a light. The error of flat columns, 0.5 % by day and 0.9 %
# on average at 80 degrees, is 15 % at 88.
_LOWEST = 85.001 * deg
# So many wavelengths do where all optical depths are so close to what is drawn through
# them: radiances are then within 1e-3 or so.
_FEW, _SMOOTH = 10, 0.01
# Moments that near-level light tells from a peak: with 16 the brightest haze there is
# off by 0.4 %, with 24 by 0.05 %.
_RESOLVED = 32


class Columns(AbstractDiffuse):
    """All orders of scattering, as if the air lay flat around every place.

    Discrete ordinates, half of `streams` to either side, without the forward peaks of
    phase functions (delta-M, Wiscombe 1977), in `layers` layers. Where these are thin,
    what they send is then followed along twice as many directions, in a flat world with
    narrower peaks. Light that turned once is added in the round and with its peak
    (Nakajima and Tanaka 1988), and so is what peaks alone turned more than once.
    Diffuse light is kept by altitude and, where the world is round, for `suns` zenith
    angles of each light, whose rays reach a column along their own curved way. A line
    of sight takes `nodes` places in each of `pieces` pieces.

    Diffuse light is found at `wavelengths` of all wavelengths and drawn out to the
    rest, relative to light that turned once. Where that is left open they are 10 if the
    air is smooth enough, which leaves up to 3e-4 of the radiance in the mean and 2e-3
    in places (7e-3 of diffuse fluxes within the ozone layer), and all if it is not, or
    cannot be known as its numbers are traced.

    With `stokes` 3 the light is polarised, which changes its radiance too.

    Raises `ValueError` where a medium does not depend on altitude alone, where media
    have more edges than there are layers, in a round world for lights less than 5
    degrees above the horizon, for other `stokes` than 1 and 3, and for 3 with fewer
    than 4 streams, for fewer than 5 `wavelengths` or for more than lie apart from each
    other; and for panoramas from so high up that a light has set on their horizon.
    """

    around: ClassVar[int] = 17
    streams: int = eqx.field(static=True, default=16)
    layers: int = eqx.field(static=True, default=60)
    suns: int = eqx.field(static=True, default=12)
    wavelengths: int | None = eqx.field(static=True, default=None)
    pieces: int = eqx.field(static=True, default=12)
    nodes: int = eqx.field(static=True, default=3)
    single: SingleScattering = SingleScattering()
    stokes: int = eqx.field(static=True, default=1)

    def __check_init__(self):
        check_stokes(self.stokes)
        if self.wavelengths is not None and self.wavelengths < 5:
            raise ValueError(
                f"`wavelengths` must be at least 5; got {self.wavelengths}."
            )
        if self.stokes == 3 and self.streams < 4:
            raise ValueError(
                f"`streams` must be at least 4 where `stokes` is 3; got {self.streams}."
            )

    @property
    def degrees(self) -> int:
        """How many moments of phase functions are resolved, of all but their peaks.

        As many as there are streams while these are few. Of many, what scatters from
        one ordinate to another has too high a degree for Gauss's rule on half of the
        sphere, and a sharp peak is better left to `_peaks`.
        """
        return max(min(self.streams, 16), 2 * (5 * self.streams // 16))

    def check(self, scene: Scene, wavelength: Wavelength) -> Scene:
        check_layered(scene)
        if isinstance(scene.geometry, Flat):
            return scene
        for i, light in enumerate(scene.suns):
            zenith = light.zenith
            if not isinstance(zenith, Tracer) and zenith > _LOWEST:
                raise ValueError(
                    f"`scene.lights[{i}]` must stand 5 degrees above the horizon or "
                    "higher, for columns in a round world; got "
                    f"{90.0 - float(zenith) / deg:.6g}."
                )
        return scene

    def check_panorama(self, scene: Scene, lowest: float) -> None:
        if not isinstance(scene.geometry, Flat) and lowest > 90.001 * deg:
            raise ValueError(
                "`position` must be so low that no light has set on the horizon, for "
                f"columns; there one stands {lowest / deg - 90.0:.3g} degrees below."
            )

    def suited(self, scene: Scene, wavelength: Wavelength) -> "Columns":
        count, known = wavelength.size, jax.tree.leaves((scene, wavelength))
        few = _FEW if self.wavelengths is None else self.wavelengths
        if count <= few:
            return dataclasses.replace(self, wavelengths=few)
        if any(isinstance(x, Tracer) for x in known):
            few = count if self.wavelengths is None else few
            return dataclasses.replace(self, wavelengths=few)
        rough = float(_roughness(scene, wavelength, few))
        if self.wavelengths is None:
            few = few if rough < _SMOOTH else count
        elif math.isinf(rough):
            raise ValueError(
                "`wavelengths` must be no more than lie apart from each other; "
                f"got {few}."
            )
        return dataclasses.replace(self, wavelengths=few)

    def prepare(self, scene: Scene, wavelength: Wavelength) -> Diffused:
        chosen = Chosen.of(wavelength, self.wavelengths or _FEW)
        peaks = Peaks.of(scene, wavelength, self.degrees, self.stokes, chosen)
        mixed = peaks.without
        few = chosen.of_mixture(mixed)
        cut = layers(scene, mixed.extinction, self.layers)
        suns = self._suns(scene, wavelength)
        zeniths = suns.zeniths()
        stack = Stack.of(scene, cut, zeniths)
        slant, cosine = stack.slant(few), stack.cosine
        column = stack.amount(few.extinction), stack.amount(few.scattering)
        more = slant, cosine, stack.amount(few.polarised)
        light = solve_column(*column, *more, nodes=self.streams // 2)
        lit = stack.arrives(slant) + light.down[-1]
        glow = Glow(light.up[::-1, -1], light.down[::-1, -1], lit[:-1])

        share, passed = thin(column[0], slant), slant
        # In the round flatness costs more than peaks that matter near level.
        if isinstance(scene.geometry, Flat):
            resolved = max(self.degrees, min(2 * self.degrees, _RESOLVED))
            fine = Peaks.of(scene, wavelength, resolved, self.stokes).without
            followed = jnp.clip(chosen.smooth(jnp.min(share, 0)), 0.0, 1.0)
            mixed = mixed.towards(fine, followed)
            peaks = dataclasses.replace(peaks, without=mixed)
            few = chosen.of_mixture(mixed)
            slant = stack.slant(few)
        column = stack.amount(few.extinction), stack.amount(few.scattering)
        more = slant, passed, cosine, stack.amount(few.polarised), share
        light, sky = follow(light, *column, *more, nodes=self.streams)
        lit = stack.arrives(slant) + sky
        moments = jnp.swapaxes(light.moments[::-1], 1, 2)
        ground = Ground(moments[:, :, -1], sky[:-1], lit[:-1], sky[-1])
        field = Field(
            few,
            cut.altitude,
            suns,
            moments[:, :, :-1],
            light.up[::-1, :-1],
            light.down[::-1, :-1],
            jnp.zeros((len(cut.altitude), len(zeniths)), wavelength.dtype),
            self.stokes,
        )
        albedo = jnp.broadcast_to(scene.ground.evaluate(wavelength), wavelength.shape)
        field = Interpolated(mixed, chosen, field, ground, glow, albedo)
        return Diffused(field, peaks, jnp.zeros((), wavelength.dtype))

    def _suns(self, scene: Scene, wavelength: Wavelength) -> AbstractSuns:
        """The zenith angles of lights that diffuse light is found for."""
        lights = jnp.array([x.zenith for x in scene.suns], wavelength.dtype)
        if isinstance(scene.geometry, Flat):
            return FlatSuns(lights)
        last = 0.5 * jnp.pi + scene.geometry.dip(scene.top, jnp.zeros_like(scene.top))
        return RoundSuns(lights, last, jnp.full_like(last, CLOSE), self.suns)


@eqx.filter_jit
def _roughness(scene: Scene, wavelength: Wavelength, few: int) -> Number:
    """By how much few wavelengths miss what a medium takes out, scatters or turns."""
    found = overhead(scene)
    mixed = mixture(scene, wavelength, 2)
    depths = jnp.concatenate([mixed.extinction[:, None], mixed.scattering], 1)
    return misfit(found[:, None, None] * depths, wavelength, few)
