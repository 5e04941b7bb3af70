import dataclasses
from collections.abc import Sequence
from typing import Any, Literal

from .. import gridfile, medium, particle, phase, spectrum
from ..geometry import AbstractGeometry, Flat, Spherical
from ..particle import aerosol
from ..scene import air, haze, ozone, Scene
from ._base import Above0, AtLeast0, build, Table, within
from ._cameras import Camera
from ._errors import refuse, under
from ._lights import Light, Sun
from ._phases import Phase
from ._profiles import Blackbody, File as GridFile, located, Profile
from ._spectra import Molecules, Ozone, Spectrum
from ._surfaces import Albedo, albedo, Surface


class Planet(Table, kw_only=True):
    shape: Literal["spherical", "flat"]
    radius: Above0 | None = None
    top: Above0
    ground_albedo: Albedo = 0.0

    def geometry(self) -> AbstractGeometry:
        if self.shape == "flat":
            return Flat()
        if self.radius is None:
            refuse("radius", "is missing; a spherical planet needs one, in m")
        if self.radius < self.top:
            refuse("radius", f"must be above `top`, {self.top} m", self.radius)
        return Spherical(self.radius)


class Medium(Table):
    """Either a `preset`, or a profile, coefficients where it is 1, and a phase."""

    name: str | None = None
    scattering: Spectrum | Molecules | None = None
    absorption: Spectrum | Ozone | None = None
    extinction: Spectrum | None = None
    single_scattering_albedo: Spectrum | None = None
    profile: Profile | None = None
    phase: Phase | None = None
    emission: Spectrum | Blackbody | None = None
    colour: str | None = None
    preset: str | None = None
    column: AtLeast0 | None = None
    optical_depth: AtLeast0 | None = None
    visibility: Above0 | None = None

    def build(self) -> tuple[medium.Medium, ...]:
        if self.preset is not None:
            return (self._ready_made(self.preset),)
        return self._coloured() if self.colour is not None else (self._plain(),)

    def _plain(self) -> medium.Medium:
        self._alone("column", "optical_depth", "visibility", beside="no `preset`")
        if self.profile is None:
            refuse("profile", "is missing")
        profile = build("profile", self.profile)
        shape = None if self.phase is None else build("phase", self.phase)
        scatters = self.scattering is not None or self.extinction is not None
        if scatters and shape is None:
            refuse("phase", "is missing; whatever scatters needs one")
        if self.extinction is not None:
            self._alone("scattering", "absorption", beside="`extinction`")
            albedo = self.single_scattering_albedo
            if albedo is None:
                refuse("single_scattering_albedo", "is missing beside `extinction`")
            albedo = within("single_scattering_albedo", albedo, 0.0, 1.0)
            extinction = within("extinction", self.extinction, 0.0)
            assert shape is not None
            found = medium.of_extinction(extinction, albedo, profile, shape)
            return dataclasses.replace(found, emission=self._emission())
        self._alone("single_scattering_albedo", beside="no `extinction`")
        parts = {
            name: within(name, value, 0.0)
            for name in ("scattering", "absorption")
            if (value := getattr(self, name)) is not None
        }
        emission = self._emission()
        if not parts and emission is None:
            refuse("scattering", "is missing, and so are `absorption`, `extinction`")
        return medium.Medium(
            profile, **parts, phase=shape or phase.Isotropic(), emission=emission
        )

    def _emission(self) -> medium.AbstractEmission | None:
        if self.emission is None:
            return None
        if isinstance(self.emission, Blackbody):
            return build("emission", self.emission)
        return medium.Glow(within("emission", self.emission, 0.0))

    def _coloured(self) -> tuple[medium.Medium, ...]:
        """Of a density and a `colour` in one file."""
        others = "scattering", "absorption", "single_scattering_albedo", "emission"
        self._alone(*others, beside="`colour`")
        if not isinstance(self.profile, GridFile):
            refuse("colour", 'needs a `profile` of kind "file"', self.colour)
        if self.extinction is None or self.phase is None:
            refuse("extinction", "is missing beside `colour`, or `phase` is")
        assert self.colour is not None
        extinction = within("extinction", self.extinction, 0.0)
        if self.profile.factor != 1.0:
            factor = spectrum.Constant(self.profile.factor)
            extinction = spectrum.Product(extinction, factor)
        with under("profile.file"), located(self.profile.file) as path:
            return gridfile.load_coloured(
                path,
                self.profile.grid,
                self.colour,
                extinction,
                build("phase", self.phase),
            )

    def _ready_made(self, preset: str) -> medium.Medium:
        own = {"air": (), "ozone": ("column",)}
        own = own.get(preset, ("optical_depth", "visibility"))
        free = {"name", "preset", *own}
        others = [x for x in self.__struct_fields__ if x not in free]
        self._alone(*others, beside=f'`preset = "{preset}"`')
        if preset == "air":
            return air()
        if preset == "ozone":
            return ozone(300.0 if self.column is None else self.column)
        if preset not in aerosol.NAMES:
            names = ", ".join(["air", "ozone", *aerosol.NAMES])
            refuse("preset", f"must be one of {names}", preset)
        return haze(opac(preset, self.optical_depth, self.visibility))

    def _alone(self, *names: str, beside: str) -> None:
        for name in names:
            if getattr(self, name) is not None:
                refuse(name, f"must not stand beside {beside}")


class File(Table):
    """Suns come before other lights in what it makes."""

    planet: Planet
    sun: Sun | list[Sun] | None = None
    light: list[Light] = []
    surface: list[Surface] = []
    medium: list[Medium] = []
    camera: Camera | None = None

    def build(self) -> Scene:
        with under("planet"):
            geometry = self.planet.geometry()
            ground = albedo("ground_albedo", self.planet.ground_albedo)
        media = tuple(x for found in _each("medium", self.medium) for x in found)
        lights = (*self._suns(), *_each("light", self.light))
        shines = lights or any(x.emission is not None for x in media)
        if self.sun is None and not shines:
            refuse("sun", "is missing, and nothing else shines; sun = [] says so")
        surfaces = _each("surface", self.surface)
        return Scene(geometry, self.planet.top, media, lights, ground, surfaces)

    def _suns(self) -> tuple[Any, ...]:
        if isinstance(self.sun, list):
            return _each("sun", self.sun)
        return () if self.sun is None else (build("sun", self.sun),)


def _each(key: str, tables: Sequence[Table]) -> tuple[Any, ...]:
    return tuple(build(f"{key}[{i}]", x) for i, x in enumerate(tables))


def opac(
    name: str, optical_depth: float | None = None, visibility: float | None = None
) -> particle.Aerosol:
    """An aerosol of OPAC, of which there is as much as one of the two says.

    The optical depth is that at 550 nm, the visibility is in m. Raises `ValueError` for
    an unknown name, for both, and for an amount out of range.
    """
    found = aerosol.opac(name)
    if optical_depth is not None and visibility is not None:
        refuse("visibility", "must not stand beside `optical_depth`")
    if visibility is not None:
        amount = aerosol.optical_depth(visibility, found.scale_height)
    elif optical_depth is not None:
        amount = optical_depth
    else:
        return found
    return dataclasses.replace(found, optical_depth=amount)
