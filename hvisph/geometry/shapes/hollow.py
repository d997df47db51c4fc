"""Hollow shapes: the annulus (2D), the tube and the hollow sphere (3D)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .shape import AXES, Axial, Centred, box_distance, require_sizes, require_smaller


class HollowBall(Centred):
    """All points between two radii from the origin, in any number of dimensions."""

    outer_diameter: float
    inner_diameter: float

    def __post_init__(self) -> None:
        _require_hollow(self.kind, self.outer_diameter, self.inner_diameter)

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return (self.outer_diameter,) * self.dim

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return the signed distance of `points` (n, dim) [m] to the surface, negative inside: (n,) [m]."""
        return _wall(points, self.outer_diameter, self.inner_diameter)


@dataclass(frozen=True)
class Annulus(HollowBall):
    """A disc with a concentric hole (2D): the cross-section of a long tube.

    Parameters
    ----------
    outer_diameter, inner_diameter
        Diameters [m].
    """

    outer_diameter: float
    inner_diameter: float

    dim = 2

    def centroid(self) -> np.ndarray:
        """Return the middle of the volume, the origin, (2,) [m]."""
        return np.zeros(self.dim)

    @property
    def volume(self) -> float:
        """Area [m^2]."""
        return math.pi * (self.outer_diameter**2 - self.inner_diameter**2) / 4


@dataclass(frozen=True)
class HollowSphere(HollowBall):
    """A ball with a concentric cavity (3D).

    Parameters
    ----------
    outer_diameter, inner_diameter
        Diameters [m].
    """

    outer_diameter: float
    inner_diameter: float

    kind = "hollow sphere"
    dim = 3

    @property
    def volume(self) -> float:
        """Volume [m^3]."""
        return math.pi * (self.outer_diameter**3 - self.inner_diameter**3) / 6


@dataclass(frozen=True)
class Tube(Axial, Centred):
    """A circular tube of finite length (3D).

    Parameters
    ----------
    outer_diameter, inner_diameter, length
        Diameters and full length [m].
    axis
        ``x``, ``y`` or ``z``: where the length lies.
    """

    outer_diameter: float
    inner_diameter: float
    length: float
    axis: str = "x"

    def __post_init__(self) -> None:
        require_sizes("tube", length=self.length)
        _require_hollow("tube", self.outer_diameter, self.inner_diameter)
        super().__post_init__()

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return tuple(self.length if axis == self.axis else self.outer_diameter for axis in AXES)

    @property
    def volume(self) -> float:
        """Volume [m^3]."""
        return math.pi * (self.outer_diameter**2 - self.inner_diameter**2) / 4 * self.length

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return the signed distance of `points` (n, 3) [m] to the surface, negative inside: (n,) [m]."""
        along, across = self.split(points)
        wall = _wall(across, self.outer_diameter, self.inner_diameter)
        return box_distance(np.abs(along) - self.length / 2, wall)


def _require_hollow(shape: str, outer: float, inner: float) -> None:
    require_sizes(shape, outer_diameter=outer, inner_diameter=inner)
    require_smaller(shape, ("inner_diameter", inner), ("outer_diameter", outer))


def _wall(points: np.ndarray, outer: float, inner: float) -> np.ndarray:
    radius = np.sqrt(np.einsum("ij,ij->i", points, points))
    return np.maximum(radius - outer / 2, inner / 2 - radius)
