"""Halo exchange: rows of other processes within the interaction distance, sent at every evaluation."""

from collections.abc import Sequence

import numpy as np

from hvisph.compiler.jit import specialise
from hvisph.sph.neighbours.ghost_rows import Plane

from .world import MpiProcesses


def _box(rows, box):
    """Write the bounding box of `rows`, lower bounds first."""
    for axis in range(np.uint64(DIM)):
        low, high = np.inf, -np.inf
        for i in range(np.uint64(rows.shape[0])):
            low, high = min(low, rows[i, axis]), max(high, rows[i, axis])
        box[axis], box[np.uint64(DIM) + axis] = low, high


def _choose(rows, box, edge, indices):
    """Write the indices of the rows within `edge` of `box`; return their number."""
    n = np.uint64(0)
    for i in range(np.uint64(rows.shape[0])):
        inside = True
        for axis in range(np.uint64(DIM)):
            x = rows[i, axis]
            inside &= (x >= box[axis] - edge) & (x <= box[np.uint64(DIM) + axis] + edge)
        indices[n] = i
        n += np.uint64(inside)
    return n


def _pack(rows, numbers, indices, width, table):
    """Write the first `width` slots of the rows `indices`, followed by their numbers."""
    for k in range(np.uint64(indices.shape[0])):
        i = np.uint64(indices[k])
        for f in range(np.uint64(width)):
            table[k, f] = rows[i, f]
        table[k, np.uint64(width)] = np.float64(numbers[i])


class Halo:
    """Rows of other processes behind the own; behind `planes` of symmetry the interaction distance doubles."""

    def __init__(self, world: MpiProcesses, dim: int, width: int, planes: Sequence[Plane] = ()):
        self._world, self._dim, self._width, self._planes = world, dim, width, planes
        self._storage = np.zeros((0, width))
        self._numbers = np.zeros(0, np.uint64)
        self._indices = np.zeros(0, np.uint32)
        self._lists: dict[int, np.ndarray] = {}
        self._received_rows: dict[int, slice] = {}
        self._find_box = specialise(_box, parallel=False, DIM=dim)
        self._choose = specialise(_choose, parallel=False, DIM=dim)
        self._pack = specialise(_pack, parallel=False)
        self.evaluations = self.received_count = 0

    def append(self, rows: np.ndarray, numbers: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
        """Return rows and numbers followed by those of other processes within `reach` [m]."""
        world, dim, local_count, width = self._world, self._dim, len(rows), min(self._width, rows.shape[1])
        extent = np.empty(2 * dim + 1)
        self._find_box(rows, extent[:-1])
        extent[-1] = self._distance_beyond_planes(rows, reach)
        boxes = world.gather_all(extent)
        reach = reach + 2.0 * float(boxes[:, -1].max())
        if len(self._indices) < local_count + 1:
            self._indices = np.zeros(local_count + local_count // 4 + 1, np.uint32)
        distance = np.maximum(boxes[:, :dim] - extent[dim:-1], extent[:dim] - boxes[:, dim:-1])
        tables: dict[int, np.ndarray] = {}
        self._lists = {}
        for rank in map(int, np.flatnonzero((distance <= reach).all(axis=1))):
            if rank == world.rank or not local_count:
                continue
            count = int(self._choose(rows, boxes[rank, :-1], reach, self._indices))
            if count:
                indices = self._indices[:count].copy()
                table = np.empty((count, width + 1))
                self._pack(rows, numbers, indices, width, table)
                tables[rank], self._lists[rank] = table, indices
        received = world.exchange_tables(tables, width + 1)
        received_count = sum(map(len, received.values()))
        self.evaluations, self.received_count = self.evaluations + 1, self.received_count + received_count
        all_rows, all_numbers = self._enlarged_storage(rows, numbers, local_count + received_count)
        self._received_rows, first = {}, local_count
        for rank, table in sorted(received.items()):
            last = first + len(table)
            all_rows[first:last, :width], all_numbers[first:last] = table[:, :-1], table[:, -1]
            self._received_rows[rank], first = slice(first, last), last
        return all_rows, all_numbers

    def _distance_beyond_planes(self, rows: np.ndarray, reach: float) -> float:
        """Return the sum of the distances of rows beyond planes of symmetry [m]."""
        distance = 0.0
        for axis, coordinate, side in ((plane.axis, plane.at, plane.side) for plane in self._planes):
            depth = side * (coordinate - rows[:, axis])
            distance += float(depth[depth < reach].max(initial=0.0))
        return distance

    def _enlarged_storage(self, rows: np.ndarray, numbers: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return storage for `count` rows and numbers that begins with the given ones."""
        local_count = len(rows)
        if count > len(self._storage) or rows.shape[1] != self._storage.shape[1]:
            gap = rows.strides[0] > rows.itemsize * rows.shape[1]  # loops are compiled for one layout
            self._storage = np.zeros((count + count // 4 + 64, rows.shape[1] + gap))[:, : rows.shape[1]]
            self._numbers = np.zeros(len(self._storage), np.uint64)
        if not np.shares_memory(rows, self._storage) or rows.ctypes.data != self._storage.ctypes.data:
            self._storage[:local_count] = rows
        self._numbers[:local_count] = numbers
        return self._storage[:count], self._numbers[:count]

    def refresh(self, sorted_rows: np.ndarray, place: np.ndarray) -> None:
        """Send the same rows again after a pass has changed them."""
        width = self._width
        tables = {rank: np.ascontiguousarray(sorted_rows[place[rows], :width]) for rank, rows in self._lists.items()}
        buffers = {
            rank: np.empty((rows.stop - rows.start, width), sorted_rows.dtype)
            for rank, rows in self._received_rows.items()
        }
        self._world.exchange(tables, buffers)
        for rank, rows in self._received_rows.items():
            sorted_rows[place[rows], :width] = buffers[rank]

    def select_appended(self, indices: np.ndarray) -> None:
        """Declare the rows given to `append` as those with these `indices` of more rows, for `exchange_again`."""
        self._lists = {rank: indices[rows] for rank, rows in self._lists.items()}

    def exchange_again(self, values: np.ndarray) -> np.ndarray:
        """Return `values` (n, ...) of the rows received by the last `append`."""
        tables = {rank: np.ascontiguousarray(values[indices]) for rank, indices in self._lists.items()}
        count = sum(rows.stop - rows.start for rows in self._received_rows.values())
        received = np.empty((count, *values.shape[1:]), values.dtype)
        buffers, first = {}, 0
        for rank, rows in sorted(self._received_rows.items()):
            last = first + rows.stop - rows.start
            buffers[rank], first = received[first:last], last
        self._world.exchange(tables, buffers)
        return received

    def total(self, counts: np.ndarray) -> np.ndarray:
        """Return the sums of integers over all processes."""
        return self._world.total(counts)

    def get_maxima(self, values: np.ndarray) -> np.ndarray:
        """Return the maximum of each float over all processes."""
        return self._world.get_maxima(values)

    def any_process(self, condition: bool) -> bool:
        """Return whether a condition holds on any process."""
        return bool(self._world.total(np.array([int(condition)]))[0])
