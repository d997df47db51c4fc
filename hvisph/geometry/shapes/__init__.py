"""Shapes of bodies, one frozen dataclass a shape, families of them a file."""

from hvisph.geometry.shapes.basic import Box, Cylinder, Disc, Interval, Sphere
from hvisph.geometry.shapes.combined import Difference, Intersection, Placed, Repeat, Union
from hvisph.geometry.shapes.hollow import Annulus, HollowSphere, Tube
from hvisph.geometry.shapes.nosed import Dome, Frustum, Nosed, Ogive, RoundedCylinder
from hvisph.geometry.shapes.polygon import Polygon, Prism, Ring
from hvisph.geometry.shapes.shape import Shape

__all__ = [
    "Annulus",
    "Box",
    "Cylinder",
    "Difference",
    "Disc",
    "Dome",
    "Frustum",
    "HollowSphere",
    "Intersection",
    "Interval",
    "Nosed",
    "Ogive",
    "Placed",
    "Polygon",
    "Prism",
    "Repeat",
    "Ring",
    "RoundedCylinder",
    "Shape",
    "Sphere",
    "Tube",
    "Union",
]
