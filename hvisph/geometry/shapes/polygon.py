"""Polygons, and solids from plane shapes: prisms and solids of revolution."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hvisph.core.errors import CaseError

from .shape import Axial, Shape, box_distance, first_moment

AT_ONCE = 16_000  # points times edges that are compared at once: what lies in a core's own cache


@dataclass(frozen=True)
class Polygon(Shape):
    """A region of the plane with straight edges (2D), in the coordinates of its points."""

    points: Sequence[Sequence[float]]  # corners in order, either way round; the last joins the first [m]

    def __post_init__(self) -> None:
        corners = np.asarray(self.points, dtype=float)
        object.__setattr__(self, "points", tuple(map(tuple, corners.tolist())))
        if not self.volume > 0:
            raise CaseError("the polygon's points enclose no area", where="points")
        crossing = _crossing(corners)
        if crossing is not None:
            raise CaseError(
                f"the polygon's edges {crossing[0]} and {crossing[1]} cross each other; list its points in order",
                where="points",
            )

    @cached_property
    def corners(self) -> np.ndarray:
        """Corners, counter-clockwise (n, 2) [m]."""
        corners = np.asarray(self.points)
        return corners if _area(corners) > 0 else corners[::-1]

    dim = 2

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        corners = np.asarray(self.points)
        return corners.min(axis=0), corners.max(axis=0)

    @property
    def volume(self) -> float:
        return abs(_area(np.asarray(self.points)))

    def centroid(self) -> np.ndarray:
        start = self.corners
        end = np.roll(start, -1, axis=0)
        cross = start[:, 0] * end[:, 1] - start[:, 1] * end[:, 0]
        return np.asarray(((start + end) * cross[:, None]).sum(axis=0) / (3 * cross.sum()))

    def distance(self, points: np.ndarray) -> np.ndarray:
        start = self.corners
        edge = np.roll(start, -1, axis=0) - start
        step = max(1, AT_ONCE // len(start))
        parts = [_to_edges(points[k : k + step], start, edge) for k in range(0, len(points), step)]
        return np.concatenate(parts or [np.empty(0)])


def _to_edges(points: np.ndarray, start: np.ndarray, edge: np.ndarray) -> np.ndarray:
    (px, py), (sx, sy, ex, ey) = points.T, (component[:, None] for component in (*start.T, *edge.T))
    x, y = px - sx, py - sy
    share = np.minimum(np.maximum((x * ex + y * ey) / (ex**2 + ey**2), 0.0), 1.0)
    squared = ((x - share * ex) ** 2 + (y - share * ey) ** 2).min(axis=0)
    above, above_end = y >= 0, py - (sy + ey) >= 0
    # crossings of the ray towards +x, upwards and downwards edges alike
    crossed = (above != above_end) & ((ex * y - ey * x > 0) == above)
    return np.asarray(np.sqrt(squared) * np.where(np.logical_xor.reduce(crossed, axis=0), -1.0, 1.0))


def _area(corners: np.ndarray) -> float:
    x, y = corners.T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def _crossing(corners: np.ndarray) -> tuple[int, int] | None:
    """Return two edges that cross each other, None if there are none."""
    n = len(corners)
    start, end = corners, np.roll(corners, -1, axis=0)

    def side(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
        u, v = b - a, c - a
        return np.asarray(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])

    for i in range(n - 2):
        candidates = np.arange(i + 2, n - (i == 0))
        a, b, c, d = start[i], end[i], start[candidates], end[candidates]
        crosses = (side(a, b, c) * side(a, b, d) < 0) & (side(c, d, a) * side(c, d, b) < 0)
        if crosses.any():
            return i, int(candidates[np.argmax(crosses)])
    return None


@dataclass(frozen=True)
class Prism(Axial):
    """A plane shape extruded along an axis (3D), from -length/2 to length/2."""

    section: Shape  # a shape in 2D, in the two other coordinates in the order x, y, z
    length: float  # full length [m]
    axis: str = "x"  # ``x``, ``y`` or ``z``: where the length lies

    @property
    def flat_axes(self) -> tuple[int, ...]:
        return (self.axis_column, *(k if k < self.axis_column else k + 1 for k in self.section.flat_axes))

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        low, high = self.section.bounds()
        return np.insert(low, self.axis_column, -self.length / 2), np.insert(high, self.axis_column, self.length / 2)

    @property
    def volume(self) -> float:
        return self.section.volume * self.length

    def distance(self, points: np.ndarray) -> np.ndarray:
        height, lateral = self.split(points)
        return box_distance(np.abs(height) - self.length / 2, self.section.distance(lateral))


@dataclass(frozen=True)
class Ring(Axial):
    """A plane shape swept round an axis (3D): a torus from a disc, a washer from a box."""

    section: Shape  # a shape in 2D, its first coordinate along the axis, its second outwards
    radius: float  # distance of the section's origin from the axis [m]; 0 for a section drawn with its radius
    axis: str = "x"  # ``x``, ``y`` or ``z``: what it goes round

    def __post_init__(self) -> None:
        inner = float(self.section.bounds()[0][1]) + self.radius
        if inner < -1e-9 * max(self.section.extent()):
            raise CaseError(
                f"the ring's section crosses the axis, to r = {inner:g}; enlarge the radius", where="radius"
            )

    @property
    def flat_axes(self) -> tuple[int, ...]:
        return (self.axis_column,) if 0 in self.section.flat_axes else ()

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        low, high = self.section.bounds()
        outer = self.radius + high[1]
        return np.insert([-outer] * 2, self.axis_column, low[0]), np.insert([outer] * 2, self.axis_column, high[0])

    @cached_property
    def volume(self) -> float:
        """Volume, 2 pi times the section's moment about the axis (Pappus) [m^3]."""
        return 2 * math.pi * first_moment(self.section, 1, self.radius)

    def distance(self, points: np.ndarray) -> np.ndarray:
        height, lateral = self.split(points)
        radius = np.sqrt((lateral**2).sum(axis=1))
        return self.section.distance(np.stack([height, radius - self.radius], axis=1))
