"""A set of experiments on the terminal: measured beside computed values, and verdicts on all shots together."""

from __future__ import annotations

from typing import Any

from hvisph.cli.formatting import duration, table

from .comparison import verdicts
from .evaluators import evaluator_of
from .table_cells import CELLS, collapsed, row_cells, verdict_cells


def result_text(experiments: Any, result: Any) -> str:
    """Return the results of a set as tables."""
    words = evaluator_of(experiments.model.evaluator).quantities
    rows: list[tuple[str, ...]] = [("", "", "measured", "computed", "off", "")]
    rows += [row_cells(row, words) for row in collapsed(result.rows)]
    lines = [CELLS, *(verdict_cells(verdict, experiments.model.required.get(verdict.quantity), words)
                     for verdict in verdicts(result.rows, experiments.model.required))]  # fmt: skip
    head = f"\n{experiments.name}: {experiments.model.title}, {result.across:g} particles across"
    failed = [f"  {name}: {shot['status']} {shot['message']}" for name, shot in result.shots.items()
              if shot["status"] != "done"]  # fmt: skip
    return "\n".join([head, "", table(rows), "", table(lines), *failed, f"\n  {duration(result.seconds)} of computing"])
