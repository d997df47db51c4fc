"""Neighbour lists that last for several steps, for schemes of small steps and several passes.

The list is made by the one traversal with a margin beyond the kernel's reach. It is valid until particles may have
crossed the margin. The kernel is zero for pairs in the margin.

Entries are particle numbers, followed by those of rows of other processes and of images at symmetry planes, and last
the far row, which fills lists up to whole vectors. The lists of a chunk of particles are contiguous.
"""

from __future__ import annotations

import numpy as np

from hvisph.compiler.jit import specialise
from hvisph.compiler.vector.api import EIGHT
from hvisph.sph.kernels import Kernel

from . import cells, traversal
from .ghost_rows import Halo, Images, Plane, make_images
from .particle_layout import RowLayout

# Size allocated for the lists of a chunk, over that needed.
SPARE = 1.3
NO_COEFFICIENTS = np.zeros(1)


def record(indices, n, rows, i, constants, out):
    """Record the neighbours of sorted particle `i` by their numbers in the state (pair law)."""
    entries, order, first, last, sizes, size = out
    chunk = i // np.uint64(CHUNK)
    if i % np.uint64(CHUNK) == np.uint64(0):
        sizes[chunk] = np.uint64(0)
    s = np.uint64(order[i])
    if s >= np.uint64(first.shape[0]):  # an image: nothing is summed for it
        return
    begin = sizes[chunk]
    sizes[chunk] = begin + n
    if begin + n > size:
        return
    begin += chunk * size
    first[s] = begin
    last[s] = begin + n
    for k in range(n):
        entries[begin + k] = order[np.uint64(indices[k])]


class NeighbourList:
    """Lists of neighbours of all particles.

    `kernel`: the smoothing kernel.
    `margin`: largest distance of a neighbour beyond the kernel's reach, over h.
    `positions`, `h`: positions at the start (n, dim) [m] and the largest smoothing length [m].
    `planes`: planes of symmetry.
    It holds:
    `entries`: numbers of neighbours, uint32, those of particle s from first[s] to last[s]: whole vectors.
    `first`, `last`: places in `entries` (n,), uint64.
    `halo`: exchange of rows with other processes; None for one process.
    `images`: images at the planes, numbered after the particles.
    `present`: number of particles and copies: the number of the far row.
    """

    def __init__(self, kernel: Kernel, margin: float, positions: np.ndarray, h: float, planes: tuple[Plane, ...] = ()):
        self.count, self.dim = positions.shape
        self.reach, self.planes = kernel.reach + margin, planes
        self.layout = RowLayout(self.dim, (("x", "vector"), ("h", "scalar")))
        self.halo: Halo | None = None
        self.images: list[Images] = []
        self.entries = np.zeros(0, np.uint32)
        self._grid = cells.Grid.from_positions(positions, self.reach * h)
        self._capacity = 64 * 4 ** (self.dim - 1)
        self._chunk_size = 0
        self._allocated = 0
        law = specialise(record, CHUNK=traversal.CHUNK)
        self._sweep = traversal.loop(self.dim, law)
        self.resize(self.count)

    def resize(self, count: int) -> None:
        """Allocate lists for `count` particles."""
        self.count = count
        self.first, self.last = np.zeros(count, np.uint64), np.zeros(count, np.uint64)
        self._allocate(count)

    def fit_grid(self, positions: np.ndarray) -> None:
        """Fit the cell grid to `positions` (n, dim) [m]."""
        self._grid = cells.Grid.from_positions(positions, self._grid.edge)

    def _allocate(self, count: int) -> None:
        """Allocate work arrays of `count` rows."""
        if count > self._allocated:
            self._allocated = count if count == self.count else count + count // 4
            self._sorted = np.zeros((self._allocated + 1, self.layout.width))
            self._columns = np.zeros((self.dim + 1, self._allocated + EIGHT))
            self._cells = np.zeros(self._allocated, np.uint32)
            self._place = np.zeros(self._allocated, np.uint32)
            self.order = np.zeros(self._allocated + 1, np.uint32)
        self._sorted[count] = 0.0
        self._sorted[count, : self.dim] = traversal.FAR
        self._sorted[count, self.dim] = 1.0
        self.order[count] = count
        self.present = count

    def make(self, positions: np.ndarray, lengths: np.ndarray, h_max: float, numbers: np.ndarray) -> None:
        """Make the lists.

        `positions`, `lengths`, `h_max`, `numbers`: positions (n, dim) and smoothing lengths (n,) [m], the longest of
        all processes, and permanent numbers (n,).
        Raises `RunError` when a particle has too many neighbours to be anything but a collapse.
        """
        rows = np.zeros((self.count, self.layout.width))
        rows[:, : self.dim], rows[:, self.dim] = positions, lengths
        reach, numbers = self.reach * h_max, numbers.astype(np.uint64)
        if self.halo is not None:
            rows, numbers = self.halo.append(rows, numbers, reach)
        self.image_start = len(rows)
        if self.planes:
            images, numbers, self.images = make_images(rows, numbers, self.planes, self.layout, reach)
            rows = np.concatenate([rows, images])
        self._allocate(len(rows))
        n = self.present
        self._grid.edge = reach
        cells.sort(self._grid, rows, numbers, self.dim, self._cells[:n], self.order[:n], self._place[:n],
                   self._sorted[:n], self._columns, self.dim)  # fmt: skip
        chunks = -(-n // traversal.CHUNK)
        sizes = np.zeros(chunks, np.uint64)

        def outputs(capacity: int) -> tuple[object, ...]:
            return self.entries, self.order, self.first, self.last, sizes, np.uint64(self._chunk_size)

        while True:
            if len(self.entries) < chunks * self._chunk_size:
                self.entries = np.zeros(chunks * self._chunk_size, np.uint32)
            self._capacity = traversal.complete_sweep(self._sweep, self._sorted, self._columns, self.order, (n, n),
                                                      self._grid, self.reach, NO_COEFFICIENTS, self._capacity,
                                                      outputs)  # fmt: skip
            demand = int(sizes.max())
            if demand <= self._chunk_size:
                return
            self._chunk_size = int(SPARE * demand) // EIGHT * EIGHT
