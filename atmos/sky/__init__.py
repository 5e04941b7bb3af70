from ._base import AbstractSky as AbstractSky
from .panorama import (
    COARSE as COARSE,
    FINE as FINE,
    Grid as Grid,
    Panorama as Panorama,
    Resolution as Resolution,
)
