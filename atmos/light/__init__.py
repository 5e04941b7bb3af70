"""What shines on the world."""

from ._base import AbstractLight as AbstractLight, Shine as Shine
from .sun import (
    ephemeris as ephemeris,
    limb_darkening as limb_darkening,
    SOLAR_RADIUS as SOLAR_RADIUS,
    Sun as Sun,
    sunlight as sunlight,
)
