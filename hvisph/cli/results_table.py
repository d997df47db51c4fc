"""Tables of measures, expected values, bodies and fragments, of one run and of several."""

import math
import re
import sys
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import typer

from hvisph.cli.formatting import duration, paragraph, table, tables, times
from hvisph.core.measure_catalogue import NumberFormat, axis_unit, format_of, main_measures
from hvisph.core.text import PlainMapping
from hvisph.measures.compare import Row as ComparedRow
from hvisph.measures.compare import shown_measures
from hvisph.measures.fragments import BodyFragments
from hvisph.measures.measure import Measures
from hvisph.measures.result import Result
from hvisph.measures.tables import Row, body_rows, rows
from hvisph.postprocessing.exact_solution import Overlay
from hvisph.visualization.curves import label_and_scale

# Heading of values: their uncertainty is estimated from one run, not from several resolutions.
ONE_RESOLUTION = "value at one resolution"


def results_table(
    measures: Mapping[str, PlainMapping],
    expected: Sequence[PlainMapping] = (),
    unitless: bool = False,
    figures: Mapping[str, float | None] | None = None,
    variants: bool = False,
) -> str:
    """Return measures and expectations of a summary as aligned text, with `figures` such as drifts."""
    results = {name: Result.from_dict(result) for name, result in measures.items()}
    entries = rows({**results, **(figures or {})}, expected, unitless, variants)
    # undefined measures without an expected value are left out; the summary has their reason
    entries = [row for row in entries if row.value != "-" or row.passed is not None]
    lines: list[tuple[str, ...]]
    if expected:
        lines = [("measure", ONE_RESOLUTION, "expected", "", "")]
        verdicts = {None: "", True: "ok", False: "MISSED"}
        lines += [(row.label, row.value, row.expected, verdicts[row.passed], row.note) for row in entries]
    else:
        lines = [("measure", ONE_RESOLUTION), *((row.label, row.value, row.note) for row in entries)]
    return _colour(table(lines))


def sections_table(summary: PlainMapping, unitless: bool = False, variants: bool = False) -> str:
    """Return the measures of layers, projectile and cloud of a summary as aligned text, a column for each layer."""
    blocks = []
    for name, parts in (("layer", summary.get("layers", [])), *((k, summary.get(k)) for k in ("projectile", "cloud"))):
        columns = parts if name == "layer" else [parts] if parts else []
        results = [{key: Result.from_dict(values) for key, values in column["measures"].items()} for column in columns]
        cells = [{row.name: row for row in rows(part, unitless=unitless, variants=variants)} for part in results]
        measures = dict.fromkeys(measure for column in sorted(cells, key=len, reverse=True) for measure in column)
        names = [
            m for m in measures if m != "perforated" and any(m in column and column[m].value != "-" for column in cells)
        ]
        if names:
            heads = [column["body"] if name == "layer" else "" for column in columns]
            lines = [(name, *heads)]
            lines += [(format_of(m).label, *(_note(column.get(m)) for column in cells)) for m in names]
            blocks.append(table(lines))
    return "\n\n".join(blocks)


def bodies_table(summary: PlainMapping, unitless: bool = False) -> str:
    """Return mass, velocity and kinetic energy of every body of a summary as aligned text; empty without any."""
    rows = body_rows(summary, unitless)
    return table([("body", "mass", "velocity", "kinetic energy"), *rows]) if rows else ""


def _note(row: Row | None) -> str:
    if row is None:
        return "-"
    return f"{row.value} (not settled)" if "not settled" in row.note else str(row.value)


def _colour(text: str) -> str:
    # after alignment: escape codes have no width
    if not sys.stdout.isatty():
        return text
    missed = typer.style("MISSED", fg=typer.colors.RED, bold=True)
    return text.replace("  ok ", f"  {typer.style('ok', fg=typer.colors.GREEN)} ").replace("MISSED", missed)


# unit for people and factor from SI, by the unit of the mass
MASSES = {"kg": ("g", 1e3), "kg/m": ("kg/m", 1.0), "kg/m^2": ("kg/m^2", 1.0)}


def fragments_text(moment: Measures, fewest: int) -> str:
    """Return the fragments of the bodies at one moment; those of less than `fewest` particles are summed up."""
    return "\n\n".join(_body(part, moment, fewest) for part in moment.fragments)


def fragments_series(series: Sequence[Measures], fewest: int) -> str:
    """Return for every body one line a moment."""
    unitless = series[-1].unitless
    speed = "" if unitless else "m/s"
    head = [
        ["t", "fragments", f"of {fewest}+", "largest", "its v_x", "its speed", f"below {fewest}", "single"],
        ["", "", "particles", "% of mass", speed, speed, "% of mass", "% of mass"],
    ]
    moments = times([moment.time for moment in series], "" if unitless else "s")
    blocks = []
    for name in dict.fromkeys(part.body for moment in series for part in moment.fragments):
        lines = []
        for time, moment in zip(moments, series, strict=True):
            for part in [group for group in moment.fragments if group.body == name]:
                largest, shares = part.fragments[0], (part.share(part.counts < fewest), part.share(part.counts == 1))
                figures = [_percent(part.share([0])), _figure(largest.velocity[0]), _figure(largest.speed)]
                lines.append([time, str(len(part)), str(part.number(fewest)), *figures, *map(_percent, shares)])
        blocks.append(f"{name}\n{table([*head, *lines])}")
    return "\n\n".join(blocks)


def _body(part: BodyFragments, moment: Measures, fewest: int) -> str:
    unitless, axes = moment.unitless, "xyz"[: moment.dimensions]
    unit, factor = ("", 1.0) if unitless else MASSES[moment.mass_unit]
    large = [fragment for fragment in part.fragments if fragment.count >= fewest]
    sizes = [float(value) for piece in large for value in (*piece.centre, *piece.extent)]
    measure, length = ("", 1.0) if unitless else axis_unit("mm", sizes)
    speeds = ["" if unitless else "m/s"] * (len(axes) + 1)
    lengths = [measure] * (2 * len(axes))
    lines = [
        ["", "particles", "mass", "share", *(f"v_{axis}" for axis in axes), "speed", *axes]
        + [f"extent {axis}" for axis in axes],
        ["", "", unit, "%", *speeds, *lengths],
    ]
    columns = [
        *_columns([[*piece.velocity, piece.speed] for piece in large]),
        *_columns([[length * value for value in piece.centre] for piece in large]),
        *_columns([[length * value for value in piece.extent] for piece in large]),
    ]
    for row, piece in enumerate(large):
        mass, share = _figure(factor * piece.mass), _percent(part.share([row]))
        figures = [column[row] for column in columns]
        lines.append([str(row + 1), str(piece.count), mass, share, *figures, part.roles[row]])
    parts = [paragraph(_summary(part, unit, factor), hanging=2), *([table(lines)] if large else [])]
    small = part.counts < fewest
    if small.any():
        counts = f"{small.sum()} of fewer than {fewest} particles: {part.counts[small].sum()} particles"
        parts.append(f"  {counts}{_mass_and_share(part, small, unit, factor)}")
    return "\n".join(parts)


def _summary(part: BodyFragments, unit: str, factor: float) -> str:
    count, single = len(part), part.counts == 1
    text = f"{part.body}: {count} fragment{'s' if count > 1 else ''} of {part.counts.sum()} particles"
    if math.isfinite(part.mass):
        text += f", {_figure(factor * part.mass)} {unit}".rstrip()
        text += f"; the largest, {part.counts[0]} particles, holds {_percent(part.share([0]))} %"
    if single.any():
        plural = "s" if single.sum() > 1 else ""
        text += f"; {single.sum()} single particle{plural}{_mass_and_share(part, single, unit, factor)}"
    return text


def _mass_and_share(part: BodyFragments, group: Any, unit: str, factor: float) -> str:
    mass = part.masses[group].sum()
    if not math.isfinite(mass):
        return ""
    return f", {_figure(factor * mass)} {unit}".rstrip() + f", {_percent(part.share(group))} % of the mass"


def _percent(share: float) -> str:
    """Return a share in per cent; small ones keep two figures."""
    if not math.isfinite(share):
        return "-"
    return f"{100.0 * share:.2g}" if 0.0 < share < 0.001 else f"{100.0 * share:.2f}"


def _columns(rows: list[list[float]]) -> list[list[str]]:
    """Return the columns of numbers of one kind, with as many decimals as give the largest four figures."""
    scale = max((abs(value) for row in rows for value in row if math.isfinite(value)), default=0.0)
    decimals = max(0, 3 - math.floor(math.log10(scale))) if scale > 0.0 else 0
    return [[_figure(value, f".{decimals}f") for value in column] for column in zip(*rows, strict=True)]


def _figure(value: float, form: str = ".4g") -> str:
    if not math.isfinite(value):
        return "-"
    text = f"{value:{form}}"
    return text if float(text) else text.lstrip("-")  # zero has no sign


SHORT = {"angular_momentum_drift": "angular_drift", "kinetic_energy_ratio": "kinetic_ratio"}
MISSED = " *"  # behind a value that is further from the published one than its tolerance


def comparison_tables(rows: Sequence[ComparedRow], unitless: bool = False, full: bool = False) -> str:
    """Return the tables of measures (all where `full`, else the main ones) and of costs, with notes on the marks."""
    parts = [_measures_table(rows, unitless, full)]
    if any(row.conservation or row.cost for row in rows):
        parts += ["", _cost_table(rows)]
    if any(row.published for row in rows):
        parts += ["", "In brackets: less the published value; * beyond its tolerance."]
    parts += [f"{row.name}: {row.failure['message']}" for row in rows if row.failure]
    text = "\n".join(parts)
    missed = r"\S+( \([^)]*\))? \*"  # colours have no width: they follow the alignment
    red = partial(typer.style, fg=typer.colors.RED)
    return re.sub(missed, lambda cell: red(cell[0]), text) if sys.stdout.isatty() else text


def _measures_table(rows: Sequence[ComparedRow], unitless: bool, full: bool) -> str:
    names = shown_measures(rows)
    main = names if full or any(row.published for row in rows) else main_measures(names)
    omitted, names = len(names) - len(main), main
    displays = {}
    for name in names:
        unit = next((row.measures[name]["unit"] for row in rows if name in row.measures), "")
        largest = max((abs(row.value(name) or 0.0) for row in rows), default=0.0)
        displays[name] = format_of(name, unit, unitless).scale_to(largest)
    lines = [["", *(getattr(display, part) for display in displays.values())] for part in ("short", "unit")]
    lines += [[row.name, *(_compared_value(row, name, display) for name, display in displays.items())] for row in rows]
    hint = f"\n  {omitted} more with --all" if omitted else ""
    return tables(lines) + hint


def _compared_value(row: ComparedRow, name: str, display: NumberFormat) -> str:
    value = row.value(name)
    if value is None:
        return "-" + (MISSED if name in row.missed else "")
    error = row.differences.get(name)
    # a published void fraction of none needs no difference
    bracket = f" ({_format_scaled(error, display, '+')})" if error is not None and row.published[name]["value"] else ""
    return _format_scaled(value, display) + bracket + (MISSED if name in row.missed else "")


def _format_scaled(value: float, display: NumberFormat, sign: str = "") -> str:
    value *= display.factor
    return f"{value:{sign}.{display.decimals}f}" if display.decimals >= 0 else f"{value:{sign}.4g}"


def _cost_table(rows: Sequence[ComparedRow]) -> str:
    drifts = list(dict.fromkeys(name for row in rows for name in row.conservation))
    # such as energy drift, on two lines
    words = [SHORT.get(name, name).replace("_", " ").rpartition(" ") for name in drifts]
    lines = [
        ["", "", *(of for of, _, _ in words), "particles", "steps", "us a particle-", "wall"],
        ["", "", *(noun for _, _, noun in words), "", "", "step", ""],
    ]
    for row in rows:
        pace = row.cost.get("microseconds_per_particle_step")
        wall = row.cost.get("wall_seconds")
        drift_cells = [_drift(row.conservation.get(name)) for name in drifts]
        counts = [str(row.cost.get(name, "-")) for name in ("particles", "steps")]
        costs = ["-" if pace is None else f"{pace:.3f}", "-" if wall is None else duration(wall)]
        lines.append([row.name, row.status, *drift_cells, *counts, *costs])
    return table(lines)


def _drift(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}" if abs(value) > 0.01 else f"{value:.1e}"


def gauge_table(overlay: Overlay) -> str:
    """Return how far the gauges of each run are from the exact solution."""
    lines = [["gauge", "field", *overlay.differences]] if overlay.differences else []
    for column in dict.fromkeys(c for columns in overlay.differences.values() for c in columns):
        _, gauge, name = column.split(".", 2)
        label, scale = label_and_scale(name, overlay.unitless)
        cells = []
        for columns in overlay.differences.values():
            error = columns.get(column)
            share = f" ({error.mean / error.exact_range:.1%})" if error and error.exact_range > 0.0 else ""
            cells.append(f"{error.mean * scale:.3g}{share}" if error else "-")
        lines.append([gauge, label, *cells])
    head = "Mean difference from the exact solution over the run (and of the exact range):"
    parts = ["", head, table(lines)] if lines else []
    return "\n".join([*parts, *(f"{name}: no exact solution: {why}" for name, why in overlay.without.items())])
