"""Overlap of bodies: depth of surface points of one body inside another.

The distance of particles does not tell whether bodies touch: a lattice ends in steps at a curved or turned face. Where
bodies have shapes, their signed distances are used. Points start at particles near the other body and descend the
distance to its surface within their own body. The deepest one gives the overlap, at faces, an edge, a tip, or in a
plate thinner than a spacing.

Where the particles of one come from a file there is no surface. There it is the volume that both fill: the sum of V W
over the particles of both is 1 inside matter, less at a face, and more where there is matter twice.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import scipy

from .cutting_planes import Section
from .shapes import Placed, Shape
from .shapes.shape import push_inside

# Depth [spacings of the finer body] from which on bodies stand in each other: less is how a place is typed.
DEEPEST = 0.4
SAME_PLACE = 1e-3  # particles this close [spacings] are one place twice, which no pair law can tell apart
# How far under its surface [spacings] a body's outermost particles may lie, and the steps down from there.
UNDER = 2.5
STEPS = (0.6, 0.5, 0.4, 0.4, 0.3, 0.25, 0.2, 0.15, 0.1, 0.05)
# How far over its own surface [spacings] a point may come to lie, and over which distance slopes are taken.
SLACK, SLOPE = 0.02, 0.05
# Points at most, the nearest to the other body; of surfaces of triangles, whose distances take long, fewer.
MOST, MOST_OF_MESH = 50_000, 3_000
# Share of its volume that matter fills before it stands in other matter, within `ROUND` spacings; depth of a particle
# in the other's surface that says the same.
FULLEST, ROUND, INSIDE = 1.12, 2.5, 0.25


@dataclass(frozen=True)
class Standing:
    """A body at its place."""

    positions: np.ndarray  # particle centres, shape (n, dim) [m]
    breadth: np.ndarray  # side of a square or cube of each particle's volume, shape (n,) [m]
    spacing: tuple[float, float]  # least and largest spacing of its particles [m]
    surface: Shape | None = None  # its surface; None where there is none but the particles'

    @property
    def uniform(self) -> bool:
        """Whether the spacing is uniform."""
        return self.spacing[1] <= self.spacing[0] * (1 + 1e-9)

    @property
    def triangles(self) -> bool:
        """Whether its surface is one of triangles."""
        return getattr(self.surface, "kind", "") == "mesh"

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the corners of the box around its particles, half a spacing wider (dim,) [m]."""
        return self.positions.min(axis=0) - self.spacing[0] / 2, self.positions.max(axis=0) + self.spacing[0] / 2

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return the signed distance of `points` (n, dim) [m] to its surface, negative inside; the axis is none."""
        return solid_of(self.surface).distance(points)


@dataclass(frozen=True)
class Overlap:
    """Two overlapping bodies."""

    bodies: tuple[int, int]  # indices of the two bodies
    place: np.ndarray  # where, (dim,) [m]
    # by how much at least [m]; 0 where particles of both stand in one place or matter fills its volume twice
    depth: float


def overlaps(bodies: Sequence[Standing]) -> list[Overlap]:
    """Return the pairs of bodies that overlap by 0.4 spacings or more; bodies apart along an axis cost nothing."""
    pairs = ((k, l, _overlap(bodies[k], bodies[l])) for k, l in combinations(range(len(bodies)), 2))
    return [Overlap((k, l), *where) for k, l, where in pairs if where is not None]


def _overlap(first: Standing, second: Standing) -> tuple[np.ndarray, float] | None:
    """Return place and depth of the overlap of two bodies."""
    dx = min(first.spacing[0], second.spacing[0])
    if first.uniform and second.uniform and _boxes_are_separate(first.bounds(), second.bounds(), 1e-6 * dx):
        return None
    if first.surface is not None and second.surface is not None:
        shapes_apart = _boxes_are_separate(first.surface.bounds(), second.surface.bounds(), SLACK * dx)
        for a, b in () if shapes_apart else ((first, second), (second, first)):
            place, depth = _deepest(a, b, dx)
            if depth >= DEEPEST * dx:
                return place, depth
        return _same_place(first, second, SAME_PLACE * dx)
    for a, b in ((first, second), (second, first)):
        if b.surface is not None:
            depths = -b.distance(a.positions)
            if depths.max() > INSIDE * dx:
                return a.positions[depths.argmax()], float(depths.max())
    return _overfilled(first, second) or _same_place(first, second, SAME_PLACE * dx)


def _boxes_are_separate(a: tuple[np.ndarray, np.ndarray], b: tuple[np.ndarray, np.ndarray], slack: float) -> bool:
    """Whether along some axis one box ends before the other begins, or no more than `slack` [m] later."""
    return bool((a[0] - b[1] >= -slack).any() or (b[0] - a[1] >= -slack).any())


def _deepest(first: Standing, second: Standing, dx: float) -> tuple[np.ndarray, float]:
    """Return the point of `first` that lies deepest in `second` and its depth; one above the limit ends the search."""
    under = UNDER * first.spacing[1]
    low, high = second.surface.bounds() if second.surface is not None else second.bounds()
    points = first.positions[((first.positions >= low - under) & (first.positions <= high + under)).all(axis=1)]
    best, place = -math.inf, np.zeros(first.positions.shape[1])
    if len(points) == 0:
        return place, best
    distance = second.distance(points)
    nearest = np.argsort(distance, kind="stable")[: MOST_OF_MESH if first.triangles or second.triangles else MOST]
    points = points[nearest[distance[nearest] < under]]
    for step in (0.0, *STEPS):
        if len(points) == 0:
            break
        if step:
            points = points - step * first.spacing[1] * solid_of(second.surface).outward(points, SLOPE * dx)
            points = push_inside(solid_of(first.surface), points, 0.0, 0.1 * SLACK * dx, SLOPE * dx)
        depth = np.where(first.distance(points) <= SLACK * dx, -second.distance(points), -math.inf)
        if depth.max() > best:
            best, place = float(depth.max()), points[depth.argmax()]
        if best >= DEEPEST * dx:
            break
    return place, best


def solid_of(surface: Shape | None) -> Shape:
    """Return the surface; that of a half-plane section continued beyond the axis."""
    assert surface is not None
    shape = getattr(surface, "shape", surface)
    return _Mirrored(surface, shape) if isinstance(shape, Section) else surface


@dataclass(frozen=True)
class _Mirrored(Shape):
    """A section of a solid of revolution on both sides of its axis, which is no surface of it."""

    placed: Shape
    section: Section

    dim = 2

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        low, high = self.placed.bounds()
        return np.array([low[0], -high[1]]), high

    @property
    def volume(self) -> float:
        return 2 * self.section.volume

    def distance(self, points: np.ndarray) -> np.ndarray:
        local = self.placed.inwards(points) if isinstance(self.placed, Placed) else points
        return self.section.solid.distance(np.concatenate([local, np.zeros((len(local), 1))], axis=1))


def _same_place(a: Standing, b: Standing, reach: float) -> tuple[np.ndarray, float] | None:
    """Return a place occupied by particles of both bodies."""
    boxes = [(body.positions.min(axis=0) - reach, body.positions.max(axis=0) + reach) for body in (a, b)]
    low, high = np.maximum(boxes[0][0], boxes[1][0]), np.minimum(boxes[0][1], boxes[1][1])
    sets = [body.positions[((body.positions >= low) & (body.positions <= high)).all(axis=1)] for body in (a, b)]
    if not (len(sets[0]) and len(sets[1])):
        return None
    # loaded here: scipy.spatial takes 0.2 s to import, and bodies in a row never come this far
    distance, _ = scipy.spatial.cKDTree(sets[1]).query(sets[0], distance_upper_bound=reach)
    return (sets[0][distance.argmin()], 0.0) if np.isfinite(distance).any() else None


def _overfilled(first: Standing, second: Standing) -> tuple[np.ndarray, float] | None:
    """Return where the particles of both together fill more volume than there is."""
    dim, reach = first.positions.shape[1], ROUND * max(first.spacing[1], second.spacing[1])
    norm = {1: 32 / 35, 2: math.pi / 4, 3: 64 * math.pi / 315}[dim] * reach**dim
    trees = [scipy.spatial.cKDTree(body.positions) for body in (first, second)]
    adjacent = [np.isfinite(trees[1 - k].query(trees[k].data, distance_upper_bound=reach)[0]) for k in (0, 1)]
    points = np.concatenate([trees[k].data[adjacent[k]] for k in (0, 1)])
    if len(points) == 0:
        return None
    filled, at = np.zeros(len(points)), scipy.spatial.cKDTree(points)
    for tree, body in zip(trees, (first, second), strict=True):
        pairs = at.sparse_distance_matrix(tree, reach, output_type="ndarray")
        share = body.breadth[pairs["j"]] ** dim * (1 - (pairs["v"] / reach) ** 2) ** 3
        filled += np.bincount(pairs["i"], share, len(points))
    fullest = int(filled.argmax())
    return (points[fullest], 0.0) if filled[fullest] > FULLEST * norm else None
