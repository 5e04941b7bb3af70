"""Multiple scattering in flat columns against DISORT's own test cases.

Cases 1 to 5 of DISORT's tests (slabs under a sun: isotropic, Rayleigh,
Henyey-Greenstein, Haze L and Cloud C.1 of Garcia and Siewert 1985), run to convergence
with CDISORT at up to 256 streams; reflection and transmission of 216 slabs from the
same code; and a clear sky over 60 km of air, aerosol and ozone, made flat, against
PythonicDISORT at 48 streams. Everything goes through `solve`, at several numbers of
streams. Errors of radiance are relative, those of flux to what comes in.

    python -m validation.columns --truth DIR

where DIR has `disort_converged_nanodisort.json` and
`slab_reflectance_transmittance_hg.csv`. The phase functions of cases 4 and 5 are taken
from nanodisort, if it is installed.
"""

import argparse
import csv
import json
import math
import sys
from collections.abc import Iterator

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

import atmos
from atmos import geometry, light, medium, phase, solver

from . import quadrature as judge, single_scattering
from .claim import Claim, main


try:
    from PythonicDISORT.pydisort import pydisort
except ImportError:
    pydisort = None

try:
    from nanodisort.utils import phase_functions as published
except ImportError:
    published = None

STREAMS = [16, 32, 64]
DEEP = 1000.0
PI = math.pi


class Series(phase.AbstractPhaseFunction):
    """A phase function known by its Legendre moments alone."""

    known: Array

    def evaluate(self, versine, wavelength):
        def term(rows, at):
            l, known = at
            before, row = rows
            ahead = ((2.0 * l + 1.0) * (1.0 - versine) * row - l * before) / (l + 1.0)
            return (row, ahead), (2.0 * l + 1.0) * known * row

        start = jnp.zeros_like(versine), jnp.ones_like(versine)
        degrees = jnp.arange(len(self.known), dtype=versine.dtype)
        _, terms = jax.lax.scan(term, start, (degrees, self.known))
        return jnp.sum(terms)[None] / (4.0 * PI)

    def sample(self, key, wavelength):
        versines = 0.5 * jnp.linspace(0.0, 2.0, 8193, dtype=self.known.dtype) ** 2
        density = jax.vmap(lambda x: self.evaluate(x, wavelength)[0])(versines)
        steps = 0.5 * (density[1:] + density[:-1]) * jnp.diff(versines)
        upto = jnp.concatenate([jnp.zeros_like(steps[:1]), jnp.cumsum(steps)])
        u = jax.random.uniform(key, dtype=upto.dtype)
        return jnp.interp(u * upto[-1], upto, versines)

    def moments(self, count, wavelength):
        known = self.known[:count]
        return jnp.pad(known, (0, count - len(known)))[:, None]


def slab(depth, albedo, lobe, cosine, irradiance, cuts=()) -> atmos.Scene:
    """Cut at these optical depths, where one wants to look."""
    edges = [DEEP * (1.0 - x / depth) for x in (0.0, *cuts, depth)][::-1]
    media = tuple(
        medium.Medium(
            medium.Uniform(low, high),
            depth * albedo / DEEP,
            depth * (1.0 - albedo) / DEEP,
            lobe,
        )
        for low, high in zip(edges, edges[1:], strict=False)
    )
    direction = np.array([math.sqrt(1.0 - cosine * cosine), 0.0, cosine])
    sun = light.Sun(direction, irradiance, 0.0)
    return atmos.Scene(geometry.Flat(), DEEP, media, (sun,), 0.0)


@eqx.filter_jit
def look(scene, columns, positions, directions):
    sky = atmos.solve(scene, columns, jnp.array([500.0], positions.dtype))
    flux = lambda at: columns.fluxes(
        sky.prepared, sky.scene, sky.scene.lights[0], sky.wavelength, at
    )
    radiance = jax.vmap(jax.vmap(sky.radiance, (None, 0)), (0, None))
    return radiance(positions, directions)[..., 0], jax.vmap(flux)(positions)


_ONE = [-1.0, -0.5, -0.1, 0.1, 0.5, 1.0]
_TWO = [-0.981986, -0.538263, -0.018014, 0.018014, 0.538263, 0.981986]


def cases() -> Iterator[tuple]:
    """Name, depth, albedo, lobe, sun, irradiance, depths, cosines and azimuths."""
    even, air = phase.Isotropic(), phase.Rayleigh()
    lobe = phase.HenyeyGreenstein(0.75)
    for name, depth, albedo in [
        ("1a", 0.03125, 0.2),
        ("1b", 0.03125, 1.0),
        ("1d", 32.0, 0.2),
        ("1e", 32.0, 1.0),
    ]:
        yield name, depth, albedo, even, 0.1, PI / 0.1, [0.0, depth], _ONE, [0.0]
    for name, depth, albedo in [
        ("2a", 0.2, 0.5),
        ("2b", 0.2, 1.0),
        ("2c", 5.0, 0.5),
        ("2d", 5.0, 1.0),
    ]:
        yield name, depth, albedo, air, 0.080442, PI, [0.0, depth], _TWO, [0.0]
    for name, depth in [("3a", 1.0), ("3b", 8.0)]:
        yield name, depth, 1.0, lobe, 1.0, PI, [0.0, depth], _ONE, [0.0]
    if published is None:
        print("nanodisort is not installed: cases 4 and 5 are skipped.")
        return
    haze = Series(jnp.asarray(published.haze_l(82)))
    cloud = Series(jnp.asarray(published.cloud_c1(299)))
    depths = [0.0, 0.5, 1.0]
    yield "4a", 1.0, 1.0, haze, 1.0, PI, depths, _ONE, [0.0]
    yield "4b", 1.0, 0.9, haze, 1.0, PI, depths, _ONE, [0.0]
    yield "4c", 1.0, 0.9, haze, 0.5, PI, depths, _ONE, [0.0, 90.0, 180.0]
    yield "5a", 64.0, 1.0, cloud, 1.0, PI, [0.0, 32.0, 64.0], _ONE, [0.0]
    yield "5b", 64.0, 0.9, cloud, 1.0, PI, [3.2, 12.8, 48.0], _ONE, [0.0]


def disort(truth: dict, streams: int, only: str = "") -> Iterator[Claim]:
    """Those whose names begin with `only`."""
    bar = 1e-3 if streams == STREAMS[-1] else None
    chosen = (x for x in cases() if x[0].startswith(only))
    for name, depth, albedo, lobe, cosine, irradiance, depths, mus, azimuths in chosen:
        known = truth[name]
        inner = [x for x in depths if 0.0 < x < depth]
        scene = slab(depth, albedo, lobe, cosine, irradiance, inner)
        columns = solver.Columns(streams=streams, layers=80, pieces=20)
        heights = DEEP * (1.0 - np.array(depths) / depth)
        positions = np.zeros((len(depths), 3))
        positions[:, 2] = heights
        phi, mu = np.meshgrid(np.radians(azimuths), mus, indexing="ij")
        # What travels upwards is seen by looking down.
        level = np.sqrt(1.0 - mu * mu)
        views = np.stack([level * np.cos(phi), level * np.sin(phi), -mu], -1)
        radiance, flux = look(
            scene, columns, jnp.asarray(positions), jnp.asarray(views.reshape(-1, 3))
        )
        seen = np.asarray(radiance).reshape(len(depths), len(azimuths), len(mus))
        due = np.array(known["uu"]).transpose(1, 0, 2)
        shown = due > 1e-10
        aureole = (views @ np.asarray(scene.lights[0].direction)) > math.cos(0.0349)
        aureole = np.broadcast_to(aureole[None], due.shape)
        error = np.where(shown, np.abs(seen / np.where(shown, due, 1.0) - 1.0), 0.0)
        text = f"case {name}, {streams} streams: radiance"
        yield Claim(text, "CDISORT, converged", bar, error[~aureole].max())
        if aureole.any() and shown[aureole].any():
            bright = 2e-2 if bar else None
            yield Claim(
                "    in the aureole", "CDISORT, converged", bright, error[aureole].max()
            )
        apart = [
            np.abs(np.asarray(got)[:, 0] - known[key]).max() / (irradiance * cosine)
            for got, key in [
                (flux.up, "flup"),
                (flux.diffuse, "rfldn"),
                (flux.direct, "rfldir"),
            ]
        ]
        yield Claim(
            "    fluxes", "CDISORT, converged", 1e-4 if bar else None, max(apart)
        )


def slabs(rows: np.ndarray, streams: int) -> Claim:
    columns = solver.Columns(streams=streams, layers=16)

    @jax.jit
    def shares(row):
        depth, albedo, g, cosine = row
        scene = slab(1.0, 1.0, phase.HenyeyGreenstein(g), 0.5, 1.0)
        stuff = scene.media[0]
        stuff = medium.Medium(
            stuff.profile,
            depth * albedo / DEEP,
            depth * (1.0 - albedo) / DEEP,
            stuff.phase,
        )
        direction = jnp.stack([jnp.sqrt(1.0 - cosine**2), 0.0 * cosine, cosine])
        sun = light.Sun(direction, 1.0, 0.0)
        scene = atmos.Scene(geometry.Flat(), DEEP, (stuff,), (sun,), 0.0)
        sky = atmos.solve(scene, columns, jnp.array([500.0]))
        place = jnp.zeros((2, 3)).at[1, 2].set(DEEP)
        flux = lambda at: columns.fluxes(
            sky.prepared, sky.scene, sky.scene.lights[0], sky.wavelength, at
        )
        found = jax.vmap(flux)(place)
        down = found.diffuse + found.direct
        return jnp.stack([found.up[1, 0], down[0, 0]]) / cosine

    found = np.stack([shares(jnp.asarray(row[:4])) for row in rows])
    error = np.abs(found - rows[:, 4:6]).max()
    bar = 1e-4 if streams == STREAMS[-1] else None
    return Claim(
        f"216 slabs, {streams} streams: flux", "CDISORT, 128 streams", bar, error
    )


def clear_sky(zenith: float) -> atmos.Scene:
    """The world of `validation.single_scattering`, flat."""
    flat = lambda scene: scene.geometry
    return eqx.tree_at(flat, single_scattering.world(zenith), geometry.Flat())


def peer(zenith: float, layers: int, azimuths: np.ndarray):
    """PythonicDISORT at 48 streams: its cosines; radiance at top and ground."""
    top, ozone = judge.TOP, judge.OZONE
    fine = np.linspace(0.0, top, 200001)
    amount = fine / top + sum(1.0 - np.exp(-fine / x) for x in judge.SCALE_HEIGHTS)
    even = np.linspace(0.0, amount[-1], layers + 1)
    edges = np.unique(np.concatenate([np.interp(even, amount, fine), ozone]))
    columns = [-x * np.diff(np.exp(-edges / x)) for x in judge.SCALE_HEIGHTS]
    width = ozone[1] - ozone[0]
    x = (np.clip(edges, ozone[0], ozone[2]) - ozone[0]) / width
    tent = np.where(x < 1.0, 0.5 * x * x, 1.0 - 0.5 * (2.0 - x) ** 2)
    columns = np.stack([*columns, width * np.diff(tent)], -1)[::-1]
    l = np.arange(200)
    air = np.where(l == 0, 1.0, np.where(l == 2, 0.1, 0.0))
    lobes = np.stack([air, judge.SHARE * judge.ASYMMETRY**l])
    found = []
    for i in range(len(judge.WAVELENGTH)):
        depth = columns * judge.EXTINCTION[:, i]
        moments = depth[:, :2] @ lobes
        share = np.minimum(moments[:, 0] / depth.sum(1), 1.0 - 1e-9)
        total = np.cumsum(depth.sum(1))
        moments /= moments[:, :1]
        mu, _, _, _, radiance = pydisort(
            total,
            share,
            48,
            moments,
            math.cos(math.radians(zenith)),
            1.0,
            0.0,
            NLeg=48,
            NFourier=48,
            f_arr=moments[:, 48],
            NT_cor=True,
            BDRF_Fourier_modes=[judge.ALBEDO],
        )
        ends = [[radiance(x, a) for a in azimuths] for x in (0.0, total[-1])]
        found.append(np.array(ends))
    return mu, np.moveaxis(np.array(found), 0, -1)


def smooth_peer(zenith: float, azimuths: np.ndarray):
    """The same of air without layers: these err as the square of their thickness."""
    mu, coarse = peer(zenith, 120, azimuths)
    _, fine = peer(zenith, 240, azimuths)
    return mu, fine + (fine - coarse) / 3.0


def clear_skies() -> Iterator[Claim]:
    azimuths = np.radians([0.0, 5.0, 30.0, 90.0, 150.0, 180.0])
    grids = [(16, 60, 12, 3), (16, 120, 24, 4), (24, 60, 12, 3), (32, 120, 24, 4)]
    known = {zenith: smooth_peer(zenith, azimuths) for zenith in (30.0, 60.0, 80.0)}
    for streams, layers, pieces, nodes in grids:
        columns = solver.Columns(
            streams=streams, layers=layers, pieces=pieces, nodes=nodes
        )
        worst, mean = [], []
        for zenith, (mu, due) in known.items():
            level = np.sqrt(1.0 - mu * mu)[None]
            north, east = np.cos(azimuths)[:, None], np.sin(azimuths)[:, None]
            down = np.broadcast_to(-mu, (len(azimuths), len(mu)))
            views = np.stack([level * east, level * north, down], -1)
            places = np.array([[0.0, 0.0, judge.TOP], [0.0, 0.0, 0.0]])
            seen = spectral(clear_sky(zenith), columns, places, views.reshape(-1, 3))
            error = np.abs(np.asarray(seen).reshape(due.shape) / due - 1.0)
            clear = np.abs(mu) > math.cos(math.radians(89.0))
            error = [error[0][:, clear & (mu > 0)], error[1][:, clear & (mu < 0)]]
            worst.append(max(x.max() for x in error))
            mean.append(np.mean([x.mean() for x in error]))
        text = f"clear sky, {streams} streams, {layers} layers: radiance"
        bar = 5e-4 if layers == 60 else None
        yield Claim(text, "PythonicDISORT, 48 streams", bar, max(worst))
        yield Claim("    mean", "PythonicDISORT, 48 streams", None, np.mean(mean))


@eqx.filter_jit
def spectral(scene, columns, places, views):
    sky = atmos.solve(scene, columns, judge.WAVELENGTH)
    return jax.vmap(jax.vmap(sky.radiance, (None, 0)), (0, None))(places, views)


def gradients() -> Claim:
    columns = solver.Columns(streams=8, layers=12)
    views = np.array([[0.6, 0.0, 0.8], [0.0, 0.8, -0.6], [-0.28, 0.0, 0.96]])

    def total(numbers):
        depth, albedo, g, cosine = numbers
        scene = slab(depth, albedo, phase.HenyeyGreenstein(g), 0.5, 1.0)
        direction = jnp.stack([jnp.sqrt(1.0 - cosine**2), 0.0 * cosine, cosine])
        sun = light.Sun(direction, 1.0, 0.0)
        scene = atmos.Scene(scene.geometry, DEEP, scene.media, (sun,), 0.3)
        sky = atmos.solve(scene, columns, jnp.array([500.0]))
        place = jnp.array([0.0, 0.0, 300.0])
        return jnp.sum(jax.vmap(sky.radiance, (None, 0))(place, views))

    numbers = jnp.array([1.3, 0.95, 0.7, 0.6])
    slope, value = jax.jit(jax.grad(total))(numbers), jax.jit(total)
    steps = 1e-5 * np.eye(4)
    due = [(value(numbers + x) - value(numbers - x)) / 2e-5 for x in steps]
    error = np.abs(np.asarray(slope) / np.array(due) - 1.0).max()
    return Claim("gradients of radiance", "central differences", 1e-5, error)


def claims(arguments: argparse.Namespace) -> Iterator[Claim]:
    folder = arguments.truth
    if folder is None or not folder.is_dir():
        print("`--truth` is not a folder: skipped.")
        return
    jax.config.update("jax_enable_x64", True)
    text = (folder / "slab_reflectance_transmittance_hg.csv").read_text()
    lines = [x for x in text.splitlines() if not x.startswith("#")]
    rows = [[float(x) for x in row] for row in list(csv.reader(lines))[1:]]
    text = (folder / "disort_converged_nanodisort.json").read_text()
    truth = {x["case"]: x["values"] for x in json.loads(text)["cases"]}
    yield gradients()
    if pydisort is None:
        print("PythonicDISORT is not installed: the clear sky is skipped.")
    else:
        yield from clear_skies()
    for streams in STREAMS:
        yield slabs(np.array(rows), streams)
        yield from disort(truth, streams)


if __name__ == "__main__":
    sys.exit(main(__doc__, claims))
