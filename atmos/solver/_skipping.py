"""Marching through clouds and smoke past what is empty."""

import equinox as eqx
import jax
import jax.numpy as jnp
from equinox.internal import while_loop

from ..quantity import Wavelength
from ..scene import Scene
from ._majorants import Cells, cells_of, cross, Crossing, fly
from ._ray import Found, Ray
from ._steps import AbstractSteps, check_count, OPAQUE, TOGETHER


class Skipping(AbstractSteps):
    """Steps of one length, none of them where there is nothing: for clouds and smoke.

    There are `count` on the longest way through the box about all media; where there is
    nothing is known for so many `cells` along each axis of it. It is as if every step
    had been taken. Steps heed no edges but those of the box. Raises `ValueError` when
    solved with a medium that lies in no box.
    """

    count: int = eqx.field(static=True, default=256)
    cells: int = eqx.field(static=True, default=32)

    def __check_init__(self):
        check_count(self.count)
        if self.cells < 1:
            raise ValueError(f"`cells` must be at least 1; got {self.cells}.")

    @property
    def pieces(self) -> int:
        return 1

    def prepare(self, scene: Scene, wavelength: Wavelength) -> Cells | None:
        for i, x in enumerate(scene.media):
            if x.profile.box is None:
                raise ValueError(
                    f"`scene.media[{i}].profile` must lie in a box, for steps that "
                    f"skip what is empty; got {type(x.profile).__name__}."
                )
        if not scene.media:
            return None
        return cells_of(scene, wavelength, self.cells, jnp.ones_like(scene.top))

    def march(self, ray: Ray) -> Found:
        cells = ray.prepared
        if cells is None:
            return ray.begin()
        way = jax.lax.stop_gradient((ray.path.start.position, ray.path.direction))
        cells, last = jax.lax.stop_gradient((cells, ray.cuts[-1]))
        first = jnp.minimum(jax.lax.stop_gradient(ray.cuts[0]), last)
        size = cells.upper - cells.lower
        length = jnp.sqrt(jnp.sum(size * size)) / self.count

        each = jnp.arange(TOGETHER + 1, dtype=jnp.int32)

        def onwards(number):
            """The step in which the next cell begins that holds something."""
            at = first + number.astype(length.dtype) * length

            def seek(state):
                crossing, _, _, met = fly(cells, state[0], jnp.zeros_like(length))
                return crossing, met

            goes = lambda state: ~state[1] & state[0].inside(cells)
            start = cross(cells, *way, at, last), jnp.array(False)
            there: Crossing
            there, met = jax.lax.while_loop(goes, seek, start)
            step = jnp.int32(jnp.floor((there.at - first) / length))
            return jnp.maximum(step, number), met

        def goes_on(state):
            _, met, found = state
            return met & jnp.any(ray.depth(found) < OPAQUE)

        def step(state):
            number, _, found = state
            edges = first + (number + each).astype(length.dtype) * length
            edges = jnp.minimum(edges, last)
            begins, ends = edges[:-1], edges[1:]
            found = ray.on(found, begins, ends, 0.5 * (begins + ends))
            return *onwards(number + TOGETHER), found

        start = *onwards(jnp.int32(0)), ray.begin()
        rounds = -(-self.count // TOGETHER) + 2
        return while_loop(goes_on, step, start, max_steps=rounds, kind="checkpointed")[
            2
        ]
