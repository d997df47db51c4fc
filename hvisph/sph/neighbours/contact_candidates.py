"""Contact candidates: particles near another body or an Eulerian particle.

Cells of the kernel's reach are marked with the bodies and Eulerian particles that they contain. The selection may
contain particles without such a neighbour, but it omits none that has one.
"""

from __future__ import annotations

import numpy as np

from hvisph.compiler.jit import specialise
from hvisph.compiler.parallel_for import chunk_loop, particle_loop
from hvisph.compiler.tensors import row_vector
from hvisph.compiler.vector.api import atomic_max, atomic_min, fetch

from .cells import Grid, adjacent_cell, cell_at, number_of, place_of

CHUNK = 1024
# Rows are prefetched so many particles before they are needed.
AHEAD = 8
NO_BODY = 0xFFFFFFFF
# Largest number of cells per particle: a thin plate fills few cells of its box.
CELLS = 4
# Number of cells along each axis with distinct codes.
BITS = 21
APART = 1 << BITS


def _locate(chunk, count, rows, inverse_edge, nx, ny, nz, eulerian, bodies, cells, extents, lowest, highest, spatial):
    """Find the cells of a chunk of rows, their least and largest coordinates, and mark what the cells hold.

    Marks are the lowest and the highest body, and whether there is an Eulerian particle.
    """
    first, extent = chunk * np.uint64(CHUNK), extents[chunk]
    extent[0], extent[1] = np.inf, -np.inf
    for i in range(first, min(first + np.uint64(CHUNK), count)):
        fetch(rows, min(i + np.uint64(AHEAD), count - np.uint64(1)), np.uint64(0))
        cell = number_of(cell_at(row_vector(rows, i, 0, DIM), inverse_edge, nx, ny, nz), nx, nz)
        cells[i] = cell
        # atomic operations are slow, and rarely needed
        if bodies[i] < lowest[cell]:
            atomic_min(lowest, cell, bodies[i])
        if bodies[i] > highest[cell]:
            atomic_max(highest, cell, bodies[i])
        if eulerian[i] != 0:
            spatial[cell] = np.uint8(1)
        for axis in range(np.uint64(DIM)):
            extent[0, axis] = min(extent[0, axis], rows[i, axis])
            extent[1, axis] = max(extent[1, axis], rows[i, axis])


def _assign_marks(i, cells, lowest, highest, spatial, contacts, eulerian, own_contacts, own_eulerian):
    """Write the marks of each particle's cell to the particle, and clear the cell's marks."""
    cell = np.uint64(cells[i])
    own_contacts[i], own_eulerian[i] = contacts[cell], eulerian[cell] != 0
    lowest[cell], highest[cell], spatial[cell] = np.uint32(NO_BODY), np.uint32(0), np.uint8(0)


def _choose_unwrapped(rows, eulerian, bodies, indices, inverse_edge, rounds, contacts, spatial):
    """Write the results of `Selection.choose` for particles `indices`, with cells that do not wrap round (template).

    `rounds`: 2 where neighbours of those near an Eulerian particle are near, too, else 1
    """
    count, cells = len(indices), 0
    codes, cell = np.zeros(count, np.int64), np.empty(count, np.int64)
    keys, marks, copies = np.empty(count, np.int64), np.empty((count, 3), np.int64), np.empty((count, 3), np.int64)
    for k in range(count):
        for f in range(DIM):
            codes[k] |= np.int64(np.floor(rows[indices[k], f] * inverse_edge)) % APART << BITS * f
    order = np.argsort(codes)
    for k in range(count):
        i = indices[order[k]]
        if k == 0 or codes[order[k]] != keys[cells - 1]:
            keys[cells] = codes[order[k]]
            marks[cells, 0], marks[cells, 1], marks[cells, 2] = NO_BODY, 0, 0
            cells += 1
        entry = marks[cells - 1]
        entry[0], entry[1], entry[2] = min(entry[0], bodies[i]), max(entry[1], bodies[i]), max(entry[2], eulerian[i])
        cell[order[k]] = cells - 1
    for stage in range(rounds):
        for c in range(cells):
            copies[c] = marks[c]
            for shift in range(3**DIM):
                code, digits = np.int64(0), shift
                for f in range(DIM):
                    code |= ((keys[c] >> BITS * f) + digits % 3 - 1) % APART << BITS * f
                    digits //= 3
                row = np.searchsorted(keys[:cells], code)
                if row < cells and keys[row] == code:
                    if stage == 0:
                        copies[c, 0] = min(copies[c, 0], marks[row, 0])
                        copies[c, 1] = max(copies[c, 1], marks[row, 1])
                    copies[c, 2] = max(copies[c, 2], marks[row, 2])
        marks[:cells] = copies[:cells]
    for k in range(count):
        entry = marks[cell[k]]
        contacts[indices[k]], spatial[indices[k]] = entry[0] != entry[1], entry[2] != 0


def _mark_near(cell, nx, ny, nz, lowest, highest, spatial, contacts, spatial_near):
    """Find the occupied cells that have another body, or an Eulerian particle, in or beside them."""
    if lowest[cell] == np.uint32(NO_BODY):
        spatial_near[cell] = np.uint8(0)
        return
    low, high, eulerian, place = lowest[cell], highest[cell], spatial[cell], place_of(cell, nx, nz)
    for shift in range(np.uint64(3**DIM)):
        neighbour = adjacent_cell(place, shift, nx, ny, nz)
        low, high, eulerian = min(low, lowest[neighbour]), max(high, highest[neighbour]), eulerian | spatial[neighbour]
    contacts[cell] = low != high
    spatial_near[cell] = eulerian


def _widen(cell, nx, ny, nz, lowest, marks, result):
    """Mark in `result` the occupied cells that are marked in `marks` or adjacent to a marked cell."""
    if lowest[cell] == np.uint32(NO_BODY):
        return
    mark, place = marks[cell], place_of(cell, nx, nz)
    for shift in range(np.uint64(3**DIM)):
        mark |= marks[adjacent_cell(place, shift, nx, ny, nz)]
    result[cell] = mark


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
        self._no_eulerian = np.zeros(count, np.uint8)
        self._locate = chunk_loop(specialise(_locate, DIM=dim), CHUNK, short=True)
        self._assign_marks = particle_loop(specialise(_assign_marks), short=True)
        self._mark_near = particle_loop(specialise(_mark_near, DIM=dim), short=True)
        self._widen = particle_loop(specialise(_widen, DIM=dim), short=True)
        self._choose_unwrapped = specialise(_choose_unwrapped, parallel=False, DIM=dim)

    def fit(self, position: np.ndarray) -> None:
        """Fit the grid to particles at `position` (n, dim) [m]."""
        self.grid = Grid.from_positions(position, self.grid.edge, CELLS)
        size = self.grid.shape[0] * self.grid.shape[1] * self.grid.shape[2]
        self._lowest, self._highest = np.full(size, NO_BODY, np.uint32), np.zeros(size, np.uint32)
        self._spatial = np.zeros(size, np.uint8)
        self._contacts, self._spatial_near = np.zeros(size, bool), np.zeros(size, np.uint8)
        self._wide_marks = np.zeros(size, np.uint8)

    def choose(self, rows: np.ndarray, eulerian: np.ndarray, bodies: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return which particles are near another body, and which near an Eulerian particle (n,), bool.

        The selection does not depend on the periodicity of the cell grid.

        `rows`: packed rows (n or more, width), position first
        `eulerian`: (n,) uint8, 1 for Eulerian particles
        `bodies`: body of each particle (n,) uint32
        """
        count, edge, sizes = len(bodies), self.grid.edge, self.grid.sizes
        cells, euler = self._find(rows, eulerian, bodies), self._spatial_near
        if self._with_neighbours:
            self._widen(len(self._lowest), *sizes, self._lowest, euler, self._wide_marks)
            euler = self._wide_marks
        contact, spatial = np.empty((2, count), bool)
        self._assign_marks(count, cells, *self._marks, self._contacts, euler, contact, spatial)
        if self._wraps():
            ids = np.flatnonzero(contact | spatial)
            self._choose_unwrapped(rows, eulerian, bodies, ids, 1.0 / edge, 1 + self._with_neighbours, contact, spatial)
        return contact, spatial

    def _find(self, rows: np.ndarray, eulerian: np.ndarray, bodies: np.ndarray) -> np.ndarray:
        """Return the cell of each row (n,), and mark the cells with other bodies or Eulerian particles in or beside."""
        count = len(bodies)
        if len(self._cells) < count:
            self._cells = np.zeros(count + count // 4, np.uint32)
        cells = self._cells[:count]
        self._extents = np.empty((-(-count // CHUNK), 2, self._dim))
        self._marks = self._lowest, self._highest, self._spatial
        self._locate(count, rows, 1.0 / self.grid.edge, *self.grid.sizes, eulerian, bodies, cells, self._extents,
                     *self._marks)  # fmt: skip
        self._mark_near(len(self._lowest), *self.grid.sizes, *self._marks, self._contacts, self._spatial_near)
        return cells

    def _wraps(self) -> bool:
        """Return whether particles have spread so far that one cell of the grid represents several places."""
        lower, upper = self._extents[:, 0].min(axis=0), self._extents[:, 1].max(axis=0)
        low, high = np.floor(np.array([lower, upper]) * (1.0 / self.grid.edge))
        # two cells more: the outermost cells need empty neighbours
        return not (high - low + 3.0 <= self.grid.shape[: self._dim]).all()

    def near_other_bodies(self, rows: np.ndarray, bodies: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
        """Return particles within `reach` [m] of another body, and their neighbours; cells wrap round."""
        self.grid.edge = reach
        count = len(bodies)
        if len(self._no_eulerian) < count:
            self._no_eulerian = np.zeros(count + count // 4, np.uint8)
        cells = self._find(rows, self._no_eulerian, bodies)
        self._widen(len(self._lowest), *self.grid.sizes, self._lowest, self._contacts.view(np.uint8), self._wide_marks)
        contacts, others = np.empty((2, count), bool)
        self._assign_marks(count, cells, *self._marks, self._contacts, self._wide_marks, contacts, others)
        others &= ~contacts
        return np.flatnonzero(contacts), np.flatnonzero(others)
