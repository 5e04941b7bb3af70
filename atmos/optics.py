"""A scene as layers: the seam between what is known of media and radiative transfer."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .quantity import Length, Wavelength
from .scene import Scene
from .transport import densities, extinctions, gauss_legendre


class Mixture(eqx.Module):
    """What a metre of each medium does to light where its profile is 1.

    `scattering` is the scattering coefficient times the Legendre moments of the phase
    function, and `polarised` that times its `polarisation_moments`, so that media
    simply add; without degrees where polarisation is not asked for. All in m^-1.
    """

    extinction: Float[Array, "medium wl"]
    scattering: Float[Array, "medium l wl"]
    polarised: Float[Array, "medium k 3 wl"]

    def truncated(self) -> "Mixture":
        """The same without the forward peak, which is taken as not scattered at all.

        Delta-M (Wiscombe 1977): of each medium the share of the last moment goes, and
        that moment with it. Light in the peak stays polarised as it was.
        """
        peak = self.scattering[:, -1]
        smooth = self.scattering[:, :-1] - peak[:, None]
        # Of media that polarise: the others keep nothing that could be less.
        polarises = jnp.any(self.polarised != 0.0, (1, 2, 3), keepdims=True)
        degree = np.arange(self.polarised.shape[1])[:, None]
        kept = jnp.asarray((degree >= 2) & np.array([True, True, False]), peak.dtype)
        lost = jnp.where(polarises, peak[:, None, None], 0.0) * kept[None, :, :, None]
        return Mixture(self.extinction - peak, smooth, self.polarised - lost)

    def towards(self, finer: "Mixture", share: Float[Array, "wl"]) -> "Mixture":
        """So much of the same with more moments, that is with less of a peak gone."""
        more = finer.scattering.shape[1] - self.scattering.shape[1]
        scattering = jnp.pad(self.scattering, ((0, 0), (0, more), (0, 0)))
        same = Mixture(self.extinction, scattering, self.polarised)
        mix = lambda x, y: (
            x + share.reshape((1,) * (x.ndim - 1) + share.shape) * (y - x)
        )
        return jax.tree.map(mix, same, finer)


def mixture(
    scene: Scene, wavelength: Wavelength, moments: int, stokes: int = 1
) -> Mixture:
    """The media of a scene with the first so many moments of their phase functions.

    With those of polarisation, of one degree less, if `stokes` is 3.
    """
    lobes = []
    for x in scene.media:
        if x.scattering is None:
            lobe = jnp.zeros((moments, *wavelength.shape), wavelength.dtype)
        else:
            lobe = x.phase.moments(moments, wavelength)
            lobe = lobe * x.scattering.evaluate(wavelength)[None]
        lobes.append(jnp.broadcast_to(lobe, (moments, *wavelength.shape)))
    none = jnp.zeros((0, moments, *wavelength.shape), wavelength.dtype)
    return Mixture(
        extinctions(scene, wavelength),
        jnp.stack(lobes) if lobes else none,
        _polarised(scene, wavelength, moments - 1 if stokes == 3 else 0),
    )


def _polarised(
    scene: Scene, wavelength: Wavelength, count: int
) -> Float[Array, "medium k 3 wl"]:
    """Scattering times the moments of polarisation, of as many degrees as any has."""
    found = [jnp.zeros((0, 3, *wavelength.shape), wavelength.dtype)] * len(scene.media)
    for i, x in enumerate(scene.media):
        if x.scattering is not None and count > 0:
            known = x.phase.polarisation_moments(count, wavelength)
            known = known * x.scattering.evaluate(wavelength)[None, None]
            found[i] = jnp.broadcast_to(known, (*known.shape[:2], *wavelength.shape))
    most = max((len(x) for x in found), default=0)
    pad = lambda x: jnp.pad(x, ((0, most - len(x)), (0, 0), (0, 0)))
    none = jnp.zeros((0, most, 3, *wavelength.shape), wavelength.dtype)
    return jnp.stack([pad(x) for x in found]) if found else none


def check_layered(scene: Scene) -> None:
    """Raises `ValueError` for a medium that does not depend on altitude alone."""
    for i, x in enumerate(scene.media):
        if not x.profile.layered:
            raise ValueError(
                f"`scene.media[{i}].profile` must depend on altitude alone, for this "
                f"solver; got {type(x.profile).__name__}."
            )


class Layers(eqx.Module):
    """The air straight above the origin, cut at rising altitudes, in m.

    `column` is how many metres of density 1 of each medium a layer holds.
    """

    altitude: Float[Array, "level"]
    column: Float[Array, "layer medium"]


def above(scene: Scene, altitude: Length) -> Float[Array, "medium"]:
    """How much there is of each medium straight above the origin."""
    position = jnp.zeros(3, altitude.dtype).at[2].set(altitude)
    return densities(scene, scene.geometry.locate(position))


def layers(
    scene: Scene,
    extinction: Float[Array, "medium wl"],
    count: int,
    even: float = 0.5,
) -> Layers:
    """Cuts the air into `count` layers, thin where light changes fast.

    The more `even` they are to be, the more altitude itself counts beside that. No
    profile has an edge within a layer. Raises `ValueError` if there are more edges
    than layers.
    """
    edges = _edges(scene)
    spare = count + 1 - edges.shape[0]
    if spare < 0:
        raise ValueError(
            f"`layers` must be at least {edges.shape[0] - 1}, for so many edges of "
            f"media; got {count}."
        )
    inner = _crowded(scene, edges, extinction, spare, even)
    altitude = jnp.sort(jnp.concatenate([edges, inner]))
    return Layers(altitude, _columns(scene, altitude[:-1], jnp.diff(altitude), 6))


def overhead(scene: Scene) -> Float[Array, "medium"]:
    """How many metres of density 1 of each medium lie straight above the origin."""
    edges = _edges(scene)
    return jnp.sum(_columns(scene, edges[:-1], jnp.diff(edges), 6), 0)


def _edges(scene: Scene) -> Float[Array, "edge"]:
    """The altitudes between which media are smooth."""
    top = scene.top
    edges = [jnp.zeros_like(top)[None], top[None]]
    edges += [x.profile.levels.astype(top.dtype) for x in scene.media]
    return jnp.sort(jnp.clip(jnp.concatenate(edges), 0.0, top))


def _columns(
    scene: Scene, low: Float[Array, "*n"], thickness: Float[Array, "*n"], nodes: int
) -> Float[Array, "*n medium"]:
    u, w = (jnp.asarray(x, low.dtype) for x in gauss_legendre(nodes))
    inside = low[..., None] + jnp.multiply.outer(thickness, u)
    found = jax.vmap(lambda x: above(scene, x))(inside.ravel())
    found = found.reshape(*inside.shape, -1)
    return jnp.sum(found * jnp.multiply.outer(thickness, w)[..., None], -2)


# Places a piece between two edges, and how they crowd at its ends.
_FINE, _CROWDED = 48, 4
# An optical depth below which nothing changes on its way to an edge.
_THIN = 0.05


def _crowded(
    scene: Scene,
    edges: Float[Array, "edge"],
    extinction: Float[Array, "medium wl"],
    count: int,
    even: float,
) -> Float[Array, "count"]:
    """Altitudes with as much between any two of them of what light may notice.

    That is a mixture of altitude, each medium's share, and the logarithm of the optical
    depth to the nearest edge, so that thick media are resolved near their faces.
    """
    u = np.linspace(0.0, 1.0, _FINE + 1)
    share = u**_CROWDED / (u**_CROWDED + (1.0 - u) ** _CROWDED)
    share = jnp.asarray(share, edges.dtype)
    altitude = edges[:-1, None] + jnp.diff(edges)[:, None] * share[None]
    step = jnp.diff(altitude)
    column = _columns(scene, altitude[:, :-1], step, 3)
    depth = jnp.einsum("pim,ml->pil", column, extinction, precision="highest")
    depth = jnp.max(depth, -1, initial=0.0)
    below = jnp.cumsum(depth, 1)
    above = jnp.cumsum(depth[:, ::-1], 1)[:, ::-1]
    logarithm = jnp.log1p(depth / (below - depth + _THIN))
    logarithm += jnp.log1p(depth / (above - depth + _THIN))
    whole = jnp.sum(column, (0, 1))
    thick = whole * jnp.max(extinction, 1, initial=0.0)
    weight = jnp.where(whole > 0.0, thick / (thick + _THIN), 0.0)
    weight = weight / jnp.where(whole > 0.0, whole, 1.0)
    amount = even * step / edges[-1] + 0.5 * logarithm
    amount += jnp.einsum("pim,m->pi", column, weight, precision="highest")
    total = jnp.cumsum(amount)
    total = jnp.concatenate([jnp.zeros_like(total[:1]), total])
    places = jnp.concatenate([altitude[:, :-1].ravel(), edges[-1:]])
    wanted = jnp.asarray((np.arange(count) + 0.5) / max(count, 1), edges.dtype)
    return jnp.interp(wanted * total[-1], total, places)
