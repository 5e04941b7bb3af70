"""What shines on the world."""

from ._base import AbstractLight as AbstractLight, Shine as Shine
from .lamp import Lamp as Lamp
from .spot import Spot as Spot
from .sun import (
    ephemeris as ephemeris,
    limb_darkening as limb_darkening,
    SOLAR_RADIUS as SOLAR_RADIUS,
    Sun as Sun,
    sunlight as sunlight,
)
from .surrounding import Surrounding as Surrounding
