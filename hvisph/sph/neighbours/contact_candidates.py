"""Contact candidates: particles near another body or an Eulerian particle.

Cells of the kernel's reach are marked with the bodies and Eulerian particles that they contain. The selection may
contain particles without such a neighbour, but it omits none that has one.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from hvisph.compiler.jit import specialise
from hvisph.compiler.parallel_for import chunk_loop, particle_loop
from hvisph.compiler.tensors import own_vector
from hvisph.compiler.vector.api import atomic_max, atomic_min, fetch

from .cells import Grid, adjacent_cell, cell_at, number_of, place_of

CHUNK = 1024
# Rows are asked for so many particles before they are needed.
AHEAD = 8
NO_BODY = 0xFFFFFFFF
# Largest number of cells per particle: a thin plate fills few cells of its box.
CELLS = 4
# Cells of space that have a number of their own along each axis: beyond so many, numbers repeat.
APART = 1 << 21


def _locate(chunk, count, rows, inverse_edge, nx, ny, nz, eulerian, bodies, cells, extents, lowest, highest, spatial):
    """Find the cells of a chunk of rows, their least and largest coordinates, and mark what the cells hold.

    Marks are the lowest and the highest body, and whether there is an Eulerian particle.
    """
    first, extent = chunk * np.uint64(CHUNK), extents[chunk]
    extent[0], extent[1] = np.inf, -np.inf
    for i in range(first, min(first + np.uint64(CHUNK), count)):
        fetch(rows, min(i + np.uint64(AHEAD), count - np.uint64(1)), np.uint64(0))
        cell = number_of(cell_at(own_vector(rows, i, 0, DIM), inverse_edge, nx, ny, nz), nx, nz)
        cells[i] = cell
        # a particle marked again is rare
        if bodies[i] < lowest[cell]:
            atomic_min(lowest, cell, bodies[i])
        if bodies[i] > highest[cell]:
            atomic_max(highest, cell, bodies[i])
        if eulerian[i] != 0:
            spatial[cell] = np.uint8(1)
        for axis in range(np.uint64(DIM)):
            extent[0, axis] = min(extent[0, axis], rows[i, axis])
            extent[1, axis] = max(extent[1, axis], rows[i, axis])


def _tell(i, cells, lowest, highest, spatial, meets, near, of_meets, of_near):
    """Write the marks of each particle's cell to the particle, and clear the cell's marks."""
    cell = np.uint64(cells[i])
    of_meets[i], of_near[i] = meets[cell], near[cell] != 0
    lowest[cell], highest[cell], spatial[cell] = np.uint32(NO_BODY), np.uint32(0), np.uint8(0)


def _spread(cell, nx, ny, nz, lowest, highest, spatial, meets, spatial_near):
    """Find the occupied cells that have another body, or an Eulerian particle, in or beside them."""
    if lowest[cell] == np.uint32(NO_BODY):
        spatial_near[cell] = np.uint8(0)
        return
    low, high, euler, place = lowest[cell], highest[cell], spatial[cell], place_of(cell, nx, nz)
    for shift in range(np.uint64(3**DIM)):
        at = adjacent_cell(place, shift, nx, ny, nz)
        low, high, euler = min(low, lowest[at]), max(high, highest[at]), euler | spatial[at]
    meets[cell] = low != high
    spatial_near[cell] = euler


def _widen(cell, nx, ny, nz, lowest, near, wider):
    """Mark the occupied cells that are, or lie beside, one that is marked in `near`."""
    if lowest[cell] == np.uint32(NO_BODY):
        return
    beside_one, place = near[cell], place_of(cell, nx, nz)
    for shift in range(np.uint64(3**DIM)):
        beside_one |= near[adjacent_cell(place, shift, nx, ny, nz)]
    wider[cell] = beside_one


class Selection:
    """Selection of particles by their surroundings.

    `position`: positions at the start (n, dim) [m], for the grid's extent.
    `reach`: distance within which others count as near [m].
    `with_neighbours`: whether the neighbours of those near an Eulerian particle are chosen, too: their corrections need
    them.
    """

    def __init__(self, position: np.ndarray, reach: float, with_neighbours: bool = False):
        count, dim = position.shape
        self._dim, self._cells = dim, np.zeros(count, np.uint32)
        self.grid = Grid.from_positions(position, reach, CELLS)
        self.fit(position)
        self._with_neighbours = with_neighbours
        self._nowhere = np.zeros(count, np.uint8)
        self._locate = chunk_loop(specialise(_locate, DIM=dim), CHUNK, short=True)
        self._tell = particle_loop(specialise(_tell), short=True)
        self._spread = particle_loop(specialise(_spread, DIM=dim), short=True)
        self._widen = particle_loop(specialise(_widen, DIM=dim), short=True)

    def fit(self, position: np.ndarray) -> None:
        """Make the grid anew around particles at `position` (n, dim) [m]."""
        self.grid = Grid.from_positions(position, self.grid.edge, CELLS)
        size = self.grid.shape[0] * self.grid.shape[1] * self.grid.shape[2]
        self._lowest, self._highest = np.full(size, NO_BODY, np.uint32), np.zeros(size, np.uint32)
        self._spatial = np.zeros(size, np.uint8)
        self._meets, self._spatial_near = np.zeros(size, bool), np.zeros(size, np.uint8)
        self._wider = np.zeros(size, np.uint8)

    def choose(self, rows: np.ndarray, eulerian: np.ndarray, bodies: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return which particles are near another body, and which near an Eulerian particle (n,), bool.

        The selection does not depend on the periodicity of the cell grid.

        `rows`: packed rows (n or more, width), position first
        `eulerian`: (n,) uint8, 1 for Eulerian particles
        `bodies`: body of each particle (n,) uint32
        """
        count, edge, sizes = len(bodies), self.grid.edge, self.grid.sizes
        if len(self._cells) < count:
            self._cells = np.zeros(count + count // 4, np.uint32)
        cells = self._cells[:count]
        self._find(rows, eulerian, bodies, cells)
        near = self._spatial_near
        if self._with_neighbours:
            self._widen(len(self._lowest), *sizes, self._lowest, near, self._wider)
            near = self._wider
        meets, spatial = np.empty((2, count), bool)
        self._tell(count, cells, *self._marks, self._meets, near, meets, spatial)
        if self._wraps():
            some = np.flatnonzero(meets | spatial)
            meets[some], spatial[some] = _choose_without_wrapping(
                rows[some, : self._dim], eulerian[some], bodies[some], edge, self._with_neighbours
            )
        return meets, spatial

    def _find(self, rows: np.ndarray, eulerian: np.ndarray, bodies: np.ndarray, cells: np.ndarray) -> None:
        """Find the cells of the rows, mark what they hold, and find those that have others in or beside them."""
        self._extents = np.empty((-(-len(cells) // CHUNK), 2, self._dim))
        self._marks = self._lowest, self._highest, self._spatial
        self._locate(len(cells), rows, 1.0 / self.grid.edge, *self.grid.sizes, eulerian, bodies, cells, self._extents,
                     *self._marks)  # fmt: skip
        self._spread(len(self._lowest), *self.grid.sizes, *self._marks, self._meets, self._spatial_near)

    def _wraps(self) -> bool:
        """Whether particles have spread so far that cells of the grid stand for several places."""
        least, most = self._extents[:, 0].min(axis=0), self._extents[:, 1].max(axis=0)
        low, high = np.floor(np.array([least, most]) * (1.0 / self.grid.edge))
        # two cells more: beside those at the rim lie empty ones
        return not (high - low + 3.0 <= self.grid.shape[: self._dim]).all()

    def near_other_bodies(self, rows: np.ndarray, bodies: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
        """Return particles within `reach` [m] of another body, and their neighbours; cells wrap round."""
        self.grid.edge = reach
        sizes, count = self.grid.sizes, len(rows)
        if len(self._nowhere) < count:
            self._nowhere = np.zeros(count + count // 4, np.uint8)
            self._cells = np.zeros(count + count // 4, np.uint32)
        cells = self._cells[:count]
        self._find(rows, self._nowhere, bodies, cells)
        self._widen(len(self._lowest), *sizes, self._lowest, self._meets.view(np.uint8), self._wider)
        meets, beside = np.empty((2, count), bool)
        self._tell(count, cells, *self._marks, self._meets, self._wider, meets, beside)
        beside &= ~meets
        return np.flatnonzero(meets), np.flatnonzero(beside)


def _choose_without_wrapping(
    position: np.ndarray, eulerian: np.ndarray, bodies: np.ndarray, edge: float, with_neighbours: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Return what `Selection.choose` does, of particles at `position` (n, dim) [m], by cells that do not wrap round."""
    dim = position.shape[1]
    places = np.floor(position * (1.0 / edge)).astype(np.int64) % APART
    weights = APART ** np.arange(dim)
    codes, first, cell = np.unique(places @ weights, return_index=True, return_inverse=True)
    lowest = np.full(len(codes), NO_BODY, np.uint32)
    highest, spatial = np.zeros((2, len(codes)), np.uint32)
    np.minimum.at(lowest, cell, bodies)
    np.maximum.at(highest, cell, bodies)
    np.maximum.at(spatial, cell, eulerian)
    beside = np.empty((3**dim, len(codes)), np.int64)
    for k, shift in enumerate(product((-1, 0, 1), repeat=dim)):
        there = (places[first] + shift) % APART @ weights
        at = np.minimum(np.searchsorted(codes, there), len(codes) - 1)
        beside[k] = np.where(codes[at] == there, at, np.arange(len(codes)))  # itself where there is none
    meets = lowest[beside].min(axis=0) != highest[beside].max(axis=0)
    near = spatial[beside].max(axis=0)
    if with_neighbours:
        near = near[beside].max(axis=0)
    return meets[cell], near[cell] != 0
