"""Which particles a pass over current neighbours concerns: those near another body or an Eulerian particle.

Cells of the kernel's reach are marked with the bodies and Eulerian particles that they hold. Cells wrap
round, so a particle may be chosen in vain, but none that has such a neighbour is missed.
"""

from __future__ import annotations

import numpy as np

from hvisph.core.jit import prange, specialise
from hvisph.sph.cells import Grid, wrapped

CHUNK = 1024
NO_BODY = 0xFFFFFFFF


def _mark(rows, eulerian, bodies, inverse_edge, nx, ny, nz, cells, lowest, highest, spatial):
    lowest[:] = np.uint32(NO_BODY)
    highest[:] = np.uint32(0)
    spatial[:] = np.uint8(0)
    for i in range(np.uint64(cells.shape[0])):
        cell = wrapped(rows[i, 0], inverse_edge, nx)
        if DIM > 1:
            cell += nx * wrapped(rows[i, 1], inverse_edge, ny)
        if DIM > 2:
            cell += nx * ny * wrapped(rows[i, 2], inverse_edge, nz)
        cells[i] = cell
        lowest[cell] = min(lowest[cell], bodies[i])
        highest[cell] = max(highest[cell], bodies[i])
        spatial[cell] |= eulerian[i]


def _beside(cx, cy, cz, shift, nx, ny, nz):
    """Return the cell that lies `shift`, 0 to 3**DIM - 1, from the one at (cx, cy, cz): in the middle itself."""
    one, three = np.uint64(1), np.uint64(3)
    x = (cx + shift % three + nx - one) & (nx - one)
    y = (cy + (shift // three) % three + ny - one) & (ny - one) if DIM > 1 else cy
    z = (cz + shift // (three * three) + nz - one) & (nz - one) if DIM > 2 else cz
    return x + nx * (y + ny * z)


def _spread(nx, ny, nz, lowest, highest, spatial, meets, spatial_near):
    """Find the occupied cells that have another body, or an Eulerian particle, in or beside them."""
    count = np.uint64(lowest.shape[0])
    for chunk in prange((count + np.uint64(CHUNK - 1)) // np.uint64(CHUNK)):
        first, one = np.uint64(chunk) * np.uint64(CHUNK), np.uint64(1)
        for cell in range(first, min(first + np.uint64(CHUNK), count)):
            if lowest[cell] == np.uint32(NO_BODY):
                spatial_near[cell] = np.uint8(0)
                continue
            cx, cy, cz = cell & (nx - one), (cell // nx) & (ny - one), cell // (nx * ny)
            low, high, euler = lowest[cell], highest[cell], spatial[cell]
            for shift in range(np.uint64(3**DIM)):
                at = beside(cx, cy, cz, shift, nx, ny, nz)
                low, high, euler = min(low, lowest[at]), max(high, highest[at]), euler | spatial[at]
            meets[cell] = low != high
            spatial_near[cell] = euler


def _widen(nx, ny, nz, near, wider):
    """Mark the cells that are, or lie beside, one that is marked in `near`."""
    count = np.uint64(near.shape[0])
    for chunk in prange((count + np.uint64(CHUNK - 1)) // np.uint64(CHUNK)):
        first, one = np.uint64(chunk) * np.uint64(CHUNK), np.uint64(1)
        for cell in range(first, min(first + np.uint64(CHUNK), count)):
            cx, cy, cz = cell & (nx - one), (cell // nx) & (ny - one), cell // (nx * ny)
            beside_one = near[cell]
            for shift in range(np.uint64(3**DIM)):
                beside_one |= near[beside(cx, cy, cz, shift, nx, ny, nz)]
            wider[cell] = beside_one


class Selection:
    """Chooses particles by what is near them.

    Parameters
    ----------
    position
        Positions at the start (n, dim) [m], for the grid's extent.
    bodies
        Body of each particle (n,).
    reach
        Distance within which others count as near [m].
    with_neighbours
        Whether the neighbours of those near an Eulerian particle are chosen, too: their corrections
        need them.
    """

    def __init__(self, position: np.ndarray, bodies: np.ndarray, reach: float, with_neighbours: bool = False):
        count, dim = position.shape
        self.grid = Grid.around(position, reach)
        self.bodies = bodies.astype(np.uint32)
        size = self.grid.shape[0] * self.grid.shape[1] * self.grid.shape[2]
        self._cells = np.zeros(count, np.uint32)
        self._lowest, self._highest = np.zeros(size, np.uint32), np.zeros(size, np.uint32)
        self._spatial = np.zeros(size, np.uint8)
        self._meets, self._spatial_near = np.zeros(size, bool), np.zeros(size, np.uint8)
        self._wider = np.zeros(size, np.uint8)
        self._with_neighbours = with_neighbours
        self._nowhere = np.zeros(count, np.uint8)
        self._mark = specialise(_mark, parallel=False, DIM=dim)
        beside = specialise(_beside, DIM=dim)
        self._spread = specialise(_spread, parallel=True, DIM=dim, beside=beside)
        self._widen = specialise(_widen, parallel=True, DIM=dim, beside=beside)

    def choose(self, rows: np.ndarray, eulerian: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the indices of the particles near another body, and of those near an Eulerian one or such.

        Parameters
        ----------
        rows
            Packed rows (n or more, width), position first.
        eulerian
            (n,) uint8, 1 for Eulerian particles.
        """
        sizes = self.grid.sizes
        self._mark(rows, eulerian, self.bodies, 1.0 / self.grid.edge, *sizes, self._cells, self._lowest, self._highest,
                   self._spatial)  # fmt: skip
        self._spread(*sizes, self._lowest, self._highest, self._spatial, self._meets, self._spatial_near)
        near = self._spatial_near
        if self._with_neighbours:
            self._widen(*sizes, near, self._wider)
            near = self._wider
        return np.flatnonzero(self._meets[self._cells]), np.flatnonzero(near[self._cells])

    def near_other_bodies(self, rows: np.ndarray, bodies: np.ndarray, reach: float) -> np.ndarray:
        """Return the indices of the particles within `reach` [m] of another body, and of their neighbours."""
        self.grid.edge = reach
        sizes, count = self.grid.sizes, len(rows)
        if len(self._nowhere) < count:
            self._nowhere = np.zeros(count + count // 4, np.uint8)
            self._cells = np.zeros(count + count // 4, np.uint32)
        cells = self._cells[:count]
        self._mark(rows, self._nowhere, bodies, 1.0 / reach, *sizes, cells, self._lowest, self._highest,
                   self._spatial)  # fmt: skip
        self._spread(*sizes, self._lowest, self._highest, self._spatial, self._meets, self._spatial_near)
        self._widen(*sizes, self._meets.view(np.uint8), self._wider)
        return np.flatnonzero(self._wider[cells])
