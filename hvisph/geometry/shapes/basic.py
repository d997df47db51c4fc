"""The basic shapes: interval, disc, sphere, box and cylinder.

One frozen dataclass a shape. Sizes that are not positive and finite raise `CaseError`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hvisph.core.errors import CaseError, nearest
from hvisph.geometry.shapes.shape import AXES, SURFACE_MARGIN, Centred, box_distance, require_sizes


@dataclass(frozen=True)
class Interval(Centred):
    """A stretch of the line (1D).

    Parameters
    ----------
    length
        Full length [m].
    """

    length: float

    def __post_init__(self) -> None:
        require_sizes("interval", length=self.length)

    @property
    def dim(self) -> int:
        """Number of dimensions: 1."""
        return 1

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return (self.length,)

    @property
    def volume(self) -> float:
        """Length [m]."""
        return self.length

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Tell which `points` (n, 1) [m] lie strictly inside: booleans of shape (n,)."""
        return _within_box(points, self.extent())

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return the signed distance of `points` (n, 1) [m] to the surface, negative inside: (n,) [m]."""
        return _beyond_box(points, self.extent())

    @property
    def flat_axes(self) -> tuple[int, ...]:
        """Axes across which flat faces bound the whole shape."""
        return (0,)


@dataclass(frozen=True)
class Disc(Centred):
    """A disc (2D): the cross-section of an infinite cylinder across the plane.

    Parameters
    ----------
    diameter
        Diameter [m].
    """

    diameter: float

    def __post_init__(self) -> None:
        require_sizes("disc", diameter=self.diameter)

    @property
    def dim(self) -> int:
        """Number of dimensions: 2."""
        return 2

    def centroid(self) -> np.ndarray:
        """Return the middle of the volume, the origin, (dim,) [m]."""
        return np.zeros(self.dim)

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return (self.diameter, self.diameter)

    @property
    def volume(self) -> float:
        """Area [m^2]."""
        return math.pi * self.diameter**2 / 4

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Tell which `points` (n, 2) [m] lie strictly inside: booleans of shape (n,)."""
        return _within_ball(points, self.diameter)

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return the signed distance of `points` (n, 2) [m] to the surface, negative inside: (n,) [m]."""
        return _beyond_ball(points, self.diameter)


@dataclass(frozen=True)
class Sphere(Centred):
    """A ball (3D).

    Parameters
    ----------
    diameter
        Diameter [m].
    """

    diameter: float

    def __post_init__(self) -> None:
        require_sizes("sphere", diameter=self.diameter)

    @property
    def dim(self) -> int:
        """Number of dimensions: 3."""
        return 3

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return (self.diameter,) * 3

    @property
    def volume(self) -> float:
        """Volume [m^3]."""
        return math.pi * self.diameter**3 / 6

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Tell which `points` (n, 3) [m] lie strictly inside: booleans of shape (n,)."""
        return _within_ball(points, self.diameter)

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return the signed distance of `points` (n, 3) [m] to the surface, negative inside: (n,) [m]."""
        return _beyond_ball(points, self.diameter)


@dataclass(frozen=True)
class Box(Centred):
    """A rectangle (2D) or a cuboid (3D) with its edges along the axes.

    Parameters
    ----------
    size
        Full size along x, y and, in 3D, z [m].
    """

    size: Sequence[float]

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", tuple(float(side) for side in self.size))
        if len(self.size) not in (2, 3):
            raise CaseError(f"a box has 2 or 3 sizes, not {len(self.size)}", where="size")
        require_sizes("box", **{f"size[{axis}]": side for axis, side in enumerate(self.size)})

    @property
    def dim(self) -> int:
        """Number of dimensions: 2 or 3, as many as there are sizes."""
        return len(self.size)

    def centroid(self) -> np.ndarray:
        """Return the middle of the volume, the origin, (dim,) [m]."""
        return np.zeros(self.dim)

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return tuple(self.size)

    @property
    def volume(self) -> float:
        """Area [m^2] or volume [m^3]."""
        return math.prod(self.size)

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Tell which `points` (n, dim) [m] lie strictly inside: booleans of shape (n,)."""
        return _within_box(points, self.extent())

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return the signed distance of `points` (n, dim) [m] to the surface, negative inside: (n,) [m]."""
        return _beyond_box(points, self.extent())

    @property
    def flat_axes(self) -> tuple[int, ...]:
        """Axes across which flat faces bound the whole shape."""
        return tuple(range(self.dim))


@dataclass(frozen=True)
class Cylinder(Centred):
    """A circular cylinder of finite length (3D).

    Parameters
    ----------
    diameter, length
        Diameter and full length [m].
    axis
        ``x``, ``y`` or ``z``: where the length lies.
    """

    diameter: float
    length: float
    axis: str = "x"

    def __post_init__(self) -> None:
        require_sizes("cylinder", diameter=self.diameter, length=self.length)
        if self.axis not in AXES:
            raise CaseError(f"unknown axis '{self.axis}'{nearest(self.axis, AXES)}", where="axis")

    @property
    def dim(self) -> int:
        """Number of dimensions: 3."""
        return 3

    @property
    def axis_index(self) -> int:
        """Column of the coordinate along the length."""
        return AXES.index(self.axis)

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return tuple(self.length if axis == self.axis else self.diameter for axis in AXES)

    @property
    def volume(self) -> float:
        """Volume [m^3]."""
        return math.pi * self.diameter**2 / 4 * self.length

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Tell which `points` (n, 3) [m] lie strictly inside: booleans of shape (n,)."""
        along = points[:, [self.axis_index]]
        across = np.delete(points, self.axis_index, axis=1)
        return _within_ball(across, self.diameter) & _within_box(along, (self.length,))

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return the signed distance of `points` (n, 3) [m] to the surface, negative inside: (n,) [m]."""
        return box_distance(
            np.abs(points[:, self.axis_index]) - self.length / 2,
            _beyond_ball(np.delete(points, self.axis_index, axis=1), self.diameter),
        )

    @property
    def flat_axes(self) -> tuple[int, ...]:
        """Axes across which flat faces bound the whole shape."""
        return (self.axis_index,)


def _within_ball(points: np.ndarray, diameter: float) -> np.ndarray:
    squared = np.einsum("ij,ij->i", points, points)
    return squared < (diameter / 2) ** 2 * (1 - SURFACE_MARGIN)


def _within_box(points: np.ndarray, extent: tuple[float, ...]) -> np.ndarray:
    return (np.abs(points) < np.asarray(extent) / 2 * (1 - SURFACE_MARGIN)).all(axis=1)


def _beyond_ball(points: np.ndarray, diameter: float) -> np.ndarray:
    return np.sqrt(np.einsum("ij,ij->i", points, points)) - diameter / 2


def _beyond_box(points: np.ndarray, extent: tuple[float, ...]) -> np.ndarray:
    return box_distance(*(np.abs(points) - np.asarray(extent) / 2).T)
