"""Cell grid: particles sorted into cells, so that neighbours are contiguous runs of rows.

The grid is a torus: cell coordinates are taken modulo a power of two along each axis.
Debris may fly anywhere without growing the grid, and no bounding box is needed; two
particles within the cell edge of each other always lie in the same or adjacent cells,
and the distance test removes what only wraps round.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from hvisph.compiler.jit import CompiledFunction, Options, inline, specialise
from hvisph.compiler.parallel_for import chunk_loop, particle_loop
from hvisph.compiler.tensors import row_vector

CHUNK = 1024
# Rows of cells along y that are numbered together, so that in 3D more neighbours lie in a cache; the least number in a
# grid.
BLOCK = 4
# Number of slots of packed rows that are stored in the sorted rows, behind as many others; 0 for separate packed rows.
PACKED = 0
# Largest value in rows of single precision; units of rows in double precision, which are not read.
LARGEST, NO_UNITS = 1e30, np.zeros(0)


@dataclass
class Grid:
    """Periodic grid of cells: numbers of cells along the axes (powers of two, at least 4) and edge [m].

    The edge is at least the largest distance of neighbours. `undisturbed` (cells,) is 1 where `find_undisturbed` has
    found all rates of a cell to be zero.
    """

    shape: tuple[int, int, int]
    edge: float

    def __post_init__(self) -> None:
        cells = self.shape[0] * self.shape[1] * self.shape[2]
        self.starts = np.zeros(cells + 1, np.uint32)
        self.uniform, self.undisturbed = np.zeros(cells, np.uint8), np.zeros(cells, np.uint8)
        nx, ny, nz = self.shape
        self.sizes = np.uint64(nx), np.uint64(ny), np.uint64(nz)

    @classmethod
    def from_positions(cls, positions: np.ndarray, edge: float, per_particle: int = 4) -> Grid:
        """Return a grid for `positions` (n, dim) [m] with a margin, of `per_particle` cells a particle at most."""
        n, dim = positions.shape
        counts = np.ptp(positions, axis=0) / edge * 1.5 + 4
        shape = [int(2 ** np.ceil(np.log2(w))) for w in counts] + [1] * (3 - dim)
        while shape[0] * shape[1] * shape[2] > max(per_particle * n, 4**dim) and max(shape) > 4:
            shape[int(np.argmax(shape))] //= 2
        return cls((shape[0], shape[1], shape[2]), edge)


@inline
def wrap_cell(x, inverse_edge, count):
    """Return the cell coordinate of `x` along an axis with `count` cells (a power of two)."""
    return np.uint64(np.int64(np.floor(x * inverse_edge))) & (count - np.uint64(1))


@inline
def cell_at(x, inverse_edge, nx, ny, nz):
    """Return the cell coordinates of the position `x`; 0 along unused axes."""
    cx = wrap_cell(x[0], inverse_edge, nx)
    cy = wrap_cell(x[1], inverse_edge, ny) if len(x) > 1 else np.uint64(0)
    cz = wrap_cell(x[2], inverse_edge, nz) if len(x) > 2 else np.uint64(0)
    return cx, cy, cz


@inline
def number_of(cell, nx, nz):
    """Return the number of a cell: they are counted along x, BLOCK rows of y, z, then further rows of y."""
    block = np.uint64(BLOCK)
    return cell[0] + nx * (cell[1] % block + block * (cell[2] + nz * (cell[1] // block)))


@inline
def place_of(cell, nx, nz):
    """Return the coordinates of a cell."""
    block, row = np.uint64(BLOCK), cell // nx
    layer = row // block
    return cell & (nx - np.uint64(1)), row % block + block * (layer // nz), layer & (nz - np.uint64(1))


@inline
def adjacent_cell(place, shift, nx, ny, nz):
    """Return the cell `shift`, 0 to 3**dim - 1 along x, y, z, of those around the one at `place`."""
    one, three = np.uint64(1), np.uint64(3)
    x = (place[0] + shift % three + nx - one) & (nx - one)
    y = (place[1] + (shift // three) % three + ny - one) & (ny - one)
    z = (place[2] + shift // (three * three) + nz - one) & (nz - one)
    return number_of((x, y, z), nx, nz)


def find_cells(i, rows, inverse_edge, nx, ny, nz, cells):
    """Find the cell number of each row (template)."""
    cells[i] = number_of(cell_at(row_vector(rows, i, PACKED, DIM), inverse_edge, nx, ny, nz), nx, nz)


def count_and_place(cells, starts, order):
    """Count the rows of each cell, and sort the rows by cell (template)."""
    n = np.uint64(cells.shape[0])
    one = np.uint64(1)
    starts[:] = 0
    for i in range(n):
        starts[np.uint64(cells[i])] += np.uint32(1)
    total = np.uint32(0)
    for c in range(np.uint64(starts.shape[0])):
        count = starts[c]
        starts[c] = total
        total += count
    for i in range(n):
        cell = np.uint64(cells[i])
        order[np.uint64(starts[cell])] = i
        starts[cell] += np.uint32(1)
    for c in range(np.uint64(starts.shape[0]) - one, np.uint64(0), -1):
        starts[c] = starts[c - one]
    starts[np.uint64(0)] = np.uint32(0)


def _order_and_gather(chunk, n, rows, numbers, cells, starts, order, place, out, columns, h, units):
    """Sort the rows of each cell by their numbers, and gather them (template)."""
    one, first = np.uint64(1), np.uint64(PACKED)
    begin = chunk * np.uint64(CHUNK)
    end = min(begin + np.uint64(CHUNK), n)
    # A chunk sorts the cells that begin in it. Another one may be sorting the cell before these: all its rows have the
    # same cell number, so that reading them meanwhile is safe.
    cell = np.uint64(cells[np.uint64(order[begin])])
    k = begin if np.uint64(starts[cell]) == begin else np.uint64(starts[cell + one])
    while k < end:
        stop = np.uint64(starts[np.uint64(cells[np.uint64(order[k])]) + one])
        for j in range(k + one, stop):
            row = order[j]
            number = numbers[np.uint64(row)]
            slot = j
            while slot > k and numbers[np.uint64(order[slot - one])] > number:
                order[slot] = order[slot - one]
                slot -= one
            order[slot] = row
        for j in range(k, stop):
            i = np.uint64(order[j])
            place[i] = j
            for f in range(np.uint64(PACKED or rows.shape[1])):
                out[j, f] = min(max(rows[i, f] * units[f], -LARGEST), LARGEST) if X_REST else rows[i, first + f]
            if X_REST:
                for f in range(np.uint64(DIM)):
                    out[j, np.uint64(X_REST) + f] = rows[i, f] * units[f] - np.float64(out[j, f])
                    slot_u = np.uint64(U) + f
                    out[j, np.uint64(U_REST) + f] = rows[i, slot_u] * units[slot_u] - np.float64(out[j, slot_u])
            for f in range(np.uint64(DIM)):
                columns[f, j] = rows[i, first + f]
            columns[DIM, j] = rows[i, first + h]
        k = stop


def find_uniform(c, starts, order, limit, rows, zero, equal, uniform):
    """Set `uniform[c]` to 1 if all rows of cell `c` are zero in the slots `zero` and agree in the slots `equal`.

    Rows whose number before sorting is `limit` or above count as different.
    """
    begin, end = np.uint64(starts[c]), np.uint64(starts[c + np.uint64(1)])
    uniform[c] = 1
    for j in range(begin, end):
        if np.uint64(order[j]) >= limit:
            uniform[c] = 0
            return
        for k in range(np.uint64(zero.shape[0])):
            if rows[j, np.uint64(zero[k])] != 0.0:
                uniform[c] = 0
                return
        for k in range(np.uint64(equal.shape[0])):
            if rows[j, np.uint64(equal[k])] != rows[begin, np.uint64(equal[k])]:
                uniform[c] = 0
                return


def find_surrounded(c, starts, rows, equal, nx, ny, nz, uniform, surrounded):
    """Set `surrounded[c]` to 1 if `c` has rows, and it and those around it are `uniform`, empty ones apart."""
    begin = np.uint64(starts[c])
    surrounded[c] = uniform[c] if begin < np.uint64(starts[c + np.uint64(1)]) else 0
    if surrounded[c] == 0:
        return
    place = place_of(c, nx, nz)
    for shift in range(np.uint64(3**DIM)):
        cell = adjacent_cell(place, shift, nx, ny, nz)
        first = np.uint64(starts[cell])
        if first < np.uint64(starts[cell + np.uint64(1)]):
            if uniform[cell] == 0:
                surrounded[c] = 0
                return
            for k in range(np.uint64(equal.shape[0])):
                if rows[first, np.uint64(equal[k])] != rows[begin, np.uint64(equal[k])]:
                    surrounded[c] = 0
                    return


def find_undisturbed(
    grid: Grid, order: np.ndarray, limit: int, rows: np.ndarray, zero: np.ndarray, equal: np.ndarray, dim: int
) -> None:
    """Mark the cells whose particles have no rates, as no wave and no other body is near.

    Within two cells around, all rows are zero in some slots (stresses) and agree in others (velocity, body). Every pair
    law then sums zeros, in one cell around as well, so that leaving the cell out changes no result.

    `grid`: its `undisturbed` is written; `sort` has been called
    `order`, `limit`: numbers (n,) of the rows before sorting; from `limit` on they belong to other processes, whose
      further neighbours are not here
    `rows`: sorted rows (n, width)
    `zero`, `equal`: slots (k,) uint64 of the rows
    """
    uniform, surrounded = _rest_loops(dim)
    count = len(grid.uniform)
    uniform(count, grid.starts, order, np.uint64(limit), rows, zero, equal, grid.uniform)
    surrounded(count, grid.starts, rows, equal, *grid.sizes, grid.uniform, grid.undisturbed)
    grid.uniform[:] = grid.undisturbed
    surrounded(count, grid.starts, rows, equal, *grid.sizes, grid.uniform, grid.undisturbed)


def sort(grid: Grid, rows: np.ndarray, numbers: np.ndarray, h_slot: int, cells: np.ndarray, order: np.ndarray,
         place: np.ndarray, out: np.ndarray, columns: np.ndarray, dim: int, units: np.ndarray = NO_UNITS,
         vectors: tuple[int, int, int] = (0, 0, 0), packed: int = 0) -> None:  # fmt: skip
    """Sort `rows` by cell, and within a cell by permanent number.

    Sums over neighbours in this order depend neither on the order of `rows` nor on the shape of the torus.

    `grid`: its `starts` receive the first sorted index of each cell
    `rows`, `numbers`, `h_slot`: packed rows (n, width), position first, their permanent numbers (n,), whole, each once,
      and the slot of the smoothing length
    `cells`, `order`, `place`: work arrays (n,) uint32; `order[k]` becomes the index in `rows` of sorted row k, `place`
      its inverse
    `out`, `columns`: sorted rows (n or more, width), and their positions and smoothing lengths by column, (dim + 1, n +
      8)
    `units`, `vectors`: for sorted rows of float32: factors of the slots of `rows`, and the slots of the velocity and of
      the rounding errors of position and velocity
    `packed`: number of slots of a packed row if these are stored in `out`, which is then given for `rows`, too
    """
    find, count_and_place, order_and_gather = _loops(dim, packed, *vectors)
    find(len(cells), rows, 1.0 / grid.edge, *grid.sizes, cells)
    count_and_place(cells, grid.starts, order)
    order_and_gather(len(order), rows, numbers, cells, grid.starts, order, place, out, columns, np.uint64(h_slot),
                     units)  # fmt: skip


@cache
def _loops(dim: int, packed: int, u: int, x_rest: int, u_rest: int) -> tuple[CompiledFunction, ...]:
    options: Options = {"DIM": dim, "PACKED": packed}
    return (
        particle_loop(specialise(find_cells, **options), short=True),
        specialise(count_and_place, parallel=False),
        chunk_loop(specialise(_order_and_gather, **options, U=u, X_REST=x_rest, U_REST=u_rest), CHUNK, short=True),
    )


@cache
def _rest_loops(dim: int) -> tuple[CompiledFunction, CompiledFunction]:
    return (
        particle_loop(specialise(find_uniform), short=True),
        particle_loop(specialise(find_surrounded, DIM=dim), short=True),
    )
