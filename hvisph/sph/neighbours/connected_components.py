"""Connected components of a body: particles linked within the kernel support.

Components that are separated by more than the kernel's reach do not interact. From then on they are separate bodies,
between which contact acts when they touch again. Components of fewer than `SMALLEST` particles remain part of their
body.

Particles of one cell, and of two cells that share a face, are always connected, as cells are small enough. The
remaining pairs of groups are searched particle by particle.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from hvisph.compiler.jit import CompiledFunction, inline, specialise
from hvisph.compiler.parallel_for import particle_loop
from hvisph.compiler.tensors import dot, row_vector, subtract

from .cells import Grid, adjacent_cell, count_and_place, find_cells, place_of

# Particles of the smallest component that becomes a body: three a side.
SMALLEST = {1: 3, 2: 9, 3: 27}


def label_components(
    position: np.ndarray, lengths: np.ndarray, reach: float, bodies: np.ndarray, pieces: np.ndarray, numbers: np.ndarray
) -> np.ndarray:
    """Return the component number of each particle (n,).

    When a component separates, its largest part keeps the number (of equal parts that of the lowest particle number).
    Other parts of at least `SMALLEST` particles receive the next free numbers, ordered by their lowest particle
    numbers.

    `position`, `lengths`: positions (n, dim) and smoothing lengths (n,) [m]
    `reach`: reach of the kernel in smoothing lengths
    `bodies`, `pieces`, `numbers`: body, present component and permanent number of each particle (n,)
    """
    next_number, result, additions = int(pieces.max(initial=0)) + 1, pieces, []
    for body in np.unique(bodies):
        rows = np.flatnonzero(bodies == body)
        link = reach * float(lengths[rows].max())
        roots = connect_components(np.ascontiguousarray(position[rows]), pieces[rows].astype(np.uint32), link)
        _, first, group = np.unique(roots, return_index=True, return_inverse=True)
        if len(first) == len(np.unique(pieces[rows])):
            continue
        sizes, labels = np.bincount(group), pieces[rows[first]]
        minima = np.full(len(sizes), np.iinfo(np.int64).max)
        np.minimum.at(minima, group, numbers[rows].astype(np.int64))
        order = np.lexsort((minima, -sizes, labels))
        mask = np.zeros(len(sizes), bool)
        mask[order[np.unique(labels[order], return_index=True)[1]]] = True
        components = np.flatnonzero(~mask & (sizes >= SMALLEST[position.shape[1]]))
        additions += [(int(body), int(minima[component]), rows[group == component]) for component in components]
    if additions:
        result = pieces.copy()
        for number, (_, _, rows) in enumerate(sorted(additions, key=lambda part: part[:2]), next_number):
            result[rows] = number
    return result


def connect_components(position: np.ndarray, labels: np.ndarray, link: float) -> np.ndarray:
    """Return the root of each component (n,): particles nearer than `link` [m] of equal `labels` (n,)."""
    count, dim = position.shape
    grid = Grid.from_positions(position, link / np.sqrt(dim + 3.0))
    cells, order, parent = np.zeros(count, np.uint32), np.zeros(count, np.uint32), np.arange(count)
    find, place, link_near, search, flatten = _loops(dim)
    find(len(cells), position, 1.0 / grid.edge, *grid.sizes, cells)
    place(cells, grid.starts, order)
    link_near(position, labels, cells, grid.starts, order, *grid.sizes, link * link, parent)
    flatten(parent)
    roots = np.flatnonzero(parent == np.arange(count))
    ascending = roots[np.argsort(np.bincount(parent, minlength=count)[roots], kind="stable")]
    largest = np.zeros(int(labels.max(initial=0)) + 1, np.int64)
    largest[labels[ascending]] = ascending  # of each label the last counts
    mask = (parent != largest[labels]).astype(np.uint8)
    if mask.any():
        grid = Grid.from_positions(position, link)
        find(len(cells), position, 1.0 / grid.edge, *grid.sizes, cells)
        place(cells, grid.starts, order)
        search(position, labels, cells, grid.starts, order, *grid.sizes, link * link, mask, parent)
        flatten(parent)
    return parent


@inline
def root_of(parent, i):
    """Return the root of `i` in the forest of connected particles."""
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@inline
def merge_roots(parent, i, j):
    """Connect `i` and `j` under the smaller of their roots."""
    a, b = root_of(parent, i), root_of(parent, j)
    parent[max(a, b)] = min(a, b)
    return min(a, b)


def _link_near(position, labels, cells, starts, order, nx, ny, nz, link2, parent):
    """Connect each particle with one of its cell, and with one of each adjacent cell along an axis."""
    for i in range(position.shape[0]):
        x, place = row_vector(position, i, 0, DIM), place_of(np.uint64(cells[i]), nx, nz)
        for side in range(DIM + 1):
            shift = (3**DIM - 1) // 2 + (3 ** (side - 1) if side > 0 else 0)
            cell = adjacent_cell(place, np.uint64(shift), nx, ny, nz)
            for k in range(np.int64(starts[cell]), np.int64(starts[cell + np.uint64(1)])):
                j = np.int64(order[k])
                if j != i and labels[j] == labels[i]:
                    dx = subtract(x, row_vector(position, j, 0, DIM))
                    if dot(dx, dx) < link2:
                        merge_roots(parent, i, j)
                        break


def _search(position, labels, cells, starts, order, nx, ny, nz, link2, mask, parent):
    """Connect the particles in `mask` with all neighbours."""
    for i in range(position.shape[0]):
        if mask[i] == 0:
            continue
        root = root_of(parent, i)
        x, place = row_vector(position, i, 0, DIM), place_of(np.uint64(cells[i]), nx, nz)
        for shift in range(np.uint64(3**DIM)):
            cell = adjacent_cell(place, shift, nx, ny, nz)
            for k in range(np.int64(starts[cell]), np.int64(starts[cell + np.uint64(1)])):
                j = np.int64(order[k])
                if labels[j] != labels[i] or root_of(parent, j) == root:
                    continue
                dx = subtract(x, row_vector(position, j, 0, DIM))
                if dot(dx, dx) < link2:
                    root = merge_roots(parent, i, j)


def _flatten(parent):
    for i in range(parent.shape[0]):
        parent[i] = root_of(parent, i)


@cache
def _loops(dim: int) -> tuple[CompiledFunction, ...]:
    return (
        particle_loop(specialise(find_cells, DIM=dim)),
        specialise(count_and_place, parallel=False),
        specialise(_link_near, parallel=False, DIM=dim),
        specialise(_search, parallel=False, DIM=dim),
        specialise(_flatten, parallel=False),
    )
