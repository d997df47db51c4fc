"""Basic shapes: interval, disc, sphere, box and cylinder; annulus, tube and hollow sphere.

One frozen dataclass a shape. A hollow one whose inner diameter is not below its outer one raises `CaseError`.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hvisph.core.errors import CaseError

from .shape import AXES, SURFACE_MARGIN, Axial, Centred, box_distance

PARTS = {2: 4, 3: 6}  # of pi d^dim: the area of a disc, and the volume of a sphere


class Symmetric(Centred):
    """A shape that is symmetric about the origin."""

    def centroid(self) -> np.ndarray:
        return np.zeros(self.dim)


@dataclass(frozen=True)
class Ball(Symmetric):
    """All points nearer to the origin than half a diameter, in any number of dimensions."""

    diameter: float  # diameter [m]

    def extent(self) -> tuple[float, ...]:
        return (self.diameter,) * self.dim

    @property
    def volume(self) -> float:
        return math.pi * self.diameter**self.dim / PARTS[self.dim]

    def contains(self, points: np.ndarray) -> np.ndarray:
        return _within_ball(points, self.diameter)

    def distance(self, points: np.ndarray) -> np.ndarray:
        return _beyond_ball(points, self.diameter)


class Rectangular(Symmetric):
    """All points within the extent along each axis, in any number of dimensions."""

    def contains(self, points: np.ndarray) -> np.ndarray:
        return _within_box(points, self.extent())

    def distance(self, points: np.ndarray) -> np.ndarray:
        return box_distance(*(np.abs(points) - np.asarray(self.extent()) / 2).T)

    @property
    def flat_axes(self) -> tuple[int, ...]:
        return tuple(range(self.dim))


@dataclass(frozen=True)
class Interval(Rectangular):
    """Interval of the x axis (1D)."""

    length: float  # full length [m]

    dim = 1

    def extent(self) -> tuple[float, ...]:
        return (self.length,)

    @property
    def volume(self) -> float:
        return self.length


class Disc(Ball):
    """A disc (2D): the cross-section of an infinite cylinder across the plane."""

    dim = 2


class Sphere(Ball):
    """A ball (3D)."""

    dim = 3


@dataclass(frozen=True)
class Box(Rectangular):
    """A rectangle (2D) or a cuboid (3D) with its edges along the axes."""

    size: Sequence[float]  # full size along x, y and, in 3D, z [m]

    @property
    def dim(self) -> int:
        return len(self.size)

    def extent(self) -> tuple[float, ...]:
        return tuple(self.size)

    @property
    def volume(self) -> float:
        return math.prod(self.size)


@dataclass(frozen=True)
class Cylinder(Axial, Centred):
    """A circular cylinder of finite length (3D)."""

    # diameter and full length [m]
    diameter: float
    length: float
    axis: str = "x"  # ``x``, ``y`` or ``z``: where the length lies

    def extent(self) -> tuple[float, ...]:
        return tuple(self.length if axis == self.axis else self.diameter for axis in AXES)

    @property
    def volume(self) -> float:
        return math.pi * self.diameter**2 / 4 * self.length

    def contains(self, points: np.ndarray) -> np.ndarray:
        height, lateral = self.split(points)
        return _within_ball(lateral, self.diameter) & _within_box(height[:, None], (self.length,))

    def distance(self, points: np.ndarray) -> np.ndarray:
        height, lateral = self.split(points)
        return box_distance(np.abs(height) - self.length / 2, _beyond_ball(lateral, self.diameter))


def _within_ball(points: np.ndarray, diameter: float) -> np.ndarray:
    squared = np.einsum("ij,ij->i", points, points)
    return squared < (diameter / 2) ** 2 * (1 - SURFACE_MARGIN)


def _within_box(points: np.ndarray, extent: tuple[float, ...]) -> np.ndarray:
    return (np.abs(points) < np.asarray(extent) / 2 * (1 - SURFACE_MARGIN)).all(axis=1)


def _beyond_ball(points: np.ndarray, diameter: float) -> np.ndarray:
    return np.sqrt(np.einsum("ij,ij->i", points, points)) - diameter / 2


@dataclass(frozen=True)
class HollowBall(Symmetric):
    """All points between two radii from the origin, in any number of dimensions."""

    outer_diameter: float  # diameters [m]
    inner_diameter: float

    def __post_init__(self) -> None:
        _require_hollow(self.outer_diameter, self.inner_diameter)

    def extent(self) -> tuple[float, ...]:
        return (self.outer_diameter,) * self.dim

    @property
    def volume(self) -> float:
        return math.pi * (self.outer_diameter**self.dim - self.inner_diameter**self.dim) / PARTS[self.dim]

    def distance(self, points: np.ndarray) -> np.ndarray:
        return _wall(points, self.outer_diameter, self.inner_diameter)


class Annulus(HollowBall):
    """A disc with a concentric hole (2D): the cross-section of a long tube."""

    dim = 2


class HollowSphere(HollowBall):
    """A ball with a concentric cavity (3D)."""

    kind = "hollow sphere"
    dim = 3


@dataclass(frozen=True)
class Tube(Axial, Centred):
    """A circular tube of finite length (3D)."""

    # diameters and full length [m]
    outer_diameter: float
    inner_diameter: float
    length: float
    axis: str = "x"  # ``x``, ``y`` or ``z``: where the length lies

    def __post_init__(self) -> None:
        _require_hollow(self.outer_diameter, self.inner_diameter)

    def extent(self) -> tuple[float, ...]:
        return tuple(self.length if axis == self.axis else self.outer_diameter for axis in AXES)

    @property
    def volume(self) -> float:
        return math.pi * (self.outer_diameter**2 - self.inner_diameter**2) / 4 * self.length

    def distance(self, points: np.ndarray) -> np.ndarray:
        height, lateral = self.split(points)
        wall = _wall(lateral, self.outer_diameter, self.inner_diameter)
        return box_distance(np.abs(height) - self.length / 2, wall)


def _require_hollow(outer: float, inner: float) -> None:
    if not inner < outer:
        raise CaseError(
            f"its inner_diameter of {inner:g} must be below its outer_diameter of {outer:g}", where="inner_diameter"
        )


def _wall(points: np.ndarray, outer: float, inner: float) -> np.ndarray:
    radius = np.sqrt(np.einsum("ij,ij->i", points, points))
    return np.maximum(radius - outer / 2, inner / 2 - radius)
