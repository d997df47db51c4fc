"""Ways through a layer: whether space before it and space behind it are connected, and what was so at the start.

Particles are balls on a grid in the layer's own axes, within the layer's edges. A
layer that was open before it was struck - a mesh, a honeycomb, a plate with holes or of several parts - has a new way
where one leads through space that is wider than it was at the start.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np

from hvisph.measures.debris.groups import connected_groups
from hvisph.measures.frame.target_geometry import RIM, Plate

RADIUS = 1.5  # [dx] of the balls: half the width of a way
WIDER = 3.0  # [dx] by which a new way's half width is more than that at the start; walls that bend do less
CELL = {2: 0.5, 3: 1.0}  # [dx]
SHIFT = 0.37  # [cells]; keeps the particles of a lattice off the borders of cells
MOST_CELLS = 40_000_000
LINED_UP = 0.75  # [dx] across the shot line: nearer is in the way, and what fits a hole is a spacing off


@dataclass(frozen=True)
class Grid:
    """Cells about a layer.

    Parameters
    ----------
    plate
        The layer.
    low
        Lowest corner, depth and coordinates in the plane (dim) [m].
    cell
        Edge of a cell [m].
    shape
        Number of cells, with `pad` more on either side.
    pad
        Cells beyond the particles along the normal, where there is space, and beyond the edges across it.
    """

    plate: Plate
    low: np.ndarray
    cell: float
    shape: tuple[int, ...]
    pad: int

    @classmethod
    def about(cls, plate: Plate, spacing: float, places: Sequence[np.ndarray], radius: float = RADIUS) -> Grid:
        """Return the grid about particles at `places`, each of shape (n, dim), in the axes of the layer [m]."""
        dim = places[0].shape[1]
        low = np.concatenate([[min(place[:, 0].min() for place in places)], RIM * np.array(plate.low)])
        high = np.concatenate([[max(place[:, 0].max() for place in places)], RIM * np.array(plate.high)])
        reach, cell = radius * spacing, CELL[dim] * spacing
        cell = max(cell, float((np.prod(high - low + 4.0 * reach) * len(places) / MOST_CELLS) ** (1.0 / dim)))
        pad = int(np.ceil(reach / cell)) + 2
        shape = tuple((np.ceil((high - low) / cell).astype(int) + 2 * pad).tolist())
        return cls(plate, low, cell, shape, pad)

    def fill(self, place: np.ndarray) -> np.ndarray:
        """Return the cells that hold a particle."""
        index = np.floor((place - self.low) / self.cell + SHIFT).astype(int) + self.pad
        inside = ((index >= 0) & (index < self.shape)).all(axis=1)
        cells = np.zeros(self.shape, dtype=bool)
        cells[tuple(index[inside].T)] = True
        return cells

    def clearance(self, place: np.ndarray) -> np.ndarray:
        """Return the distance [m] from the nearest particle of every cell within the edges, and beyond the faces."""
        from scipy import ndimage

        far = ndimage.distance_transform_edt(~self.fill(place)) * self.cell
        return np.asarray(far[(slice(None), *[slice(self.pad, -self.pad)] * (len(self.shape) - 1))])

    def free(self, place: np.ndarray, reach: float) -> np.ndarray:
        """Return where `clearance` is more than `reach`, a few cells [m]: the same at less cost."""
        cells, near = self.fill(place), np.zeros(self.shape, dtype=bool)
        steps = range(-int(reach / self.cell) - 1, int(reach / self.cell) + 2)
        for step in product(steps, repeat=len(self.shape)):
            if np.sqrt(float(sum(k * k for k in step))) * self.cell <= reach:
                near |= np.roll(cells, step, tuple(range(len(step))))  # pads are wider than that
        return np.asarray(~near[(slice(None), *[slice(self.pad, -self.pad)] * (len(self.shape) - 1))])

    @cached_property
    def edge_mask(self) -> np.ndarray:
        """Whether cells across the layer are within its edges: a disc has no corners, through which there is a way."""
        counts = [count - 2 * self.pad for count in self.shape[1:]]
        if not self.plate.edges:
            return np.ones(counts, dtype=bool)
        axes = [corner + (np.arange(count) + 0.5 - SHIFT) * self.cell
                for corner, count in zip(self.low[1:], counts, strict=True)]  # fmt: skip
        middles = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(counts))
        return np.asarray((self.plate.outward(middles) <= RIM).reshape(counts))

    def leads_through(self, free: np.ndarray) -> bool:
        """Whether free cells connect the space before the layer with that behind it."""
        from scipy import ndimage

        labels, _ = ndimage.label(free & self.edge_mask)
        return bool(np.intersect1d(labels[0], labels[-1]).max(initial=0) > 0)

    def layer_slice(self, place: np.ndarray) -> slice:
        """Return the cells along the normal from the first to the last of particles."""
        first, last = np.floor((place[:, 0].min() - self.low[0], place[:, 0].max() - self.low[0]) / np.array(self.cell))
        return slice(int(first) + self.pad, int(last) + self.pad + 1)


def place_of(plate: Plate, position: np.ndarray, own: float | np.ndarray, spacing: float) -> np.ndarray:
    """Return depth and coordinates in the plane [m] of particles at `position` (n, dim) in the axes of the shot.

    `own` is their spacing, or of each its own (n,), `spacing` is dx [m]: a particle of k dx stands for k^dim places.
    """
    place = np.column_stack([plate.depth(position), plate.in_plane(position)])
    if not isinstance(own, np.ndarray):
        return place
    number = np.maximum(np.ceil(own / spacing - 0.3), 1.0).astype(int)
    parts = []
    for count in np.unique(number):
        chosen = number == count
        steps = np.meshgrid(*[(np.arange(count) + 0.5) / count - 0.5] * place.shape[1], indexing="ij")
        offsets = np.stack([one.ravel() for one in steps], axis=1)
        spread = place[chosen, None] + own[chosen, None, None] * offsets
        parts.append(spread.reshape(-1, place.shape[1]))
    return np.concatenate(parts)


def is_open(plate: Plate, solid: np.ndarray, spacing: float) -> bool:
    """Whether a way leads through what is at `solid`, places (n, dim) in the axes of the layer [m]."""
    grid = Grid.about(plate, spacing, [solid])
    return grid.leads_through(grid.free(solid, RADIUS * spacing))


def has_opened(plate: Plate, solid: np.ndarray, before: np.ndarray, spacing: float) -> bool:
    """Return whether a path leads through a layer that was not there at the start.

    `solid` is what is attached now, `before` all of it at the start, moved with the rim: places (n, dim) [m].
    """
    grid = Grid.about(plate, spacing, [solid, before], RADIUS + WIDER)
    least = np.full_like(now := grid.clearance(solid), RADIUS * spacing)
    within = grid.layer_slice(before)
    least[within] = np.maximum(least[within], grid.clearance(before)[within] + WIDER * spacing)
    return grid.leads_through(now > least)


def with_openings(plate: Plate, position: np.ndarray, projectile: np.ndarray, own: float | np.ndarray, spacing: float
                  ) -> Plate:  # fmt: skip
    """Return a layer with its initial openings: open or not, also along the shot line, and in how many parts.

    `position` and `projectile` are its particles and the projectile's at the start (n, dim) in the axes of the shot
    [m], `own` is the spacing of its particles, or of each its own (n,), `spacing` is dx [m].
    """
    if position.shape[1] == 1:
        return plate
    place = place_of(plate, position, own, spacing)
    grid = Grid.about(plate, spacing, [place])
    cells = grid.fill(place)
    if _is_full(grid, cells, RADIUS * spacing):
        return plate
    from scipy import ndimage

    _, pieces = ndimage.label(cells, structure=np.ones([3] * cells.ndim))
    if pieces > 1:  # of cells, which may be more than of particles linked at 2 dx
        pieces = len(np.unique(connected_groups(position, own)))
    opened = is_open(plate, place, spacing)
    return replace(plate, open=opened, pieces=max(pieces, 1), clear=opened and _clear(position, projectile, spacing))


def _is_full(grid: Grid, cells: np.ndarray, radius: float) -> bool:
    """Whether all cells of a slice across the layer are within `radius` [m] of particles: it is closed."""
    near = cells.copy()
    for _ in range(int(radius / grid.cell)):
        grown = near.copy()
        for axis in range(cells.ndim):
            for step in (-1, 1):
                grown |= np.roll(near, step, axis)  # what wraps round comes from the pad, which is empty
        near = grown
    near = near[(slice(None), *[slice(grid.pad, -grid.pad)] * (cells.ndim - 1))]
    return bool((near | ~grid.edge_mask).reshape(len(near), -1).all(axis=1).any())


def _clear(position: np.ndarray, projectile: np.ndarray, spacing: float) -> bool:
    """Whether nothing at `position` is in the projectile's way along x."""
    from scipy.spatial import cKDTree

    nearest = cKDTree(position[:, 1:]).query(projectile[:, 1:], distance_upper_bound=LINED_UP * spacing)[0]
    return not bool(np.isfinite(nearest).any())
