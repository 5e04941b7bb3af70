"""A physically based spectral sky."""

from . import (
    bake as bake,
    camera as camera,
    checkpoint as checkpoint,
    colour as colour,
    comparison as comparison,
    denoise as denoise,
    film as film,
    geometry as geometry,
    gridfile as gridfile,
    image as image,
    light as light,
    medium as medium,
    particle as particle,
    phase as phase,
    polarisation as polarisation,
    scenefile as scenefile,
    sky as sky,
    solver as solver,
    spectrum as spectrum,
    surface as surface,
    surroundings as surroundings,
    transport as transport,
)
from .disk import render_disks as render_disks
from .quantity import deg as deg, km as km, m as m, nm as nm
from .render import render as render, render_stokes as render_stokes
from .scene import earth as earth, mars as mars, Scene as Scene
from .solver import solve as solve
