"""Shapes about an axis: cone, frustum, ogive, dome and rounded cylinder, and their plane sections.

Each is a profile, the region below a radius R(x) in the half-plane (x, r), whose nose points towards +x. In 3D it is
turned about its axis and has the volume pi int R^2 dx; in the plane it is the section through the axis, twice the
region, with the area 2 int R dx.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field

import numpy as np

from hvisph.core.errors import CaseError

from .shape import AXES, Centred, box_distance, line_distance

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(64)


class Profile(ABC):
    """A region of the half-plane below a radius R(x), centred along x."""

    diameter: float

    @property
    @abstractmethod
    def length(self) -> float:
        """Full length along the axis [m]."""

    @property
    def width(self) -> float:
        """Largest diameter [m]."""
        return self.diameter

    def breaks(self) -> tuple[float, ...]:
        """Return the coordinates between which R is smooth, the two ends among them [m]."""
        return (-self.length / 2, self.length / 2)

    @abstractmethod
    def radius(self, x: np.ndarray) -> np.ndarray:
        """Return the radius at `x` [m]."""

    @abstractmethod
    def distance(self, x: np.ndarray, r: np.ndarray) -> np.ndarray:
        """Return the signed distance of points with r >= 0 [m]."""

    def integral(self, power: int) -> float:
        """Return int R^power dx; x = sin makes roots of (end - x) smooth."""
        total = 0.0
        for low, high in zip(self.breaks()[:-1], self.breaks()[1:], strict=True):
            half, turn = (high - low) / 2, math.pi / 2 * _NODES
            values = self.radius((low + high) / 2 + half * np.sin(turn)) ** power
            total += float((values * np.cos(turn)) @ _WEIGHTS) * half * math.pi / 2
        return total


@dataclass(frozen=True)
class Frustum(Profile):
    """A truncated cone, or with one end of diameter 0 a cone."""

    # diameters at the ends towards -x and +x, and length [m]
    back_diameter: float
    front_diameter: float
    length: float = field(default=0.0)

    def __post_init__(self) -> None:
        if not self.width > 0:
            raise CaseError(f"the frustum needs a positive, finite size, not {self.width:g}", where="back_diameter")

    @property
    def width(self) -> float:
        return max(self.back_diameter, self.front_diameter)

    def radius(self, x: np.ndarray) -> np.ndarray:
        return (self.back_diameter + (self.front_diameter - self.back_diameter) * (x / self.length + 0.5)) / 2

    def distance(self, x: np.ndarray, r: np.ndarray) -> np.ndarray:
        half = self.length / 2
        side = line_distance(x, r, (-half, self.back_diameter / 2), (half, self.front_diameter / 2))
        return np.maximum(side, np.abs(x) - half)


@dataclass(frozen=True)
class Ogive(Profile):
    """A tangent ogive, the usual nose of a bullet, with a cylinder behind it.

    The arc has the radius (R^2 + L^2) / (2 R) for a nose of length L on a radius R and meets the
    cylinder without a kink; a calibre radius head q is L = R sqrt(4 q - 1).
    """

    # diameter at the base, length of the nose (at least the radius) and of the cylinder behind [m]
    diameter: float
    nose_length: float
    shank_length: float = 0.0

    def __post_init__(self) -> None:
        if self.nose_length < self.diameter / 2 * (1 - 1e-12):
            raise CaseError(
                f"an ogive's nose is at least as long as its radius, {self.diameter / 2:g}; take a dome",
                where="nose_length",
            )

    @property
    def length(self) -> float:
        return self.nose_length + self.shank_length

    @property
    def arc(self) -> float:
        """Radius of the arc [m]."""
        return (self.diameter**2 / 4 + self.nose_length**2) / self.diameter

    def breaks(self) -> tuple[float, ...]:
        half = self.length / 2
        return (-half, half - self.nose_length, half) if self.shank_length > 0 else (-half, half)

    def radius(self, x: np.ndarray) -> np.ndarray:
        depth = np.maximum(x - (self.length / 2 - self.nose_length), 0.0)
        return np.maximum(np.sqrt(self.arc**2 - depth**2) - self.arc + self.diameter / 2, 0.0)

    def distance(self, x: np.ndarray, r: np.ndarray) -> np.ndarray:
        depth = np.maximum(x - (self.length / 2 - self.nose_length), 0.0)
        side = np.hypot(depth, r - self.diameter / 2 + self.arc) - self.arc
        return np.maximum(side, -self.length / 2 - x)


@dataclass(frozen=True)
class Dome(Profile):
    """A cap of a ball on a flat base: a hemisphere where its height is the radius."""

    # diameter of the base, and height, at most the radius [m]
    diameter: float
    height: float

    def __post_init__(self) -> None:
        if self.height > self.diameter / 2 * (1 + 1e-12):
            raise CaseError(
                f"a dome is at most as high as its radius, {self.diameter / 2:g}; take an ogive or a rounded cylinder",
                where="height",
            )

    @property
    def length(self) -> float:
        return self.height

    @property
    def ball(self) -> float:
        """Radius of the ball [m]."""
        return (self.diameter**2 / 4 + self.height**2) / (2 * self.height)

    def radius(self, x: np.ndarray) -> np.ndarray:
        return np.sqrt(np.maximum(self.ball**2 - (x - self.height / 2 + self.ball) ** 2, 0.0))

    def distance(self, x: np.ndarray, r: np.ndarray) -> np.ndarray:
        return np.maximum(np.hypot(x - self.height / 2 + self.ball, r) - self.ball, -self.height / 2 - x)


@dataclass(frozen=True)
class RoundedCylinder(Profile):
    """A cylinder with rounded edges; with an edge radius of half its diameter, hemispheres for ends."""

    # diameter and full length [m]
    diameter: float
    length: float = field(default=0.0)
    edge_radius: float = 0.0  # radius of the edges, at most half the diameter [m]
    ends: str = "both"  # ``both`` or ``front``: which edges are rounded

    def __post_init__(self) -> None:
        largest = min(self.diameter / 2, self.length / (2 if self.ends == "both" else 1))
        if self.edge_radius > largest * (1 + 1e-12):
            raise CaseError(f"the edge radius of {self.edge_radius:g} must be at most {largest:g}", where="edge_radius")

    def breaks(self) -> tuple[float, ...]:
        half, edge = self.length / 2, self.edge_radius
        inner = [half - edge] if self.ends == "front" else [edge - half, half - edge]
        return tuple(dict.fromkeys([-half, *inner, half]))

    def radius(self, x: np.ndarray) -> np.ndarray:
        depth = np.maximum(self._nose_coordinate(x) - (self.length / 2 - self.edge_radius), 0.0)
        return np.sqrt(np.maximum(self.edge_radius**2 - depth**2, 0.0)) + self.diameter / 2 - self.edge_radius

    def distance(self, x: np.ndarray, r: np.ndarray) -> np.ndarray:
        edge, height = self.edge_radius, self._nose_coordinate(x)
        rounded = box_distance(height - (self.length / 2 - edge), r - (self.diameter / 2 - edge)) - edge
        return np.maximum(rounded, -self.length / 2 - x)

    def _nose_coordinate(self, x: np.ndarray) -> np.ndarray:
        return np.abs(x) if self.ends == "both" else x


@dataclass(frozen=True)
class Nosed(Centred):
    """A profile revolved about its axis (3D), or its section through the axis (2D)."""

    profile: Profile  # meridian
    dim: int = field(default=3)  # 2 or 3
    axis: str = "x"  # ``x``, ``y`` or ``z``: where the nose points

    @property
    def kind(self) -> str:
        return type(self.profile).__name__.lower()

    def extent(self) -> tuple[float, ...]:
        return tuple(self.profile.length if axis == self.axis else self.profile.width for axis in AXES[: self.dim])

    @property
    def volume(self) -> float:
        return 2 * self.profile.integral(1) if self.dim == 2 else math.pi * self.profile.integral(2)

    def distance(self, points: np.ndarray) -> np.ndarray:
        column = AXES.index(self.axis)
        radius = np.sqrt((np.delete(points, column, axis=1) ** 2).sum(axis=1))
        return self.profile.distance(points[:, column], radius)
