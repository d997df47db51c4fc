"""Progress of a run, from its files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hvisph.core.errors import CaseError, OutputError
from hvisph.measures.measure import measure
from hvisph.output.reader import list_snapshots, read_history, read_summary

COLUMNS = ("kinetic_energy", "internal_energy", "centre_pressure", "dt", "energy_drift")


@dataclass(frozen=True)
class RunProgress:
    """State of a run.

    Parameters
    ----------
    status
        ``running`` or how it ended.
    progress
        Time, steps and step in words.
    histories
        Columns of the history by name.
    measures
        Plain measures of the newest snapshot, or of the summary.
    answer
        Verdict on the layers.
    ended
        Whether there is a summary.
    snapshots
        How many there are.
    """

    status: str
    progress: str
    histories: Mapping[str, list[float]] = field(default_factory=dict)
    measures: Mapping[str, Any] = field(default_factory=dict)
    answer: str = ""
    ended: bool = False
    snapshots: int = 0


def run_progress(folder: Path) -> RunProgress:
    """Return the state of a run; raises `OutputError` for damaged files."""
    history = _history(folder)
    summary = _summary(folder)
    count = _count(folder)
    histories = {name: _numbers(history[name]) for name in COLUMNS if name in history}
    histories = {name: values for name, values in histories.items() if values}
    progress = "nothing is written yet"
    if len(history.get("time", ())):
        progress = (f"t = {float(history['time'][-1]):.4g} s, step {int(history['step'][-1])}, "
                    f"next {float(history['dt'][-1]):.3g} s, limited by {history['criterion'][-1]}")  # fmt: skip
    if summary:
        answer = str(summary.get("answer") or "")
        return RunProgress(summary["status"], progress, histories, summary["measures"], answer, True, count)
    measures: Mapping[str, Any] = {}
    answer = ""
    if count > 1:
        try:
            measured = measure(folder)
            measures, answer = measured.as_dict()["measures"], measured.answer
        except (OutputError, CaseError):  # the newest is being written, say
            measures = {}
    return RunProgress("running, or cut off", progress, histories, measures, answer, False, count)


def _history(folder: Path) -> Mapping[str, np.ndarray]:
    try:
        return read_history(folder)
    except OutputError:
        return {}


def _summary(folder: Path) -> dict[str, Any]:
    try:
        return read_summary(folder)
    except OutputError:
        return {}


def _count(folder: Path) -> int:
    try:
        return len(list_snapshots(folder))
    except OutputError:
        return 0


def _numbers(column: np.ndarray) -> list[float]:
    try:
        return [float(value) for value in column]
    except ValueError:  # empty cells
        return [float(value) for value in column if value]
