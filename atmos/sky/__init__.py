from ._base import AbstractSky as AbstractSky
from .panorama import Grid as Grid, Panorama as Panorama
