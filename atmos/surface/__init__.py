"""What is solid in a scene."""

from ._base import (
    AbstractMaterial as AbstractMaterial,
    AbstractShape as AbstractShape,
    Surface as Surface,
)
from .glass import Glass as Glass
from .lambertian import Lambertian as Lambertian
from .mirror import Mirror as Mirror
from .plane import Plane as Plane
from .sphere import Sphere as Sphere
