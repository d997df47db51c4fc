"""Output of distributed particles slab by slab, so that no process stores all of them.

The first process requests slices of arrays; the others answer in `serve`.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from hvisph.core.fields import transform_arrays
from hvisph.output.snapshot import Snapshot

from .world import SingleProcess

# Largest number of particles gathered on one process for a file; rows of a slab.
MOST_GATHERED, SLAB = 10_000_000, 1 << 20


@dataclass
class Slabs:
    """Rows of all processes in one order; of this one `arrays`, computed on request, and their `positions` (n,)."""

    world: SingleProcess
    arrays: Mapping[str, np.ndarray]
    positions: np.ndarray
    count: int
    _order: np.ndarray = field(init=False, repr=False)
    _cached: tuple[str, np.ndarray] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._order = np.argsort(self.positions)
        self.positions = self.positions[self._order]
        self._cached = "", self.positions

    def get_array(self, name: str) -> Any:
        """Return an array over all processes, on the first."""
        return SlabArray(self, name, self._local_array(name))

    def _local_array(self, name: str) -> np.ndarray:
        """Return an array of this process, cached until another one is requested."""
        if self._cached[0] != name:
            self._cached = name, self.arrays[name]
        return self._cached[1]

    def fetch(self, name: str, begin: int, end: int) -> np.ndarray:
        """Return rows of an array over all processes, on the first; the others answer in `serve`."""
        self.world.broadcast_from_first(lambda: (name, begin, end))
        return self._answer(name, begin, end)

    def _answer(self, name: str, begin: int, end: int) -> np.ndarray:
        first, last = np.searchsorted(self.positions, (begin, end))
        rows = self._local_array(name)[self._order[first:last]]
        positions, values = self.world.gather_rows(self.positions[first:last]), self.world.gather_rows(rows)
        result = np.empty_like(values)
        result[positions - begin] = values
        return result

    def serve(self) -> None:
        """Answer requests of the first process until it has finished."""
        while request := self.world.broadcast_from_first(lambda: None):
            self._answer(*request)

    @contextmanager
    def open(self) -> "Iterator[Slabs | None]":
        """Open the arrays for reading on the first process while the others serve."""
        if not self.world.first:
            self.serve()
            yield None
            return
        yield self
        self.world.broadcast_from_first(lambda: None)  # ends `serve` of the others


class SlabArray:
    """Array over all processes that is fetched by slices; `like` has its shape and type."""

    def __init__(self, slabs: Slabs, name: str, sample: np.ndarray):
        self._slabs, self._name = slabs, name
        self.shape, self.dtype = (slabs.count, *sample.shape[1:]), sample.dtype
        self._slab, self._begin = np.zeros((0, *sample.shape[1:]), sample.dtype), 0

    def __len__(self) -> int:
        return self.shape[0]

    def astype(self, dtype: np.dtype | type) -> "SlabArray":
        """Return the array converted to another type."""
        result = SlabArray(self._slabs, self._name, self._slab[:0])
        result.dtype = np.dtype(dtype)
        return result

    def __getitem__(self, rows: slice | np.ndarray) -> np.ndarray:
        if isinstance(rows, np.ndarray):
            return self._read_rows(rows)
        begin, end, step = rows.indices(len(self))
        if step != 1:
            raise IndexError("an array of the whole is fetched by slices of neighbouring rows")
        pieces = []
        while begin < end:
            if not self._begin <= begin < self._begin + len(self._slab):
                self._begin = begin // SLAB * SLAB
                self._slab = self._slabs.fetch(self._name, self._begin, min(self._begin + SLAB, len(self)))
            last = min(end, self._begin + len(self._slab))
            pieces.append(self._slab[begin - self._begin : last - self._begin])
            begin = last
        return np.concatenate([self._slab[:0], *pieces]).astype(self.dtype, copy=False)

    def _read_rows(self, rows: np.ndarray) -> np.ndarray:
        """Return rows by their increasing positions (k,)."""
        pieces = [self[0:0]]
        for begin in range(0, len(self), SLAB):
            first, last = np.searchsorted(rows, (begin, begin + SLAB))
            if last > first:
                pieces.append(self[begin : begin + SLAB][rows[first:last] - begin])
        return np.concatenate(pieces)

    def __array__(self, dtype: np.dtype | None = None, copy: bool | None = None) -> np.ndarray:
        return self[:].astype(dtype or self.dtype, copy=False)


@dataclass
class Moment:
    """Output time of a run: all particles on the first process, or slabs to fetch them from."""

    snapshot: Snapshot | None
    slabs: Slabs | None = None

    @contextmanager
    def open(self) -> Iterator[Snapshot | None]:
        """Open the arrays for reading on the first process while the others serve."""
        if self.slabs is None:
            yield self.snapshot
            return
        with self.slabs.open():
            yield self.snapshot


def load_arrays(snapshot: Snapshot, keep: bool = False) -> Snapshot:
    """Return a snapshot with its arrays in memory; its fields are loaded on request unless `keep`."""

    def array(values: np.ndarray) -> np.ndarray:
        return np.asarray(values)

    body, material, number = map(array, (snapshot.body, snapshot.material, snapshot.id))
    fields = transform_arrays(snapshot.fields, lambda _, values: array(values))
    return replace(snapshot, fields=dict(fields) if keep else fields, body=body, material=material, id=number)
