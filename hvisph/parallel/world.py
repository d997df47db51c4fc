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
    peers = 1  # processes of this machine, this one included

    def __init__(self) -> None:
        self.waiting_time = 0.0
        self.messages = self.sent_rows = 0

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

    def gather_objects(self, value: object) -> list[Any]:
        """Return a small object of every process."""
        return [value]

    def gather_rows(self, rows: np.ndarray) -> np.ndarray:
        """Return the rows of all processes in order of rank on the first process; empty on the others."""
        return rows

    def scatter_rows(self, rows: np.ndarray | None, indices: list[np.ndarray] | None) -> np.ndarray:
        """Distribute those rows of `rows` (n, ...) from the first process that `indices` lists for each."""
        assert rows is not None
        assert indices is not None
        return np.asarray(rows[indices[0]])

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
        self._mpi, self._communicator = MPI, communicator
        self.rank, self.size = communicator.rank, communicator.size
        self._machine = communicator.Split_type(MPI.COMM_TYPE_SHARED)
        self.peers = self._machine.size

    def _wait_for(self, call: Callable[[], T]) -> T:
        start = time.perf_counter()
        result = call()
        self.waiting_time += time.perf_counter() - start
        return result

    def total(self, values: np.ndarray) -> np.ndarray:
        sums = np.empty_like(values)
        self._wait_for(lambda: self._communicator.Allreduce(np.ascontiguousarray(values), sums, self._mpi.SUM))
        return sums

    def get_maxima(self, values: np.ndarray) -> np.ndarray:
        maxima = np.empty(values.shape)
        operands = np.where(np.isnan(values), np.inf, values).astype(float)
        self._wait_for(lambda: self._communicator.Allreduce(operands, maxima, self._mpi.MAX))
        return maxima

    def gather_all(self, values: np.ndarray) -> np.ndarray:
        table = np.empty((self.size, len(values)), values.dtype)
        self._wait_for(lambda: self._communicator.Allgather(np.ascontiguousarray(values), table))
        return table

    def gather_objects(self, value: Any) -> list[Any]:
        return list(self._wait_for(lambda: self._communicator.allgather(value)))

    def gather_rows(self, rows: np.ndarray) -> np.ndarray:
        local_rows = np.ascontiguousarray(rows)
        counts = self.gather_all(np.array([len(local_rows)]))[:, 0]
        if self.rank:
            self._send(local_rows, 0)
            return local_rows[:0]
        all_rows = np.empty((int(counts.sum()), *local_rows.shape[1:]), local_rows.dtype)
        all_rows[: len(local_rows)] = local_rows
        ends = np.cumsum(counts)
        for rank in range(1, self.size):
            self._receive(all_rows[ends[rank - 1] : ends[rank]], rank)
        return all_rows

    def _send(self, rows: np.ndarray, rank: int) -> None:
        for piece in _pieces(rows):
            self._wait_for(lambda piece=piece: self._communicator.Send(piece, rank, 1))  # type: ignore[misc]

    def _receive(self, rows: np.ndarray, rank: int) -> None:
        for piece in _pieces(rows):
            self._wait_for(lambda piece=piece: self._communicator.Recv(piece, rank, 1))  # type: ignore[misc]

    def scatter_rows(self, rows: np.ndarray | None, indices: list[np.ndarray] | None) -> np.ndarray:
        form = None if rows is None or indices is None else (rows.shape[1:], rows.dtype.str, [len(w) for w in indices])
        shape, dtype, counts = self.broadcast_from_first(lambda: form or ((), "", [0]))
        if rows is None or indices is None:
            local_rows = np.empty((counts[self.rank], *shape), dtype)
            self._receive(local_rows, 0)
            return local_rows
        for rank in range(1, self.size):
            self._send(rows[indices[rank]], rank)
        return np.asarray(rows[indices[0]])

    def broadcast_from_first(self, make: Callable[[], T]) -> T:
        result: Any = None
        if self.first:
            try:
                result = (make(), None)
            except Exception as error:
                result = (None, error)
        value, failure = self._wait_for(lambda: self._communicator.bcast(result))
        if failure is not None:
            failure.shared = True  # see `end_together`
            raise failure
        return cast(T, value)

    def exchange_tables(self, tables: dict[int, np.ndarray], width: int) -> dict[int, np.ndarray]:
        sent_counts, received_counts = np.zeros(self.size, np.int64), np.empty(self.size, np.int64)
        for rank, table in tables.items():
            sent_counts[rank] = len(table)
        self._wait_for(lambda: self._communicator.Alltoall(sent_counts, received_counts))
        received = {int(rank): np.empty((received_counts[rank], width)) for rank in np.flatnonzero(received_counts)}
        self.exchange({rank: table for rank, table in tables.items() if len(table)}, received)
        return received

    def exchange(self, tables: dict[int, np.ndarray], buffers: dict[int, np.ndarray]) -> None:
        """Send tables to processes by rank, and receive those of known sizes."""
        requests = [self._communicator.Irecv(table, rank, 3) for rank, table in buffers.items()]
        requests += [self._communicator.Isend(table, rank, 3) for rank, table in tables.items()]
        self._wait_for(lambda: self._mpi.Request.Waitall(requests))
        self.messages += len(tables)
        self.sent_rows += sum(map(len, tables.values()))

    def prepare_per_machine(self, prepare: Callable[[], None]) -> None:
        if not self._machine.rank:
            prepare()
        self._wait_for(self._communicator.Barrier)

    @contextmanager
    def raise_together(self) -> Iterator[None]:
        local_error: Exception | None = None
        try:
            yield
        except Exception as error:
            local_error = error
        errors: list[Any] = [entry for entry in self.gather_objects(local_error) if entry is not None]
        if errors:
            failure: Any = local_error or errors[0]
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
            text = error if isinstance(error, HvisphError) else f"{type(error).__name__}: {error}"
            if type(error).__module__.partition(".")[0] == "mpi4py":
                text = f"another process is out of reach, it may have been killed ({error}); go on with: hvisph resume"
            print(f"error: on process {self.rank} of {self.size}: {text}", file=sys.stderr, flush=True)  # noqa: T201
            if not isinstance(error, HvisphError):
                traceback.print_exc()
            self._communicator.Abort(code)


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
        reason = str(error).splitlines()[0]
        raise CaseError(
            f"started as one of {size} processes, but MPI cannot be used here ({reason}): {INSTALL}; without it each "
            "of them would run the whole case"
        ) from error
    comm = MPI.COMM_WORLD
    if comm.size != size:
        library = MPI.Get_library_version().splitlines()[0].strip()
        fault = f"the launcher started {size} processes, but MPI sees {comm.size}: mpi4py uses another MPI than the"
        raise CaseError(f"{fault} launcher's ({library}); take the `mpiexec` of that one, or {INSTALL}")
    world = MpiProcesses(comm)
    builds = world.gather_objects(build_id())
    if len(set(builds)) > 1:
        other = next(rank for rank, build in enumerate(builds) if build != builds[0])
        raise CaseError(
            f"the processes would not compute the same bits: process 0 has {builds[0]}, process {other} has "
            f"{builds[other]}; set NUMBA_CPU_NAME and NUMBA_CPU_FEATURES alike on all, or take machines of one kind"
        )
    return world
