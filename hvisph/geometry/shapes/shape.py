"""Interface of shapes: bounding box, volume and signed distance.

A shape has its own coordinates, with the origin where `position` puts it and about which it is turned; that is
the centre of all shapes but those given by points, by a file or by parts. All lengths in metres (or in
the case's own unit where it has none).

Volumes and moments of shapes without a formula follow from their signed distance (`integrate`). A box around the shape
is halved along all axes again and again. A cell whose centre is farther from the surface than its corners is wholly in
or out; the rest at the end lies along the surface, and a cell of it of size s with its centre at the signed distance d
counts clip(1/2 - d/s, 0, 1). Over a smooth surface the errors of the cells cancel and along edges they go
like s^2, which the last two sizes tell (Richardson's extrapolation).
"""

import itertools
import math
from abc import ABC, abstractmethod
from collections.abc import Callable

import numpy as np

# Relative margin within which a point counts as lying on the surface, hence outside: wide against
# round-off, narrow against the steps of a lattice of 10^4 nodes across.
SURFACE_MARGIN = 1e-10

AXES = ("x", "y", "z")


class Shape(ABC):
    """A region of the line, the plane or space."""

    @property
    @abstractmethod
    def dim(self) -> int:
        """Number of dimensions."""

    @abstractmethod
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the lower and the upper corner of the box around it, (dim,) each [m]."""

    @property
    @abstractmethod
    def volume(self) -> float:
        """Length, area or volume [m^dim], exact or to 1e-4."""

    @abstractmethod
    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return signed distances (n,) [m], negative inside: exact in sign, at most the true one in size."""

    def outward(self, points: np.ndarray, step: float) -> np.ndarray:
        """Return unit vectors (n, dim) along which the distance to the surface grows, by differences of `step` [m]."""
        slopes = np.empty_like(points)
        for axis in range(points.shape[1]):
            move = np.zeros(points.shape[1])
            move[axis] = step
            slopes[:, axis] = self.distance(points + move) - self.distance(points - move)
        size = np.sqrt((slopes**2).sum(axis=1))
        return slopes / np.maximum(size, 1e-300)[:, None]

    @property
    def kind(self) -> str:
        """Name of the kind of shape, for messages."""
        return type(self).__name__.lower()

    @property
    def flat_axes(self) -> tuple[int, ...]:
        """Axes across which flat faces bound the whole shape."""
        return ()

    @property
    def wall_axes(self) -> tuple[int, ...]:
        """Axes along which layers begin half a spacing from the lower bound, because an axis of revolution is there."""
        return ()

    @property
    def radial_axes(self) -> tuple[int, ...]:
        """Axes that are the distance from an axis of revolution."""
        return ()

    def centroid(self) -> np.ndarray | None:
        """Return the middle of the volume, (dim,) [m]; None where no formula gives it."""
        return None

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        low, high = self.bounds()
        return tuple(float(side) for side in high - low)

    def contains_grid(self, axes: list[np.ndarray]) -> np.ndarray:
        """Tell which nodes of the product of coordinates lie strictly inside, in the order of `grid`: (nodes,)."""
        return self.contains(grid(axes))

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Tell which `points` (n, dim) [m] lie strictly inside: booleans of shape (n,)."""
        return self.distance(points) < -SURFACE_MARGIN * max(self.extent())


class Centred(Shape):
    """A shape whose box is centred at the origin."""

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        half = np.asarray(self.extent()) / 2
        return -half, half

    @abstractmethod
    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""


class Axial(Shape):
    """A solid of revolution about, or extruded along, one of the axes (3D); its field `axis` is the axis's name."""

    dim = 3
    axis: str

    @property
    def axis_column(self) -> int:
        """Column of the coordinate along the axis."""
        return AXES.index(self.axis)

    @property
    def flat_axes(self) -> tuple[int, ...]:
        """Axes across which flat faces bound the whole shape: both ends."""
        return (self.axis_column,)

    def split(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the coordinate (n,) [m] of `points` (n, 3) along the axis, and the two across it (n, 2)."""
        return points[:, self.axis_column], np.delete(points, self.axis_column, axis=1)


def push_inside(shape: Shape, points: np.ndarray, depth: float, tolerance: float, step: float) -> np.ndarray:
    """Return `points` (n, dim) with those nearer than `depth` to the surface, or beyond it, put back to that depth.

    `tolerance`, `step`: how far off a point may remain, and over which length slopes are taken [m].
    """
    rows = np.arange(len(points))
    for _ in range(3):  # a point that is deep enough stays where it is
        d = shape.distance(points[rows]) + depth
        out = d > tolerance
        rows = rows[out]
        if len(rows) == 0:
            break
        points[rows] -= d[out, None] * shape.outward(points[rows], step)
    return points


def box_distance(*excess: np.ndarray) -> np.ndarray:
    """Return the signed distance to a box from how far a point lies beyond its faces along each axis."""
    outside = np.sqrt(sum(np.maximum(b, 0.0) ** 2 for b in excess))
    inside = excess[0]
    for b in excess[1:]:
        inside = np.maximum(inside, b)
    return np.where(inside > 0, outside, inside)


def line_distance(x: np.ndarray, y: np.ndarray, start: tuple[float, float], end: tuple[float, float]) -> np.ndarray:
    """Return the signed distance of points of the plane to a line, positive to the left of `start` -> `end`."""
    tx, ty = end[0] - start[0], end[1] - start[1]
    return ((y - start[1]) * tx - (x - start[0]) * ty) / math.hypot(tx, ty)


def grid(axes: list[np.ndarray]) -> np.ndarray:
    """Return the points of the product of coordinate lists, the last coordinate fastest: (n, dim)."""
    mesh = np.meshgrid(*axes, indexing="ij")
    return np.stack([coordinate.ravel() for coordinate in mesh], axis=1)


# Cells along the surface at the end, by dimensions: some 1e-5 of the volume.
MOST_CELLS = 1_500_000
DEEPEST = 24
AT_ONCE = 250_000


def first_moment(shape: Shape, axis: int, offset: float) -> float:
    """Return the integral of (coordinate `axis` + `offset`) over `shape` [m^(dim+1)]."""
    exact = shape.centroid()
    if exact is not None:
        return shape.volume * (exact[axis] + offset)
    return integrate(shape, lambda points: points[:, axis] + offset)


def integrate(shape: Shape, weight: Callable[[np.ndarray], np.ndarray] = lambda points: np.ones(len(points))) -> float:
    """Return the integral of `weight` over the shape, without one its volume, to about 1e-5 of its box [m^dim]."""
    dim = shape.dim
    low, high = shape.bounds()
    size = float((high - low).max())
    # cubes that cover the box, of which none is larger than the shortest side
    side = size / max(1, math.ceil(size / float((high - low).min()) - 1e-9))
    side = max(side, size / 64)
    counts = [max(1, math.ceil(float(s) / side - 1e-9)) for s in high - low]
    # an irrational shift keeps faces off the planes between cells
    start = (low + high) / 2 - np.array(counts) * side / 2 + side * 0.0137 * np.array([1.0, 0.618, 0.367][:dim])
    counts = [n + 1 for n in counts]
    centres = start + grid([np.arange(n) for n in counts]) * side
    corners = np.array(list(itertools.product((-0.25, 0.25), repeat=dim)))
    total, coarser, depth = 0.0, math.nan, 0
    while True:
        parts = [shape.distance(centres[k : k + AT_ONCE]) for k in range(0, len(centres), AT_ONCE)]
        d = np.concatenate(parts) if parts else np.empty(0)
        reach = side * math.sqrt(dim) / 2
        inside, boundary = d <= -reach, np.abs(d) < reach
        total += weight(centres[inside]).sum() * side**dim
        centres, d = centres[boundary], d[boundary]
        depth += 1
        share = np.clip(0.5 - d / side, 0.0, 1.0)
        integral = float(total + (share * weight(centres)).sum() * side**dim)
        if len(centres) * 2**dim > MOST_CELLS or depth >= DEEPEST or len(centres) == 0:
            return integral + (integral - coarser) / 3 if depth > 3 else integral
        coarser = integral
        centres = (centres[:, None, :] + side * corners).reshape(-1, dim)
        side /= 2
