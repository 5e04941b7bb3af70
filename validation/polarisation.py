"""Polarised light against the tables of Natraj, Li and Yung (2009), and sasktran2.

Molecules without depolarisation over a Lambertian ground: I, Q and U at the top and the
ground, for 7 optical depths, 3 albedos, 7 suns, and 16 zenith angles and 7 azimuths of
the view, in all 32,928 directions. Errors are relative to I. Optical depths and albedos
go through `solve` as wavelengths. And the world of `validation.single_scattering`, air,
aerosol and ozone around a planet, against sasktran2: its exact single scattering, and
its discrete ordinates, which are off by half a per cent there themselves.

    python -m validation.polarisation --truth DIR

where DIR has `natraj2009_rayleigh_IQU.csv`.
"""

import argparse
import csv
import math
import sys
from collections.abc import Iterator

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import atmos
from atmos import geometry, light, medium, phase, solver, spectrum

from . import quadrature as judge, single_scattering
from .claim import Claim, main


try:
    import sasktran2
except ImportError:
    sasktran2 = None


DEEP = 1000.0
THIN = 0.1
SOURCE = "Natraj, Li and Yung 2009"


def slab(depths, albedos, cosines):
    """Air of an optical depth over a ground, a pair of these for each wavelength."""
    bands = 400.0 + np.arange(float(depths.size))
    table = lambda values: spectrum.Tabulated(bands, values)
    air = medium.Medium(
        medium.Uniform(0.0, DEEP), table(depths / DEEP), phase=phase.Rayleigh()
    )
    suns = tuple(
        light.Sun(np.array([0.0, math.sqrt(1.0 - x * x), x]), math.pi, 0.0)
        for x in cosines
    )
    return atmos.Scene(geometry.Flat(), DEEP, (air,), suns, table(albedos)), bands


@eqx.filter_jit
def look(sky, mu, azimuth):
    """At the top looking down and at the ground looking up: [2, view, stokes, wl]."""
    stokes = sky.stokes
    if sky.solver.stokes == 1:
        stokes = lambda *place: sky.radiance(*place)[None]
    # Straight up, the azimuth still says which way is level.
    level = jnp.maximum(jnp.sqrt(1.0 - mu * mu), 1e-9)
    flat = [level * jnp.sin(azimuth), level * jnp.cos(azimuth)]
    see = jax.vmap(stokes, (None, 0))
    place = jnp.zeros((2, 3)).at[0, 2].set(DEEP)
    up, down = jnp.stack([*flat, -mu], -1), jnp.stack([*flat, mu], -1)
    return jnp.stack([see(place[0], up), see(place[1], down)])


KEYS = ["tau", "albedo", "mu0", "mu", "phi"]


def table(rows):
    """The axes, and I, Q and U: [up or down, tau, albedo, mu0, mu, phi, stokes]."""
    axes = [sorted({float(x[key]) for x in rows}) for key in KEYS]
    known = np.full((2, *(len(x) for x in axes), 3), np.nan)
    for x in rows:
        at = [axis.index(float(x[key])) for key, axis in zip(KEYS, axes, strict=True)]
        known[(int(x["dir"] == "DN"), *at)] = [float(x[key]) for key in "IQU"]
    return axes, known


def solved(axes, columns):
    """The same as atmos has it; all suns are solved for at once."""
    tau, albedo, mu0, mu, phi = axes
    depths, albedos = np.meshgrid(tau, albedo, indexing="ij")
    mu, phi = np.meshgrid(mu, np.radians(phi), indexing="ij")
    scene, bands = slab(depths.ravel(), albedos.ravel(), mu0)
    sky = atmos.solve(scene, columns, bands)
    found = []
    for sun in sky.scene.lights:
        alone = eqx.tree_at(lambda x: x.scene.lights, sky, (sun,))
        seen = np.asarray(look(alone, mu.ravel(), phi.ravel()))
        seen = seen.reshape(2, *mu.shape, -1, *depths.shape)
        found.append(np.moveaxis(seen, (4, 5), (1, 2)))
    return np.stack(found, 3)


def errors(axes, known, columns):
    """Of I, Q and U, over I, for those optical depths: [row, stokes]."""
    found = solved(axes, columns)
    error = np.abs(found - known[..., : columns.stokes]) / known[..., :1]
    return error.reshape(-1, columns.stokes)


# Nearer to the zenith theirs turn with the azimuth less than they should.
ZENITHS = [30.0, 45.0, 60.0, 75.0, 85.0, 89.0, 120.0, 150.0]
AZIMUTHS = [0.0, 45.0, 90.0, 150.0, 180.0]


def peer(sun, views, levels, multiple):
    """I, Q and U by sasktran2 in the world of `validation.single_scattering`.

    From the ground, or where one looks down from 60 km: [view, wl, stokes].
    """
    config = sasktran2.Config()
    config.num_stokes, config.num_streams = 3, 16
    config.num_singlescatter_moments = 64
    config.num_threads = 2
    config.single_scatter_source = sasktran2.SingleScatterSource.Exact
    config.multiple_scatter_source = multiple
    config.delta_m_scaling = multiple != sasktran2.MultipleScatterSource.NoSource
    config.num_successive_orders_points = 60
    grown = np.expm1(np.linspace(0.0, 4.0, levels + 1)) / np.expm1(4.0)
    altitude = np.unique(np.concatenate([judge.TOP * grown, judge.OZONE]))
    cosine = math.cos(math.radians(sun))
    shape = sasktran2.Geometry1D(
        cosine,
        0.0,
        judge.RADIUS,
        altitude,
        sasktran2.InterpolationMethod.LinearInterpolation,
        sasktran2.GeometryType.Spherical,
    )
    rays = sasktran2.ViewingGeometry()
    for zenith, azimuth in views:
        eye = judge.TOP if zenith > 90.0 else 0.0
        view = math.cos(math.radians(zenith))
        look = sasktran2.SolarAnglesObserverLocation(
            cosine, math.radians(azimuth), view, eye
        )
        rays.add_ray(look)
    air = sasktran2.Atmosphere(
        shape, config, wavelengths_nm=judge.WAVELENGTH, calculate_derivatives=False
    )
    l = np.arange(64)
    none, second = np.zeros(64), np.where(l == 2, 1.0, 0.0)
    # alpha1, alpha2, alpha3 and beta1 of air, dust and ozone, with the factor 2l + 1.
    dipole = [(l == 0) + 0.5 * second, 3.0 * second, none, math.sqrt(1.5) * second]
    dust = [(2.0 * l + 1.0) * judge.ASYMMETRY**l, none, none, none]
    lobes = [
        (1.0, dipole),
        (judge.SHARE, dust),
        (0.0, [1.0 * (l == 0), none, none, none]),
    ]
    density = judge.densities(altitude)
    for i, (share, lobe) in enumerate(lobes):
        extinction = density[:, i, None] * judge.EXTINCTION[i]
        moments = np.stack(lobe, 1).reshape(-1, 1, 1)
        moments = np.broadcast_to(moments, (len(moments), *extinction.shape))
        air[f"medium {i}"] = sasktran2.constituent.Manual(
            extinction, np.full_like(extinction, share), moments.copy()
        )
    air["ground"] = sasktran2.constituent.LambertianSurface(judge.ALBEDO)
    engine = sasktran2.Engine(config, shape, rays)
    return np.moveaxis(engine.calculate_radiance(air).radiance.values, 0, 1)


def round_world() -> Iterator[Claim]:
    """Q and U of sasktran2 have the other sign."""
    views = np.array([(z, a) for z in ZENITHS for a in AZIMUTHS])
    place = jnp.where(views[:, :1] > 90.0, jnp.array([0.0, 0.0, judge.TOP]), 0.0)
    towards = jnp.asarray(single_scattering.vectors(*views.T))
    source, sign = sasktran2.MultipleScatterSource, np.array([1.0, -1.0, -1.0])
    for sun in (30.0, 60.0, 75.0):
        scene = single_scattering.world(sun)
        once = solver.SingleScattering(stokes=3)
        seen = np.asarray(around(scene, once, place, towards))
        # Theirs err with the square of a layer's thickness.
        coarse, fine = (sign * peer(sun, views, n, source.NoSource) for n in (100, 200))
        due = fine + (fine - coarse) / 3.0
        error = np.abs(seen - due) / due[..., :1]
        text = f"light that turned once, sun {sun:g}: I, Q, U over I"
        yield Claim(text, "sasktran2, exact, limit", 1e-5, error.max())
        seen = np.asarray(around(scene, solver.Columns(stokes=3), place, towards))
        due = sign * peer(sun, views, 60, source.DiscreteOrdinates)
        parts = [x / x[..., :1] for x in (seen, due)]
        text = f"all light, round, sun {sun:g}: Q/I and U/I"
        error = np.abs(parts[0] - parts[1])
        yield Claim(text, "sasktran2, 16 ordinates", 5e-3, error.max())
        yield Claim("    mean", "sasktran2, 16 ordinates", None, error[..., 1:].mean())


@eqx.filter_jit
def around(scene, solve, places, views):
    sky = atmos.solve(scene, solve, judge.WAVELENGTH)
    return jnp.swapaxes(jax.vmap(sky.stokes)(places, views), 1, 2)


def gradients() -> Claim:
    columns = solver.Columns(streams=4, layers=8, pieces=4, stokes=3)
    views = np.array([[0.6, 0.0, 0.8], [0.0, 0.8, -0.6], [-0.28, 0.0, 0.96]])

    def total(numbers):
        depth, rho, cosine, ground = numbers
        air = medium.Medium(
            medium.Uniform(0.0, DEEP), depth / DEEP, phase=phase.Rayleigh(rho)
        )
        direction = jnp.stack([jnp.sqrt(1.0 - cosine**2), 0.0 * cosine, cosine])
        sun = light.Sun(direction, 1.0, 0.0)
        scene = atmos.Scene(geometry.Flat(), DEEP, (air,), (sun,), ground)
        sky = atmos.solve(scene, columns, jnp.array([500.0]))
        place = jnp.array([0.0, 0.0, 300.0])
        seen = jax.vmap(sky.stokes, (None, 0))(place, views)
        return jnp.sum(seen * jnp.array([1.0, 2.0, 3.0])[None, :, None])

    numbers = jnp.array([0.7, 0.03, 0.6, 0.3])
    slope, value = jax.jit(jax.grad(total))(numbers), jax.jit(total)
    steps = 1e-5 * np.eye(4)
    due = [(value(numbers + x) - value(numbers - x)) / 2e-5 for x in steps]
    error = np.abs(np.asarray(slope) / np.array(due) - 1.0).max()
    return Claim("gradients of I, Q and U", "central differences", 1e-5, error)


def claims(arguments: argparse.Namespace) -> Iterator[Claim]:
    folder = arguments.truth
    if folder is None or not folder.is_dir():
        print("`--truth` is not a folder: skipped.")
        return
    jax.config.update("jax_enable_x64", True)
    text = (folder / "natraj2009_rayleigh_IQU.csv").read_text()
    lines = [x for x in text.splitlines() if not x.startswith("#")]
    (depths, *axes), known = table(list(csv.DictReader(lines)))

    yield gradients()
    if sasktran2 is None:
        print("sasktran2 is not installed: the round world is skipped.")
    else:
        yield from round_world()
    # Thin air wants more streams near the horizon, thick air more layers.
    thin = sum(x <= THIN for x in depths)
    fine = solver.Columns(streams=48, layers=40, stokes=3)
    deep = solver.Columns(streams=32, layers=200, stokes=3)
    error = [
        errors([depths[:thin], *axes], known[:, :thin], fine),
        errors([depths[thin:], *axes], known[:, thin:], deep),
    ]
    for name, x in zip("IQU", np.concatenate(error).T, strict=True):
        yield Claim(f"{name} over I, {x.size} directions", SOURCE, 1e-4, x.max())
        yield Claim("    median", SOURCE, None, np.median(x))
    usual = errors([depths, *axes], known, solver.Columns(stokes=3))
    yield Claim("I, Q, U over I, 16 streams, 60 layers", SOURCE, 5e-3, usual.max())
    yield Claim("    median", SOURCE, None, np.median(usual))
    alone = errors([depths, *axes], known, solver.Columns())
    yield Claim("I without polarisation", SOURCE, None, alone.max())


if __name__ == "__main__":
    sys.exit(main(__doc__, claims))
