"""All that a solver is told about the world; ready-made worlds."""

import equinox as eqx
from jaxtyping import ArrayLike

from .geometry import AbstractGeometry, Spherical
from .light import AbstractLight, Sun
from .medium import Exponential, Medium, StandardAtmosphere, Tent
from .particle import Air, CarbonDioxide, Depolarisation, Scattering
from .particle.aerosol import Aerosol, martian_dust, martian_dust_phase, opac
from .particle.ozone import cross_section, DOBSON
from .particle.surface import albedo
from .phase import HenyeyGreenstein, Rayleigh
from .quantity import as_float, km, Length
from .spectrum import AbstractSpectrum, as_spectrum, Constant, Product
from .surface import Surface


class Scene(eqx.Module):
    """A world: its shape, the top of its air, what is in it, and what shines on it.

    `ground` is the albedo of a Lambertian ground. Nothing lies above `top`, in m:
    profiles are cut there, not renormalised. `surfaces` are what else is solid.
    """

    geometry: AbstractGeometry
    top: Length = eqx.field(converter=as_float)
    media: tuple[Medium, ...]
    lights: tuple[AbstractLight, ...]
    ground: AbstractSpectrum = eqx.field(converter=as_spectrum, default=0.0)
    surfaces: tuple[Surface, ...] = ()

    @property
    def suns(self) -> tuple[Sun, ...]:
        """The lights that are suns."""
        return tuple(x for x in self.lights if isinstance(x, Sun))

    @property
    def scattering_media(self) -> tuple[Medium, ...]:
        """The media that do more than absorb."""
        return tuple(x for x in self.media if x.scattering is not None)


def air() -> Medium:
    """The molecules of the US Standard Atmosphere 1976."""
    gas = Air()
    return Medium(
        StandardAtmosphere(),
        scattering=Scattering(gas),
        phase=Rayleigh(Depolarisation(gas)),
    )


def ozone(dobson_units: ArrayLike) -> Medium:
    """An ozone layer from 10 to 40 km (Bruneton 2017); 300 Dobson units are usual."""
    half_width = 15.0 * km
    most = dobson_units * (DOBSON / half_width)
    return Medium(
        Tent(25.0 * km, half_width),
        absorption=Product(Constant(most), cross_section()),
    )


def haze(aerosol: Aerosol) -> Medium:
    """An aerosol that thins out with altitude, with a Henyey-Greenstein lobe."""
    return Medium(
        Exponential(aerosol.scale_height),
        scattering=aerosol.scattering(),
        absorption=aerosol.absorption(),
        phase=HenyeyGreenstein(aerosol.asymmetry),
    )


def earth(
    sun: Sun,
    aerosol: Aerosol | None = None,
    ozone_column: ArrayLike = 300.0,
    ground: AbstractSpectrum | None = None,
) -> Scene:
    """The Earth under a clear sky: air, ozone (in Dobson units), and an aerosol.

    By default OPAC's continental clean aerosol, and grass.
    """
    aerosol = opac("continental_clean") if aerosol is None else aerosol
    ground = albedo("grass") if ground is None else ground
    media = air(), ozone(ozone_column), haze(aerosol)
    return Scene(Spherical(6371.0 * km), 100.0 * km, media, (sun,), ground)


def mars(
    sun: Sun, dust: ArrayLike = 0.5, ground: AbstractSpectrum | None = None
) -> Scene:
    """Mars: thin carbon dioxide, and dust of an optical depth at 550 nm.

    Radius, scale height, pressure and temperature at the ground (610 Pa, 210 K) from
    NASA's Mars fact sheet. The sun is 1.524 times as far away as from the Earth.
    """
    gas = CarbonDioxide()
    number_density = 610.0 / (1.380649e-23 * 210.0)
    air = Medium(
        Exponential(11.1 * km),
        scattering=Scattering(gas, number_density),
        phase=Rayleigh(Depolarisation(gas)),
    )
    aerosol = martian_dust(dust)
    particles = Medium(
        Exponential(aerosol.scale_height),
        scattering=aerosol.scattering(),
        absorption=aerosol.absorption(),
        phase=martian_dust_phase(),
    )
    ground = albedo("mars") if ground is None else ground
    return Scene(Spherical(3389.5 * km), 100.0 * km, (air, particles), (sun,), ground)
