"""Measures against what was expected of them, as a table for people."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from typing import Any

import typer

from .formatting import table


def results_table(
    measures: Mapping[str, Mapping[str, Any]],
    expected: Sequence[Mapping[str, Any]] = (),
    unitless: bool = False,
    further: Mapping[str, float | None] | None = None,
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
    """
    from hvisph.measures.table import rows

    results: dict[str, Any] = {name: _result(plain) for name, plain in measures.items()}
    shown = rows(results | dict(further or {}), expected, unitless)
    # what has no value and was not asked for is noise; its reason is in the summary
    shown = [row for row in shown if row.value != "-" or row.passed is not None]
    lines: list[tuple[str, ...]]
    if expected:
        lines = [("measure", "value", "expected", "", "")]
        lines += [(row.label, row.value, row.expected, _verdict(row.passed), row.note) for row in shown]
    else:
        lines = [("measure", "value"), *((row.label, row.value, row.note) for row in shown)]
    return _coloured(table(lines))


def sections_table(plain: Mapping[str, Any], unitless: bool = False) -> str:
    """Return the measures of layers, projectile and cloud as aligned text: a column a layer; empty without any.

    Parameters
    ----------
    plain
        A summary, or the plain form of measures.
    unitless
        True for a case without units.
    """
    from hvisph.measures.table import rows

    blocks = []
    for name, parts in (("layer", plain.get("layers", [])), *((k, plain.get(k)) for k in ("projectile", "cloud"))):
        columns = parts if name == "layer" else [parts] if parts else []
        cells = [{row.name: row for row in rows({one: _result(values) for one, values in column["measures"].items()},
                                                unitless=unitless)} for column in columns]  # fmt: skip
        names = [one for one in (cells[0] if cells else {}) if any(column[one].value != "-" for column in cells)]
        names = [one for one in names if one != "perforated"]
        if names:
            heads = [column["body"] if name == "layer" else "" for column in columns]
            lines = [(name, *heads)]
            lines += [(cells[0][one].label, *(_noted(column[one]) for column in cells)) for one in names]
            blocks.append(table(lines))
    return "\n\n".join(blocks)


def _noted(row: Any) -> str:
    return f"{row.value} (not settled)" if "not settled" in row.note else str(row.value)


def conservation_rows(summary: Mapping[str, Any]) -> dict[str, float | None]:
    """Return the drifts of a summary, those it has."""
    return {name: value for name, value in summary["conservation"].items() if value is not None}


def _result(plain: Mapping[str, Any]) -> Any:
    from hvisph.measures.result import Result

    return Result.from_dict(plain)


def _verdict(passed: bool | None) -> str:
    return "" if passed is None else "ok" if passed else "MISSED"


def _coloured(text: str) -> str:
    # after alignment: escape codes have no width
    if not sys.stdout.isatty():
        return text
    missed = typer.style("MISSED", fg=typer.colors.RED, bold=True)
    return text.replace("  ok ", f"  {typer.style('ok', fg=typer.colors.GREEN)} ").replace("MISSED", missed)
