"""`atmos compare`: two skies side by side."""

import math
from pathlib import Path
from typing import Annotated, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .. import colour, image
from ..camera import LatLong
from ..comparison import compare as figures, side_by_side
from ..render import render
from ._app import (
    app,
    CAMERA,
    exposure_value,
    flat,
    MODEL,
    option,
    OUTPUT,
    real,
    refuse,
    SIGNED,
    SUN,
    WORLD,
)
from ._model import Model, MODELS
from ._options import check_output, SunPosition, World
from ._session import progress_bar, start
from ._view import View
from ._world import about, make_scene, solve_file, solver_named


_SOLVERS = ("single", "shared", "bruneton", "columns", "shells")


@app.command
def compare(
    one: Annotated[str, option("An OpenEXR file, or the name of a way to make one.")],
    other: Annotated[str, option("The same, to be compared with the first.")],
    /,
    *,
    world: Annotated[World | None, flat(WORLD)] = None,
    sun: Annotated[SunPosition | None, flat(SUN)] = None,
    model: Annotated[Model | None, flat(MODEL)] = None,
    view: Annotated[View | None, flat(CAMERA)] = None,
    output: Annotated[Path, option("The PNG file to write.", group=OUTPUT)] = Path(
        "compare.png"
    ),
    exposure: Annotated[
        float | None,
        option(
            "Exposure of both, in EV at ISO 100, or auto.",
            converter=exposure_value,
            n_tokens=1,
            show_default=lambda _: "auto",
            metavar="EV",
            group=OUTPUT,
            **SIGNED,
        ),
    ] = None,
    limit: Annotated[
        float | None,
        real("End of the scale of differences.", 1e-3, 1e4, "PERCENT", group=OUTPUT),
    ] = None,
) -> None:
    """Two skies and their relative difference, side by side, with numbers.

    Each is an OpenEXR file, a solver (single, shared, bruneton, columns, shells) or a
    model (preetham, hosek, hosek-rgb, cie, perez). Skies that are not files are made
    with the options below, without the sun's disk.

    For example:

    atmos compare columns hosek --sun-elevation 40 --projection fisheye --height 400

    atmos compare preetham hosek --turbidity 4

    atmos compare a.exr b.exr --output ab.png
    """
    check_output("--output", output, ".png")
    made = [x for x in (one, other) if not _is_file(x)]
    kinds = [x for x in made if x in MODELS]
    ways = (*_SOLVERS, *MODELS)
    for name in made:
        if name not in ways:
            refuse("what to compare", f"must be a .exr file or {', '.join(ways)}", name)
    options = (world, sun, model, view)
    if not made and any(x is not None for x in options):
        refuse("a sun, a world, a model or a camera", "is not for two files")
    world, sun, view = world or World(), sun or SunPosition(), view or View()
    model = model or Model()
    if model.model is not None:
        refuse("--model", "is not for compare; name the model in place of a file")
    model.check(kinds, world, alone=len(kinds) == len(made))
    start()

    look = lambda x: _read(x) if _is_file(x) else _make(x, world, sun, model, view)
    first, second = look(one), look(other)
    if first.xyz.shape != second.xyz.shape:
        sizes = [f"{x.xyz.shape[1]} x {x.xyz.shape[0]}" for x in (first, second)]
        refuse("both pictures", "must be alike in size", " and ".join(sizes))
    lines = []
    weight = first.weight if first.dome == second.dome else np.ones((1, 1))
    if first.dome and second.dome:
        upper = slice(0, len(first.xyz) // 2)
        found = figures(first.xyz[upper], second.xyz[upper], weight[upper])
        lines.append(f"above the horizon: {found}")
    lines.append(f"everywhere: {figures(first.xyz, second.xyz, weight)}")
    if exposure is None:
        exposure = round(float(colour.automatic_exposure(jnp.asarray(first.xyz))), 2)
    page = side_by_side(
        first.xyz,
        second.xyz,
        (first.name, second.name),
        exposure,
        tuple(lines),
        None if limit is None else 0.01 * limit,
    )
    image.write_png(output, page, {"exposure": f"EV {exposure:g} at ISO 100"})
    print("\n".join(lines))
    print(f"wrote {output}: exposure EV {exposure:g}")


class _Seen(NamedTuple):
    """A picture in CIE XYZ, the solid angles of its pixels, and if it is a dome."""

    name: str
    xyz: Float[np.ndarray, "height width 3"]
    weight: Float[np.ndarray, "#height #width"]
    dome: bool


def _is_file(text: str) -> bool:
    return text.lower().endswith(".exr")


def _make(name: str, world: World, sun: SunPosition, model: Model, view: View) -> _Seen:
    camera = view.camera()
    bands = np.array(model.bands(name), np.float32)
    if name in MODELS:
        sky = model.sky(name, sun, world, bands)
    else:
        scene = make_scene(None, world, sun, 10.0)
        method = solver_named(name, 1, float(camera.position[2]))
        sky = solve_file(scene, method, bands, None)
    weights = colour.response(jnp.asarray(bands))
    with progress_bar(name) as tell, about({"position": "--altitude"}):
        xyz = np.asarray(render(sky, camera, weights, progress=tell))
    x, y = (jnp.arange(float(n)) + 0.5 for n in (camera.width, camera.height))
    area = jax.vmap(jax.vmap(camera.solid_angle, (0, None)), (None, 0))(x, y)
    seen = np.asarray(area) * np.asarray(camera.sees())
    return _Seen(name, xyz, seen, isinstance(camera, LatLong))


def _read(path: str) -> _Seen:
    found = image.read_exr(path)
    if not {"R", "G", "B"} <= set(found.channels):
        channels = ", ".join(found.channels)
        refuse(f"'{path}'", "must have channels R, G and B", channels)
    values = jnp.asarray(found.stack("R", "G", "B").astype(np.float32))
    xyz = np.asarray(_space(found).to_xyz(values))
    # Other programs may count in other units, and say so here.
    white = float(found.attributes.get("whiteLuminance", colour.EFFICACY))
    xyz = xyz * (white / colour.EFFICACY)
    height, width = xyz.shape[:2]
    dome = "envmap" in found.attributes and width == 2 * height
    rows = np.sin((np.arange(height) + 0.5) * (math.pi / height))[:, None]
    return _Seen(Path(path).stem, xyz, rows if dome else np.ones((1, 1)), dome)


def _space(picture: image.Picture) -> colour.AbstractColourSpace:
    """The colour space with the chromaticities of the header; without, Rec. 709."""
    corners = picture.attributes.get("chromaticities")
    if corners is None:
        return colour.REC709
    for space in colour.COLOUR_SPACES.values():
        known = np.concatenate([*space.tables.primaries, space.tables.white])
        if np.allclose(known, np.asarray(corners, float), atol=1e-4):
            return space
    refuse(
        "chromaticities", "must be those of a colour space that atmos knows", corners
    )
