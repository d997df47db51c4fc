"""Traversal of pairs, in which every pair law is evaluated.

The particles of a cell share their candidates: particles of its 3, 9 or 27 adjacent cells near the box around them are
copied once. Each particle filters the copy into a list of neighbours, which is filled up to whole vectors with a
distant, massless row. The pair law sums over the list in one loop without branches. Each particle writes its own row
only, and a list follows the cells along x, y and z in rising order: the bits do not depend on the number of threads.

A pair law is a module of `hvisph.schemes` or `hvisph.sph`; `law(indices, n, rows, i, constants, out)` is its loop,
bound into the template below by `loop`. It reads its neighbours, a vector at a time, with
`hvisph.compiler.vector.intrinsics.neighbours`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hvisph.compiler.jit import CompiledFunction, Options, specialise
from hvisph.compiler.parallel_for import chunk_loop
from hvisph.compiler.tensors import column_vector, dot, row_vector
from hvisph.compiler.tensors3d import extend_vector
from hvisph.compiler.vector.api import (
    LANES,
    NUMBERED,
    SINGLES,
    SIXTEEN,
    append_marked,
    append_near_box,
    flush_tiny,
    mark_near,
    restore_mode,
)
from hvisph.core.errors import RunError

from . import cells
from .cells import cell_at, number_of

CHUNK = 256
FAR = 1e30  # coordinate [m] of the row that pads lists: beyond every kernel, and massless
FAR_SINGLE = 1e11  # the same in single precision, in its unit of length: the cube is a number, too
# Pairs beyond this share of the kernel's reach are left out. Their weight is negligible, but if the reach is a multiple
# of the spacing, up to a quarter of the pairs of a lattice lie there.
RIM = 1.0 - 1e-9
ROUND_OFF = 1.0 + 1e-9  # factor of the reach for distances to a box
# Error of a squared distance in single precision over the square of a cell's edge: positions relative to a particle
# within two edges, each rounded by 2^-24.
SLACK = 4e-6


# Use of neighbour lists by the passes of one evaluation: made for one pass, kept for the next, taken from the last.
FORGETS, KEEPS, TAKES = 0, 1, 2
# Placeholder where no lists are kept.
NO_LISTS = np.zeros((0, 0), np.uint32)
# Number of candidates of a particle that indicates a collapse of the particle distribution.
MOST_NEIGHBOURS = 200_000


def enclose(columns, i, end, inverse_edge, box):
    """Find the box around particle `i` and those up to `end` of its cell; return their end and largest length.

    A cell of the torus may hold particles from far apart: those end before the first that is more than an edge away.
    """
    last, h = end, columns[DIM, i]
    for f in range(np.uint64(DIM)):
        for k in range(i, end):
            if abs(columns[f, k] - columns[f, i]) * inverse_edge > 1.0:
                last = min(last, k)
    for f in range(np.uint64(DIM)):
        origin, low, high = columns[f, i], 0.0, 0.0
        for k in range(i, last):
            low, high = min(low, columns[f, k] - origin), max(high, columns[f, k] - origin)
        box[f, 0], box[f, 1], box[f, 2] = origin, 0.5 * (low + high), 0.5 * (high - low)
    for k in range(i, last):
        h = max(h, columns[DIM, k])
    return last, h


def gather(columns, place, grid, box, h, half_reach, capacity, copies):
    """Copy candidates of the particles in the box into `copies`; return their number, and the capacity needed or 0.

    With OWN_REACH also all particles within the longest kernel of the cell, `h`.
    """
    singles, doubles, numbers = copies
    cx, cy, cz = place
    starts, _, nx, ny, nz, _ = grid
    zero, one, two, three, eight = np.uint64(0), np.uint64(1), np.uint64(2), np.uint64(3), np.uint64(8)
    m = demand = zero
    for run in range(np.uint64(3 ** (DIM - 1))):
        ry = (cy + run % three + ny - one) & (ny - one) if DIM > 1 else zero
        rz = (cz + run // three + nz - one) & (nz - one) if DIM > 2 else zero
        base = number_of((zero, ry, rz), nx, nz)
        low = base + cx - one if cx > zero else base + nx - one
        high = base + nx if cx == zero else base + min(cx + two, nx)
        for segment in range(two):
            if segment == one:  # pairs across the periodic boundary of the cell numbers
                low = base
                high = base + two if cx == zero else base + one if cx == nx - one else base
            begin, end = np.uint64(starts[low]), np.uint64(starts[high])
            if m + end - begin > capacity:
                demand = max(demand, m + end - begin)
                continue
            for j in range(begin, end, eight):
                m = append_near_box(columns, DIM, j, end, box, 2.0 * h if OWN_REACH else h, half_reach, numbers, m)
    for f in range(np.uint64(DIM + 1)):
        origin = box[f, 0] if f < np.uint64(DIM) else 0.0
        for k in range(m):
            value = columns[f, np.uint64(numbers[k])]
            doubles[f, k], singles[f, k] = value, np.float32(value - origin)
        for k in range(m, m + np.uint64(SIXTEEN)):
            doubles[f, k], singles[f, k] = (FAR, np.float32(FAR)) if f < np.uint64(DIM) else (0.0, np.float32(0.0))
    return m, demand


def all_rigid(rows, numbers, n):
    """Return whether all `n` rows of these `numbers` belong to rigid bodies."""
    k = np.uint64(0)
    while k < n and rows[np.uint64(numbers[k]), RIGID] < 0.0:
        k += np.uint64(1)
    return k == n


def sweep(chunk, n_rows, rows, columns, order, owned, grid, reach, constants, capacity, lists, out, overflow):
    """Run the pair law over the particles of a chunk (template).

    Bound names: DIM, law, ONLY (slot of a vector: rows where it is zero are left out; 0 for none), LANES (neighbours in
    a vector), UNITS (where the units of results begin in `constants`, 0 for none), SKIPS (whether the results of
    undisturbed cells are set to zero, from column FIRST on, without calling the law), RIGID (with SKIPS, slot that is
    below zero in rows of rigid bodies, which have no results among themselves either; 0 for none), LISTS (FORGETS,
    KEEPS or TAKES) and the templates above.

    Lists are kept for a later pass as long as a chunk has space for them: how many numbers there are, 0 for none; for
    each group its end and the number of its candidates, their numbers, and for each particle a bit a candidate. A
    group has no candidates if it is left out, or if no particle is the caller's own.

    `chunk`, `n_rows`: see `compiler.parallel_for.chunk_loop`
    `rows`, `columns`: sorted rows (n_rows + 1, width), the last one far away and massless, and the same positions and
      smoothing lengths by column, (dim + 1, n_rows + 8)
    `order`: number before sorting of each row
    `owned`: number of rows that are the caller's own, numbered before all others [uint64]: the law is summed for them
      alone. Others are images at symmetry planes
    `grid`: first sorted row of each cell, 1 / edge [1/m], numbers of cells [uint64], and which are undisturbed
    `reach`: support radius of the kernel over h
    `constants`: coefficients of the law
    `capacity`: number of candidates of a cell that fit [uint64]
    `lists`: (n_rows or more, width) uint32: space for the lists of a chunk in its rows. It may be that of `out` when
      lists are taken
    `out`: result rows; the law writes row i alone
    `overflow`: (chunks,) receives the size that a chunk would have needed, 0 where it sufficed
    """
    mode, half_reach = flush_tiny(), 0.5 * RIM * reach
    zero, one, sixteen = np.uint64(0), np.uint64(1), np.uint64(SIXTEEN)
    starts, inverse_edge, nx, ny, nz, undisturbed = grid
    size = capacity + sixteen
    indices, numbers, box = np.empty(size, np.uint32), np.empty(size, np.uint32), np.empty((3, 3))
    singles, doubles = np.empty((DIM + 1, size), np.float32), np.empty((DIM + 1, size))
    slack = SLACK / (inverse_edge * inverse_edge)
    first = chunk * np.uint64(CHUNK)
    last = min(first + np.uint64(CHUNK), n_rows)
    demand, m, group, search, h_max, rest_end = zero, zero, first, False, 0.0, zero
    space = (last - first) * np.uint64(lists.shape[1]) if LISTS else zero
    base, slot, head = first * np.uint64(lists.shape[1]), one, zero
    storage, extent = lists.reshape(-1) if LISTS else numbers, zero
    recording = LISTS == KEEPS
    record = np.empty(space + sixteen, np.uint32) if LISTS == TAKES else numbers
    if LISTS == TAKES:
        extent = np.uint64(storage[base])
        for k in range(extent):
            record[k] = storage[base + k]
    for i in range(first, last):
        if ONLY and not dot(row_vector(rows, i, ONLY, DIM), row_vector(rows, i, ONLY, DIM)) > 0.0:
            group = max(group, i + one)
            continue
        x, h = column_vector(columns, i, DIM), columns[DIM, i]
        if i == group and extent > zero:
            group, m = first + np.uint64(record[slot]), np.uint64(record[slot + one])
            slot += one + one
            for k in range(m):
                numbers[k] = record[slot + k]
            slot += m
            rest_end = group if m == zero else zero
        elif i == group:  # the first of a cell, or of a group in it
            place = cell_at(x, inverse_edge, nx, ny, nz)
            cell = number_of(place, nx, nz)
            end = min(np.uint64(starts[cell + one]), last)
            search = not (SKIPS and undisturbed[cell])
            if search:
                group, h_max = enclose(columns, i, end, inverse_edge, box)
            else:
                group = rest_end = end
            if recording:
                recording = slot + one < space
                if recording:
                    head = base + slot
                    storage[head], storage[head + one] = np.uint32(group - first), np.uint32(0)
                    slot += one + one
        if np.uint64(order[i]) >= owned:
            continue
        if search:
            search = False
            m, shortage = gather(
                columns, place, grid, box, h_max, half_reach * ROUND_OFF, capacity, (singles, doubles, numbers)
            )
            demand = max(demand, shortage)
            if RIGID and all_rigid(rows, numbers, m):
                rest_end = group
            elif recording:
                recording = slot + m <= space
                if recording:
                    storage[head + one] = np.uint32(m)
                    for k in range(m):
                        storage[base + slot + k] = numbers[k]
                    slot += m
        if SKIPS and i < rest_end:
            for f in range(np.uint64(FIRST), np.uint64(out.shape[1])):
                out[i, f] = 0.0
            continue
        n, mark, centre = zero, zero, (*extend_vector(x), h)
        marks = (m + np.uint64(2 * SIXTEEN - 1)) // np.uint64(2 * SIXTEEN)
        recording = recording and slot + marks <= space
        if OWN_REACH and extent == zero:  # shorter lengths are replaced by h, so that the mean is at least h
            for k in range(m):
                length = max(columns[DIM, np.uint64(numbers[k])], h)
                doubles[DIM, k], singles[DIM, k] = length, np.float32(length)
        for k in range(zero, m, sixteen):
            shift = k & sixteen
            if extent > zero:
                bits = np.uint64(record[slot + k // np.uint64(2 * SIXTEEN)]) >> shift  # the lower sixteen count
            else:
                bits = mark_near(singles, doubles, numbers, DIM, k, i, centre, box, half_reach, slack)
            if recording:
                mark = bits if shift == zero else mark | bits << shift
                storage[base + slot + k // np.uint64(2 * SIXTEEN)] = np.uint32(mark)
            n = append_marked(numbers, bits, k, indices, n)
        if recording or extent > zero:
            slot += marks
        if not NUMBERED:
            for k in range(n):
                indices[k] = numbers[np.uint64(indices[k])]
        if RIGID and rows[i, RIGID] < 0.0 and all_rigid(rows, indices, n):
            for f in range(np.uint64(FIRST), np.uint64(out.shape[1])):
                out[i, f] = 0.0
            continue
        for k in range(np.uint64(LANES)):
            indices[n + k] = n_rows
        width = (n + np.uint64(LANES - 1)) & ~np.uint64(LANES - 1)
        law(indices, width, rows, i, constants, out)
        if UNITS:
            for f in range(np.uint64(out.shape[1])):
                out[i, f] *= constants[np.uint64(UNITS) + f]
    if LISTS == KEEPS:
        storage[base] = np.uint32(slot) if recording else np.uint32(0)
    overflow[chunk] = demand
    restore_mode(mode)


def loop(
    dim: int,
    law: CompiledFunction,
    only: int = 0,
    own_reach: bool = False,
    first_result: int | None = None,
    lists: int = FORGETS,
    single: bool = False,
    units: int = 0,
    rigid: int = 0,
) -> CompiledFunction:
    """Return the traversal compiled for a bound law, with the slot of `Pass.only` in rows.

    `own_reach`: whether lists contain all particles within the particle's own kernel. `first_result`: first column
    that the law writes, if undisturbed cells are left out. `lists`: whether it keeps lists or takes those of a pass
    before. `single`: whether rows are of float32. `units`: index of the units of its results in the constants.
    `rigid`: slot of RIGID.
    """
    skips: Options = {"SKIPS": int(first_result is not None), "FIRST": first_result or 0}
    options: Options = {"DIM": dim, "OWN_REACH": int(own_reach), "RIGID": rigid if skips["SKIPS"] else 0}
    parts: Options = {part.__name__: specialise(part, **options) for part in (enclose, gather, all_rigid)}
    options |= skips | {"LISTS": lists, "ONLY": only, "LANES": SINGLES if single else LANES, "UNITS": units}
    return chunk_loop(specialise(sweep, **options, law=law, **parts), CHUNK)


def complete_sweep(
    sweep: CompiledFunction,
    rows: np.ndarray,
    columns: np.ndarray,
    order: np.ndarray,
    counts: tuple[int, int],
    grid: cells.Grid,
    reach: float,
    constants: np.ndarray,
    capacity: int,
    outputs: Callable[[int], object],
    lists: np.ndarray = NO_LISTS,
) -> int:
    """Run a compiled `sweep`, and again with a larger capacity while a list of neighbours overflows.

    sweep ... constants: the loop and what it takes, see the template.
    `capacity`: number of candidates of a cell that fit to begin with.
    `outputs`: returns `out` for a capacity.
    `lists`: space for lists, see the template. A pass that takes lists has at least the capacity that the one before
    had.
    Returns the capacity that sufficed.
    Raises `RunError` when a particle has too many neighbours to be anything but a collapse.
    """
    count, owned = counts
    overflow = np.zeros(-(-count // CHUNK), np.uint64)
    cell_table = (grid.starts, 1.0 / grid.edge, *grid.sizes, grid.undisturbed)
    while True:
        sweep(count, rows, columns, order, np.uint64(owned), cell_table, reach, constants, np.uint64(capacity),
              lists, outputs(capacity), overflow)  # fmt: skip
        if np.count_nonzero(overflow) == 0:
            return capacity
        demand = int(overflow.max())
        if demand > MOST_NEIGHBOURS:
            raise RunError(f"a particle has more than {MOST_NEIGHBOURS} candidate neighbours: the bodies collapsed")
        capacity = 2 * demand
