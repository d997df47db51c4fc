"""Comparison of runs with published values and with one another, from their files alone."""

import os
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hvisph.core.errors import CaseError, suggest_nearest
from hvisph.core.text import Plain
from hvisph.output import file_names, reader

from .measure import measure
from .result import Result

COST = ("particles", "steps", "threads", "wall_seconds", "microseconds_per_particle_step")


@dataclass(frozen=True)
class Row:
    """One run of a comparison."""

    name: str  # label in the comparison
    source: Path  # its folder, or a snapshot that stands for it
    title: str  # the case's title
    # ``done``, ``failed`` or ``interrupted``; ``unfinished`` for a run without a summary, ``snapshot`` for files of
    # other codes and single snapshots
    status: str
    failure: Plain | None  # reason for the stop; None if there was none
    end_time: float  # time reached [s]
    measures: dict[str, Plain]  # as in ``summary.json``: SI
    conservation: dict[str, float | None]  # drifts by name; empty where they are not known
    cost: Plain  # particles, steps, threads, wall time [s] and microseconds per particle-step; empty likewise
    published: dict[str, Plain]  # expected values of the case, by name of the measure: `value`, `tolerance`, `source`

    def value(self, name: str) -> float | None:
        """Return a measure or a drift by name; None where it has no value."""
        if name in self.measures:
            return self.measures[name]["value"]
        return self.conservation.get(name)

    @property
    def differences(self) -> dict[str, float | None]:
        """Computed less published value by name of the measure; None without a value."""
        differences = {}
        for name, entry in self.published.items():
            value = self.value(name)
            differences[name] = None if value is None else value - entry["value"]
        return differences

    @property
    def missed(self) -> list[str]:
        """Names of the measures that differ from the published value by more than its tolerance."""
        return [
            name
            for name, entry in self.published.items()
            if not is_within(self.value(name), entry["value"], entry["tolerance"])
        ]

    def as_dict(self) -> Plain:
        """Return the plain form for JSON: SI throughout."""
        comparison = {"source": str(self.source), "differences": self.differences, "missed": self.missed}
        return asdict(self) | comparison


def row(name: str, source: str | os.PathLike[str]) -> Row:
    """Return one run for a comparison: the folder of a run, of another code's VTU files, or one snapshot.

    Raises `CaseError` where there is no such file or folder, and `OutputError` where nothing in it can be measured.
    """
    path = Path(source)
    if (path / file_names.SUMMARY).is_file():
        return _finished_row(name, path, reader.read_summary(path))
    measured = measure(path)
    status = "unfinished" if (path / file_names.CASE).is_file() else "snapshot"
    results = measured.as_dict()["measures"]
    return Row(name, path, measured.title, status, None, measured.time, results, {}, {}, {})


def _finished_row(name: str, path: Path, summary: Plain) -> Row:
    columns = {"value": "expected", "tolerance": "tolerance", "source": "source"}
    expected = {entry["name"]: entry for entry in summary["expected"]}
    published = {name: {column: entry[key] for column, key in columns.items()} for name, entry in expected.items()}
    keys = ("title", "status", "failure", "end_time", "measures", "conservation")
    cost = {key: summary[key] for key in COST}
    return Row(name, path, **{key: summary[key] for key in keys}, cost=cost, published=published)


def shown_measures(rows: Iterable[Row]) -> list[str]:
    """Return the measures of a table: those published for some row and voids, else all with a value in some row."""
    rows = list(rows)
    order = list(dict.fromkeys(name for row in rows for name in row.measures))
    valued = {name for row in rows for name in row.measures if row.value(name) is not None}
    published = {name for row in rows for name in row.published}
    if published:
        valued = (valued & {"void_fraction"}) | published
    return [name for name in order if name in valued]


def compare_expected(
    results: Mapping[str, Result | float | None], expected: Iterable[tuple[str, object]]
) -> list[Plain]:
    """Compare measures, and other figures of a run as plain numbers, with expected values by the same names.

    An expectation has `value`, `tolerance` (half-width) and, optionally, `source`, in SI; a value on the limit passes,
    an undefined one is None. Raises `CaseError` where an expectation names no measure.
    """
    rows = []
    for name, entry in expected:
        if name not in results:
            raise CaseError(f"unknown measure '{name}'{suggest_nearest(name, list(results))}", where=f"expected.{name}")
        result = results[name]
        value = result.value if isinstance(result, Result) else result
        target, tolerance = float(_value_of(entry, "value")), float(_value_of(entry, "tolerance"))
        row = {"name": name, "value": value, "expected": target, "tolerance": tolerance}
        row |= {"source": str(_value_of(entry, "source", "") or ""), "passed": is_within(value, target, tolerance)}
        rows.append(row)
    return rows


def is_within(value: float | None, expected: float, tolerance: float) -> bool:
    """Whether a measured value is within the tolerance, or a few ulp beyond it; a missing value is not."""
    slack = 1e-12 * (abs(expected) + tolerance)
    return value is not None and abs(value - expected) <= tolerance + slack


def _value_of(entry: object, name: str, default: object = None) -> Any:
    return entry.get(name, default) if isinstance(entry, Mapping) else getattr(entry, name, default)


def mean_difference(times: np.ndarray, values: np.ndarray, exact: np.ndarray) -> float:
    """Return the time mean of abs(`values` - `exact`), both at `times`, without NaN."""
    finite = np.isfinite(values)
    times, difference = times[finite], np.abs(values - exact)[finite]
    if len(times) < 2:
        return float("nan")
    return float(np.trapezoid(difference, times) / (times[-1] - times[0]))
