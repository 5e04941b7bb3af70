"""All that a solver is told about the world."""

import equinox as eqx

from .geometry import AbstractGeometry
from .light import Sun
from .medium import Medium
from .quantity import as_float, Length
from .spectrum import AbstractSpectrum, as_spectrum


class Scene(eqx.Module):
    """A world: its shape, the top of its air, what is in the air, on the ground and above.

    `ground` is the albedo of a Lambertian ground. Nothing lies above `top`, in m:
    profiles are cut there, not renormalised.
    """

    geometry: AbstractGeometry
    top: Length = eqx.field(converter=as_float)
    media: tuple[Medium, ...]
    lights: tuple[Sun, ...]
    ground: AbstractSpectrum = eqx.field(converter=as_spectrum, default=0.0)

    @property
    def scattering_media(self) -> tuple[Medium, ...]:
        """The media that do more than absorb."""
        return tuple(x for x in self.media if x.scattering is not None)
