"""The line integrals that every solver is made of.

A ray is cut where a density is not smooth, and each piece is integrated by Gauss and
Legendre in a variable that crowds the nodes where the medium is thickest.
"""

import functools as ft
import math

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from .geometry import AbstractPath, Point
from .light import Sun
from .medium import AbstractProfile
from .quantity import (
    Depth,
    Direction,
    dot,
    Fraction,
    Irradiance,
    Length,
    Position,
    Wavelength,
)
from .scene import Scene


# Nodes a piece for an optical depth right to 1e-10.
FINE = 32


@ft.cache
def gauss_legendre(nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Places and weights on the interval from 0 to 1."""
    x, w = np.polynomial.legendre.leggauss(nodes)
    return 0.5 * (x + 1.0), 0.5 * w


@ft.cache
def cumulative(nodes: int) -> np.ndarray:
    """The matrix that turns values at the nodes into integrals from 0 to each node."""
    u, _ = gauss_legendre(nodes)
    powers = np.arange(nodes)
    legendre = np.polynomial.legendre
    basis = np.linalg.inv(legendre.legvander(2.0 * u - 1.0, nodes - 1))
    integrals = [
        legendre.legval(2.0 * u - 1.0, legendre.legint(np.eye(nodes)[l], lbnd=-1))
        for l in powers
    ]
    return 0.5 * np.stack(integrals, 1) @ basis


@ft.partial(jax.jit, static_argnames="nodes")
def column(
    profile: AbstractProfile, path: AbstractPath, far: Length, *, nodes: int
) -> Length:
    """How many metres of density 1 hold as much as lies between the start and `far`."""
    edges = jnp.clip(profile.breaks(path), 0.0, far)
    if profile.box is None:
        edges = jnp.concatenate([jnp.zeros_like(far)[None], edges, far[None]])
    begin, end = edges[:-1], edges[1:]
    # Start each piece at its lower end, where the medium is thickest.
    falls = 0.5 * (begin + end) < path.lowest()
    low = jnp.where(falls, end, begin)
    length = jnp.where(falls, begin - end, end - begin)
    u, w = (jnp.asarray(x, far.dtype) for x in gauss_legendre(nodes))

    def piece(low, length):
        places = low + length * (u * u)
        density = jax.vmap(lambda s: profile.density(path.at(s)))(places)
        return jnp.abs(length) * jnp.sum(density * (2.0 * u * w))

    return jnp.sum(jax.vmap(piece)(low, length))


def columns(
    scene: Scene, path: AbstractPath, far: Length, *, nodes: int
) -> Float[Array, "medium"]:
    """The column of every medium between the start of a ray, in the air, and `far`."""
    found = [column(x.profile, path, far, nodes=nodes) for x in scene.media]
    return jnp.stack(found) if found else jnp.zeros(0, far.dtype)


def contract(product: str, *terms: Array) -> Array:
    """A sum of products, in full precision."""
    return jnp.einsum(product, *terms, precision="highest")


def densities(scene: Scene, point: Point) -> Float[Array, "medium"]:
    """How much there is of each medium, relative to its coefficients."""
    found = [x.profile.density(point) for x in scene.media]
    return jnp.stack(found) if found else jnp.zeros(0, point.altitude.dtype)


def extinctions(scene: Scene, wavelength: Wavelength) -> Float[Array, "medium wl"]:
    """The extinction coefficient of every medium where its profile is 1, in m^-1."""
    if not scene.media:
        return jnp.zeros((0, *wavelength.shape), wavelength.dtype)
    return jnp.stack(
        [
            jnp.broadcast_to(x.extinction(wavelength), wavelength.shape)
            for x in scene.media
        ]
    )


def enter(
    scene: Scene, position: Position, direction: Direction
) -> tuple[AbstractPath, Length, Bool[Array, ""]]:
    """The ray from where it enters the air, its length there, and if it ends grounded.

    An observer above the air is moved to its top: no digits are lost on the way. A ray
    that meets no air begins anywhere there.
    """
    along = lambda place: scene.geometry.path(scene.geometry.locate(place), direction)
    path = along(position).enter(scene.top)
    span = path.span(scene.top)
    # What grazes the top, and by rounding has not entered, is out.
    far = jnp.where(span.near > 0.0, 0.0, span.far)
    anywhere = along(jnp.zeros_like(position).at[2].set(scene.top))
    meets = span.grounded | (far > 0.0)
    path = jax.tree.map(lambda a, b: jnp.where(meets, a, b), path, anywhere)
    return path, far, span.grounded


def optical_depth(
    scene: Scene,
    position: Position,
    direction: Direction,
    wavelength: Wavelength,
    *,
    distance: Length | None = None,
    nodes: int = FINE,
) -> Depth:
    """The optical depth from a place to the ground or the top of the air, along a ray.

    With `distance`, in m, no farther than that.
    """
    path, far, _ = enter(scene, position, direction)
    if distance is not None:
        gone = path.start.position - position
        far = jnp.clip(distance - dot(gone, direction), 0.0, far)
    found = columns(scene, path, far, nodes=nodes)
    return dot(found, extinctions(scene, wavelength))


def transmittance(
    scene: Scene,
    position: Position,
    direction: Direction,
    wavelength: Wavelength,
    *,
    nodes: int = FINE,
) -> Fraction:
    """The share of light from beyond the air that arrives; 0 through the ground."""
    _, _, grounded = enter(scene, position, direction)
    depth = optical_depth(scene, position, direction, wavelength, nodes=nodes)
    return jnp.where(grounded, 0.0, jnp.exp(-depth))


def direct_irradiance(
    scene: Scene, sun: Sun, position: Position, wavelength: Wavelength
) -> Irradiance:
    """What a plane facing the sun receives from its disk, through the air.

    In W m^-2 nm^-1. The air weakens the disk strip by strip; the horizon may cut it.
    """
    here = scene.geometry.locate(position)
    rise = dot(here.up, sun.direction)
    level = sun.direction - rise * here.up
    squared = dot(level, level)
    aside = squared > 0.0
    length = jnp.where(aside, jnp.sqrt(jnp.where(aside, squared, 1.0)), 0.0)
    level = level / jnp.where(aside, length, 1.0)
    zenith = jnp.arctan2(length, rise)

    radius = jnp.maximum(sun.angular_radius, 1e-9)
    horizon = 0.5 * math.pi + scene.geometry.dip(here.altitude, jnp.zeros_like(rise))
    cut = jnp.clip((horizon - zenith) / radius, -1.0, 1.0)
    whole = cut * cut >= 1.0
    half = jnp.where(whole, 0.0, jnp.sqrt(jnp.where(whole, 1.0, 1.0 - cut * cut)))
    # From the upper limb, where the angle is 0, to the horizon or the lower limb.
    last = jnp.arctan2(half, -cut)
    u, w = (jnp.asarray(x, rise.dtype) for x in gauss_legendre(24))

    def strip(angle):
        down = zenith - radius * jnp.cos(angle)
        direction = jnp.cos(down) * here.up + jnp.sin(down) * level
        depth = optical_depth(scene, position, direction, wavelength)
        share = sun.slice(-jnp.cos(angle), wavelength)
        return share * jnp.sin(angle) * jnp.exp(-depth)

    strips = jax.vmap(strip)(last * u)
    passed = last * jnp.sum(strips * w[:, None], 0)
    return passed * sun.irradiance.evaluate(wavelength)
