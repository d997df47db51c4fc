"""Comparison of computed and measured values in columns `experiment.NAME`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from hvisph.case.dimensions import DIMENSIONS, NUMBER
from hvisph.case.units import parse_quantity

from .parameters import EXPERIMENT
from .table import Row


def against_experiment(rows: Sequence[Row]) -> dict[str, Any]:
    """Return each measure beside its column of the experiment, by name.

    Parameters
    ----------
    rows
        Cases that are done. A column counts where its name is that of a measure, and its cell is a number,
        with a unit or in SI.

    Returns
    -------
    By measure: ``unit``, ``cases`` (numbers), ``measured`` and ``computed`` [SI], and ``mean`` and ``worst``, the
    mean and the largest of (computed - measured)/measured with its sign; None where all that was measured is zero.
    """
    verdicts = {}
    for head in dict.fromkeys(head for row in rows for head in row["values"] if head.startswith(EXPERIMENT)):
        name = head.removeprefix(EXPERIMENT)
        pairs = [(row["number"], *pair) for row in rows if (pair := _pair(row, head, name)) is not None]
        if not pairs:
            continue
        numbers, measured, computed = (list(column) for column in zip(*pairs, strict=True))
        off = [(c - m) / abs(m) for m, c in zip(measured, computed, strict=True) if m != 0.0]
        unit = next(
            row["measures"][name]["unit"] for row in rows if row["measures"].get(name, {}).get("unit") is not None
        )
        verdicts[name] = {"unit": unit, "cases": numbers, "measured": measured, "computed": computed,
                          "mean": float(np.mean(off)) if off else None,
                          "worst": max(off, key=abs) if off else None}  # fmt: skip
    return verdicts


def _pair(row: Row, head: str, name: str) -> tuple[float, float] | None:
    """Return what was measured and what was computed in a case [SI]; None where one of them is not known."""
    one = row["measures"].get(name, {})
    if not isinstance(one.get("value"), int | float) or row["values"].get(head) is None:
        return None
    dimension = next((kind for kind in DIMENSIONS if kind.unit == one["unit"]), NUMBER)
    try:
        return parse_quantity(str(row["values"][head]), dimension), float(one["value"])
    except ValueError:
        return None
