"""Tables and pictures of the exact solution of a case."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hvisph.core.errors import OutputError
from hvisph.output.atomic_write import reason, write_text
from hvisph.visualization.curves import Curve, curves_picture, steps

from .exact_solution import ExactSolution

if TYPE_CHECKING:
    from hvisph.case.case import Case

# Moments drawn beside one another in the picture of profiles.
MOST_DRAWN = 6


def write_exact(solution: ExactSolution, case: Case, folder: str | Path) -> list[Path]:
    """Write gauges and profiles of an exact solution into `folder`, made if need be; return the files.

    ``gauge.NAME.csv`` holds two lines for every jump, the values before and after it, so that straight
    lines between its points are the exact history; ``profile_N.csv`` likewise two for every region, at
    the moments of the case's output.

    Raises
    ------
    OutputError
        When something cannot be written.
    """
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot write {folder}: {reason(error)}") from error
    unitless, end = case.units == "none", case.time.end
    files: list[Path] = []
    panels: dict[str, Any] = {}
    for gauge in solution.gauges:
        table = {}
        for column in gauge.columns:
            table["time"], table[column] = steps(gauge.times, gauge.values(column), end)
            panels.setdefault(column, []).append(Curve(gauge.name, table["time"], table[column]))
        files.append(_write_table(folder / f"gauge.{gauge.name}.csv", table))
    title = f"{case.title}, exact" if case.title else "exact"
    if panels:
        files.append(curves_picture(panels, folder / "gauges.png", title=title, unitless=unitless))
    moments = _moments(case)
    drawn = set(np.linspace(0, len(moments) - 1, MOST_DRAWN).round().astype(int)) if moments else set()
    profiles: dict[str, list[Curve]] = {}
    for number, time in enumerate(moments):
        profile = solution.profile(time)
        files.append(_write_table(folder / f"profile_{number + 1:04d}.csv", profile))
        for column in solution.columns():
            if number in drawn:
                label = f"t = {time:.4g}" if unitless else f"t = {1e6 * time:.4g} us"
                profiles.setdefault(column, []).append(Curve(label, profile["x"], profile[column]))
    files.append(curves_picture(profiles, folder / "profiles.png", title=title, across="x", unitless=unitless))
    return files


def _moments(case: Case) -> list[float]:
    end, every = case.time.end, case.snapshot_interval
    # the end itself is the first moment that the waves are not followed through
    return [min(number * every, end * (1.0 - 1e-12)) for number in range(1, int(np.ceil(end / every - 1e-9)) + 1)]


def _write_table(path: Path, table: dict[str, np.ndarray]) -> Path:
    rows = zip(*(map(float, values) for values in table.values()), strict=True)
    lines = [",".join(table), *(",".join(map(repr, row)) for row in rows)]
    write_text(path, "\n".join(lines) + "\n")
    return path
