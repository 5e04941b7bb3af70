"""Lines through round air, cut at its levels: the same for all places and suns."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..geometry import Spherical
from ..optics import above, Layers
from ..quantity import Length
from ..scene import Scene
from ..transport import contract, gauss_legendre


class Steps(eqx.Module):
    """Ways from a level to the next one, along each line.

    `angle` is that between the verticals at both ends, and `column` how many metres of
    density 1 of each medium lie between.
    """

    length: Float[Array, "layer ray"]
    angle: Float[Array, "layer ray"]
    column: Float[Array, "layer ray medium"]


class Rays(eqx.Module):
    """Straight lines that pass the planet's centre at various distances.

    The first lines meet the ground, at Gauss's and Legendre's cosines; of the others,
    the limb, each turns round in the middle of one layer, the lowest first. `ahead` is
    the distance from a line's lowest place to each level; 0 where it never gets there.
    Half way from level to level a line is lower than the layer's middle, by a share
    `skew` of the layer, as it is flatter where it is lower. At each level `weight` adds
    up integrals over the cosine of the zenith angle from 0 to 1, of what is seen
    upwards and downwards together.
    """

    altitude: Float[Array, "level"]
    ahead: Float[Array, "level ray"]
    cosine: Float[Array, "level ray"]
    weight: Float[Array, "level ray"]
    skew: Float[Array, "layer ray"]
    up: Steps  # from the lower level to the upper one
    down: Steps  # from the upper level to the lower one, or through the lowest place
    grounded: int = eqx.field(static=True)


def rays(scene: Scene, cut: Layers, grounded: int) -> Rays:
    """Lines through a round world, of which so many meet the ground."""
    altitude, radius = cut.altitude, radius_of(scene)
    layers = altitude.shape[0] - 1
    x, w = (jnp.asarray(x, altitude.dtype) for x in gauss_legendre(grounded))
    low = 0.5 * (altitude[:-1] + altitude[1:])

    h = altitude[:, None]
    below = low[None]
    inner = jnp.sqrt((radius * x[None]) ** 2 + h * (h + 2.0 * radius))
    squared = (h - below) * (h + below + 2.0 * radius)
    over = squared > 0.0
    outer = jnp.where(over, jnp.sqrt(jnp.where(over, squared, 1.0)), 0.0)
    ahead = jnp.concatenate([inner, outer], 1)
    nearest = jnp.concatenate([radius * jnp.sqrt((1.0 - x) * (1.0 + x)), radius + low])
    cosine = ahead / (radius + h)
    dip = lambda x: scene.geometry.dip(x, jnp.zeros_like(x))
    horizon = jnp.sin(jax.vmap(dip)(altitude))[:, None]
    inner = (radius / (radius + h)) ** 2 * (x * w)[None] / cosine[:, :grounded]
    inner = _mended(cosine[:, :grounded], horizon, inner)

    begin, end = ahead[:-1], ahead[1:]
    chord = (h[1:] - h[:-1]) * (h[1:] + h[:-1] + 2.0 * radius)
    passes = begin > 0.0
    over = jnp.where(passes, 1.0 / jnp.where(passes, begin + end, 1.0), 0.0)
    straight = chord * over
    turns = np.eye(layers, grounded + layers, grounded, dtype=bool)
    through = jnp.where(turns, 2.0 * end, straight)
    return Rays(
        altitude,
        ahead,
        cosine,
        jnp.concatenate([inner, _limb(cosine[:, grounded:], horizon)], 1),
        0.25 * straight * over,
        _steps(scene, altitude[1:], end, nearest, straight),
        _steps(scene, altitude[1:], end, nearest, through),
        grounded,
    )


def _steps(
    scene: Scene,
    altitude: Float[Array, "layer"],
    ahead: Float[Array, "layer ray"],
    nearest: Float[Array, "ray"],
    length: Float[Array, "layer ray"],
) -> Steps:
    """Steps from levels at `altitude` downwards."""
    radius = radius_of(scene)
    other = ahead - length
    angle = jnp.arctan2(nearest[None] * length, ahead * other + nearest[None] ** 2)
    u, w = (jnp.asarray(x, altitude.dtype) for x in gauss_legendre(6))

    def column(altitude, ahead, length):
        along = length * u
        q = along * (along - 2.0 * ahead)
        r = radius + altitude
        found = jax.vmap(lambda x: above(scene, x))(
            jnp.maximum(altitude + q / (jnp.sqrt(jnp.maximum(r * r + q, 0.0)) + r), 0.0)
        )
        return length * contract("j,jm->m", w, found)

    over_rays = jax.vmap(column, (None, 0, 0))
    return Steps(length, angle, jax.vmap(over_rays)(altitude, ahead, length))


def radius_of(scene: Scene) -> Length:
    """That of a round world."""
    geometry = scene.geometry
    assert isinstance(geometry, Spherical)
    return geometry.radius


# Polynomials that sums over lines which meet the ground integrate exactly have a lower
# degree: the ground's cosines alone miss that others change fast near the horizon.
_DEGREE = 8


def _mended(
    cosine: Float[Array, "level line"],
    horizon: Float[Array, "level 1"],
    plain: Float[Array, "level line"],
) -> Float[Array, "level line"]:
    """The weights next to some for which low polynomials are integrated exactly.

    From the horizon to straight up or down.
    """
    count = min(_DEGREE, cosine.shape[1])
    width = 1.0 - horizon
    across = 2.0 * (cosine - horizon) / width - 1.0
    basis = [jnp.ones_like(across), across]
    for n in range(2, count):
        ahead = (2 * n - 1) * across * basis[-1]
        basis.append((ahead - (n - 1) * basis[-2]) / n)
    basis = jnp.stack(basis[:count], 1)  # level, degree, line
    whole = jnp.asarray(np.arange(count) == 0, cosine.dtype)[None] * width
    missing = whole - contract("idk,ik->id", basis, plain)
    gram = contract("idk,iek,ik->ide", basis, basis, plain)
    lift = jnp.linalg.solve(gram, missing[..., None])[..., 0]
    return plain + plain * contract("idk,id->ik", basis, lift)


# The share of the way between two lines that sets a third apart from either.
_SLIM = 1e-3


def _limb(
    cosine: Float[Array, "level line"], horizon: Float[Array, "level 1"]
) -> Float[Array, "level line"]:
    """Weights of lines in the limb, from level to the horizon.

    Of what is seen upwards and downwards together, which goes on evenly through level:
    by cubics between each two of them, with the slopes of parabolas at both ends, and a
    straight line before the first. Cosines fall, and are 0 of lines that are not.
    """
    there = cosine > 0.0
    step = jnp.where(there[:, 1:], cosine[:, :-1] - cosine[:, 1:], 0.0)
    none = jnp.zeros_like(horizon)
    before = jnp.concatenate([none, step], 1)
    after = jnp.concatenate([step, none], 1)
    first = jnp.asarray(np.arange(cosine.shape[1]) == 0)[None]
    last = there & ~jnp.concatenate([there[:, 1:], none > 0.0], 1)
    after = jnp.where(last, 2.0 * cosine, after)  # to the same line, seen downwards
    ahead = jnp.where(there & first, horizon - cosine, 0.0)

    # The slope at a line, from those before and after it; from one of them where the
    # other is the line itself, nearly, as of layers without thickness.
    over = lambda x: jnp.where(x > 0.0, 1.0 / jnp.where(x > 0.0, x, 1.0), 0.0)
    both = over(before + after)
    to_one, to_other = before * both, after * both
    rest = jnp.where(to_one > _SLIM, -to_other * over(before), 0.0)
    rest = jnp.where(to_other > _SLIM, rest, -over(before))
    next = jnp.where(to_other > _SLIM, to_one * over(after), 0.0)
    next = jnp.where(to_one > _SLIM, next, over(after))
    next = jnp.where(last, 0.0, next)
    # What slopes do to the whole.
    share = (after * after - before * before) / 12.0 - 0.5 * ahead * ahead
    weight = 0.5 * (before + after) + ahead - share * (rest + next)
    weight += jnp.concatenate([(share * rest)[:, 1:], none], 1)
    weight += jnp.concatenate([none, (share * next)[:, :-1]], 1)
    return jnp.where(there, weight, 0.0)
