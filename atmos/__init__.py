"""A physically based spectral sky.

Everything is imported when it is first used: the command line answers at once.
"""

import importlib
import sys
import types
from typing import Any, TYPE_CHECKING


if TYPE_CHECKING:
    from . import (
        camera as camera,
        colour as colour,
        geometry as geometry,
        image as image,
        light as light,
        medium as medium,
        particle as particle,
        phase as phase,
        scenefile as scenefile,
        sky as sky,
        solver as solver,
        spectrum as spectrum,
        transport as transport,
    )
    from .disk import render_disks as render_disks
    from .quantity import deg as deg, km as km, m as m, nm as nm
    from .render import render as render
    from .scene import earth as earth, mars as mars, Scene as Scene
    from .solver import solve as solve


_ROOMS = """camera colour geometry image light medium particle phase scenefile sky
solver spectrum transport""".split()
_HOMES = {"render_disks": "disk", "solve": "solver"}
_HOMES |= dict.fromkeys(["deg", "km", "m", "nm"], "quantity")
_HOMES |= dict.fromkeys(["earth", "mars", "Scene"], "scene")


class _Package(types.ModuleType):
    def __getattr__(self, name: str) -> Any:
        if name in _ROOMS:
            return importlib.import_module(f"atmos.{name}")
        if name in _HOMES:
            return getattr(importlib.import_module(f"atmos.{_HOMES[name]}"), name)
        raise AttributeError(f"module 'atmos' has no attribute '{name}'")

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *_ROOMS, *_HOMES, "render"})

    # The function, even once the room of its name has been imported.

    @property
    def render(self) -> Any:
        return importlib.import_module("atmos.render").render

    @render.setter
    def render(self, room: Any) -> None:
        del room


sys.modules[__name__].__class__ = _Package
