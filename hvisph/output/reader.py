"""Reading a run: snapshots of either format, the history, the summary and the check of its form.

The functions work on files alone, in any process, while the run continues or after it was killed.
"""

import csv
import io
import json
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hvisph.core.errors import FEW, CaseError, OutputError
from hvisph.core.text import Plain, is_number, sanitize

from . import file_names
from .atomic_write import read_errors
from .foreign import SI, Convention, read_lammps, read_vtk
from .hdf5 import read_hdf5, time_in
from .snapshot import Snapshot
from .verified_hdf5 import SIGNATURE
from .vtu import read_vtu

STATUSES = ("done", "failed", "interrupted")


def _is_number_or_none(value: object) -> bool:
    return value is None or is_number(value)


def _is_count(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 2**63


def _is_text(value: object) -> bool:
    return isinstance(value, str)


# Form of a summary, by key: a test of the value, or the form of a mapping; "*" stands for every key or entry, "*?" for
# optional keys of every entry.
Form = Callable[[object], bool] | Mapping[str, Any]
_MEASURE = dict.fromkeys(("value", "uncertainty"), _is_number_or_none) | {"unit": _is_text}
_OPTIONAL = {"time": _is_number_or_none, "reason": _is_text}
_RESOLUTION = {"resolution": {"spacing": is_number, "support": _is_number_or_none}}
_EXPECTED = dict.fromkeys(("name", "source"), _is_text) | dict.fromkeys(("expected", "tolerance"), is_number)
_SUMMARY: Mapping[str, Form] = {
    "title": _is_text,
    "status": lambda value: value in STATUSES,
    **dict.fromkeys(("end_time", "wall_seconds"), is_number),
    **dict.fromkeys(("particles", "steps", "threads"), _is_count),
    "microseconds_per_particle_step": _is_number_or_none,
    "failure": lambda value: value is None or (isinstance(value, dict) and _is_text(value.get("message"))),
    "measures": {"*": _MEASURE, "*?": _OPTIONAL | _RESOLUTION},
    "conservation": {"*": _is_number_or_none},
    "expected": {"*": _EXPECTED | {"value": _is_number_or_none, "passed": lambda value: isinstance(value, bool)}},
}


def misfit(value: object, form: Form = _SUMMARY, path: str = "") -> str:
    """Return which part of a summary is missing or of another type than hvisph writes; empty if there is none."""
    if callable(form):
        return "" if form(value) else f"its {path} is missing or of the wrong kind"
    entries: Any = value
    if path == "expected":  # a list
        entries = dict(enumerate(value)) if isinstance(value, list) else None
    if not isinstance(entries, dict):
        return f"its {path} has no keys" if path else "it is not a summary"
    parts: Mapping[Any, Any] = dict.fromkeys(entries, form["*"]) if "*" in form else form
    texts = [misfit(entries.get(key, _is_text), part, f"{path}.{key}".lstrip(".")) for key, part in parts.items()]
    for key, entry in entries.items() if "*?" in form else ():
        optional = {name: part for name, part in form["*?"].items() if isinstance(entry, dict) and name in entry}
        texts.append(misfit(entry, optional, f"{path}.{key}"))
    return next(filter(None, texts), "")


# Files of other codes, by how their names end; in a folder of several kinds the first of these is read.
FOREIGN = ("*.vtu", "*.vtp", "*.vtk", "*.dump", "*.lammpstrj", "dump.*")
LARGEST_SUMMARY = 10_000_000  # [bytes]; a thousand times a usual one


def read_snapshot(path: str | Path, convention: Convention = SI, *, lazily: bool = False) -> Snapshot:
    """Read a snapshot by the content of the file, for any name: HDF5 or VTU, or points of another code.

    `path`: HDF5 or VTU; of other codes VTU, VTP, VTK (legacy) and LAMMPS text dumps, of which the last moment is read.
    `lazily`: whether fields of an HDF5 file are read on each access: the file must not change.
    Raises `OutputError` when it is missing, truncated, damaged or of no known kind.
    """
    start = _bytes(Path(path), 64)
    if start.startswith(SIGNATURE):
        convention.refuse_for_own_files()
        return read_hdf5(path, lazily)
    text = start.lstrip(b"\xef\xbb\xbf \t\r\n")
    if text.startswith(b"<"):
        head = _bytes(Path(path), 4096)
        is_vtp = b"PolyData" in head and b"UnstructuredGrid" not in head
        return read_vtk(path, convention, ".vtp") if is_vtp else read_vtu(path, convention)
    if text.startswith(b"# vtk DataFile"):
        return read_vtk(path, convention)
    if text.startswith(b"ITEM:"):
        return read_lammps(path, convention)
    content = "it is empty" if not start else "it is none of HDF5, VTU, VTP, VTK and LAMMPS dump"
    raise OutputError(f"cannot read {path}: {content}")


def read_time(path: str | Path, convention: Convention = SI) -> float:
    """Return the time [s] of a snapshot, of HDF5 without its fields; raises as `read_snapshot`."""
    return time_in(path) if _bytes(Path(path), 64).startswith(SIGNATURE) else read_snapshot(path, convention).time


def list_snapshots(run: str | Path) -> list[Path]:
    """Return the snapshots of a run folder in order of time: its VTKHDF files, or its VTU files if it has none.

    A folder without the sub-folders of a run is searched itself, so that the files of another code can be read. Order
    of time is the order of the numbers in the names. Raises `OutputError` when there is no such folder.
    """
    folder = Path(run)
    if not folder.is_dir():
        raise OutputError(f"cannot read {run}: no such folder")
    native = (f"*{file_names.SNAPSHOT_ENDING}", f"*{file_names.OLD_ENDING}")
    for place, patterns in (
        (folder / file_names.SNAPSHOTS, native),
        (folder / file_names.VTU, ("*.vtu",)),
        (folder, native),
        *((folder, (pattern,)) for pattern in FOREIGN),
    ):
        paths = (path for pattern in patterns for path in place.glob(pattern) if path.name != file_names.TIME_SERIES)
        files = sorted(paths, key=lambda path: _natural(path.name))
        if place.name == file_names.SNAPSHOTS and place.parent == folder:  # a copy that a user keeps there is no moment
            files = [path for path in files if file_names.is_own(path)] or files
        if files:
            return files
    return []


def snapshots_in(run: str | Path) -> list[Path]:
    """Return `list_snapshots`; if there are none, raise `CaseError` with the folder's content and the remedy."""
    files = list_snapshots(run)
    if files:
        return files
    folder = Path(run)
    names = sorted(path.name for path in folder.iterdir() if not path.name.startswith("."))
    if file_names.SUMMARY in names:
        remedy = "a sweep has kept its summary only (`keep`): run its case again"
    elif file_names.CASE in names or file_names.LOG in names:
        remedy = "its run has not written the first; `hvisph run` of the case makes them"
    elif "table.csv" in names:
        remedy = f"it is that of a sweep: give one of {folder / 'runs'}"
    else:
        listing = ", ".join(names[:FEW]) + (f" and {len(names) - FEW} more" if len(names) > FEW else "")
        remedy = f"it holds {listing or 'nothing'}; give the folder that a run made (runs/NAME), or a snapshot"
    raise CaseError(f"{run}: the folder holds no snapshot: {remedy}")


def snapshots_at(path: Path, at: Sequence[float] | str | None) -> Iterator[Snapshot]:
    """Yield a file, or the snapshots nearest to times [s], the last (None) or ``all``; `CaseError` without any."""
    files = [path] if path.is_file() else snapshots_in(path)
    if at is None or at == "all":
        yield from (read_snapshot(file) for file in (files[-1:] if at is None else files))
        return
    times = [read_time(file) for file in files]
    for time in at:
        yield read_snapshot(files[int(np.argmin([abs(moment - float(time)) for moment in times]))])


def read_history(run: str | Path) -> dict[str, np.ndarray]:
    """Return the columns of a run's `history.csv` by name: floats, NaN for empty cells, or text.

    A last line without its end, left by a kill, is not read. Raises `OutputError` when the file is missing or not a
    history, or time or a gauge is not a number.
    """
    path = Path(run) / file_names.HISTORY
    content = _bytes(path)
    try:
        text = content[: content.rfind(b"\n") + 1].decode("utf-8")
        header, *rows = csv.reader(io.StringIO(text, newline=""), strict=True)
    except (ValueError, csv.Error) as error:
        raise OutputError(f"cannot read {path}: it is not a history ({error})") from error
    if any(len(row) != len(header) for row in rows):
        line = next(i for i, row in enumerate(rows) if len(row) != len(header))
        raise OutputError(f"cannot read {path}: line {line + 2} has not {len(header)} columns; it is damaged")
    if "time" not in header:
        raise OutputError(f"cannot read {path}: it is not a history (it has no column 'time')")
    columns = {name: _column_values([row[k] for row in rows]) for k, name in enumerate(header)}
    for name, values in columns.items():
        if values.dtype.kind != "f" and name.startswith(("time", "gauge.")):
            raise OutputError(f"cannot read {path}: the column {name} holds text in place of numbers; it is damaged")
    return columns


def read_summary(run: str | Path) -> Plain:
    """Return a run's `summary.json`; raises `OutputError` when it is missing, damaged or incomplete."""
    path = Path(run) / file_names.SUMMARY
    try:
        summary = json.loads(_bytes(path, LARGEST_SUMMARY))
    except (ValueError, RecursionError) as error:
        raise OutputError(f"cannot read {path}: it is truncated or damaged ({error})") from error
    wrong = misfit(summary)
    if wrong:
        raise OutputError(f"cannot read {path}: {wrong}")
    return dict(_sanitize(summary))


def _sanitize(value: object) -> Any:
    """Return plain values whose texts are free of control characters of terminals."""
    if isinstance(value, dict):
        return {sanitize(name): _sanitize(item) for name, item in value.items()}
    if isinstance(value, list):
        return [_sanitize(item) for item in value]
    return sanitize(value) if isinstance(value, str) else value


def _bytes(path: Path, count: int = -1) -> bytes:
    with read_errors(path, "a file"), path.open("rb") as file:
        return file.read(count)


def _natural(name: str) -> list[tuple[int, int, str]]:
    """Return a key that orders plate_9 before plate_10, and numbers before words."""
    parts = re.split(r"(\d+)", name)
    return [(0, int(part), "") if part.isdecimal() else (1, 0, part) for part in parts if part]


def _column_values(column: list[str]) -> np.ndarray:
    try:
        return np.array([cell or "nan" for cell in column], dtype=float)
    except ValueError:
        return np.array(column)
