"""Runs side by side as text: a line each, what they measured above, what they conserved and cost below."""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

import typer

from hvisph.cli.words import duration, table

if TYPE_CHECKING:
    from hvisph.measures.compare import Row
    from hvisph.study.gauge_overlay import Overlay

# Labels that leave room for many columns: those of the papers, where they have one.
SHORT = {
    "crater_diameter": "d_cra",
    "crater_diameter_minimum": "d_cra min",
    "crater_lip_to_lip": "lip to lip",
    "extension": "L_ext",
    "penetration": "L_proj",
    "void_fraction": "voids",
    "centre_pressure_peak": "P peak",
    "centre_tension_peak": "T peak",
    "residual_velocity": "v_d",
    "momentum_transfer": "beta",
}
MISSED = " *"  # behind a value that is further from the published one than its tolerance


def comparison_tables(rows: Sequence[Row], unitless: bool = False) -> str:
    """Return the two tables, and a word on brackets and marks where there are any."""
    parts = [_measures(rows, unitless)]
    if any(row.conservation or row.cost for row in rows):
        parts += ["", _cost(rows)]
    if any(row.published for row in rows):
        parts += ["", "In brackets: less the published value; * beyond its tolerance."]
    parts += [f"{row.name}: {row.failure['message']}" for row in rows if row.failure]
    return _coloured("\n".join(parts))


def _measures(rows: Sequence[Row], unitless: bool) -> str:
    from hvisph.measures.compare import shown_measures

    names = shown_measures(rows)
    looks = {name: _look(rows, name, unitless) for name in names}
    lines = [
        ["", *(SHORT.get(name, name.replace("_", " ")) for name in names)],
        ["", *(looks[name][0] for name in names)],
    ]
    lines += [[row.name, *(_cell(row, name, *looks[name][1:]) for name in names)] for row in rows]
    return table(lines)


def _look(rows: Sequence[Row], name: str, unitless: bool) -> tuple[str, float, int]:
    """Return the unit for people, its factor from SI and the decimals (-1 for significant figures)."""
    from hvisph.measures.table import SHOWN

    own = next((row.measures[name]["unit"] for row in rows if name in row.measures), "")
    _, unit, factor, decimals = SHOWN.get(name, ("", own, 1.0, -1))
    return ("", 1.0, -1) if unitless and unit != "%" else (unit, factor, decimals)


def _cell(row: Row, name: str, factor: float, decimals: int) -> str:
    value = row.value(name)
    if value is None:
        return "-" + (MISSED if name in row.missed else "")
    off = row.differences.get(name)
    # a published void fraction of none needs no difference
    shown = f" ({_number(off * factor, decimals, '+')})" if off is not None and row.published[name]["value"] else ""
    return _number(value * factor, decimals) + shown + (MISSED if name in row.missed else "")


def _number(value: float, decimals: int, sign: str = "") -> str:
    return f"{value:{sign}.{decimals}f}" if decimals >= 0 else f"{value:{sign}.4g}"


def _cost(rows: Sequence[Row]) -> str:
    drifts = list(dict.fromkeys(name for row in rows for name in row.conservation))
    head = ["", "", *(name.replace("_", " ") for name in drifts), "particles", "steps", "us/p-step", "wall"]
    lines = [head]
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
    from hvisph.pictures.curves import label_and_scale

    lines = []
    if overlay.differences:
        lines.append(["gauge", "field", *overlay.differences])
    for column in dict.fromkeys(c for columns in overlay.differences.values() for c in columns):
        _, gauge, name = column.split(".", 2)
        shown, scale = label_and_scale(name, overlay.unitless)
        cells = []
        for columns in overlay.differences.values():
            one = columns.get(column)
            share = f" ({one.mean / one.exact_range:.1%})" if one and one.exact_range > 0.0 else ""
            cells.append(f"{one.mean * scale:.3g}{share}" if one else "-")
        lines.append([gauge, shown, *cells])
    parts = ["", "Mean difference from the exact solution over the run (and of the exact range):", table(lines)]
    parts = parts if lines else []
    return "\n".join([*parts, *(f"{name}: no exact solution: {why}" for name, why in overlay.without.items())])


def _coloured(text: str) -> str:
    if not sys.stdout.isatty():
        return text
    return re.sub(r"\S+( \([^)]*\))? \*", lambda cell: typer.style(cell[0], fg=typer.colors.RED), text)
