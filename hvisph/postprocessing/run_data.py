"""Runs in Python: snapshots, history, summary, and progress, from the files of their folders."""

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from html import escape
from pathlib import Path
from typing import Any, overload

import numpy as np

from hvisph.casefile.document import formulation, symmetry_axes
from hvisph.core.errors import CaseError, OutputError, suggest_nearest
from hvisph.core.fields import component_names
from hvisph.core.measure_catalogue import axis_unit, format_time
from hvisph.core.text import Plain, PlainMapping
from hvisph.measures.measure import measure
from hvisph.measures.result import Result
from hvisph.measures.tables import rows
from hvisph.output.reader import list_snapshots, read_history, read_snapshot, read_summary, snapshots_at
from hvisph.output.snapshot import Snapshot
from hvisph.visualization.particles import Look, Moment, draw, usual_view, view_picture


def open_run(path: str | os.PathLike[str]) -> "OpenRun":
    """Return a run's folder as an object; raises `CaseError` where there is none."""
    return OpenRun(Path(path))


class State(Snapshot):
    """A snapshot that becomes a table or a picture."""

    def to_dataframe(self) -> Any:
        """Return all particles as a pandas DataFrame: a row each, vectors and tensors by component, SI."""
        columns: dict[str, np.ndarray] = {
            "id": self.id,
            "body": np.array(self.bodies, dtype=object)[self.body],
            "material": np.array(self.materials, dtype=object)[self.material],
        }
        for name, values in self.fields.items():
            parts = values.reshape(self.count, -1)
            names = component_names(name, self.dimensions)
            if len(names) != parts.shape[1]:
                names = [f"{name}_{k}" for k in range(parts.shape[1])]
            columns |= {column: parts[:, k] for k, column in enumerate(names)}
        return _pandas().DataFrame(columns).set_index("id")

    def plot(self, field: str = "speed", **look: Any) -> Any:
        """Return a matplotlib figure of all particles; options as of `hvisph.visualization.particles.Look`."""
        moment = moment_of(self)
        return draw([moment], Look(field, **{"view": usual_view(moment)} | look))

    def __repr__(self) -> str:
        return f"<state at t = {self.time:.6g} s, step {self.step}: {self.count} particles in {self.dimensions}D>"


class Summary(Mapping[str, Any]):
    """A run's summary: a mapping, and measures as attributes with `value`, `unit`, `uncertainty`, `reason`."""

    def __init__(self, content: PlainMapping):
        self._content = content
        self._measures = dict(content.get("measures", {}))

    def __getitem__(self, key: str) -> Any:
        return self._content[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._content)

    def __len__(self) -> int:
        return len(self._content)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        if name in self._measures:
            return Value.from_dict(self._measures[name])
        if name in self._content:
            return self._content[name]
        raise AttributeError(f"the summary has no '{name}'; it has {', '.join(dir(self))}")

    def __dir__(self) -> list[str]:
        return sorted({*self._measures, *self._content})


class Value(Result):
    """A measure that is a number and reads as a text."""

    def __float__(self) -> float:
        return float("nan") if self.value is None else float(self.value)

    def __repr__(self) -> str:
        if self.value is None:
            return f"- ({self.reason})"
        spread = f" ± {self.uncertainty:.2g}" if self.uncertainty else ""
        return f"{self.value:.6g}{spread} {self.unit}".rstrip()


class OpenRun:
    """A run's folder: ``run[-1]`` is its last state; ``run.history`` and ``run.summary`` are its records.

    `path`: the folder of a run, ended or not, or of another code's snapshots.
    Raises `CaseError` when there is no such folder.
    """

    def __init__(self, path: Path):
        if not path.is_dir():
            raise CaseError(f"there is no run at {path}")
        self.path = path

    @property
    def files(self) -> list[Path]:
        """The snapshots in order of time, those written since included."""
        return list_snapshots(self.path)

    def __len__(self) -> int:
        return len(self.files)

    @overload
    def __getitem__(self, index: int) -> State: ...

    @overload
    def __getitem__(self, index: slice) -> list[State]: ...

    def __getitem__(self, index: int | slice) -> State | list[State]:
        files = self.files
        if isinstance(index, slice):
            return [_state(file) for file in files[index]]
        return _state(files[index])

    def __iter__(self) -> Iterator[State]:
        return (_state(file) for file in self.files)

    def state_at(self, time: float) -> State:
        """Return the state nearest to a time [s]."""
        return min(self, key=lambda state: abs(state.time - time))

    @property
    def history(self) -> Any:
        """The history as a pandas DataFrame over time, or as arrays by name where pandas is not installed."""
        columns = read_history(self.path)
        try:
            return _pandas().DataFrame(columns).set_index("time")
        except CaseError:
            return columns

    @cached_property
    def summary(self) -> Summary:
        """Summary of a finished run; measures of the present state of an unfinished one."""
        try:
            return Summary(read_summary(self.path))
        except OutputError:
            return Summary(measure(self.path).as_dict())

    def plot(self, field: str = "speed", **look: object) -> Any:
        """Return a matplotlib figure of the last state; options as of `hvisph.visualization.particles.Look`."""
        return self[-1].plot(field, **look)

    def report(self, path: str | os.PathLike[str] | None = None) -> Path:
        """Write the run's report and return its file."""
        from hvisph.visualization.html.report import report

        return report([self.path], path)

    def __dir__(self) -> list[str]:
        return ["files", "history", "path", "plot", "report", "state_at", "summary"]

    def __repr__(self) -> str:
        return f"<run {self.path}: {len(self)} snapshots, {self.summary.get('status', 'not ended')}>"

    def _repr_html_(self) -> str:
        summary = self.summary
        results = {name: getattr(summary, name) for name in summary.get("measures", {})}
        defined = [row for row in rows(results, summary.get("expected", [])) if row.value != "-"]
        cells = [[escape(text) for text in (row.label, row.value, row.expected)] for row in defined]
        lines = "".join(f"<tr><td>{'</td><td>'.join(row)}</td></tr>" for row in cells)
        head = f"<b>{escape(str(summary.get('title', self.path.name)))}</b><br>{escape(str(summary.get('answer', '')))}"
        return f"{head}<table><tr><th>measure</th><th>value</th><th>expected</th></tr>{lines}</table>"


def _state(file: Path) -> State:
    return State(**vars(read_snapshot(file)))


def _pandas() -> Any:
    from importlib import import_module

    try:
        return import_module("pandas")
    except ImportError:
        raise CaseError("needs pandas: pip install pandas") from None


COLUMNS = ("kinetic_energy", "internal_energy", "centre_pressure", "dt", "energy_drift")


@dataclass(frozen=True)
class RunProgress:
    """State of a run."""

    status: str  # ``running`` or how it ended
    progress: str  # time, steps and step in words
    histories: Mapping[str, list[float]] = field(default_factory=dict)
    measures: PlainMapping = field(default_factory=dict)  # plain measures of the newest snapshot, or of the summary
    answer: str = ""
    ended: bool = False
    snapshots: int = 0


def run_progress(folder: Path) -> RunProgress:
    """Return the state of a run from the files that exist."""
    history: Mapping[str, np.ndarray] = {}
    summary: Plain = {}
    count, measures, answer = 0, {}, ""
    with suppress(OutputError):
        history = read_history(folder)
    with suppress(OutputError):
        count = len(list_snapshots(folder))
    with suppress(OutputError):
        summary = read_summary(folder)
    columns = {name: [v for v in history[name] if str(v)] for name in COLUMNS if name in history}  # not empty
    histories = {name: [float(v) for v in values] for name, values in columns.items() if values}
    progress = "nothing is written yet"
    if len(history.get("time", ())):
        time, step, dt, criterion = (history[name][-1] for name in ("time", "step", "dt", "criterion"))
        progress = f"t = {float(time):.4g} s, step {int(step)}, next {float(dt):.3g} s, limited by {criterion}"
    if summary:
        answer = str(summary.get("answer") or "")
        return RunProgress(summary["status"], progress, histories, summary["measures"], answer, True, count)
    if count > 1:
        with suppress(OutputError, CaseError):  # the newest snapshot may be unfinished
            measured = measure(folder)
            measures, answer = measured.as_dict()["measures"], measured.answer
    return RunProgress("running, or cut off", progress, histories, measures, answer, False, count)


def shown_moments(
    path: Path, at: Sequence[float] | str | None, with_names: bool, bodies: Sequence[str] | None = None
) -> list[Moment]:
    """Return moments `at` times [s], ``all`` or the last of a run, or of a file, titled by the run where `with_names`.

    Raises `CaseError` when there is no such run, body or snapshot; `OutputError` when one is damaged.
    """
    if not path.exists():
        raise CaseError(f"there is no run at {path}")
    return [moment_of(_part(snapshot, bodies), path.name if with_names else "") for snapshot in snapshots_at(path, at)]


def _part(snapshot: Snapshot, bodies: Sequence[str] | None) -> Snapshot:
    """Return the particles of the bodies with these names alone."""
    if bodies is None:
        return snapshot
    for name in bodies:
        if name not in snapshot.bodies:
            raise CaseError(f"there is no body '{name}'{suggest_nearest(name, snapshot.bodies)}", where="--bodies")
    return snapshot.part(np.isin(snapshot.body, [snapshot.bodies.index(name) for name in bodies]))


def draw_last_states(runs: Mapping[str, Path], path: Path, field: str) -> Path:
    """Draw the last states of runs (folders, or snapshots, by name) side by side, coloured by a field, and store it."""
    moments = [moment_of(next(snapshots_at(source, None)), name) for name, source in runs.items()]
    return view_picture(moments, path, Look(field, view=usual_view(moments[0])))


def moment_of(snapshot: Snapshot, name: str = "") -> Moment:
    """Return a snapshot to show, with its name, and below it time, spacing and formulation, in its title."""
    unitless = snapshot.metadata.get("units") == "none"
    parts = []
    parts.append(f"t = {snapshot.time:.4g}" if unitless else f"t = {format_time(snapshot.time, '.2f')}")
    spacing = snapshot.metadata.get("spacing")
    if isinstance(spacing, float):
        unit, factor = axis_unit("mm", [spacing])
        parts.append(f"dx = {spacing:.3g}" if unitless else f"dx = {spacing * factor:.3g} {unit}")
    case = snapshot.metadata.get("case")
    parts.append(formulation(case))
    words = ", ".join(part for part in parts if part)
    return Moment(snapshot, symmetry_axes(case), f"{name}\n{words}" if name else words)
