"""A set of experiments on the terminal: measured beside computed, and how all shots together do."""

from __future__ import annotations

from typing import Any

from hvisph.cli.formatting import duration, table

from .comparison import verdicts
from .evaluators import judge_of
from .table_cells import CELLS, collapsed, row_cells, verdict_cells


def result_text(experiments: Any, result: Any) -> str:
    """Return the results of a set as tables."""
    words = judge_of(experiments.model.judge).quantities
    rows: list[tuple[str, ...]] = [("", "", "measured", "computed", "off", "")]
    rows += [row_cells(row, words) for row in collapsed(result.rows)]
    said = [CELLS, *(verdict_cells(one, experiments.model.asked.get(one.quantity), words)
                     for one in verdicts(result.rows, experiments.model.asked))]  # fmt: skip
    head = f"\n{experiments.name}: {experiments.model.title}, {result.across:g} particles across"
    failed = [f"  {name}: {one['status']} {one['message']}" for name, one in result.shots.items()
              if one["status"] != "done"]  # fmt: skip
    return "\n".join([head, "", table(rows), "", table(said), *failed, f"\n  {duration(result.seconds)} of computing"])
