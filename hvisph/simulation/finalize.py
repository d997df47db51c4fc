"""End of a run: last state and summary."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numba

from hvisph.case.case import Case
from hvisph.core.errors import HvisphError, OutputError
from hvisph.core.text import Plain
from hvisph.output import file_names
from hvisph.output.reader import list_snapshots, read_history, read_snapshot
from hvisph.output.snapshot import Snapshot
from hvisph.setup.build import build

from .listener import Listener
from .settling import settle
from .writer import SnapshotWriter


@dataclass
class Outcome:
    """How a run ended."""

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
    case: Case, text: str, writer: SnapshotWriter, now: Snapshot, ended: Plain, listener: Listener, origin: Plain
) -> Plain:
    """Write and return the summary, measured from the run's files, with its warnings.

    `ended` has the arguments of `summarise` that describe the end of the run, `origin` tells of the one before it.
    """
    from hvisph.diagnostics.summary import summarise  # all that measures: nothing of it is needed to begin

    folder = writer.folder
    summary = summarise(
        case,
        text,
        **ended,
        threads=numba.get_num_threads(),
        start=_start(case, text, writer),
        now=now,
        history=read_history(folder.path),
        snapshots=list_snapshots(folder.path),
    )
    summary |= {"start": origin} if origin else {}
    folder.write_json(file_names.SUMMARY, summary)
    how = f"{ended['status']} at {ended['time']:.6g} s after {ended['steps']} steps"
    folder.log.write(f"{how}, {ended['wall_seconds']:.2f} s")
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
    return start
