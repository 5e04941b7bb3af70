"""What all fitted skies share: a spectrum in few parts, a hemisphere, a ground."""

import abc
import math
from collections.abc import Callable, Mapping
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from ..light import Sun
from ..quantity import (
    Angle,
    Cosine,
    Depth,
    Direction,
    Irradiance,
    km,
    Length,
    Position,
    Radiance,
    Versine,
    versine,
    Wavelength,
)
from ..spectrum import AbstractSpectrum, Constant
from ..transport import contract, gauss_legendre
from ._base import AbstractPanorama, AbstractSky
from ._range import Range
from .panorama import versine_between


# Fits are of the sky seen from the ground.
HIGHEST = 1.0 * km
_NODES = 32


class AbstractFittedSky(AbstractSky):
    """The sky over flat ground, as a formula for its brightness.

    Its spectra are sums of a few, so the formula is asked for one number each: that is
    what makes these skies quick. Such a sum may be below 0 at some wavelengths, where
    the colour of a model is that of no light: radiance is 0 there, and a picture in
    colour keeps the colour. Below the horizon one sees ground without end, which
    reflects the sun and the sky in all directions alike; an albedo of 0 leaves it
    black. `ranges` are where the model was fitted. Raises `ValueError` outside them
    (or see `Clamp`), and for what a place above 1 km would see.
    """

    ranges: ClassVar[Mapping[str, Range]]
    sun_zenith: eqx.AbstractVar[Angle]
    sun_azimuth: eqx.AbstractVar[Angle]
    ground: eqx.AbstractVar[AbstractSpectrum]

    @abc.abstractmethod
    def parts(self, up: Cosine, turned: Versine) -> Float[Array, "part"]:
        """How much there is of each spectrum of `basis` in one direction of the sky.

        `up` is the cosine of the zenith angle, `turned` one minus that of the angle
        from the sun.
        """

    @property
    @abc.abstractmethod
    def basis(self) -> Float[Array, "part wl"]:
        """The spectra that the sky is a sum of."""

    def diffuse(self) -> Irradiance:
        """What a level plane receives from the sky without the sun, W m^-2 nm^-1."""
        total = hemisphere(self.parts, self.sun_zenith)
        return jnp.maximum(contract("p,pl->l", total, self.basis), 0.0)

    def ground_radiance(self) -> Radiance:
        """What one sees of the ground, in W m^-2 sr^-1 nm^-1."""
        received = self.diffuse()
        here = jnp.zeros(3, received.dtype)
        for light in self.lights:
            rise = jnp.maximum(light.direction[2], 0.0)
            received += rise * self.beam(light, here)
        return self.ground.evaluate(self.wavelength) * received / math.pi

    def radiance(self, position: Position, direction: Direction) -> Radiance:
        _check_place(position)
        up = direction[2]
        towards = Sun.at(self.sun_zenith, self.sun_azimuth, Constant(0.0)).direction
        found = self.parts(jnp.maximum(up, 0.0), versine(direction, towards))
        sky = contract("p,pl->l", found, self.basis)
        return jnp.where(up >= 0.0, jnp.maximum(sky, 0.0), self.ground_radiance())

    def panorama(self, position: Position) -> "FittedPanorama":
        _check_place(position)
        return _ready(self)

    def dip(self, altitude: Length) -> Angle:
        return jnp.zeros_like(altitude)

    def beam(self, light: Sun, position: Position) -> Irradiance:
        passed = jnp.exp(-self.depth(position, light.direction))
        return light.irradiance.evaluate(self.wavelength) * passed

    def depth(self, position: Position, direction: Direction) -> Depth:
        del position, direction
        return jnp.zeros_like(self.wavelength)


class FittedPanorama(AbstractPanorama):
    """A fitted sky, which is its own table: the formula is evaluated in each pixel."""

    sky: AbstractFittedSky
    basis: Float[Array, "part channel"]
    ground: Float[Array, "channel"]
    least: float = eqx.field(static=True, default=0.0)

    def radiance(
        self,
        zenith: Float[Array, "#height #width"],
        azimuth: Float[Array, "#height #width"],
    ) -> Float[Array, "height width channel"]:
        sky = self.sky
        up = jnp.cos(zenith)
        turned = versine_between(zenith, sky.sun_zenith, azimuth - sky.sun_azimuth)
        up = jnp.broadcast_to(up, turned.shape)
        look = jax.vmap(jax.vmap(sky.parts))
        seen = look(jnp.maximum(up, 0.0), turned)
        picture = contract("hwp,pc->hwc", seen, self.basis)
        picture = jnp.maximum(picture, self.least)
        return jnp.where((up >= 0.0)[..., None], picture, self.ground)

    def stokes(
        self,
        zenith: Float[Array, "#height #width"],
        azimuth: Float[Array, "#height #width"],
    ) -> Float[Array, "height width 3 channel"]:
        raise ValueError("`sky` must be solved with `stokes` 3 to be polarised.")

    @property
    def even(self) -> bool:
        return True

    def weigh(self, response: Float[Array, "wl channel"]) -> "FittedPanorama":
        seen = lambda x: jnp.matmul(x, response, precision="highest")
        return FittedPanorama(self.sky, seen(self.basis), seen(self.ground), -math.inf)

    def finer(self) -> "FittedPanorama":
        return self


@eqx.filter_jit
def _ready(sky: AbstractFittedSky) -> FittedPanorama:
    return FittedPanorama(sky, sky.basis, sky.ground_radiance())


def _check_place(position: Position) -> None:
    if isinstance(position, Tracer):
        return
    altitude = float(np.asarray(position)[2])
    if not 0.0 <= altitude <= HIGHEST:
        raise ValueError(
            f"`position` must lie between 0 and {HIGHEST:g} m above the ground, from "
            f"where fitted skies are seen; got {altitude:g} m."
        )


def angle_between(turned: Versine) -> Angle:
    """The angle of which one minus the cosine is given, exact when small."""
    some = turned > 0.0
    half = jnp.sqrt(jnp.where(some, 0.5 * turned, 0.25))
    return jnp.where(some, 2.0 * jnp.arcsin(jnp.minimum(half, 1.0)), 0.0)


def hemisphere(
    parts: Callable[[Cosine, Versine], Float[Array, "part"]], sun_zenith: Angle
) -> Float[Array, "part"]:
    """The integral over the sky of a function times the cosine of the zenith angle.

    By Gauss and Legendre, above and below the sun apart: there is an edge at the sun.
    """
    u, w = (jnp.asarray(x, sun_zenith.dtype) for x in gauss_legendre(_NODES))
    top, bottom = jnp.zeros_like(sun_zenith), jnp.full_like(sun_zenith, 0.5 * math.pi)

    def ring(zenith):
        # Nodes crowd at the sun's azimuth; both sides are alike.
        azimuth = math.pi * u * u
        turned = versine_between(zenith, sun_zenith, azimuth)
        found = jax.vmap(lambda v: parts(jnp.cos(zenith), v))(turned)
        return contract("a,ap->p", 4.0 * math.pi * u * w, found)

    def band(first, last):
        zenith = first + (last - first) * u
        weight = (last - first) * w * jnp.sin(zenith) * jnp.cos(zenith)
        return contract("z,zp->p", weight, jax.vmap(ring)(zenith))

    return band(top, sun_zenith) + band(sun_zenith, bottom)


def straight(
    knots: Float[np.ndarray, "n"], wavelength: Wavelength
) -> Float[Array, "n wl"]:
    """The weights of values at the knots, for straight lines between them.

    Beyond the knots the value of the first or the last one holds.
    """
    where = jnp.asarray(knots, wavelength.dtype)
    one = lambda row: jnp.interp(wavelength, where, row)
    return jax.vmap(one)(jnp.eye(where.size, dtype=wavelength.dtype))
