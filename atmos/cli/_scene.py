"""`atmos scene`: a file to start from."""

import sys
from pathlib import Path
from typing import Annotated

from ..image import whole_file
from ..scenefile import dump, GUIDE
from ._app import app, flat, option, SUN, WORLD
from ._options import check_output, SunPosition, World
from ._session import start
from ._world import make_scene


@app.command
def scene(
    *,
    world: Annotated[World | None, flat(WORLD)] = None,
    sun: Annotated[SunPosition | None, flat(SUN)] = None,
    output: Annotated[
        Path | None, option("The scene file to write; standard output without it.")
    ] = None,
) -> None:
    """Write a scene file to start from: a ready-made world in numbers, with comments.

    For example:

    atmos scene --output my.toml

    atmos scene --world mars --optical-depth 1 --output dusty.toml
    """
    if output is not None:
        check_output("--output", output, ".toml")
    start()

    world = world or World()
    found = make_scene(None, world, sun or SunPosition(), 10.0)
    names = ["air", "dust"] if world.world == "mars" else ["air", "ozone", "aerosol"]
    text = f"{GUIDE}\n{dump(found, names)}"
    if output is None:
        sys.stdout.write(text)
        return
    with whole_file(output) as part:
        Path(part).write_text(text)
    print(f"wrote {output}")
