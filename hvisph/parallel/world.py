"""Communication: `SingleProcess` for one process, `MpiProcesses` by MPI. Only this module imports mpi4py.

Every method but `rank` and `size` is called by all processes, at the same place of the program.
"""

import sys
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar, cast

import numpy as np

from hvisph.compiler.self_test import build_id
from hvisph.core.errors import CaseError, HvisphError

from . import launched_rank

T = TypeVar("T")
MESSAGE = 1 << 28  # largest message [bytes]; MPI may count them in 32 bits
INSTALL = "pip install 'hvisph[mpi]', or mpi4py alone for the MPI that is there"


class SingleProcess:
    """Communication of a single process, which does nothing; time waited [s], messages and rows are counted."""

    rank, size = 0, 1
    beside = 1  # processes of this machine, this one included

    def __init__(self) -> None:
        self.waited = 0.0
        self.messages = self.sent = 0

    @property
    def first(self) -> bool:
        """Whether this is the process that writes."""
        return self.rank == 0

    def total(self, values: np.ndarray) -> np.ndarray:
        """Return the sums of integers over all processes."""
        return values

    def get_maxima(self, values: np.ndarray) -> np.ndarray:
        """Return the maximum of each float over all processes; NaN counts as infinite."""
        return values

    def gather_all(self, values: np.ndarray) -> np.ndarray:
        """Return the values (k,) of all processes, (size, k)."""
        return values[None]

    def gather_objects(self, own: object) -> list[Any]:
        """Return a small object of every process."""
        return [own]

    def gather_rows(self, rows: np.ndarray) -> np.ndarray:
        """Return the rows of all processes in order of rank on the first process; empty on the others."""
        return rows

    def scatter_rows(self, rows: np.ndarray | None, wanted: list[np.ndarray] | None) -> np.ndarray:
        """Distribute the `wanted` rows of `rows` (n, ...) from the first process."""
        assert rows is not None
        assert wanted is not None
        return np.asarray(rows[wanted[0]])

    def broadcast_from_first(self, make: Callable[[], T]) -> T:
        """Return the result of `make` on the first process, or raise its error."""
        return make()

    def exchange_tables(self, tables: dict[int, np.ndarray], width: int) -> dict[int, np.ndarray]:
        """Send tables (n, width) to processes by rank; return those received."""
        return {}

    def prepare_per_machine(self, prepare: Callable[[], None]) -> None:
        """Call `prepare` on the first process of each machine, and wait for all."""

    @contextmanager
    def raise_together(self) -> Iterator[None]:
        """Raise an error on every process when a block without communication fails on any."""
        yield

    @contextmanager
    def end_together(self) -> Iterator[None]:
        """End all processes when one of them leaves the block by an error."""
        yield


class MpiProcesses(SingleProcess):
    """Communication by MPI."""

    def __init__(self, communicator: Any):
        from mpi4py import MPI

        super().__init__()
        self._mpi, self._all = MPI, communicator
        self.rank, self.size = communicator.rank, communicator.size
        self._machine = communicator.Split_type(MPI.COMM_TYPE_SHARED)
        self.beside = self._machine.size

    def _waiting(self, call: Callable[[], T]) -> T:
        began = time.perf_counter()
        result = call()
        self.waited += time.perf_counter() - began
        return result

    def total(self, values: np.ndarray) -> np.ndarray:
        sums = np.empty_like(values)
        self._waiting(lambda: self._all.Allreduce(np.ascontiguousarray(values), sums, self._mpi.SUM))
        return sums

    def get_maxima(self, values: np.ndarray) -> np.ndarray:
        largest = np.empty(values.shape)
        own = np.where(np.isnan(values), np.inf, values).astype(float)
        self._waiting(lambda: self._all.Allreduce(own, largest, self._mpi.MAX))
        return largest

    def gather_all(self, values: np.ndarray) -> np.ndarray:
        table = np.empty((self.size, len(values)), values.dtype)
        self._waiting(lambda: self._all.Allgather(np.ascontiguousarray(values), table))
        return table

    def gather_objects(self, own: Any) -> list[Any]:
        return list(self._waiting(lambda: self._all.allgather(own)))

    def gather_rows(self, rows: np.ndarray) -> np.ndarray:
        own = np.ascontiguousarray(rows)
        counts = self.gather_all(np.array([len(own)]))[:, 0]
        if self.rank:
            self._send(own, 0)
            return own[:0]
        whole = np.empty((int(counts.sum()), *own.shape[1:]), own.dtype)
        whole[: len(own)] = own
        ends = np.cumsum(counts)
        for rank in range(1, self.size):
            self._receive(whole[ends[rank - 1] : ends[rank]], rank)
        return whole

    def _send(self, rows: np.ndarray, rank: int) -> None:
        for piece in _pieces(rows):
            self._waiting(lambda piece=piece: self._all.Send(piece, rank, 1))  # type: ignore[misc]

    def _receive(self, rows: np.ndarray, rank: int) -> None:
        for piece in _pieces(rows):
            self._waiting(lambda piece=piece: self._all.Recv(piece, rank, 1))  # type: ignore[misc]

    def scatter_rows(self, rows: np.ndarray | None, wanted: list[np.ndarray] | None) -> np.ndarray:
        form = None if rows is None or wanted is None else (rows.shape[1:], rows.dtype.str, [len(w) for w in wanted])
        shape, kind, counts = self.broadcast_from_first(lambda: form or ((), "", [0]))
        if rows is None or wanted is None:
            own = np.empty((counts[self.rank], *shape), kind)
            self._receive(own, 0)
            return own
        for rank in range(1, self.size):
            self._send(rows[wanted[rank]], rank)
        return np.asarray(rows[wanted[0]])

    def broadcast_from_first(self, make: Callable[[], T]) -> T:
        result: Any = None
        if self.first:
            try:
                result = (make(), None)
            except Exception as error:
                result = (None, error)
        value, failure = self._waiting(lambda: self._all.bcast(result))
        if failure is not None:
            failure.shared = True  # see `end_together`
            raise failure
        return cast(T, value)

    def exchange_tables(self, tables: dict[int, np.ndarray], width: int) -> dict[int, np.ndarray]:
        going, coming = np.zeros(self.size, np.int64), np.empty(self.size, np.int64)
        for rank, table in tables.items():
            going[rank] = len(table)
        self._waiting(lambda: self._all.Alltoall(going, coming))
        received = {int(rank): np.empty((coming[rank], width)) for rank in np.flatnonzero(coming)}
        self.exchange({rank: table for rank, table in tables.items() if len(table)}, received)
        return received

    def exchange(self, tables: dict[int, np.ndarray], into: dict[int, np.ndarray]) -> None:
        """Send tables to processes by rank, and receive those of known sizes."""
        requests = [self._all.Irecv(table, rank, 3) for rank, table in into.items()]
        requests += [self._all.Isend(table, rank, 3) for rank, table in tables.items()]
        self._waiting(lambda: self._mpi.Request.Waitall(requests))
        self.messages += len(tables)
        self.sent += sum(map(len, tables.values()))

    def prepare_per_machine(self, prepare: Callable[[], None]) -> None:
        if not self._machine.rank:
            prepare()
        self._waiting(self._all.Barrier)

    @contextmanager
    def raise_together(self) -> Iterator[None]:
        own: Exception | None = None
        try:
            yield
        except Exception as error:
            own = error
        errors: list[Any] = [failed for failed in self.gather_objects(own) if failed is not None]
        if errors:
            failure: Any = own or errors[0]
            failure.shared = True  # see `end_together`
            raise failure

    @contextmanager
    def end_together(self) -> Iterator[None]:
        try:
            yield
        except BaseException as error:
            if getattr(error, "shared", False):
                raise
            code = error.exit_code if isinstance(error, HvisphError) else 3
            what = error if isinstance(error, HvisphError) else f"{type(error).__name__}: {error}"
            if type(error).__module__.partition(".")[0] == "mpi4py":
                what = f"another process is out of reach, it may have been killed ({error}); go on with: hvisph resume"
            print(f"error: on process {self.rank} of {self.size}: {what}", file=sys.stderr, flush=True)  # noqa: T201
            if not isinstance(error, HvisphError):
                traceback.print_exc()
            self._all.Abort(code)


def _pieces(rows: np.ndarray) -> Iterator[np.ndarray]:
    """Yield the bytes of contiguous rows in blocks that a message can hold."""
    flat = rows.reshape(-1).view(np.uint8)
    for first in range(0, len(flat), MESSAGE):
        yield flat[first : first + MESSAGE]


def detect_processes() -> SingleProcess:
    """Return the launcher's processes; raises `CaseError` where mpi4py is missing or installations differ."""
    _, size = launched_rank()
    if size == 1:
        return SingleProcess()
    try:
        from mpi4py import MPI
    except (ImportError, RuntimeError) as error:
        why = str(error).splitlines()[0]
        raise CaseError(
            f"started as one of {size} processes, but MPI cannot be used here ({why}): {INSTALL}; without it each of "
            "them would run the whole case"
        ) from error
    here = MPI.COMM_WORLD
    if here.size != size:
        own = MPI.Get_library_version().splitlines()[0].strip()
        fault = f"the launcher started {size} processes, but MPI sees {here.size}: mpi4py uses another MPI than the"
        raise CaseError(f"{fault} launcher's ({own}); take the `mpiexec` of that one, or {INSTALL}")
    world = MpiProcesses(here)
    kinds = world.gather_objects(build_id())
    if len(set(kinds)) > 1:
        other = next(rank for rank, kind in enumerate(kinds) if kind != kinds[0])
        raise CaseError(
            f"the processes would not compute the same bits: process 0 has {kinds[0]}, process {other} has "
            f"{kinds[other]}; set NUMBA_CPU_NAME and NUMBA_CPU_FEATURES alike on all, or take machines of one kind"
        )
    return world
