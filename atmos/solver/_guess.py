"""A guess of how bright the air is, to send paths where light comes from."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..geometry import Point
from ..quantity import dot, Length, Wavelength
from ..scene import Scene
from ..transport import densities, extinctions
from ._directions import views as cells
from ._flight import brightness, fly, Layers, SUNS, to_sun


# Shells besides those of the media.
_SHELLS = 20
# How often the guess is improved, and how far it falls at most below what arrives.
_ROUNDS, _LEAST = 3, 0.5


def prepare(scene: Scene, wavelength: Wavelength) -> Layers:
    """Cuts the air into shells, and guesses how bright they are."""
    heights = tops(scene)
    scattering = [
        jnp.zeros_like(wavelength)
        if x.scattering is None
        else jnp.broadcast_to(x.scattering.evaluate(wavelength), wavelength.shape)
        for x in scene.media
    ]
    forward = [
        jnp.clip(x.phase.moments(2, wavelength)[1], 0.0, 0.999) for x in scene.media
    ]
    forward = [jnp.broadcast_to(x, wavelength.shape) for x in forward]
    none = jnp.zeros((0, *wavelength.shape), wavelength.dtype)
    dark = jnp.zeros((heights.shape[0] + 1, SUNS, *wavelength.shape), wavelength.dtype)
    layers = Layers(
        tops=heights,
        extinction=extinctions(scene, wavelength),
        scattering=jnp.stack(scattering) if scattering else none,
        forward=jnp.stack(forward) if forward else none,
        ground=jnp.broadcast_to(scene.ground.evaluate(wavelength), wavelength.shape),
        guess=dark,
        diffuse=dark,
        whence=dark[:, :, None],
    )
    found = _guess(scene, layers)
    return eqx.tree_at(lambda x: (x.guess, x.diffuse, x.whence), layers, found)


def _above(scene: Scene, altitude: Length) -> Point:
    zero = jnp.zeros_like(altitude)
    return scene.geometry.locate(jnp.stack([zero, zero, altitude]))


@eqx.filter_jit
def tops(scene: Scene) -> Float[Array, "shell"]:
    """Altitudes that share out the air, each of the media, and the height evenly."""
    x = jnp.linspace(0.0, 1.0, 1024, dtype=scene.top.dtype)
    altitudes = scene.top * x * x
    points = jax.vmap(lambda h: _above(scene, h))(altitudes)
    density = jax.vmap(lambda point: densities(scene, point))(points)
    steps = 0.5 * (density[1:] + density[:-1]) * jnp.diff(altitudes)[:, None]
    steps = steps / jnp.maximum(jnp.sum(steps, 0, keepdims=True), 1e-30)
    steps = jnp.concatenate([steps, jnp.diff(x)[:, None]], 1)
    total = jnp.append(jnp.zeros_like(x[:1]), jnp.cumsum(jnp.sum(steps, 1)))
    even = jnp.arange(1, _SHELLS, dtype=x.dtype) / _SHELLS
    cuts = [jnp.interp(even * total[-1], total, altitudes), scene.top[None]]
    cuts += [x.profile.levels.astype(scene.top.dtype) for x in scene.media]
    return jnp.sort(jnp.clip(jnp.concatenate(cuts), 0.0, scene.top))


@eqx.filter_jit
def _guess(scene: Scene, layers: Layers) -> tuple[Array, Array, Array]:
    """The light of all orders, as if each medium sent the share `forward` of what it
    scatters straight on, and the rest everywhere alike."""
    thinner = lambda x: (x.extinction, x.scattering)
    straight = layers.forward * layers.scattering
    thin = layers.extinction - straight, layers.scattering - straight
    layers = eqx.tree_at(thinner, layers, thin)
    dtype = layers.tops.dtype
    bottoms = jnp.append(jnp.zeros_like(layers.tops[:1]), layers.tops[:-1])
    nodes = jnp.append(0.5 * (bottoms + layers.tops), jnp.zeros_like(layers.tops[:1]))
    grounds = jnp.arange(nodes.shape[0]) == nodes.shape[0] - 1
    suns = _suns(dtype)
    views, weights = cells(dtype)

    def direct(altitude, grounded, sun):
        passed, lit = to_sun(scene, _above(scene, altitude), sun)
        arrives = jnp.exp(-dot(passed, layers.extinction))
        falls = jnp.where(grounded, jnp.maximum(sun[2], 0.0) / np.pi, 0.25 / np.pi)
        return jnp.where(lit, falls * arrives, 0.0)

    def looks(guess, altitude, grounded):
        """What arrives, and from where if the sun stood alike above all of it."""
        now = eqx.tree_at(lambda x: x.guess, layers, guess)
        up = jnp.where(grounded, jnp.abs(views[:, 2]), views[:, 2])

        def by_view(view):
            flight = fly(scene, layers, _above(scene, altitude), view)
            seen = lambda sun: jnp.sum(brightness(now, flight, sun)[1], 0)
            even, _ = brightness(now, flight, suns[0])
            count = layers.tops.shape[0]
            shells = even[:count][::-1] + even[count:-1]
            return jax.vmap(seen)(suns), jnp.concatenate([shells, even[-1:]])

        share = jnp.where(grounded, 2.0 * up, 1.0) * weights
        found = jax.vmap(by_view)(views.at[:, 2].set(up))
        return jax.tree.map(lambda x: x * share[:, None, None], found)

    by_sun = jax.vmap(direct, (None, None, 0))
    sources = jax.vmap(by_sun, (0, 0, None))(nodes, grounds, suns)

    def improve(_, found):
        seen = lambda x: jax.tree.map(
            lambda parts: jnp.sum(parts, 0), looks(sources + found, *x)
        )
        arrives, local = jax.lax.map(seen, (nodes, grounds))
        # Of what is missing, all that will come of it where the world is flat.
        missing = jnp.moveaxis(arrives - found, 2, 0)
        matrix = jnp.eye(nodes.shape[0], dtype=dtype)[None] - jnp.moveaxis(local, 2, 0)
        found += jnp.moveaxis(jnp.linalg.solve(matrix, missing), 0, 2)
        return jnp.maximum(found, _LEAST * arrives)

    found = jax.lax.fori_loop(0, _ROUNDS, improve, jnp.zeros_like(sources))
    whence = jax.lax.map(lambda x: looks(sources + found, *x)[0], (nodes, grounds))
    # Where nothing is guessed one must still look.
    whence = jnp.swapaxes(whence, 1, 2) + 1e-20
    whence = whence / jnp.sum(whence, 2, keepdims=True)
    return sources + found + 1e-20, found + 1e-20, whence


def _suns(dtype: jnp.dtype) -> Float[Array, "cell 3"]:
    """A sun in the middle of each cell."""
    edges = np.linspace(-1.0, 1.0, SUNS + 1)
    middle = 0.5 * (edges[1:] + edges[:-1])
    z = np.sign(middle) * middle**2
    return jnp.asarray(np.stack([np.sqrt(1.0 - z * z), 0.0 * z, z], -1), dtype)
