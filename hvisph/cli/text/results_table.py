"""Tables of measures and expected values."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from typing import Any

import typer

from hvisph.core.measure_catalogue import format_of

from .formatting import table

# Heading of values: their uncertainty is estimated from one run, not from several resolutions.
ONE_RESOLUTION = "value at one resolution"


def results_table(
    measures: Mapping[str, Mapping[str, Any]],
    expected: Sequence[Mapping[str, Any]] = (),
    unitless: bool = False,
    further: Mapping[str, float | None] | None = None,
    variants: bool = False,
) -> str:
    """Return the measures of a summary as aligned text.

    Parameters
    ----------
    measures
        As in ``summary.json``.
    expected
        Its list of expectations.
    unitless
        True for a case without units.
    further
        Other figures by name, such as drifts.
    variants
        Whether to show all variants of a measure.
    """
    from hvisph.measures.table import rows

    results: dict[str, Any] = {name: _result(plain) for name, plain in measures.items()}
    shown = rows(results | dict(further or {}), expected, unitless, variants)
    # what has no value and was not asked for is noise; its reason is in the summary
    shown = [row for row in shown if row.value != "-" or row.passed is not None]
    lines: list[tuple[str, ...]]
    if expected:
        lines = [("measure", ONE_RESOLUTION, "expected", "", "")]
        lines += [(row.label, row.value, row.expected, _verdict(row.passed), row.note) for row in shown]
    else:
        lines = [("measure", ONE_RESOLUTION), *((row.label, row.value, row.note) for row in shown)]
    return _colour(table(lines))


def sections_table(plain: Mapping[str, Any], unitless: bool = False, variants: bool = False) -> str:
    """Return the measures of layers, projectile and cloud as aligned text: a column a layer; empty without any.

    Parameters
    ----------
    plain
        A summary, or the plain form of measures.
    unitless
        True for a case without units.
    variants
        Whether to show all variants of a measure.
    """
    from hvisph.measures.table import rows

    blocks = []
    for name, parts in (("layer", plain.get("layers", [])), *((k, plain.get(k)) for k in ("projectile", "cloud"))):
        columns = parts if name == "layer" else [parts] if parts else []
        found = [{one: _result(values) for one, values in column["measures"].items()} for column in columns]
        cells = [{row.name: row for row in rows(one, unitless=unitless, variants=variants)} for one in found]
        known = dict.fromkeys(one for column in sorted(cells, key=len, reverse=True) for one in column)
        names = [one for one in known if one != "perforated"
                 and any(one in column and column[one].value != "-" for column in cells)]  # fmt: skip
        if names:
            heads = [column["body"] if name == "layer" else "" for column in columns]
            lines = [(name, *heads)]
            lines += [(format_of(one).label, *(_note(column.get(one)) for column in cells)) for one in names]
            blocks.append(table(lines))
    return "\n\n".join(blocks)


def bodies_table(plain: Mapping[str, Any], unitless: bool = False) -> str:
    """Return mass, velocity and kinetic energy of every body of a summary as aligned text; empty without any."""
    from hvisph.measures.table import body_rows

    rows = body_rows(plain, unitless)
    return table([("body", "mass", "velocity", "kinetic energy"), *rows]) if rows else ""


def _note(row: Any) -> str:
    if row is None:
        return "-"
    return f"{row.value} (not settled)" if "not settled" in row.note else str(row.value)


def conservation_rows(summary: Mapping[str, Any]) -> dict[str, float | None]:
    """Return the drifts of a summary, those it has."""
    return {name: value for name, value in summary["conservation"].items() if value is not None}


def _result(plain: Mapping[str, object]) -> Any:
    from hvisph.measures.result import Result

    return Result.from_dict(plain)


def _verdict(passed: bool | None) -> str:
    return "" if passed is None else "ok" if passed else "MISSED"


def _colour(text: str) -> str:
    # after alignment: escape codes have no width
    if not sys.stdout.isatty():
        return text
    missed = typer.style("MISSED", fg=typer.colors.RED, bold=True)
    return text.replace("  ok ", f"  {typer.style('ok', fg=typer.colors.GREEN)} ").replace("MISSED", missed)
