from .. import spectrum, surface
from ..particle.surface import albedo as albedo_of, NAMES
from ._base import Above0, build, Kind, Table, unit, within
from ._errors import refuse
from ._profiles import Place
from ._spectra import Constant, PowerLaw, Spectrum, Tabulated


Albedo = float | str | Constant | PowerLaw | Tabulated


def albedo(key: str, value: Albedo) -> spectrum.AbstractSpectrum:
    """The albedo that the value of a key stands for: a spectrum, or a name of one."""
    if not isinstance(value, str):
        return within(key, value, 0.0, 1.0)
    if value not in NAMES:
        refuse(key, f"must be one of {', '.join(NAMES)}", value)
    return albedo_of(value)


class Sphere(Kind, tag="sphere"):
    makes = surface.Sphere
    centre: Place
    radius: Above0


class Plane(Kind, tag="plane"):
    """Without end; level unless something else stands `upright` on it."""

    makes = surface.Plane
    place: Place
    upright: Place = (0.0, 0.0, 1.0)

    def build(self) -> surface.Plane:
        upright = unit("upright", self.upright)
        return surface.Plane(build("place", self.place), upright)


class Lambertian(Kind, tag="lambertian"):
    makes = surface.Lambertian
    albedo: Albedo

    def build(self) -> surface.Lambertian:
        return surface.Lambertian(albedo("albedo", self.albedo))


class Mirror(Kind, tag="mirror"):
    makes = surface.Mirror
    reflectance: Spectrum = 1.0

    def build(self) -> surface.Mirror:
        return surface.Mirror(within("reflectance", self.reflectance, 0.0, 1.0))


class Glass(Kind, tag="glass"):
    makes = surface.Glass
    index: Above0 = 1.5


class Surface(Table):
    makes = surface.Surface
    shape: Sphere | Plane
    material: Lambertian | Mirror | Glass
