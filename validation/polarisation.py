"""Polarised light in flat columns against the tables of Natraj, Li and Yung (2009).

Molecules without depolarisation over a Lambertian ground: I, Q and U at the top and the
ground, for 7 optical depths, 3 albedos, 7 suns, and 16 zenith angles and 7 azimuths of
the view, in all 32,928 directions. Errors are relative to I. Optical depths and albedos
go through `solve` as wavelengths.

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

from .claim import Claim, main


DEEP = 1000.0
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
    # Straight up, the azimuth still says which way is level.
    level = jnp.maximum(jnp.sqrt(1.0 - mu * mu), 1e-9)
    flat = [level * jnp.sin(azimuth), level * jnp.cos(azimuth)]
    see = jax.vmap(sky.stokes, (None, 0))
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
        seen = seen.reshape(2, *mu.shape, 3, *depths.shape)
        found.append(np.moveaxis(seen, (4, 5), (1, 2)))
    return np.stack(found, 3)


def compare(rows, columns):
    axes, known = table(rows)
    return solved(axes, columns), known
