"""Combined shapes: placed and rotated, union, difference, lattice of copies, honeycomb."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from hvisph.core.errors import CaseError

from .shape import Shape, box_distance, integrate

ALL_COPIES = 16  # a repeated shape of more copies than this looks only at the copies beside a point
ROUNDS = 4  # over the vectors, for points beyond the lattice: with 60 degrees between them three are enough


@dataclass(frozen=True)
class Placed(Shape):
    """A shape rotated about its origin and then moved."""

    shape: Shape  # the shape in its own coordinates
    position: np.ndarray  # where its origin goes, (dim,) [m]
    matrix: np.ndarray | None = None  # rotation (dim, dim); None for none

    @property
    def dim(self) -> int:
        return self.shape.dim

    @property
    def kind(self) -> str:
        return self.shape.kind

    @property
    def flat_axes(self) -> tuple[int, ...]:
        return self.shape.flat_axes if self.matrix is None else ()

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        low, high = self.shape.bounds()
        if self.matrix is None:
            return low + self.position, high + self.position
        corners = np.array(list(itertools.product(*zip(low, high, strict=True)))) @ self.matrix.T + self.position
        return corners.min(axis=0), corners.max(axis=0)

    @property
    def volume(self) -> float:
        return self.shape.volume

    def distance(self, points: np.ndarray) -> np.ndarray:
        return self.shape.distance(self.inwards(points))

    def contains(self, points: np.ndarray) -> np.ndarray:
        return self.shape.contains(self.inwards(points))

    def inwards(self, points: np.ndarray) -> np.ndarray:
        """Return `points` (n, dim) in the shape's own coordinates [m]."""
        offset = points - self.position
        return offset if self.matrix is None else offset @ self.matrix


class Measured(Shape):
    """A shape whose volume is integrated once, to 1e-4."""

    @cached_property
    def volume(self) -> float:
        return integrate(self)


@dataclass(frozen=True)
class OfParts(Measured):
    """Combination of shapes."""

    parts: Sequence[Shape]  # shapes of the same number of dimensions

    @property
    def dim(self) -> int:
        return self.parts[0].dim

    @property
    def _corners(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corners of the boxes around the parts, (parts, dim) each [m]."""
        lows, highs = zip(*(part.bounds() for part in self.parts), strict=True)
        return np.array(lows), np.array(highs)

    def _reduce_distance(self, points: np.ndarray, of_two: np.ufunc) -> np.ndarray:
        """Return the signed distances to the parts reduced by `of_two` (n,) [m]."""
        distance = self.parts[0].distance(points)
        for part in self.parts[1:]:
            of_two(distance, part.distance(points), out=distance)
        return distance


class Union(OfParts):
    """All that lies in one of the parts."""

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        lows, highs = self._corners
        return lows.min(axis=0), highs.max(axis=0)

    def distance(self, points: np.ndarray) -> np.ndarray:
        return self._reduce_distance(points, np.minimum)


@dataclass(frozen=True)
class Intersection(OfParts):
    """All that lies in every part."""

    def __post_init__(self) -> None:
        low, high = self.bounds()
        if not (low < high).all():
            raise CaseError("the parts of the intersection have nothing in common", where="parts")

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        lows, highs = self._corners
        return lows.max(axis=0), highs.min(axis=0)

    def distance(self, points: np.ndarray) -> np.ndarray:
        return self._reduce_distance(points, np.maximum)


@dataclass(frozen=True)
class Difference(Measured):
    """Difference: a shape without the parts that are cut out."""

    whole: Shape
    removed: Sequence[Shape]

    @property
    def dim(self) -> int:
        return self.whole.dim

    @property
    def flat_axes(self) -> tuple[int, ...]:
        return self.whole.flat_axes

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        return self.whole.bounds()

    def distance(self, points: np.ndarray) -> np.ndarray:
        largest = self.whole.distance(points)
        for part in self.removed:
            np.maximum(largest, -part.distance(points), out=largest)
        return largest


@dataclass(frozen=True)
class Repeat(Measured):
    """Copies of a shape in a row or on a lattice, centred about the origin."""

    shape: Shape  # shape of one copy
    vectors: Sequence[Sequence[float]]  # one to three steps from copy to copy, (k, dim) [m]
    counts: Sequence[int]  # number of copies along each
    _inverse: np.ndarray = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        steps = np.asarray(self.vectors, dtype=float)
        if len(steps) > self.shape.dim:
            raise CaseError(f"needs 1 to {self.shape.dim} vectors of {self.shape.dim} components", where="vectors")
        if np.linalg.matrix_rank(steps) < len(steps):
            raise CaseError("the vectors must point in different directions", where="vectors")
        object.__setattr__(self, "_inverse", np.linalg.pinv(steps))

    @property
    def dim(self) -> int:
        return self.shape.dim

    @property
    def copies(self) -> int:
        """Number of copies."""
        return math.prod(self.counts)

    @property
    def kind(self) -> str:
        return f"repeated {self.shape.kind}"

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        low, high = self.shape.bounds()
        reach = sum(np.abs(step) * (n - 1) / 2 for step, n in zip(np.asarray(self.vectors), self.counts, strict=True))
        return low - reach, high + reach

    @property
    def volume(self) -> float:
        """Area or volume: that of all copies where they are separate, to 1e-4 where they overlap [m^dim]."""
        low, high = self.shape.bounds()
        steps = np.asarray(self.vectors)
        offsets = [np.array(index) @ steps for index in itertools.product((-1, 0, 1), repeat=len(steps)) if any(index)]
        if self._all_near and all((np.abs(move) >= (high - low) * (1 - 1e-12)).any() for move in offsets):
            return self.shape.volume * self.copies
        return super().volume

    @property
    def _all_near(self) -> bool:
        """Whether a point's nearest copies are those of its cell and the adjacent cells."""
        low, high = self.shape.bounds()
        corners = np.array(list(itertools.product(*zip(low, high, strict=True)))) @ self._inverse
        return bool((np.ptp(corners, axis=0) <= 2.0).all())

    def distance(self, points: np.ndarray) -> np.ndarray:
        steps = np.asarray(self.vectors)
        last = [(n - 1) / 2 for n in self.counts]
        smallest = np.full(len(points), np.inf)
        if self.copies <= ALL_COPIES or not self._all_near:
            for index in itertools.product(*(range(n) for n in self.counts)):
                np.minimum(smallest, self.shape.distance(points - (np.array(index) - last) @ steps), out=smallest)
            return smallest
        low, high = self.shape.bounds()
        cell = self._nearest_copy(points - (low + high) / 2)
        for shift in itertools.product(*((0, -1, 1) if n > 1 else (0,) for n in self.counts)):
            at = points - (np.clip(cell + shift, 0, np.array(self.counts) - 1) - last) @ steps
            # the nearest copy comes first; of another only those look that its box could be nearer to
            candidates = np.maximum(low - at, at - high).max(axis=1) < smallest
            smallest[candidates] = np.minimum(smallest[candidates], self.shape.distance(at[candidates]))
        return smallest

    def _nearest_copy(self, points: np.ndarray) -> np.ndarray:
        """Return the index of the copy with the nearest centre (n, vectors)."""
        steps, last = np.asarray(self.vectors), np.array(self.counts) - 1
        free = np.rint(points @ self._inverse + last / 2)
        cell = np.clip(free, 0, last)
        outside = (cell != free).any(axis=1)
        at, index = points[outside], cell[outside]
        for _ in range(ROUNDS if len(at) else 0):
            for axis, step in enumerate(steps):
                offset = (at - (index - last / 2) @ steps) @ step / (step @ step)
                index[:, axis] = np.clip(np.rint(index[:, axis] + offset), 0, last[axis])
        cell[outside] = index
        return cell


@dataclass(frozen=True)
class Honeycomb(Shape):
    """A box of regular hexagonal cells along x, walls normal to y of two foils, one cell centred at the origin.

    Ribbons are bonded at every third wall: per area of the section 8/3 wall/cell is filled where walls are thin.
    """

    cell: float  # width of a cell between opposite walls [m]
    wall: float  # thickness of a wall of one foil [m], below half of the cell
    size: Sequence[float]  # sizes along x, y and z [m]

    dim = 3

    def __post_init__(self) -> None:
        if not 0.0 < 2.0 * self.wall < self.cell:
            raise CaseError(f"double walls of {2 * self.wall:g} m fill cells of {self.cell:g} m", where="cell")

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        half = np.asarray(self.size, dtype=float) / 2.0
        return -half, half

    @property
    def volume(self) -> float:
        """Volume of the walls: that of the box less those of the cells in it [m^3]."""
        depth, *sides = self.size
        first, second = 0.5 * self.cell - self.wall, 0.5 * (self.cell - self.wall)
        top, side = second / math.sqrt(0.75), (second - 0.5 * first) / math.sqrt(0.75)
        corners = np.array([[first, -side], [first, side], [0.0, top], [-first, side], [-first, -side], [0.0, -top]])
        rows, columns = (int(size / self.cell) + 2 for size in (sides[1] / math.sqrt(0.75), sides[0]))
        open_area = 0.0
        for j in range(-rows, rows + 1):
            for i in range(-columns, columns + 1):
                centre = np.array([i + 0.5 * (j % 2), j * math.sqrt(0.75)]) * self.cell
                open_area += _area_in_rectangle(corners + centre, np.array(sides) / 2.0)
        return depth * (sides[0] * sides[1] - open_area)

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return signed distances (n,) [m], negative inside; a lower bound beside edges and corners of cells."""
        outside = box_distance(*(np.abs(points) - np.asarray(self.size, dtype=float) / 2.0).T)
        normals = np.array([[1.0, 0.0], [0.5, math.sqrt(0.75)], [-0.5, math.sqrt(0.75)]])
        half = self.wall * np.array([1.0, 0.5, 0.5])
        nearest = np.full(len(points), np.inf)
        # the cell of a point is that of the nearest centre: two rectangular lattices hold all centres
        step = self.cell * np.array([1.0, math.sqrt(3.0)])
        relative = [points[:, 1:] - shift for shift in (0.0 * step, 0.5 * step)]
        offsets = [r - step * np.rint(r / step) for r in relative]
        first, second = ((offset**2).sum(axis=1) for offset in offsets)
        local = np.where((first <= second)[:, None], *offsets)
        for normal, part in zip(normals, half, strict=True):
            np.minimum(nearest, 0.5 * self.cell - np.abs(local @ normal) - part, out=nearest)
        return np.maximum(nearest, outside)


def _area_in_rectangle(corners: np.ndarray, half: np.ndarray) -> float:
    """Return the area [m^2] of the convex polygon `corners` (n, 2) within +-`half` (2,), cut side by side."""
    cut = corners
    for axis, sign in itertools.product((0, 1), (1.0, -1.0)):
        excess = sign * cut[:, axis] - half[axis]
        ring: list[np.ndarray] = []
        for start_point, end_point, a, b in zip(cut, np.roll(cut, -1, 0), excess, np.roll(excess, -1), strict=True):
            ring += [start_point] if a <= 0.0 else []
            ring += [start_point + (end_point - start_point) * a / (a - b)] if (a > 0.0) != (b > 0.0) else []
        if len(ring) < 3:
            return 0.0
        cut = np.array(ring)
    x, y = cut.T
    return float(0.5 * abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
