"""Hollow shapes: the annulus (2D), the tube and the hollow sphere (3D)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hvisph.core.errors import CaseError, nearest
from hvisph.geometry.shapes.shape import AXES, Centred, box_distance, require_sizes, require_smaller


@dataclass(frozen=True)
class Annulus(Centred):
    """A disc with a concentric hole (2D): the cross-section of a long tube.

    Parameters
    ----------
    outer_diameter, inner_diameter
        Diameters [m].
    """

    outer_diameter: float
    inner_diameter: float

    def __post_init__(self) -> None:
        _require_hollow("annulus", self.outer_diameter, self.inner_diameter)

    @property
    def dim(self) -> int:
        """Number of dimensions: 2."""
        return 2

    def centroid(self) -> np.ndarray:
        """Return the middle of the volume, the origin, (2,) [m]."""
        return np.zeros(self.dim)

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return (self.outer_diameter, self.outer_diameter)

    @property
    def volume(self) -> float:
        """Area [m^2]."""
        return math.pi * (self.outer_diameter**2 - self.inner_diameter**2) / 4

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return the signed distance of `points` (n, 2) [m] to the surface, negative inside: (n,) [m]."""
        return _wall(points, self.outer_diameter, self.inner_diameter)


@dataclass(frozen=True)
class HollowSphere(Centred):
    """A ball with a concentric cavity (3D).

    Parameters
    ----------
    outer_diameter, inner_diameter
        Diameters [m].
    """

    outer_diameter: float
    inner_diameter: float

    def __post_init__(self) -> None:
        _require_hollow("hollow sphere", self.outer_diameter, self.inner_diameter)

    @property
    def dim(self) -> int:
        """Number of dimensions: 3."""
        return 3

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return (self.outer_diameter,) * 3

    @property
    def volume(self) -> float:
        """Volume [m^3]."""
        return math.pi * (self.outer_diameter**3 - self.inner_diameter**3) / 6

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return the signed distance of `points` (n, 3) [m] to the surface, negative inside: (n,) [m]."""
        return _wall(points, self.outer_diameter, self.inner_diameter)


@dataclass(frozen=True)
class Tube(Centred):
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
        if self.axis not in AXES:
            raise CaseError(f"unknown axis '{self.axis}'{nearest(self.axis, AXES)}", where="axis")

    @property
    def dim(self) -> int:
        """Number of dimensions: 3."""
        return 3

    @property
    def flat_axes(self) -> tuple[int, ...]:
        """Axes across which flat faces bound the whole shape."""
        return (AXES.index(self.axis),)

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return tuple(self.length if axis == self.axis else self.outer_diameter for axis in AXES)

    @property
    def volume(self) -> float:
        """Volume [m^3]."""
        return math.pi * (self.outer_diameter**2 - self.inner_diameter**2) / 4 * self.length

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return the signed distance of `points` (n, 3) [m] to the surface, negative inside: (n,) [m]."""
        along = AXES.index(self.axis)
        wall = _wall(np.delete(points, along, axis=1), self.outer_diameter, self.inner_diameter)
        return box_distance(np.abs(points[:, along]) - self.length / 2, wall)


def _require_hollow(shape: str, outer: float, inner: float) -> None:
    require_sizes(shape, outer_diameter=outer, inner_diameter=inner)
    require_smaller(shape, ("inner_diameter", inner), ("outer_diameter", outer))


def _wall(points: np.ndarray, outer: float, inner: float) -> np.ndarray:
    radius = np.sqrt(np.einsum("ij,ij->i", points, points))
    return np.maximum(radius - outer / 2, inner / 2 - radius)
