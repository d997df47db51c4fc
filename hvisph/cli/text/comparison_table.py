"""Runs side by side as text: a line each, measures above, conservation and cost below."""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

import typer

from hvisph.core.measure_catalogue import NumberFormat, format_of, main_measures

from .formatting import duration, table, tables

if TYPE_CHECKING:
    from hvisph.measures.compare import Row
    from hvisph.postprocessing.exact_solution import Overlay

SHORT = {"angular_momentum_drift": "angular_drift", "kinetic_energy_ratio": "kinetic_ratio"}
MISSED = " *"  # behind a value that is further from the published one than its tolerance


def comparison_tables(rows: Sequence[Row], unitless: bool = False, every: bool = False) -> str:
    """Return the tables of measures and of costs, with notes on omitted measures, brackets and marks.

    `unitless`: True for cases without units.
    `every`: show all measures, in as many tables as that takes; without, those that matter most.
    """
    parts = [_measures(rows, unitless, every)]
    if any(row.conservation or row.cost for row in rows):
        parts += ["", _cost(rows)]
    if any(row.published for row in rows):
        parts += ["", "In brackets: less the published value; * beyond its tolerance."]
    parts += [f"{row.name}: {row.failure['message']}" for row in rows if row.failure]
    return _colour("\n".join(parts))


def _measures(rows: Sequence[Row], unitless: bool, every: bool) -> str:
    from hvisph.measures.compare import shown_measures

    names = shown_measures(rows)
    most = names if every or any(row.published for row in rows) else main_measures(names)
    left, names = len(names) - len(most), most
    displays = {}
    for name in names:
        unit = next((row.measures[name]["unit"] for row in rows if name in row.measures), "")
        largest = max((abs(row.value(name) or 0.0) for row in rows), default=0.0)
        displays[name] = format_of(name, unit, unitless).scale_to(largest)
    lines = [["", *(getattr(display, part) for display in displays.values())] for part in ("short", "unit")]
    lines += [[row.name, *(_cell(row, name, display) for name, display in displays.items())] for row in rows]
    more = f"\n  {left} more with --all" if left else ""
    return tables(lines) + more


def _cell(row: Row, name: str, display: NumberFormat) -> str:
    value = row.value(name)
    if value is None:
        return "-" + (MISSED if name in row.missed else "")
    off = row.differences.get(name)
    # a published void fraction of none needs no difference
    shown = f" ({_number(off, display, '+')})" if off is not None and row.published[name]["value"] else ""
    return _number(value, display) + shown + (MISSED if name in row.missed else "")


def _number(value: float, display: NumberFormat, sign: str = "") -> str:
    value *= display.factor
    return f"{value:{sign}.{display.decimals}f}" if display.decimals >= 0 else f"{value:{sign}.4g}"


def _cost(rows: Sequence[Row]) -> str:
    drifts = list(dict.fromkeys(name for row in rows for name in row.conservation))
    # such as energy drift, on two lines
    words = [SHORT.get(name, name).replace("_", " ").rpartition(" ") for name in drifts]
    lines = [
        ["", "", *(of for of, _, _ in words), "particles", "steps", "us a particle-", "wall"],
        ["", "", *(what for _, _, what in words), "", "", "step", ""],
    ]
    for row in rows:
        pace = row.cost.get("microseconds_per_particle_step")
        wall = row.cost.get("wall_seconds")
        lines.append(
            [
                row.name,
                row.status,
                *(_drift(row.conservation.get(name)) for name in drifts),
                str(row.cost.get("particles", "-")),
                str(row.cost.get("steps", "-")),
                "-" if pace is None else f"{pace:.3f}",
                "-" if wall is None else duration(wall),
            ]
        )
    return table(lines)


def _drift(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}" if abs(value) > 0.01 else f"{value:.1e}"


def gauge_table(overlay: Overlay) -> str:
    """Return how far the gauges of each run are from the exact solution."""
    from hvisph.visualization.curves import label_and_scale

    lines = [["gauge", "field", *overlay.differences]] if overlay.differences else []
    for column in dict.fromkeys(c for columns in overlay.differences.values() for c in columns):
        _, gauge, name = column.split(".", 2)
        shown, scale = label_and_scale(name, overlay.unitless)
        cells = []
        for columns in overlay.differences.values():
            one = columns.get(column)
            share = f" ({one.mean / one.exact_range:.1%})" if one and one.exact_range > 0.0 else ""
            cells.append(f"{one.mean * scale:.3g}{share}" if one else "-")
        lines.append([gauge, shown, *cells])
    head = "Mean difference from the exact solution over the run (and of the exact range):"
    parts = ["", head, table(lines)] if lines else []
    return "\n".join([*parts, *(f"{name}: no exact solution: {why}" for name, why in overlay.without.items())])


def _colour(text: str) -> str:
    if not sys.stdout.isatty():
        return text
    return re.sub(r"\S+( \([^)]*\))? \*", lambda cell: typer.style(cell[0], fg=typer.colors.RED), text)
