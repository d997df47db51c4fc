"""The table of a sweep: a row a case, made anew from the runs' summaries, readable at any moment."""

from __future__ import annotations

import csv
import io
import time
from collections.abc import Sequence
from typing import Any

from hvisph.core.text import format_value
from hvisph.output import atomic_write
from hvisph.output.run_folder import FileLock

from .folder import CLAIMS, TABLE, Standing, SweepFolder
from .plan import Member

Row = dict[str, Any]


def row(folder: SweepFolder, member: Member, standing: Standing) -> Row:
    """Return a case as a plain mapping: number, values, status, measures, cost, folder."""
    summary = standing.summary
    return {
        "number": member.number,
        "values": member.values,
        "status": standing.status,
        "message": standing.message,
        "measures": summary.get("measures", {}),
        "missed": summary.get("missed", []),
        "energy_drift": (summary.get("conservation") or {}).get("energy_drift"),
        "wall_seconds": summary.get("wall_seconds"),
        "folder": str(folder.run_folder(member)),
    }


def rows(folder: SweepFolder, members: Sequence[Member]) -> list[Row]:
    """Return all cases as they stand."""
    return [row(folder, member, folder.standing(member)) for member in members]


def table_text(shown: Sequence[Row], record: Sequence[str] | None) -> str:
    """Return rows as CSV; measures in SI, with the unit in the head and the uncertainty beside each."""
    paths = list(dict.fromkeys(path for one in shown for path in one["values"]))
    units: dict[str, str] = {}
    for one in shown:
        for name, measure in one["measures"].items():
            units.setdefault(name, measure["unit"] or "")
    chosen = [name for name in (record if record is not None else units) if name in units]
    heads = [f"{name} [{units[name]}]" if units[name] else name for name in chosen]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["number", *paths, "status", *(cell for head in heads for cell in (head, f"± {head}")),
                     "energy_drift", "wall_seconds", "folder", "message"])  # fmt: skip
    for one in shown:
        measures = [one["measures"].get(name, {}) for name in chosen]
        cells = [measure.get(key) for measure in measures for key in ("value", "uncertainty")]
        values = (format_value(one["values"][path]) if path in one["values"] else "" for path in paths)
        writer.writerow([one["number"], *values, one["status"], *cells,
                         one["energy_drift"], one["wall_seconds"], one["folder"], one["message"]])  # fmt: skip
    return text.getvalue()


class TableKeeper:
    """Writes the table when a case ends, at most once a second and never two processes at once."""

    def __init__(self, folder: SweepFolder, record: Sequence[str] | None):
        self.folder, self.record = folder, record
        self._next = 0.0

    def write(self, members: Sequence[Member], *, last: bool = False) -> None:
        """Write the table if it is time, or in any case when it is the last."""
        begun = time.monotonic()
        if begun < self._next and not last:
            return
        try:
            lock = FileLock(self.folder.path / CLAIMS / "table.lock")
        except BlockingIOError:  # another process writes the same
            return
        try:
            text = table_text(rows(self.folder, members), self.record)
            atomic_write.write_text(self.folder.path / TABLE, text)
        finally:
            lock.release()
        took = time.monotonic() - begun
        self._next = begun + max(1.0, 20.0 * took)
