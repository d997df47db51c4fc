"""Geometry of a layer before the impact, and paths through it.

The geometry is the normal, the faces, the point where the shot line enters, the edges, and the initial openings.

A path leads through a layer if the space in front of it and the space behind it are connected within its edges.
Particles are balls on a grid in the layer's own axes. In a layer that was open before the impact - a mesh, a honeycomb,
a plate with holes or of several parts - a path is new if it leads through an opening that is wider than it was then.

The surface of a crater is the foremost particle of each cell of the plane.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
import scipy

from hvisph.core.text import Plain

from .fragments import connected_groups

PLATE_LIKE = 0.5  # a body is a plate where its least extent is below this share of the next
PARALLEL = 1e-7  # directions that differ by less are one
RIM_SHARE = 0.9  # share of the distance from the shot line to the edges beyond which the impact has no effect
DIRECTIONS = np.round([[np.cos(a), np.sin(a)] for a in np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)], 15)


@dataclass(frozen=True)
class Plate:
    """A layer before it was struck, in the axes of the shot: x along the shot line."""

    body: int  # index of the body
    # orthonormal rows (dim, dim): the normal, on the side that the shot flies to, and directions in the plane
    basis: tuple[tuple[float, ...], ...]
    front: float  # coordinate along the normal of the struck face, half a spacing before its particles [m]
    thickness: float  # along the normal, at the shot line [m]
    # intersection of the shot line with the struck face, coordinates in the plane (dim - 1) [m]
    entry: tuple[float, ...]
    # outermost particles from there, in the plane, (dim - 1) [m]
    low: tuple[float, ...]
    high: tuple[float, ...]
    # in 3D: how far its particles reach from the entry in each of `DIRECTIONS` in the plane [m], which a disc or a
    # turned box fills less than the box of `low` and `high`; empty in 1D and 2D
    edges: tuple[float, ...] = ()
    # whether a path led through it before the impact: a mesh, a honeycomb, a plate with holes or of several parts
    open: bool = False
    clear: bool = False  # whether its openings left the path of the projectile free
    pieces: int = 1  # number of its connected groups before the impact

    @property
    def obliquity(self) -> float:
        """Angle between the shot line and the normal [rad]."""
        return float(np.arccos(np.clip(self.basis[0][0], -1.0, 1.0)))

    def depth(self, position: np.ndarray) -> np.ndarray:
        """Return how far behind the struck face, along the normal, points (n, dim) are [m]."""
        return np.asarray(position @ np.array(self.basis[0]) - self.front)

    def in_plane(self, position: np.ndarray) -> np.ndarray:
        """Return coordinates in the plane (n, dim - 1) from where the shot line enters [m]."""
        return np.asarray(position @ np.array(self.basis[1:]).reshape(-1, position.shape[1]).T - np.array(self.entry))

    def outward(self, points: np.ndarray) -> np.ndarray:
        """Return the distance of points in the plane from the shot line over that of the edge (n,); 1 is on an edge."""
        if points.shape[1] == 0:
            return np.zeros(len(points))
        if self.edges:
            share = np.zeros(len(points))
            for direction, distance in zip(DIRECTIONS, self.edges, strict=True):
                if distance > 0.0:
                    np.maximum(share, points @ direction / distance, out=share)
            return share
        reach = np.where(points > 0.0, self.high, -np.array(self.low))
        share = np.divide(np.abs(points), reach, out=np.zeros_like(points), where=reach > 0.0)
        return np.asarray(share.max(axis=1))

    def is_beyond(self, points: np.ndarray, share: float) -> np.ndarray:
        """Return whether the distance of points in the plane is a `share` of that of the edge or more, shape (n,)."""
        out = np.ones(len(points), dtype=bool)
        if self.edges and min(self.edges) > 0.0:  # points nearer than the nearest edge are not
            out = (points**2).sum(axis=1) >= (share * min(self.edges) * (1.0 - 1e-9)) ** 2
        out[out] = self.outward(points[out]) >= share
        return np.asarray(out)

    @classmethod
    def from_dict(cls, plain: Plain) -> "Plate":
        """Return the plate with the plain form `plain`."""
        return cls(**{name: to_tuples(value) for name, value in plain.items()})


def to_tuples(value: object) -> Any:
    """Return a number of a plain form as it is, and a list of them as a tuple; raises `TypeError` for anything else."""
    if isinstance(value, list | tuple):
        return tuple(map(to_tuples, value))
    if not isinstance(value, int | float):
        raise TypeError(f"{value!r} is no number")
    return value


def plate_of(
    body: int, position: np.ndarray, axis: np.ndarray, spacing: float, sizes: float | np.ndarray | None = None
) -> Plate:
    """Return a layer's geometry by its initial positions (n, dim) and the shot line's place `axis` [m].

    `sizes` is the spacing of its particles, or of each its own (n,), `spacing` is dx [m], which all have unless given.
    """
    basis = _basis(_normal(position, spacing))
    normal = basis[0]
    depth, flat = position @ normal, position @ basis[1:].T
    middle = 0.5 * (depth.min() + depth.max())
    distance = np.sqrt(((flat - _crossing(basis, axis, middle)) ** 2).sum(axis=1))
    # as thick as it is along the shot line; one that the line misses, as a whole
    struck = distance <= distance.min() + 1.5 * spacing
    size = np.broadcast_to(spacing if sizes is None else sizes, len(depth))[struck]
    depth = depth[struck]
    front = float((depth - 0.5 * size).min())
    entry = _crossing(basis, axis, front)
    flat -= entry
    return Plate(
        body,
        tuple(map(tuple, basis.tolist())),
        front,
        float(np.ptp(depth) + 0.5 * (size[depth.argmin()] + size[depth.argmax()])),
        tuple(entry.tolist()),
        tuple(flat.min(axis=0).tolist()),
        tuple(flat.max(axis=0).tolist()),
        outline(flat),
    )


def outline(flat: np.ndarray) -> tuple[float, ...]:
    """Return how far points in a plane (n, 2) reach in each of `DIRECTIONS` [m]; nothing on a line."""
    if flat.shape[1] != 2:
        return ()
    return tuple(float((flat @ direction).max()) for direction in DIRECTIONS)


def _crossing(basis: np.ndarray, axis: np.ndarray, depth: float) -> np.ndarray:
    """Return where in the plane at `depth` the shot line crosses it."""
    x = (depth - basis[0, 1:] @ axis) / basis[0, 0]
    return np.asarray(basis[1:] @ np.concatenate([[x], axis]))


def _normal(position: np.ndarray, spacing: float) -> np.ndarray:
    """Return a plate's normal on the side that the shot flies to; x for other bodies and for grazing shots."""
    dim = position.shape[1]
    x_axis = np.eye(dim)[0]
    if dim == 1 or len(position) <= dim:
        return x_axis
    centred = position - position.mean(axis=0)
    vectors = np.linalg.eigh(centred.T @ centred)[1]
    extents = np.ptp(centred @ vectors, axis=0) + spacing
    normal = vectors[:, 0]
    if extents[0] > PLATE_LIKE * extents[1:].min() or abs(normal[0]) < 0.02:
        return x_axis
    normal = normal * np.sign(normal[0])
    return x_axis if np.abs(normal - x_axis).max() < PARALLEL else normal


def _basis(normal: np.ndarray) -> np.ndarray:
    """Return the normal and directions in the plane, the first in the plane of incidence; y and z for a square hit."""
    dim = len(normal)
    if dim == 1:
        return np.ones((1, 1))
    if dim == 2:
        return np.array([normal, [-normal[1], normal[0]]])
    x_axis = np.eye(3)[0]
    if np.abs(normal - x_axis).max() < PARALLEL:
        return np.eye(3)
    first = x_axis - normal[0] * normal
    first /= np.sqrt((first**2).sum())
    return np.array([normal, first, np.cross(normal, first)])


BALL_RADIUS = 1.5  # [dx]; half the width of a path
NEW_PATH_WIDENING = 3.0  # [dx] by which half the width of a new path exceeds that at the start; bent walls: less
CELL_WIDTH = {2: 0.5, 3: 1.0}  # [dx]
GRID_SHIFT = 0.37  # [cells], so that particles of a lattice do not lie on borders of cells
MOST_CELLS = 40_000_000
OBSTRUCTED = 0.75  # [dx]; particles nearer to the shot line obstruct it


@dataclass(frozen=True)
class Grid:
    """Cells about a layer."""

    plate: Plate  # the layer
    low: np.ndarray  # lowest corner, depth and coordinates in the plane (dim) [m]
    cell: float  # edge of a cell [m]
    shape: tuple[int, ...]  # number of cells, with `pad` more on either side
    pad: int  # cells beyond the particles along the normal, where there is space, and beyond the edges across it

    @classmethod
    def about(cls, plate: Plate, spacing: float, places: Sequence[np.ndarray], radius: float = BALL_RADIUS) -> "Grid":
        """Return the grid about particles at `places`, each of shape (n, dim), in the axes of the layer [m]."""
        dim = places[0].shape[1]
        low = np.concatenate([[min(place[:, 0].min() for place in places)], RIM_SHARE * np.array(plate.low)])
        high = np.concatenate([[max(place[:, 0].max() for place in places)], RIM_SHARE * np.array(plate.high)])
        reach, cell = radius * spacing, CELL_WIDTH[dim] * spacing
        cell = max(cell, float((np.prod(high - low + 4.0 * reach) * len(places) / MOST_CELLS) ** (1.0 / dim)))
        pad = int(np.ceil(reach / cell)) + 2
        shape = tuple((np.ceil((high - low) / cell).astype(int) + 2 * pad).tolist())
        return cls(plate, low, cell, shape, pad)

    def fill(self, place: np.ndarray) -> np.ndarray:
        """Return the cells that hold a particle."""
        index = np.floor((place - self.low) / self.cell + GRID_SHIFT).astype(int) + self.pad
        inside = ((index >= 0) & (index < self.shape)).all(axis=1)
        cells = np.zeros(self.shape, dtype=bool)
        cells[tuple(index[inside].T)] = True
        return cells

    def clearance(self, place: np.ndarray) -> np.ndarray:
        """Return the distance [m] from the nearest particle of every cell within the edges, and beyond the faces."""
        distance = scipy.ndimage.distance_transform_edt(~self.fill(place)) * self.cell
        return np.asarray(distance[(slice(None), *[slice(self.pad, -self.pad)] * (len(self.shape) - 1))])

    def free(self, place: np.ndarray, reach: float) -> np.ndarray:
        """Return where `clearance` is more than `reach`, a few cells [m]: the same at less cost."""
        cells, occupied = self.fill(place), np.zeros(self.shape, dtype=bool)
        steps = range(-int(reach / self.cell) - 1, int(reach / self.cell) + 2)
        for step in product(steps, repeat=len(self.shape)):
            if np.sqrt(float(sum(k * k for k in step))) * self.cell <= reach:
                occupied |= np.roll(cells, step, tuple(range(len(step))))  # pads are wider than that
        return np.asarray(~occupied[(slice(None), *[slice(self.pad, -self.pad)] * (len(self.shape) - 1))])

    @cached_property
    def edge_mask(self) -> np.ndarray:
        """Whether cells across the layer are within its edges: the corners of the grid around a disc are not."""
        counts = [count - 2 * self.pad for count in self.shape[1:]]
        if not self.plate.edges:
            return np.ones(counts, dtype=bool)
        axes = [
            corner + (np.arange(count) + 0.5 - GRID_SHIFT) * self.cell
            for corner, count in zip(self.low[1:], counts, strict=True)
        ]
        middles = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(counts))
        return np.asarray((self.plate.outward(middles) <= RIM_SHARE).reshape(counts))

    def connects_sides(self, free: np.ndarray) -> bool:
        """Whether free cells connect the space before the layer with that behind it."""
        labels, _ = scipy.ndimage.label(free & self.edge_mask)
        return bool(np.intersect1d(labels[0], labels[-1]).max(initial=0) > 0)

    def layer_slice(self, place: np.ndarray) -> slice:
        """Return the cells along the normal from the first to the last of particles."""
        first, last = np.floor((place[:, 0].min() - self.low[0], place[:, 0].max() - self.low[0]) / np.array(self.cell))
        return slice(int(first) + self.pad, int(last) + self.pad + 1)


def place_of(plate: Plate, position: np.ndarray, sizes: float | np.ndarray, spacing: float) -> np.ndarray:
    """Return depth and coordinates in the plane [m] of particles at `position` (n, dim) in the axes of the shot.

    `sizes` is their spacing, or of each its own (n,), `spacing` is dx [m]: a particle of k dx stands for k^dim places.
    """
    place = np.empty((len(position), position.shape[1]))
    place[:, 0], place[:, 1:] = plate.depth(position), plate.in_plane(position)
    if not isinstance(sizes, np.ndarray):
        return place
    number = np.maximum(np.ceil(sizes / spacing - 0.3), 1.0).astype(int)
    parts = []
    for count in np.unique(number):
        rows = number == count
        steps = np.meshgrid(*[(np.arange(count) + 0.5) / count - 0.5] * place.shape[1], indexing="ij")
        offsets = np.stack([step.ravel() for step in steps], axis=1)
        spread = place[rows, None] + sizes[rows, None, None] * offsets
        parts.append(spread.reshape(-1, place.shape[1]))
    return np.concatenate(parts)


def is_open(plate: Plate, solid: np.ndarray, spacing: float) -> bool:
    """Whether a path leads through particles at `solid` (n, dim) in the axes of the layer [m]."""
    grid = Grid.about(plate, spacing, [solid])
    return grid.connects_sides(grid.free(solid, BALL_RADIUS * spacing))


def has_opened(plate: Plate, solid: np.ndarray, before: np.ndarray, spacing: float) -> bool:
    """Return whether places `solid` now leave a path that those of the start, `before`, did not (n, dim) [m]."""
    grid = Grid.about(plate, spacing, [solid, before], BALL_RADIUS + NEW_PATH_WIDENING)
    required = np.full_like(clearance := grid.clearance(solid), BALL_RADIUS * spacing)
    layer = grid.layer_slice(before)
    required[layer] = np.maximum(required[layer], grid.clearance(before)[layer] + NEW_PATH_WIDENING * spacing)
    return grid.connects_sides(clearance > required)


def with_openings(
    plate: Plate, position: np.ndarray, projectile: np.ndarray, sizes: float | np.ndarray, spacing: float
) -> Plate:
    """Return a layer with its initial openings: open or not, also along the shot line, and in how many parts.

    `position` and `projectile` are its particles and the projectile's at the start (n, dim) in the axes of the shot
    [m], `sizes` is the spacing of its particles, or of each its own (n,), `spacing` is dx [m].
    """
    if position.shape[1] == 1:
        return plate
    place = place_of(plate, position, sizes, spacing)
    grid = Grid.about(plate, spacing, [place])
    cells = grid.fill(place)
    free = grid.free(place, BALL_RADIUS * spacing)
    if (~(free & grid.edge_mask)).reshape(len(free), -1).all(axis=1).any():  # a slice across it is closed
        return plate
    _, pieces = scipy.ndimage.label(cells, structure=np.ones([3] * cells.ndim))
    if pieces > 1:  # of cells, which may be more than of particles linked at 2 dx
        pieces = len(np.unique(connected_groups(position, sizes)))
    if not (opened := grid.connects_sides(free)):
        return replace(plate, pieces=max(pieces, 1))
    distance = scipy.spatial.cKDTree(position[:, 1:]).query(
        projectile[:, 1:], distance_upper_bound=OBSTRUCTED * spacing
    )[0]
    return replace(plate, open=opened, pieces=max(pieces, 1), clear=not bool(np.isfinite(distance).any()))


def front_surface(
    front: np.ndarray, lateral: np.ndarray, size: np.ndarray, cell: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the surface in each cell of the plane that holds particles of `size` (n,) [dx].

    Returns the least depth `front` of the faces of all its particles [m]; the mean of that of its columns, half as
    wide, of which a gap counts as deep as a cell is wide at most [m]; and its middle, (cells, dim - 1) [m].
    """
    level = np.maximum(np.ceil(np.log2(size) - 0.3), 0.0).astype(np.int64)
    foremost, place = _cover(front, lateral, level, cell)
    foremost_of_columns, columns = _cover(front, lateral, level, 0.5 * cell)
    low, extent = place.min(axis=0), np.ptp(place, axis=0) + 1
    cells, halves = (np.ravel_multi_index(tuple((at - low).T), tuple(extent)) for at in (place, columns // 2))
    owner = np.searchsorted(cells, halves)
    surface = front[foremost]
    top = np.minimum(front[foremost_of_columns], (surface + cell * 2.0 ** level[foremost])[owner])
    count = np.bincount(owner, minlength=len(surface))  # none where a column of wider particles is empty
    mean = np.where(count > 0, np.bincount(owner, top, len(surface)) / np.maximum(count, 1), surface)
    return surface, mean, (place + 0.5) * cell


def _cover(front: np.ndarray, lateral: np.ndarray, level: np.ndarray, cell: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the foremost particle of each cell and the cells' places, in order, shape (cells, dim - 1).

    A particle of spacing 2^`level` dx (n,) fills a cell 2^`level` times as wide.
    """
    rows, places = [], []
    for value in np.unique(level):
        rows_of_level, width = np.flatnonzero(level == value), 1 << int(value)
        place = np.floor(lateral[rows_of_level] / (cell * width) + 1e-9).astype(np.int64)
        first = _first_by_place(place, front[rows_of_level])
        steps = np.indices((width,) * lateral.shape[1]).reshape(lateral.shape[1], -1).T
        places.append((place[first, None] * width + steps).reshape(-1, lateral.shape[1]))
        rows.append(np.repeat(rows_of_level[first], len(steps)))
    row, place = np.concatenate(rows), np.concatenate(places)
    first = _first_by_place(place, front[row])
    return row[first], place[first]


def _first_by_place(place: np.ndarray, depth: np.ndarray) -> np.ndarray:
    """Return the row of the least `depth` (n,) of each place (n, dim - 1), in the order of places."""
    low = place.min(axis=0)
    key = np.ravel_multi_index(tuple((place - low).T), tuple(place.max(axis=0) - low + 1))
    order = np.lexsort((depth, key))
    return np.asarray(order[np.unique(key[order], return_index=True)[1]])
