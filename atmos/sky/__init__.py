from ._base import AbstractSky as AbstractSky
from .panorama import (
    fine_enough as fine_enough,
    Grid as Grid,
    Panorama as Panorama,
    Resolution as Resolution,
)
