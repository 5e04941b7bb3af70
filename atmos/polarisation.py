"""Light that vibrates more one way than another: what I, Q and U say.

Q is how much more of it vibrates level than up and down, U how much more along the
diagonal from left below to right above, as the observer sees it, than along the other.
Light that vibrates at an angle psi from level, anticlockwise as the observer sees it,
has (Q, U) = I (cos 2 psi, sin 2 psi). Up is the vertical of the observer's place. Where
one looks straight up or down, level is as if towards north.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from .quantity import Angle, Direction, dot, Number


def degree(stokes: Float[Array, "3 *n"]) -> Float[Array, "*n"]:
    """The share of light that is linearly polarised: 0 to 1, and 0 where it is dark."""
    intensity, q, u = stokes
    squared = q * q + u * u
    some = (squared > 0.0) & (intensity > 0.0)
    root = jnp.sqrt(jnp.where(some, squared, 1.0))
    return jnp.where(some, root / jnp.where(some, intensity, 1.0), 0.0)


def angle(stokes: Float[Array, "3 *n"]) -> Float[Array, "*n"]:
    """The angle psi at which light vibrates, from -pi/2 to pi/2, in rad.

    0 is level, and positive where the right end is the higher; 0 without polarisation.
    """
    _, q, u = stokes
    some = (q != 0.0) | (u != 0.0)
    return 0.5 * jnp.arctan2(u, jnp.where(some, q, 1.0))


def frame(up: Direction, view: Direction) -> tuple[Direction, Direction]:
    """To the right and upwards, as one sees it in direction `view`."""
    right = jnp.cross(view, up)
    squared = dot(right, right)
    aside = squared > float(jnp.finfo(squared.dtype).tiny)
    right = right / jnp.sqrt(jnp.where(aside, squared, 1.0))
    right = jnp.where(aside, right, _east(view))
    return right, jnp.cross(right, view)


def _east(view: Direction) -> Direction:
    """Across a direction, and east if that is straight up (Duff et al. 2017)."""
    x, y, z = view
    sign = jnp.where(z >= 0.0, 1.0, -1.0)
    a = -1.0 / (sign + z)
    return jnp.stack([1.0 + sign * x * x * a, sign * x * y * a, -sign * x])


def across(
    right: Float[Array, "*n"], upward: Float[Array, "*n"]
) -> tuple[Float[Array, "*n"], Float[Array, "*n"]]:
    """cos 2 psi and sin 2 psi of what vibrates across the plane of scattering.

    Given how far to the right and upwards of the view the light stands: two parts of
    its direction, as in `frame`.
    """
    squared = right * right + upward * upward
    apart = squared > float(jnp.finfo(squared.dtype).tiny)
    scale = jnp.where(apart, 1.0 / jnp.where(apart, squared, 1.0), 0.0)
    q = (upward - right) * (upward + right)
    return scale * q, scale * (-2.0 * right * upward)


def vibration(
    up: Direction, view: Direction, light: Direction
) -> tuple[Number, Number]:
    """The same, of directions of unit length."""
    right, upward = frame(up, view)
    return across(dot(light, right), dot(light, upward))


def vibration_at(
    zenith: Float[Array, "*#n"], light_zenith: Angle, relative: Float[Array, "*#n"]
) -> tuple[Float[Array, "*n"], Float[Array, "*n"]]:
    """The same, of zenith angles and the azimuth of the view, clockwise from the light.

    Right at the zenith too, where level is as if towards that azimuth.
    """
    right = -jnp.sin(light_zenith) * jnp.sin(relative)
    level = jnp.cos(zenith) * jnp.sin(light_zenith)
    # sin(zenith - light_zenith), where the azimuth is the light's.
    half = jnp.sin(0.5 * relative)
    upward = jnp.sin(zenith - light_zenith) + 2.0 * level * half * half
    return across(*jnp.broadcast_arrays(right, upward))
