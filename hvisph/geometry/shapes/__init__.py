"""Shapes of bodies as frozen dataclasses."""

from .axial_bodies import Dome, Frustum, Nosed, Ogive, RoundedCylinder
from .basic import Annulus, Box, Cylinder, Disc, HollowSphere, Interval, Sphere, Tube
from .combinations import Difference, Honeycomb, Intersection, Placed, Repeat, Union
from .polygon import Polygon, Prism, Ring
from .shape import Shape
