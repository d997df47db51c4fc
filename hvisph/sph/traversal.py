"""The one traversal of pairs: every pair law runs inside it.

For each particle, in chunks that threads share: filter the contiguous runs of its 3, 9 or 27
cells into a list of neighbours, fill the list up to whole vectors with a far, massless row, and let the
pair law sum over it in one branch-free loop. Row i is written by i alone, in an order
that does not depend on threads: any number of threads gives the same bits.

A pair law is a module of `hvisph.sph.laws`; `law(near, n, rows, i, constants, out)` is
its loop, bound into the template below by `hvisph.core.jit.specialise`. It reads its neighbours, a
vector at a time, with `hvisph.core.simd.neighbours`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from hvisph.core.errors import RunError
from hvisph.core.jit import prange
from hvisph.core.lanes import LANES
from hvisph.core.simd import append_near
from hvisph.sph import cells
from hvisph.sph.cells import wrapped

CHUNK = 256
FAR = 1e30  # coordinate [m] of the row that pads lists: beyond every kernel, and massless


# A particle with more candidates than this is inside a collapse that no result survives.
MOST_NEIGHBOURS = 200_000


def sweep(rows, columns, n_rows, grid, reach, constants, capacity, out, overflow):
    """Run the pair law over all particles: the template, see the module's text.

    Bound names: DIM, H (slot of the smoothing length) and law.

    Parameters
    ----------
    rows, columns
        Sorted rows (n_rows + 1, width), the last one far away and massless, and the same positions and
        smoothing lengths by column, (dim + 1, n_rows + 8).
    n_rows
        Number of particles, images at symmetry planes included [uint64].
    grid
        First sorted row of each cell, 1 / edge [1/m], numbers of cells [uint64].
    reach
        Support radius of the kernel over h.
    constants
        Coefficients of the law.
    capacity
        Room for the neighbours of a particle [uint64].
    out
        Result rows; the law writes row i alone.
    overflow
        (chunks,) receives the room that a chunk would have needed, 0 where it sufficed.
    """
    half_reach = 0.5 * reach
    starts, inverse_edge, nx, ny, nz = grid
    for chunk in prange((n_rows + np.uint64(CHUNK - 1)) // np.uint64(CHUNK)):
        # Inside the parallel loop: constants from outside would reach its body as arguments in memory.
        zero, one, three, eight = np.uint64(0), np.uint64(1), np.uint64(3), np.uint64(8)
        near = np.empty(capacity + eight, np.uint32)
        needed = zero
        first = np.uint64(chunk) * np.uint64(CHUNK)
        for i in range(first, min(first + np.uint64(CHUNK), n_rows)):
            x = rows[i, 0]
            y = rows[i, 1] if DIM > 1 else 0.0
            z = rows[i, 2] if DIM > 2 else 0.0
            h = rows[i, H]
            cx = wrapped(x, inverse_edge, nx)
            cy = wrapped(y, inverse_edge, ny) if DIM > 1 else zero
            cz = wrapped(z, inverse_edge, nz) if DIM > 2 else zero
            n = zero
            for run in range(np.uint64(3 ** (DIM - 1))):
                ry = (cy + run % three + ny - one) & (ny - one) if DIM > 1 else zero
                rz = (cz + run // three + nz - one) & (nz - one) if DIM > 2 else zero
                base = nx * (ry + ny * rz)
                # Cells cx - 1, cx, cx + 1 in this order across the torus' seam, too: sums do not depend on its shape.
                low = (cx + nx - one) & (nx - one)
                high = cx + one if zero < cx < nx - one else nx - one
                begin = np.uint64(starts[base + low])
                end = np.uint64(starts[base + high + one])
                for segment in range(np.uint64(2)):
                    if segment == one:  # what lies on the other side of the seam
                        if cx == zero:
                            begin = np.uint64(starts[base])
                            end = np.uint64(starts[base + one + one])
                        elif cx == nx - one:
                            begin = np.uint64(starts[base])
                            end = np.uint64(starts[base + one])
                        else:
                            break
                    if n + end - begin > capacity:
                        needed = max(needed, n + end - begin)
                        break
                    for j in range(begin, end, eight):
                        n = append_near(columns, DIM, j, end, i, x, y, z, h, half_reach, near, n)
            for k in range(np.uint64(LANES)):
                near[n + k] = n_rows
            padded = (n + np.uint64(LANES - 1)) & ~np.uint64(LANES - 1)
            law(near, padded, rows, i, constants, out)
        overflow[np.uint64(chunk)] = needed


def complete_sweep(sweep: Any, rows: np.ndarray, columns: np.ndarray, count: int, grid: cells.Grid, reach: float,
                   constants: np.ndarray, capacity: int, room: Callable[[int], Any]) -> int:  # fmt: skip
    """Run a compiled `sweep`, and again with more room while a list of neighbours overflows.

    Parameters
    ----------
    sweep ... constants
        The loop and what it takes, see the template.
    capacity
        Room for the neighbours of a particle to begin with.
    room
        Returns `out` for a capacity.

    Returns
    -------
    The capacity that sufficed.

    Raises
    ------
    RunError
        When a particle has too many neighbours to be anything but a collapse.
    """
    overflow = np.zeros(-(-count // CHUNK), np.uint64)
    cell_table = (grid.starts, 1.0 / grid.edge, *grid.sizes)
    while True:
        sweep(rows, columns, np.uint64(count), cell_table, reach, constants, np.uint64(capacity), room(capacity),
              overflow)  # fmt: skip
        needed = int(overflow.max(initial=0))
        if needed == 0:
            return capacity
        if needed > MOST_NEIGHBOURS:
            raise RunError(f"a particle has more than {MOST_NEIGHBOURS} candidate neighbours: the bodies collapsed")
        capacity = 2 * needed
