"""Derivatives of radiance by the amounts of media and the ground, against sasktran2's.

In the world of `validation.single_scattering`, round, by `Columns`: how radiances seen
from the ground and from the top change with the amount of air, of aerosol and of ozone,
and with the albedo of the ground. sasktran2 (discrete ordinates for the diffuse light,
the rest in the round) linearises its own solution. Derivatives are of the logarithm of
the radiance by that of the amount, the largest of which are 0.9 by air, aerosol and the
ground, and 0.2 by ozone; the error of the radiance itself stands beside.

    python -m validation.derivatives
"""

import argparse
import importlib.util
import math
import sys
from collections.abc import Iterator
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import atmos
from atmos import medium, solver, spectrum

from . import peers, quadrature as judge, single_scattering
from .claim import Claim, main
from .multiple_scattering import vectors


SUN = 50.0  # zenith angle, degrees
STREAMS, LEVELS, MOMENTS = 16, 80, 64
AZIMUTHS = np.array([0.0, 90.0, 180.0])
# Altitude, and zenith angles of looks.
LOOKS = [(0.0, [0.0, 40.0, 70.0, 85.0]), (judge.TOP, [180.0, 140.0, 110.0])]
NAMES = ["air", "aerosol", "ozone", "albedo of the ground"]


def world(amounts: jax.Array) -> atmos.Scene:
    """With so many times the air, aerosol and ozone, over ground of an albedo."""
    scene = single_scattering.world(SUN)
    times = lambda x, by: (
        None if x is None else spectrum.Product(x, spectrum.Constant(by))
    )
    media = tuple(
        medium.Medium(
            x.profile, times(x.scattering, by), times(x.absorption, by), x.phase
        )
        for x, by in zip(scene.media, amounts[:3], strict=True)
    )
    return atmos.Scene(scene.geometry, scene.top, media, scene.lights, amounts[3])


def ours(amounts: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Radiances [look, wl], and their derivatives [look, wl, amount]."""
    columns = solver.Columns(streams=STREAMS)

    def seen(amounts):
        sky = atmos.solve(world(amounts), columns, judge.WAVELENGTH)
        found = []
        for altitude, zeniths in LOOKS:
            zenith, azimuth = np.meshgrid(zeniths, AZIMUTHS, indexing="ij")
            views = jnp.asarray(vectors(zenith.ravel(), azimuth.ravel()))
            at = jnp.array([0.0, 0.0, altitude])
            found.append(jax.vmap(sky.radiance, (None, 0))(at, views))
        return jnp.concatenate(found)

    return eqx.filter_jit(lambda x: (seen(x), jax.jacfwd(seen)(x)))(amounts)


def theirs(amounts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same, by sasktran2."""
    import sasktran2

    scene, nm = world(jnp.asarray(amounts)), judge.WAVELENGTH
    altitude = peers.levels(scene, LEVELS)
    cosine = math.cos(math.radians(SUN))
    config = sasktran2.Config()
    config.num_streams, config.num_singlescatter_moments = STREAMS, MOMENTS
    config.delta_m_scaling = True
    config.single_scatter_source = sasktran2.SingleScatterSource.Exact
    ordinates = sasktran2.MultipleScatterSource.DiscreteOrdinates
    config.multiple_scatter_source = ordinates
    sphere = sasktran2.Geometry1D(
        cosine,
        0.0,
        judge.RADIUS,
        altitude,
        sasktran2.InterpolationMethod.LinearInterpolation,
        sasktran2.GeometryType.Spherical,
    )
    rays = sasktran2.ViewingGeometry()
    for height, zeniths in LOOKS:
        for zenith in np.radians(zeniths):
            for azimuth in np.radians(AZIMUTHS):
                eye = sasktran2.SolarAnglesObserverLocation(
                    cosine, azimuth, math.cos(zenith), height
                )
                rays.add_ray(eye)
    air = sasktran2.Atmosphere(sphere, config, wavelengths_nm=nm)
    mixed = peers.optics(scene, nm, altitude, MOMENTS)
    weights = 2.0 * np.arange(MOMENTS)[:, None, None] + 1.0
    air["mixture"] = sasktran2.constituent.Manual(
        mixed.extinction, mixed.share, mixed.moments * weights
    )
    air["ground"] = sasktran2.constituent.LambertianSurface(
        np.full(len(nm), amounts[3]), nm
    )
    for name, alone in zip(NAMES[:3], scene.media, strict=True):
        alone = eqx.tree_at(lambda x: x.media, scene, (alone,))
        part = peers.optics(alone, nm, altitude, MOMENTS)
        air[name] = _amount(mixed, part, weights)
    found = sasktran2.Engine(config, sphere, rays).calculate_radiance(air)
    slopes = [found[f"wf_{x}"].values.reshape(len(nm), -1) for x in NAMES[:3]]
    ground = found["wf_ground_albedo"].values[..., 0]
    slopes.append(np.sum(ground, 0))
    return found.radiance.values[:, :, 0].T, np.stack(slopes, -1).swapaxes(0, 1)


def _amount(mixed: peers.Optics, part: peers.Optics, weights: np.ndarray) -> Any:
    """What is no medium, but has the derivative by how much there is of one."""
    import sasktran2

    scattered = part.extinction * part.share

    class Amount(sasktran2.constituent.base.Constituent):
        def add_to_atmosphere(self, atmo):
            pass

        def register_derivative(self, atmo, name):
            mapping = atmo.storage.get_derivative_mapping(f"wf_{name}")
            mapping.d_extinction[:] += part.extinction
            more = scattered - mixed.share * part.extinction
            mapping.d_ssa[:] += more / mixed.extinction
            if np.any(scattered > 0.0):
                mapping.d_leg_coeff[:] += (part.moments - mixed.moments) * weights
                both = mixed.share * mixed.extinction
                mapping.scat_factor[:] += scattered / both
            mapping.interpolator = np.ones((len(part.extinction), 1))
            mapping.interp_dim = "amount"
            mapping.assign_name = f"wf_{name}"

    return Amount()


def claims(arguments: argparse.Namespace) -> Iterator[Claim]:
    if importlib.util.find_spec("sasktran2") is None:
        print("sasktran2 is not installed: skipped.")
        return
    jax.config.update("jax_enable_x64", True)
    amounts = np.array([1.0, 1.0, 1.0, judge.ALBEDO])
    due, slopes = theirs(amounts)
    seen, found = (np.asarray(x) for x in ours(jnp.asarray(amounts)))
    source = f"sasktran2, {STREAMS} streams"
    yield Claim("radiance", source, 0.02, np.max(np.abs(seen / due - 1.0)))
    error = np.abs(found - slopes) * amounts / due[..., None]
    for i, name in enumerate(NAMES):
        yield Claim(f"its derivative by the {name}", source, 1e-2, error[..., i].max())


if __name__ == "__main__":
    sys.exit(main(__doc__, claims))
