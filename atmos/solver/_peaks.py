"""Light that turned more than once in the narrow forward peaks of phase functions.

Delta-M takes a peak as not scattered at all. Of light that met nothing but peaks, and
that arrives through columns with the extinction t and the Legendre moments x of their
peaks, the sum of all orders is

    e^-t (e^x - 1) / x

times the peaks where it turned: as if they left it on its way, the moments of n turns
are those of one to the power of n, and any of these may be counted as the one that led
from the sun's ray to the line of sight. Ahead that is exact, and elsewhere too where
one turn is wide and the others narrow. At second order in x it is the correction in
the aureole by Nakajima and Tanaka (1988).
"""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..light import Sun
from ..optics import Mixture, mixture
from ..quantity import dot, versine, Wavelength
from ..scene import Scene
from ..transport import (
    columns,
    contract,
    cumulative,
    densities,
    gauss_legendre,
)
from ._azimuths import drawn
from ._chosen import Chosen
from ._harmonics import legendre
from ._sight import Sight


# Degrees of the moments of peaks: what is yet narrower turns light once at most.
# Even, so that lobes to the back leave a share above 0 as well.
_DEGREES = 128
# Places in a piece of a line of sight, and of the way from there to the sun.
_NODES, _LIGHT_NODES = 3, 8
# The sum of orders is a polynomial in x over that of degree 0: known at as many places.
_ORDER = 8
_TURN = math.pi * (np.arange(_ORDER) + 0.5) / _ORDER
_RATIOS = np.cos(_TURN)
_CHEBYSHEV = np.cos(np.arange(_ORDER)[:, None] * _TURN) * (2.0 / _ORDER)
_CHEBYSHEV[0] *= 0.5


class Peaks(eqx.Module):
    """The media of a scene without their forward peaks, and with all but their tips.

    `without` are the media that diffuse light notices, their peaks not scattered. Light
    that turned once is to be found with the extinction of `within`. Only the media that
    are counted in `sharp` have peaks. What light turned in them is found at the chosen
    wavelengths.
    """

    without: Mixture
    within: Mixture
    chosen: Chosen
    sharp: tuple[int, ...] = eqx.field(static=True)

    @classmethod
    def of(
        cls,
        scene: Scene,
        wavelength: Wavelength,
        degrees: int,
        stokes: int = 1,
        chosen: Chosen | None = None,
    ) -> "Peaks":
        """Peaks are what so many moments do not resolve.

        All wavelengths are chosen unless told otherwise.
        """
        chosen = chosen or Chosen.of(wavelength, wavelength.size)
        broad = mixture(scene, wavelength, degrees + 1, stokes)
        fine = mixture(scene, wavelength, max(_DEGREES, degrees) + 1)
        sharp = tuple(
            i
            for i, x in enumerate(scene.media)
            if x.scattering is not None and x.phase.degree >= degrees
        )
        return cls(broad.truncated(), fine.truncated(), chosen, sharp)

    def scattered(
        self,
        scene: Scene,
        light: Sun,
        towards: Float[Array, "light 3"],
        wavelength: Wavelength,
        sight: Sight,
        once: Float[Array, "light wl"],
        every: int,
    ) -> Float[Array, "light wl"]:
        """What light that turned in peaks adds to that which turned `once`.

        Of a light that stands in one of several directions. How much there is on its
        way is found for `every` so many of them.
        """
        if not self.sharp:
            return jnp.zeros((len(towards), wavelength.size), wavelength.dtype)
        path, far, length = sight.path, sight.far, sight.length
        u, w = (jnp.asarray(x, far.dtype) for x in gauss_legendre(_NODES))
        places = sight.begin[:, None] + length[:, None] * u[None]
        # The last of the places is where the line of sight ends.
        points = jax.vmap(path.at)(jnp.append(places.ravel(), far))
        density = jax.vmap(lambda x: densities(scene, x))(points)
        amount = density[:-1].reshape(*places.shape, -1) * length[:, None, None]
        whole = contract("j,pjm->pm", w, amount)
        inner = jnp.asarray(cumulative(_NODES), far.dtype)
        before = jnp.cumsum(whole, 0) - whole
        passed = before[:, None] + contract("ij,pjm->pim", inner, amount)
        weighed = amount * w[None, :, None]
        flat = lambda x: x.reshape(-1, x.shape[-1])

        def turned(towards):
            def ahead(point):
                sunwards = scene.geometry.path(point, towards)
                end = sunwards.span(scene.top).far
                return columns(scene, sunwards, end, nodes=_LIGHT_NODES)

            sunwards = jax.vmap(ahead)(points)
            begins, ends = path.shadow(towards, jnp.zeros_like(far))
            lit = (places <= begins) | (places >= ends)
            event = flat(jnp.where(lit[:, :, None], weighed, 0.0))
            lobe = self._turned(event, flat(passed) + sunwards[:-1])
            return lobe, sunwards[-1]

        lobes, sunwards = drawn(turned, towards, every)
        apart = jax.vmap(lambda x: versine(path.direction, x))(towards)
        seen = contract("ka,akl->al", legendre(apart, lobes.shape[1]), lobes)
        irradiance = light.irradiance.evaluate(wavelength)
        irradiance = jnp.broadcast_to(irradiance, wavelength.shape)
        seen = seen * irradiance[self.chosen.index][None]
        seen = self.chosen.relative(seen, once)

        def ground(towards, sunwards):
            there = jnp.sum(whole, 0) + sunwards
            arrives = lambda x: jnp.exp(-contract("m,ml->l", there, x.extinction))
            more = arrives(self.without) - arrives(self.within)
            begins, ends = path.shadow(towards, jnp.zeros_like(far))
            shown = sight.grounded & ~((begins < far) & (far < ends))
            rise = jnp.maximum(dot(points.up[-1], towards), 0.0)
            return jnp.where(shown, rise * more, 0.0)

        white = scene.ground.evaluate(wavelength) / math.pi * irradiance
        return seen + white[None] * jax.vmap(ground)(towards, sunwards)

    def _turned(
        self,
        event: Float[Array, "place medium"],
        passed: Float[Array, "place medium"],
    ) -> Float[Array, "degree few"]:
        """Of light that passed such columns: by degrees of the turn it made."""
        without, within = map(self.chosen.of_mixture, (self.without, self.within))
        depth = contract("sm,ml->sl", passed, within.extinction)
        most = jnp.exp(-contract("sm,ml->sl", passed, without.extinction))
        broad, fine = without.scattering, within.scattering
        count, missing = broad.shape[1], fine.shape[1] - broad.shape[1]
        least = jnp.exp(-depth)
        once = contract("sm,sl->ml", event, most - least)
        once = contract("ml,mkl->kl", once, broad)

        of_sharp = lambda x: jnp.stack([x[..., i] for i in self.sharp], -1)
        event, passed = of_sharp(event), of_sharp(passed)
        resolved = [jnp.pad(broad[i], ((0, missing), (0, 0))) for i in self.sharp]
        peak = jnp.stack(
            [fine[i] - x for i, x in zip(self.sharp, resolved, strict=True)]
        )

        # The moments along the way over that of degree 0, as on average.
        seen = contract("sm,ml->sl", event, peak[:, 0]) * most
        share = contract("nl,nkl->kl", contract("sl,sn->nl", seen, passed), peak)
        # Of less the square, by which slopes are divided, is 0 already.
        some = share[:1] > float(jnp.finfo(share.dtype).tiny) ** 0.5
        ratio = jnp.where(some, share / jnp.where(some, share[:1], 1.0), 0.0)
        ratio = jnp.clip(ratio, -1.0, 1.0)
        zeroth = contract("sn,nl->sl", passed, peak[:, 0])
        known = jnp.asarray(_RATIOS, depth.dtype)[:, None, None]
        values = _orders(known * zeroth[None], depth[None]) / known
        values = contract("sm,ksl->kml", event, values)
        again = contract("nk,kml->nml", jnp.asarray(_CHEBYSHEV, least.dtype), values)
        before, row = jnp.ones_like(ratio), ratio
        mixed = again[0][:, None]
        for x in again[1:]:
            mixed = mixed + x[:, None] * row[None]
            before, row = row, 2.0 * ratio * row - before

        return (ratio * jnp.sum(peak * mixed, 0)).at[:count].add(once)


def _orders(x: Array, depth: Array) -> Array:
    """e^-depth ((e^x - 1) / x - 1), without overflow where x and depth are large."""
    size = jnp.abs(x)
    some = jnp.where(size > 0.0, size, 1.0)
    share = jnp.where(size > 0.0, -jnp.expm1(-some) / some, 1.0)
    return jnp.exp(jnp.maximum(x, 0.0) - depth) * share - jnp.exp(-depth)
