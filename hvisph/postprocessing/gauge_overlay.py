"""Comparison of gauge histories of several runs with exact solutions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hvisph.case.case import Case
from hvisph.casefile.loader import load_case
from hvisph.core.errors import CaseError, RunError
from hvisph.measures.compare import mean_difference
from hvisph.output import file_names
from hvisph.output.reader import read_history
from hvisph.visualization.curves import Curve, gauge_panels, steps

from .exact_solution import exact_solution


@dataclass(frozen=True)
class Difference:
    """Mean difference of a gauge from the exact solution, and the range of the exact values, in SI."""

    mean: float
    exact_range: float


@dataclass
class Overlay:
    """Gauges of several runs.

    Parameters
    ----------
    panels
        Curves by field, for `hvisph.visualization.curves.curves_picture`.
    differences
        By run, then by column of its history: ``gauge.<name>.<field>``.
    without
        Runs without an exact solution, and why.
    unitless
        Whether a case is non-dimensional.
    """

    panels: dict[str, list[Curve]] = field(default_factory=dict)
    differences: dict[str, dict[str, Difference]] = field(default_factory=dict)
    without: dict[str, str] = field(default_factory=dict)
    unitless: bool = False


def overlay(folders: Mapping[str, Path], exact: bool = True) -> Overlay:
    """Return the gauges of runs by their names, beside the exact solutions if `exact`.

    Raises
    ------
    CaseError
        Where a folder holds no case, or a run has no gauges.
    OutputError
        Where a run has no history.
    """
    made = Overlay()
    for name, folder in folders.items():
        if not (folder / file_names.CASE).is_file():
            raise CaseError(f"{folder} is no folder of a run: it has no {file_names.CASE}")
        case = load_case(folder / file_names.CASE)
        made.unitless |= case.units == "none"
        beside = _exact(name, folder, case, made) if exact else {}
        panels = gauge_panels(folder, beside, prefix=f"{name} " if len(folders) > 1 else "")
        for column, curves in panels.items():
            drawn = made.panels.setdefault(column, [])
            drawn += [curve for curve in curves if not _is_drawn_already(curve, drawn)]
    return made


def _exact(name: str, folder: Path, case: Case, made: Overlay) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return the exact gauges of a run by their columns, and note the differences, or why there are none."""
    try:
        solution = exact_solution(case)
    except (CaseError, RunError) as error:
        made.without[name] = str(error)
        return {}
    history = read_history(folder)
    differences = made.differences.setdefault(name, {})
    beside = {}
    for column, values in solution.histories(history["time"]).items():
        mean = mean_difference(history["time"], history[column], values)
        differences[column] = Difference(mean, float(np.ptp(values)))
    for gauge in solution.gauges:
        for column in gauge.columns:
            line = steps(gauge.times, gauge.values(column), float(history["time"][-1]))
            beside[f"gauge.{gauge.name}.{column}"] = line
    return beside


def _is_drawn_already(curve: Curve, others: list[Curve]) -> bool:
    """Whether an exact curve is there already, of another run of the same impact."""
    return curve.exact and any(
        other.exact and np.array_equal(other.x, curve.x) and np.array_equal(other.y, curve.y) for other in others
    )
