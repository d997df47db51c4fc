"""Shapes of bodies: each knows its size and which points lie inside, centred at the origin.

One frozen dataclass a shape. All lengths in metres (or in the case's own unit where it has none).
Sizes that are not positive and finite raise `CaseError`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hvisph.core.errors import CaseError, nearest

# Relative margin on squared distances within which a point counts as lying on the surface, hence
# outside: wide against round-off, narrow against the steps of a lattice of 10^4 nodes across.
SURFACE_MARGIN = 1e-10

AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Interval:
    """A stretch of the line (1D).

    Parameters
    ----------
    length
        Full length [m].
    """

    length: float

    def __post_init__(self) -> None:
        _require_sizes("interval", length=self.length)

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


@dataclass(frozen=True)
class Disc:
    """A disc (2D): the cross-section of an infinite cylinder across the plane.

    Parameters
    ----------
    diameter
        Diameter [m].
    """

    diameter: float

    def __post_init__(self) -> None:
        _require_sizes("disc", diameter=self.diameter)

    @property
    def dim(self) -> int:
        """Number of dimensions: 2."""
        return 2

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


@dataclass(frozen=True)
class Sphere:
    """A ball (3D).

    Parameters
    ----------
    diameter
        Diameter [m].
    """

    diameter: float

    def __post_init__(self) -> None:
        _require_sizes("sphere", diameter=self.diameter)

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


@dataclass(frozen=True)
class Box:
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
        _require_sizes("box", **{f"size[{axis}]": side for axis, side in enumerate(self.size)})

    @property
    def dim(self) -> int:
        """Number of dimensions: 2 or 3, as many as there are sizes."""
        return len(self.size)

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


@dataclass(frozen=True)
class Cylinder:
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
        _require_sizes("cylinder", diameter=self.diameter, length=self.length)
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


Shape = Interval | Disc | Sphere | Box | Cylinder


def _require_sizes(shape: str, **sizes: float) -> None:
    for name, value in sizes.items():
        if not (math.isfinite(value) and value > 0):
            raise CaseError(f"the {shape} needs a positive, finite size, not {value:g}", where=name)


def _within_ball(points: np.ndarray, diameter: float) -> np.ndarray:
    squared = np.einsum("ij,ij->i", points, points)
    return squared < (diameter / 2) ** 2 * (1 - SURFACE_MARGIN)


def _within_box(points: np.ndarray, extent: tuple[float, ...]) -> np.ndarray:
    return (np.abs(points) < np.asarray(extent) / 2 * (1 - SURFACE_MARGIN)).all(axis=1)
