"""Where light from beyond may have turned: rays through layers, cut into pieces."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Integer

from ..geometry import AbstractPath, Point
from ..quantity import Direction, dot, Length
from ..scene import Scene
from ..transport import columns, densities, gauss_legendre


# Nodes a piece, and on the way to the sun: optical depths right to 1e-6.
NODES, LIGHT_NODES = 3, 12
# Cells in the cosine of the sun's zenith angle.
SUNS = 64


class Layers(eqx.Module):
    """A scene cut at altitudes, and a guess of how bright its air is.

    `tops` are the upper ends of shells; `forward` is the asymmetry of a medium where it
    is above 0. `guess` is the light per irradiance that falls on a shell from all sides
    (on the ground, last: that leaves it, over its albedo), with the cells of `cell` in
    the cosine of the sun's zenith angle; `diffuse` is the part that has turned before,
    and `whence` the share of it from each cell of directions. What is worked out with a
    poor guess is right, but noisy.
    """

    tops: Float[Array, "shell"]
    extinction: Float[Array, "medium wl"]
    scattering: Float[Array, "medium wl"]
    forward: Float[Array, "medium wl"]
    ground: Float[Array, "wl"]
    guess: Float[Array, "home cell wl"]
    diffuse: Float[Array, "home cell wl"]
    whence: Float[Array, "home cell view wl"]

    def shell(self, piece: Integer[Array, "*n"]) -> Integer[Array, "*n"]:
        """The shell that a piece lies in; the ground is the piece after the last."""
        count = self.tops.shape[0]
        fall, rise = count - 1 - piece, piece - count
        return jnp.where(piece < count, fall, rise)


class Flight(eqx.Module):
    """A ray in pieces, first falling and then rising, each within a shell.

    `density` is that of the media at Gauss's nodes, `passed` how much of each lies
    before a piece, and after the last the whole.
    """

    path: AbstractPath
    far: Length
    grounded: Bool[Array, ""]
    begin: Float[Array, "piece"]
    length: Float[Array, "piece"]
    density: Float[Array, "piece node medium"]
    passed: Float[Array, "place medium"]


def cell(cosine: Float[Array, "*n"]) -> Integer[Array, "*n"]:
    """Cells are the narrower the nearer the sun is to the horizon."""
    x = jnp.sign(cosine) * jnp.sqrt(jnp.abs(cosine))
    return jnp.clip(jnp.int32(0.5 * (x + 1.0) * SUNS), 0, SUNS - 1)


def fly(scene: Scene, layers: Layers, start: Point, direction: Direction) -> Flight:
    """The ray that leaves a place in the air."""
    path = scene.geometry.path(start, direction)
    span = path.span(scene.top)
    # What grazes the top, and by rounding has not entered, is out.
    far = jnp.where(span.near > 0.0, 0.0, span.far)
    falling, rising = jax.vmap(path.crossings, out_axes=1)(layers.tops)
    lowest = path.lowest()
    edges = [
        jnp.minimum(falling[::-1], lowest),
        lowest[None],
        jnp.maximum(rising, lowest),
    ]
    edges = jnp.clip(jnp.concatenate(edges), 0.0, far)
    begin, length = edges[:-1], jnp.diff(edges)
    u, w = (jnp.asarray(x, far.dtype) for x in gauss_legendre(NODES))

    def along(place):
        return densities(scene, path.at(place))

    density = jax.vmap(jax.vmap(along))(begin[:, None] + length[:, None] * u[None])
    whole = jnp.sum(density * w[None, :, None], 1) * length[:, None]
    passed = jnp.cumsum(whole, 0)
    passed = jnp.concatenate([jnp.zeros_like(passed[:1]), passed])
    return Flight(path, far, span.grounded, begin, length, density, passed)


def share(depth: Array) -> Array:
    """`(1 - exp(-depth)) / depth`, for depths below 0 too."""
    small = jnp.abs(depth) < 1e-4
    safe = jnp.where(small, 1.0, depth)
    return jnp.where(small, 1.0 - 0.5 * depth, -jnp.expm1(-safe) / safe)


def brightness(
    layers: Layers, flight: Flight, sun: Direction
) -> tuple[Float[Array, "place wl"], Float[Array, "place wl"]]:
    """What each piece, and the ground, adds to what one sees: if all were of brightness
    1, and as it is guessed to be."""
    depth = dot(flight.passed, layers.extinction)
    scattered = dot(jnp.diff(flight.passed, axis=0), layers.scattering)
    within = scattered * share(jnp.diff(depth, axis=0))
    ground = jnp.where(flight.grounded, layers.ground, 0.0)
    even = jnp.exp(-depth) * jnp.concatenate([within, ground[None]])
    places = jnp.append(flight.begin + 0.5 * flight.length, flight.far)
    cosines = jax.vmap(lambda s: dot(flight.path.at(s).up, sun))(places)
    pieces = jnp.arange(places.shape[0])
    return even, even * layers.guess[layers.shell(pieces), cell(cosines)]


def to_sun(
    scene: Scene, point: Point, sun: Direction
) -> tuple[Float[Array, "medium"], Bool[Array, ""]]:
    """What lies on the way to the sun, and whether the ground does not."""
    path = scene.geometry.path(point, sun)
    span = path.span(scene.top)
    return columns(scene, path, span.far, nodes=LIGHT_NODES), ~span.grounded
