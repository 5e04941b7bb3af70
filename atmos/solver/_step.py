"""A step of light from one shell to the next: what is left of it, and where from."""

import dataclasses
import math

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from ._suns import cubic, RoundSuns, straight


# So far from straight up or down the sun has an azimuth.
_SLIVER = 1e-12


class Suns(eqx.Module):
    """Where the sun may stand: zenith angles, and azimuths of what one sees from its.

    Azimuths are the midpoints of half a circle; the other half mirrors it. Where
    `rough`, straight lines join both, which never fall below what they join.
    """

    zenith: RoundSuns
    rough: Bool[Array, ""]
    azimuths: int = eqx.field(static=True)

    def azimuth(self) -> Float[Array, "azimuth"]:
        """In rad."""
        each = jnp.arange(self.azimuths, dtype=self.zenith.last.dtype)
        return (each + 0.5) * (math.pi / self.azimuths)

    def seen_from(self, angle: Float[Array, "ray"]) -> "Elsewhere":
        """Where they stand so far ahead, by the angle between the verticals."""
        zenith, azimuth = self.zenith.zeniths(), self.azimuth()[None, :, None]
        sine = jnp.abs(jnp.sin(zenith))[None, None]  # not negative for a rounded pi
        cosine = jnp.cos(zenith)[None, None]
        s, c = jnp.sin(angle)[:, None, None], jnp.cos(angle)[:, None, None]
        ahead = sine * jnp.cos(azimuth)
        x, z = ahead * c - cosine * s, cosine * c + ahead * s
        # Rounding must not put it on the other side of straight up or down.
        y = jnp.abs(sine * jnp.sin(azimuth) * jnp.ones_like(c)) + _SLIVER
        level = jnp.sqrt(x * x + y * y)
        # How much lower, by what is small itself: light fades so fast by night that
        # single precision does not tell two zenith angles well enough apart.
        higher = ahead * s - 2.0 * cosine * jnp.sin(0.5 * angle)[:, None, None] ** 2
        longer = s * (s * (cosine * cosine - ahead * ahead) - 2.0 * ahead * cosine * c)
        longer = longer / (level + sine)
        lower = longer * cosine - higher * sine
        lower = jnp.arctan2(lower, cosine * z + sine * level)
        sun, step = self.zenith.place_lower(lower)
        return Elsewhere(sun, self._weights(step), *self._between(jnp.arctan2(y, x)))

    def _weights(self, step: Float[Array, "*n"]) -> Float[Array, "*n 4"]:
        return jnp.where(self.rough, straight(step), cubic(step))

    def _between(
        self, azimuth: Float[Array, "ray azimuth sun"]
    ) -> tuple[
        Int[Array, "ray azimuth sun 4"],
        Float[Array, "ray azimuth sun 4"],
        Float[Array, "ray azimuth sun 4"],
    ]:
        """Which azimuths to mix, how much of each, and on which side."""
        count = self.azimuths
        t = azimuth * (count / math.pi) - 0.5
        first = jnp.clip(jnp.floor(jax.lax.stop_gradient(t)), -1.0, count - 1.0)
        near = jnp.arange(-1, 3, dtype=jnp.int32)
        index = first.astype(jnp.int32)[..., None] + near[None, None, None]
        # What lies beyond 0 and pi is the mirror image.
        beyond = (index < 0) | (index >= count)
        index = jnp.where(index < 0, -1 - index, index)
        index = jnp.where(index >= count, 2 * count - 1 - index, index)
        weights = self._weights(t - first + 1.0)
        side = jnp.where(beyond, -jnp.ones_like(weights), 1.0)
        return jnp.clip(index, 0, count - 1), weights, side


class Elsewhere(eqx.Module):
    """Light at the other ends of steps, by where the sun stands there.

    Places and weights in azimuths and in zenith angles of the sun, of which only the
    first of four is told. Where an azimuth is the mirror image of what is meant, `side`
    is -1.
    """

    sun: Int[Array, "ray azimuth sun"]
    by_sun: Float[Array, "ray azimuth sun 4"]
    azimuth: Int[Array, "ray azimuth sun 4"]
    by_azimuth: Float[Array, "ray azimuth sun 4"]
    side: Float[Array, "ray azimuth sun 4"]

    def take(
        self, light: Float[Array, "stokes ray azimuth sun wl"]
    ) -> Float[Array, "stokes ray azimuth sun wl"]:
        """What is there of light: I, or I, Q and U, which has another sign mirrored."""
        odd = dataclasses.replace(self, by_azimuth=self.by_azimuth * self.side)
        parts = zip(light, (self, self, odd), strict=False)
        return jnp.stack([there._take(x) for x, there in parts])

    def _take(
        self, light: Float[Array, "ray azimuth sun wl"]
    ) -> Float[Array, "ray azimuth sun wl"]:
        suns = light.shape[2]
        pick = lambda x, i: jax.lax.dynamic_index_in_dim(x, i, -1, False)

        def along(light, there):
            rows = light.reshape(-1, light.shape[-1])

            # In a loop: unrolled it takes longer, and much longer to compile.
            def add(i, total):
                a, s = i // 4, i % 4
                row = pick(there.azimuth, a) * suns + there.sun + s
                weight = pick(there.by_azimuth, a) * pick(there.by_sun, s)
                return total + weight[..., None] * rows[row]

            return jax.lax.fori_loop(0, 16, add, jnp.zeros_like(light))

        return jax.vmap(along)(light, self)

    def look(self, table: Float[Array, "ray sun"]) -> Float[Array, "ray azimuth sun"]:
        """What is there of something that hangs on the sun's zenith angle alone."""

        def along(row, there):
            taps = [there.by_sun[..., s] * row[there.sun + s] for s in range(4)]
            return taps[0] + taps[1] + taps[2] + taps[3]

        return jax.vmap(along)(table, self)


class Step(eqx.Module):
    """What steps do to light, which is told relative to a reference.

    `through` is what they leave of it, and `far`, `near` and `bent` are the shares of
    the sources at both ends and of what there is more half way; the first two as seen
    from where the steps begin.
    """

    through: Float[Array, "ray azimuth sun wl"]
    far: Float[Array, "ray azimuth sun wl"]
    near: Float[Array, "ray azimuth sun wl"]
    bent: Float[Array, "ray azimuth sun wl"]
    begin: Elsewhere

    def carry(
        self, light: Array, sources: tuple[Array, Array, Array] | None
    ) -> Float[Array, "stokes ray azimuth sun wl"]:
        """Light where the steps end, with what the sources add.

        Those at both ends, and by how much the one half way is more than their mean.
        """
        left = self.through[None] * light
        if sources is None:
            return self.begin.take(left)
        far, near, bent = sources
        sent = self.begin.take(left + self.far[None] * far)
        return sent + self.near[None] * near + self.bent[None] * bent


def step(
    suns: Suns,
    angle: Float[Array, "ray"],
    depth: Float[Array, "ray wl"],
    begins: Float[Array, "ray sun"],
    ends: Float[Array, "ray sun"],
) -> Step:
    """Steps of an optical depth along which the vertical turns by an angle.

    `begins` and `ends` are the logarithm of the reference at both ends.
    """
    end, begin = suns.seen_from(-angle), suns.seen_from(angle)
    through, far, *_ = _attenuation(depth, end.look(ends) - begins[:, None])
    *_, near, bent = _attenuation(depth, ends[:, None] - begin.look(begins))
    return Step(through, far, near, bent, begin)


# Below this their series are exacter than the closed forms.
_THIN = 0.15


def _attenuation(
    depth: Float[Array, "ray wl"], gain: Float[Array, "ray azimuth sun"]
) -> tuple[Float[Array, "ray azimuth sun wl"], ...]:
    """What is left of light, and the shares of the sources at both ends and half way.

    Relative to a reference whose logarithm grows by `gain`, evenly with optical depth.
    Sources relative to it are parabolas.
    """
    depth = depth[:, None, None]
    through = jnp.exp(-depth) * jnp.exp(-gain)[..., None]
    k = depth + gain[..., None]
    thin = jnp.abs(k) < _THIN
    scale = 1.0 / jnp.where(thin, 1.0, k * k)
    far = 0.5 - k * (1.0 / 3.0 - k * (1.0 / 8.0 - k * (1.0 / 30.0 - k / 144.0)))
    far = jnp.where(thin, far, scale * (1.0 - through * (1.0 + k)))
    near = 0.5 - k * (1.0 / 6.0 - k * (1.0 / 24.0 - k / 120.0))
    near = jnp.where(thin, near, scale * (k - 1.0 + through))
    bent = 4.0 / 6.0 - k * (4.0 / 12.0 - k * (0.1 - k * (1.0 / 45.0 - k / 252.0)))
    scale = 4.0 / jnp.where(thin, 1.0, k**3)
    bent = jnp.where(thin, bent, scale * (k - 2.0 + through * (k + 2.0)))
    return through, depth * far, depth * near, depth * bent
