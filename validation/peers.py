"""Programs of others, asked for the light of a layered scene of atmos.

Each takes the scene's optics from its profiles and spectra, layer by layer or level by
level, and answers with radiances. One that is not installed is not offered, and named.
"""

import importlib.metadata
import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

import atmos


_EXPONENT = 4.0  # layers at the top are e^4 times as thick as at the ground
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)


class View(NamedTuple):
    """An eye, and the rings and azimuths it looks along: in m and degrees.

    Azimuths are relative to the sun's.
    """

    altitude: float
    zeniths: np.ndarray
    azimuths: np.ndarray


# Of a scene with one sun: all that is to be done beforehand, and then what is left to
# do for its radiances [zenith, azimuth, wl].
Look = Callable[[atmos.Scene, np.ndarray, View], Callable[[], np.ndarray]]


class Peer(NamedTuple):
    """A program at one setting: which suns it holds for, and if of a flat world."""

    method: str
    setting: str
    look: Look
    lowest_sun: float = 180.0
    flat: bool = False

    @property
    def version(self) -> str:
        return importlib.metadata.version(self.method.split()[0])


class Optics(NamedTuple):
    """What the media are at some altitudes, or in layers: [place, wl] and moments."""

    extinction: np.ndarray
    share: np.ndarray  # of the extinction, that scatters
    moments: np.ndarray  # [degree, place, wl], the first is 1


def missing() -> list[str]:
    """The programs that are not installed."""
    return [x for x in ("PythonicDISORT", "nanodisort", "sasktran2") if not _has(x)]


def peers(quick: bool = False) -> Iterator[Peer]:
    """What is installed, at several settings, from the quickest to the finest."""
    if _has("nanodisort"):
        for n in [8, 16] if quick else [8, 16, 32, 64]:
            yield Peer("nanodisort", f"{n} streams", cdisort(n), 89.9, True)
    if _has("PythonicDISORT"):
        for n in [8, 16] if quick else [8, 16, 32]:
            yield Peer("PythonicDISORT", f"{n} streams", pythonic(n), 89.9, True)
    if _has("sasktran2"):
        yield Peer("sasktran2", "single", _sasktran("NoSource"))
        for n in [8, 16]:
            setting = f"ordinates, {n} streams"
            yield Peer("sasktran2", setting, _sasktran("DiscreteOrdinates", n), 88.5)
        # With nine suns it is no better by day, and does not converge below 5 degrees.
        yield Peer("sasktran2", "successive orders", _sasktran("SuccessiveOrders", 16))


def optics(scene: atmos.Scene, wavelength, altitudes, count: int) -> Optics:
    """The media at altitudes, mixed; `count` moments of their phase functions."""
    place = lambda z: scene.geometry.locate(jnp.array([0.0, 0.0, 1.0]) * z)
    look = lambda z: jnp.stack([x.profile.density(place(z)) for x in scene.media])
    density = np.asarray(jax.vmap(look)(jnp.asarray(altitudes)), float)
    nm = jnp.asarray(wavelength)
    every = lambda x: np.broadcast_to(np.asarray(x, float), nm.shape)
    scattering = np.stack(
        [
            every(0.0 if x.scattering is None else x.scattering.evaluate(nm))
            for x in scene.media
        ]
    )
    moments = [np.asarray(x.phase.moments(count, nm), float) for x in scene.media]
    extinction = np.stack([every(x.extinction(nm)) for x in scene.media])
    moments = np.stack([np.broadcast_to(x, (count, len(nm))) for x in moments])
    total = density @ extinction
    scattered = density @ scattering
    mixed = np.einsum("km,mw,mlw->lkw", density, scattering, moments)
    some = lambda x: np.where(x > 0.0, x, 1.0)
    mixed = np.where(scattered > 0.0, mixed / some(scattered), 0.0)
    mixed[0] = 1.0
    return Optics(total, scattered / some(total), mixed)


def levels(scene: atmos.Scene, count: int) -> np.ndarray:
    """Altitudes from the ground to the top, close at the ground; edges among them."""
    top = float(scene.top)
    grown = np.expm1(np.linspace(0.0, _EXPONENT, count + 1)) / np.expm1(_EXPONENT)
    edges = [np.asarray(x.profile.levels, float) for x in scene.media]
    edges = np.concatenate([top * grown, *edges])
    return np.unique(np.clip(np.round(edges, 6), 0.0, top))


def layers(scene: atmos.Scene, wavelength, edges, count: int) -> Optics:
    """The mean of each layer; the first is the lowest."""
    middle, half = 0.5 * (edges[1:] + edges[:-1]), 0.5 * np.diff(edges)
    places = middle[:, None] + half[:, None] * _NODES
    found = optics(scene, wavelength, places.ravel(), count)
    within = lambda x: x.reshape(*x.shape[:-2], *places.shape, x.shape[-1])
    mean = lambda x: np.einsum("j,...jw->...w", 0.5 * _WEIGHTS, within(x))
    extinction = mean(found.extinction)
    scattered = mean(found.extinction * found.share)
    moments = mean(found.moments * (found.extinction * found.share)[None])
    some = np.where(scattered > 0.0, scattered, 1.0)
    moments = np.where(scattered > 0.0, moments / some, 0.0)
    moments[0] = 1.0
    thick = np.where(extinction > 0.0, extinction, 1.0)
    return Optics(extinction, scattered / thick, moments)


class Slab(NamedTuple):
    """A scene as flat programs want it: layers from the top down."""

    depth: np.ndarray  # [layer, wl]
    share: np.ndarray
    moments: np.ndarray
    cosine: float
    irradiance: np.ndarray
    albedo: np.ndarray
    above: np.ndarray  # [wl], the optical depth above the eye


def slab(scene, wavelength, view: View, count: int, moments: int) -> Slab:
    # Flat programs look from where layers meet.
    edges = levels(scene, count)
    eye = min(view.altitude, float(scene.top))
    edges = np.unique(np.concatenate([edges, [eye]]))
    found = layers(scene, wavelength, edges, moments)
    depth = found.extinction * np.diff(edges)[:, None]
    nm = jnp.asarray(wavelength)
    sun = scene.lights[0]
    every = lambda x: np.broadcast_to(np.asarray(x.evaluate(nm), float), len(nm))
    return Slab(
        depth[::-1],
        np.minimum(found.share[::-1], 1.0 - 1e-9),
        found.moments[:, ::-1],
        float(sun.direction[2]),
        every(sun.irradiance),
        every(scene.ground),
        np.sum(depth[edges[:-1] >= eye - 1e-3], 0),
    )


def _has(name: str) -> bool:
    try:
        importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return False
    return True


def cdisort(streams: int, count: int = 60) -> Look:
    def look(scene, wavelength, view):
        import nanodisort

        moments = max(2 * streams, 200)
        air = slab(scene, wavelength, view, count, moments + 1)
        travels = -np.cos(np.radians(view.zeniths))
        order = np.argsort(travels)

        def solve():
            found = []
            for i in range(len(wavelength)):
                state = nanodisort.DisortState()
                state.nstr, state.nlyr, state.nmom = streams, len(air.depth), moments
                state.ntau, state.numu, state.nphi = 1, len(travels), len(view.azimuths)
                state.usrtau = state.usrang = state.lamber = state.quiet = True
                state.onlyfl = state.planck = False
                state.intensity_correction = state.old_intensity_correction = True
                state.allocate()
                # It refuses a sun that stands at one of its ordinates.
                state.umu0, state.phi0 = air.cosine * (1.0 - 3e-7), 0.0
                state.fbeam, state.albedo = air.irradiance[i], air.albedo[i]
                state.dtauc, state.ssalb = air.depth[:, i], air.share[:, i]
                state.pmom = np.asfortranarray(air.moments[..., i])
                state.umu, state.phi = travels[order], np.asarray(view.azimuths, float)
                state.utau = np.minimum(air.above[i : i + 1], np.sum(air.depth[:, i]))
                state.solve()
                found.append(np.array(state.uu)[np.argsort(order), 0])
            return np.stack(found, -1)

        return solve

    return look


def pythonic(streams: int, count: int = 60) -> Look:
    def look(scene, wavelength, view):
        from PythonicDISORT.pydisort import pydisort
        from PythonicDISORT.subroutines import interpolate

        air = slab(scene, wavelength, view, count, 200)
        travels, turns = -np.cos(np.radians(view.zeniths)), np.radians(view.azimuths)

        def solve():
            found = []
            for i in range(len(wavelength)):
                kept = air.depth[:, i] > 0.0
                moments = air.moments[:, kept, i].T
                peak = moments[:, streams]
                corrected = bool(np.any(peak > 0.0))
                *_, radiance = pydisort(
                    np.cumsum(air.depth[kept, i]),
                    air.share[kept, i],
                    streams,
                    moments,
                    air.cosine,
                    air.irradiance[i],
                    0.0,
                    NLeg=streams,
                    NFourier=streams,
                    f_arr=peak,
                    NT_cor=corrected,
                    BDRF_Fourier_modes=[air.albedo[i]] if air.albedo[i] > 0.0 else [],
                    cache_asso_leg="no_mu0",
                )
                smooth = interpolate(radiance, NT_cor="eval" if corrected else None)
                eye = min(air.above[i], np.sum(air.depth[:, i]) * (1.0 - 1e-12))
                seen = smooth(travels, eye, turns)
                found.append(np.asarray(seen).reshape(len(travels), len(turns)))
            return np.stack(found, -1)

        return solve

    return look


def _sasktran(multiple: str, streams: int = 2, count: int = 60) -> Look:
    def look(scene, wavelength, view):
        import sasktran2

        config = sasktran2.Config()
        source, single = sasktran2.MultipleScatterSource, sasktran2.SingleScatterSource
        config.num_stokes, config.num_streams, config.num_threads = 1, streams, 2
        moments = 200
        config.num_singlescatter_moments = moments
        config.single_scatter_source = single.Exact
        config.multiple_scatter_source = getattr(source, multiple)
        config.delta_m_scaling = multiple != "NoSource"
        radius = float(scene.geometry.radius)
        altitude = levels(scene, count)
        cosine = float(scene.lights[0].direction[2])
        world = sasktran2.Geometry1D(
            cosine,
            0.0,
            radius,
            altitude,
            sasktran2.InterpolationMethod.LinearInterpolation,
            sasktran2.GeometryType.Spherical,
        )
        rays = sasktran2.ViewingGeometry()
        for zenith in view.zeniths:
            for azimuth in view.azimuths:
                place = sasktran2.SolarAnglesObserverLocation(
                    cosine,
                    math.radians(azimuth),
                    math.cos(math.radians(zenith)),
                    view.altitude,
                )
                rays.add_ray(place)
        air = sasktran2.Atmosphere(
            world, config, wavelengths_nm=wavelength, calculate_derivatives=False
        )
        found = optics(scene, wavelength, altitude, moments)
        weights = 2.0 * np.arange(moments)[:, None, None] + 1.0
        air["air"] = sasktran2.constituent.Manual(
            found.extinction, found.share, found.moments * weights
        )
        nm = jnp.asarray(wavelength)
        albedo = np.broadcast_to(np.asarray(scene.ground.evaluate(nm)), len(nm))
        air["ground"] = sasktran2.constituent.LambertianSurface(albedo, wavelength)
        irradiance = np.asarray(scene.lights[0].irradiance.evaluate(nm), float)

        def solve():
            engine = sasktran2.Engine(config, world, rays)
            seen = np.asarray(engine.calculate_radiance(air).radiance.values)
            shape = len(view.zeniths), len(view.azimuths), len(wavelength)
            return seen[:, :, 0].T.reshape(shape) * irradiance

        return solve

    return look
