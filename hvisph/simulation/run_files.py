"""Files of a run: case, history, snapshots and checkpoints, each on its schedule; the summary at its end."""

import time as wall
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path

import numba

from hvisph import __version__
from hvisph.case.case import Case
from hvisph.casefile.loader import case_hash
from hvisph.core.errors import HvisphError, OutputError
from hvisph.core.text import Plain
from hvisph.diagnostics.budgets import Budget, Observer
from hvisph.output import file_names
from hvisph.output.checkpoint_file import write_checkpoint
from hvisph.output.history import HistoryWriter
from hvisph.output.reader import list_snapshots, read_history, read_snapshot
from hvisph.output.run_folder import RunFolder, SilentFolder
from hvisph.output.snapshot import Snapshot
from hvisph.parallel.parallel_output import Moment, load_arrays
from hvisph.setup.build import build

from .checkpoint import CheckpointContent, CheckpointSchedule, Files
from .clock import Clock, TimeStep
from .listener import Listener
from .settling import settle
from .writer import SnapshotWriter


class RunFiles:
    """Writer of a run's files.

    `folder`: the run's folder.
    `case`, `text`: the effective case and its text.
    `writer`, `observer`, `clock`: snapshots, the records of the history, and the time.
    It holds:
    `state`: how far the files are, for checkpoints.
    """

    def __init__(
        self, folder: RunFolder, case: Case, text: str, writer: SnapshotWriter, observer: Observer, clock: Clock
    ):
        self.folder, self.writer, self.state = folder, writer, Files()
        self._text, self._observer, self._clock = text, observer, clock
        self._cadence = CheckpointSchedule(case.output.checkpoint_every)
        self._full_every = case.output.full_every
        self._writes = not isinstance(folder, SilentFolder)
        self.history: HistoryWriter | None = None  # of the process that writes

    def write_case(self) -> None:
        """Write the effective case."""
        head = f"{file_names.CASE_HEAD} {__version__}; hash {case_hash(self._text)}\n"
        self.folder.write_text(file_names.CASE, head + self._text)

    def begin(self, start: Moment) -> AbstractContextManager[object]:
        """Write the first snapshot; return the new history, closed by the caller."""
        with start.open() as snapshot:
            if snapshot is None:
                return nullcontext()
            self.writer.delete_after(-1)
            self.writer.write(snapshot, 0)
        self.history = HistoryWriter(self.folder.history_path, self._observer.columns)
        return self.history

    def resume(self) -> AbstractContextManager[object]:
        """Shorten the files to the checkpoint and return the history; `OutputError` where it ends before that."""
        if not self._writes:
            return nullcontext()
        self.history = HistoryWriter.resume(self.folder.history_path, self._observer.columns, self._clock.steps)
        if self.history.last_step != self.state.recorded:
            fault = f"cannot go on with {self.history.path}: it ends with step {self.history.last_step}, and the"
            raise OutputError(f"{fault} checkpoint was made after that of step {self.state.recorded}; it is damaged")
        self.write_case()
        self.writer.delete_after(self._clock.outputs)
        return self.history

    def record(self, time_step: TimeStep, limiting: int, length: float, budget: Budget) -> None:
        """Add a record: next step, limiting particle, length of the last step, budget."""
        clock = self._clock
        self.state.recorded = clock.steps
        record = self._observer.record(clock.steps, clock.time, length, time_step.criterion, limiting, budget)
        if self.history is not None:
            self.history.append(record)

    def write_output(self, moment: Moment, number: int) -> None:
        """Write the snapshot of an output time, on the first process."""
        with moment.open() as snapshot:
            if snapshot is None:
                return
            self.writer.write(snapshot, number, whole=self._clock.is_finished)
        if number % self._full_every == 0 or self._clock.is_finished:
            self.state.written = snapshot.time
        self.folder.log.write(f"snapshot {number} at {snapshot.time:.6g} s, step {snapshot.step}")

    def write_last(self, failed: bool) -> Callable[[], Snapshot] | None:
        """Write the final state, under its own name after a failure; return its source."""
        with self.writer.snapshot(self._clock.time, self._clock.steps).open() as final:
            if final is None:
                return None
            number: int | str = file_names.POST_MORTEM if failed else self._clock.outputs
            if isinstance(number, int) and self._clock.time != self.state.written:
                number += 1
            if number != self._clock.outputs:
                self.writer.write(final, number)
            self.writer.write_series()
            if not self.writer.exact:
                copy = load_arrays(final, keep=True)
                return lambda: copy
        path = self.writer.path(number)
        return lambda: read_snapshot(path, lazily=True)

    def checkpoint_due(self) -> bool:
        """Return whether a checkpoint is due."""
        return self._writes and self._cadence.due

    def checkpoint(self, checkpoint_content: CheckpointContent, time_step: TimeStep, wall_seconds: float) -> None:
        """Write a checkpoint after all records up to it."""
        start = wall.monotonic()
        self.state.wall_seconds = wall_seconds
        if self.history is not None:
            self.history.sync()
        with checkpoint_content.capture(time_step) as checkpoint:
            if checkpoint is not None:
                write_checkpoint(self.folder.checkpoint_path, checkpoint)
        self._cadence.record(start)


@dataclass
class Outcome:
    """Outcome of a run."""

    folder: Path  # the run's folder
    summary: Plain  # the content of its ``summary.json``
    exit_code: int  # 0 done and as expected, 1 missed an expectation, 3 failed, 130 interrupted, 143 terminated
    signal: str = ""  # name of the signal that stopped it, empty if none did


def exit_code_of(status: str, summary: Plain, signal: int) -> int:
    """Return the exit code of a run from its `status`, and the `signal` that interrupted it."""
    if status == "interrupted":
        return 128 + signal
    if status == "failed":
        return HvisphError.exit_code
    return 0 if all(row["passed"] for row in summary["expected"]) else 1


def measure_end(
    case: Case, text: str, writer: SnapshotWriter, final: Snapshot, record: Plain, listener: Listener, origin: Plain
) -> Plain:
    """Write and return the summary by the run's files, with warnings; `record` as for `summarise`."""
    from hvisph.diagnostics.summary import summarise  # all that measures: nothing of it is needed to begin

    folder = writer.folder
    summary = summarise(
        case,
        text,
        **record,
        threads=numba.get_num_threads(),
        start=_start(case, text, writer),
        now=final,
        history=read_history(folder.path),
        snapshots=list_snapshots(folder.path),
    )
    summary |= {"start": origin} if origin else {}
    folder.write_json(file_names.SUMMARY, summary)
    ending = f"{record['status']} at {record['time']:.6g} s after {record['steps']} steps"
    folder.log.write(f"{ending}, {record['wall_seconds']:.2f} s")
    for remark in summary["remarks"]:
        folder.log.write(f"remark: {remark}")
        listener.message(f"remark: {remark}")
    return summary


def _start(case: Case, text: str, writer: SnapshotWriter) -> Snapshot:
    """Return the first snapshot from its file, or from the case when the file is missing or incomplete."""
    if writer.exact:
        with suppress(OutputError):
            return read_snapshot(writer.path(0), lazily=True)
    setup = build(case)
    setup.stepper.start()
    settle(case, setup)
    start = SnapshotWriter(writer.folder, setup, case, text).start(case.begins).snapshot
    assert start is not None
    return load_arrays(start)
