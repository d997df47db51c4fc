"""Runs side by side, from their files alone: measures against published values, conservation, cost."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hvisph.output import file_names, reader
from hvisph.output.snapshot import Snapshot

from .expected import within
from .measure import measure

COST = ("particles", "steps", "threads", "wall_seconds", "microseconds_per_particle_step")


@dataclass(frozen=True)
class Row:
    """One run of a comparison.

    Parameters
    ----------
    name
        What it is called in the comparison.
    source
        Its folder, or a snapshot that stands for it.
    title
        The case's title.
    status
        ``done``, ``failed`` or ``interrupted``; ``unfinished`` for a run without a summary, ``snapshot`` for
        files of other codes and single snapshots.
    failure
        What stopped it; None where nothing did.
    time
        Time reached [s].
    measures
        As in ``summary.json``: SI.
    conservation
        Drifts by name; empty where the files do not tell.
    cost
        Particles, steps, threads, wall time [s] and microseconds per particle-step; empty likewise.
    published
        What the case expects, by name of the measure: `value`, `tolerance`, `source`.
    """

    name: str
    source: Path
    title: str
    status: str
    failure: dict[str, Any] | None
    time: float
    measures: dict[str, dict[str, Any]]
    conservation: dict[str, float | None]
    cost: dict[str, Any]
    published: dict[str, dict[str, Any]]

    def value(self, name: str) -> float | None:
        """Return a measure or a drift by name; None where it has no value."""
        if name in self.measures:
            return self.measures[name]["value"]
        return self.conservation.get(name)

    @property
    def differences(self) -> dict[str, float | None]:
        """Computed less published value by name of the measure; None where nothing could be measured."""
        values = {name: self.value(name) for name in self.published}
        return {
            name: None if value is None else value - self.published[name]["value"] for name, value in values.items()
        }

    @property
    def missed(self) -> list[str]:
        """Names of the measures that are further from the published value than its tolerance."""
        return [
            name
            for name, entry in self.published.items()
            if not within(self.value(name), entry["value"], entry["tolerance"])
        ]

    def as_dict(self) -> dict[str, Any]:
        """Return the plain form for JSON: SI throughout."""
        return {
            "name": self.name,
            "source": str(self.source),
            "title": self.title,
            "status": self.status,
            "failure": self.failure,
            "end_time": self.time,
            "measures": self.measures,
            "conservation": self.conservation,
            "cost": self.cost,
            "published": self.published,
            "differences": self.differences,
            "missed": self.missed,
        }


def row(name: str, source: str | os.PathLike[str]) -> Row:
    """Return one run for a comparison.

    Parameters
    ----------
    name
        What to call it.
    source
        The folder of a run, ended or not, a folder of another code's VTU files, or one snapshot.

    Raises
    ------
    CaseError
        When there is no such file or folder.
    OutputError
        When it holds nothing that can be measured.
    """
    path = Path(source)
    if (path / file_names.SUMMARY).is_file():
        return _ended(name, path, reader.read_summary(path))
    measured = measure(path)
    status = "unfinished" if (path / file_names.CASE).is_file() else "snapshot"
    plain = measured.as_dict()["measures"]
    return Row(name, path, measured.title, status, None, measured.time, plain, {}, {}, {})


def _ended(name: str, path: Path, summary: dict[str, Any]) -> Row:
    published = {
        entry["name"]: {
            "value": entry["expected"],
            "tolerance": entry["tolerance"],
            "source": entry["source"],
        }
        for entry in summary["expected"]
    }
    return Row(
        name, path, summary["title"], summary["status"], summary["failure"], summary["end_time"],
        summary["measures"], summary["conservation"], {key: summary[key] for key in COST}, published,
    )  # fmt: skip


def last_snapshot(source: str | os.PathLike[str]) -> Snapshot:
    """Return the last moment of a run, or the snapshot that stands for it; raises as `reader.snapshots_at`."""
    return next(reader.snapshots_at(Path(source), None))


def shown_measures(rows: Iterable[Row]) -> list[str]:
    """Return the measures that a table of `rows` needs.

    Where any row has published values, those that are published for some row and the voids; otherwise
    all that have a value in some row.
    """
    rows = list(rows)
    order = list(dict.fromkeys(name for row in rows for name in row.measures))
    valued = {name for row in rows for name in row.measures if row.value(name) is not None}
    published = {name for row in rows for name in row.published}
    if published:
        valued = (valued & {"void_fraction"}) | published
    return [name for name in order if name in valued]
