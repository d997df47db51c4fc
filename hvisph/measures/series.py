"""Measures and fragments over time: as columns, and as CSV files."""

import csv
import io
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hvisph.measures.debris.fragments import FEWEST
from hvisph.output.atomic_write import write_text

from .measure import Measures
from .result import Result


@dataclass(frozen=True)
class Column:
    """One quantity over time: its SI unit, empty for plain numbers, and a value a moment, NaN where there is none."""

    unit: str
    values: np.ndarray


def moments(measured: Measures) -> tuple[Measures, ...]:
    """Return the moments of a series, or the single moment."""
    return measured.series or (measured,)


def columns(measured: Measures, sections: bool = False) -> dict[str, Column]:
    """Return every measure over time by its name, and what the fragments of each body come to.

    With `sections` also those of the projectile, the layers and the cloud that have a value at any moment, as
    ``projectile.<name>``, ``layer.<body>.<name>`` and ``cloud.<name>``.

    Of the fragments: ``fragments.<body>.number`` (of five particles or more), ``.loose_mass_share`` (in smaller ones),
    ``.largest_mass_share``, ``.largest_velocity_x`` (``_y``, ``_z``) and ``.largest_speed`` [m/s].
    """
    rows: list[dict[str, tuple[str, float | None]]] = []
    for moment in moments(measured):
        row = _cells("", moment.results)
        for part in moment.fragments:
            head, largest = f"fragments.{part.body}.", part.fragments[0]
            row[head + "number"] = "", part.number()
            row[head + "loose_mass_share"] = "", part.share(part.counts < FEWEST)
            row[head + "largest_mass_share"] = "", part.share([0])
            for axis, speed in zip("xyz", largest.velocity, strict=False):
                row[f"{head}largest_velocity_{axis}"] = "m/s", float(speed)
            row[head + "largest_speed"] = "m/s", largest.speed
        rows.append(row)
    if sections:
        for row, moment in zip(rows, moments(measured), strict=True):
            parts = {"projectile": moment.projectile, "cloud": moment.cloud.results}
            parts |= {f"layer.{layer.body}": layer.results for layer in moment.layers}
            for section, results in parts.items():
                row |= _cells(f"{section}.", results)
        valued = {name for row in rows for name, (_, value) in row.items() if value is not None}
        inner = ("projectile.", "cloud.", "layer.")
        rows = [
            {name: cell for name, cell in row.items() if name in valued or not name.startswith(inner)} for row in rows
        ]
    units = {name: unit for row in rows for name, (unit, _) in row.items()}
    return {
        name: Column(unit, np.array([_number(row.get(name, (unit, None))[1]) for row in rows]))
        for name, unit in units.items()
    }


def _cells(head: str, results: Mapping[str, Result]) -> dict[str, tuple[str, float | None]]:
    """Return unit and value of each result, and of its further variants that have one, by the name of the column."""
    cells: dict[str, tuple[str, float | None]] = {}
    for name, result in results.items():
        cells[f"{head}{name}"] = result.unit, result.value
        for variant, one in [*result.variants.items()][1:]:
            if one.value is not None:
                cells[f"{head}{name}.{variant}"] = one.unit, one.value
    return cells


def write_series(measured: Measures, path: str | os.PathLike[str]) -> Path:
    """Write one row a moment: time, step, and the columns; empty where a measure has no value.

    The header names each column with its SI unit, as in ``crater_diameter [m]``. Raises `OutputError` where the file
    cannot be written; an earlier file of that name is then untouched.
    """
    table = columns(measured, sections=True)
    head = [_heading("time", "s", measured), "step", *(_heading(name, table[name].unit, measured) for name in table)]
    body = [
        [moment.time, moment.step, *(column.values[row] for column in table.values())]
        for row, moment in enumerate(moments(measured))
    ]
    return _write(path, head, body)


def write_fragments(measured: Measures, path: str | os.PathLike[str]) -> Path:
    """Write one row a fragment, single particles included, of every body and moment.

    Fragments are numbered from 1, the one with most particles. ``number_at_least`` and ``mass_share_at_least`` are the
    body's cumulative mass distribution. Raises as `write_series`.
    """
    axes = "xyz"[: measured.dimensions]
    head = [
        _heading("time", "s", measured),
        "body",
        "fragment",
        "role",
        "particles",
        _heading("mass", measured.mass_unit, measured),
    ]
    head += ["mass_share", "number_at_least", "mass_share_at_least"]
    head += [_heading(f"velocity_{axis}", "m/s", measured) for axis in axes] + [_heading("speed", "m/s", measured)]
    head += [_heading(f"{name}_{axis}", "m", measured) for name in ("centre", "extent") for axis in axes]
    body: list[list[object]] = []
    for moment in moments(measured):
        for part in moment.fragments:
            for number, (piece, role) in enumerate(zip(part.fragments, part.roles, strict=True), 1):
                heavier = part.distribution.at_mass(piece.mass) or (None, None)
                share = piece.mass / part.mass if part.mass > 0.0 else None
                body.append([moment.time, part.body, number, role, piece.count, piece.mass, share, *heavier,
                             *piece.velocity, piece.speed, *piece.centre, *piece.extent])  # fmt: skip
    return _write(path, head, body)


def _heading(name: str, unit: str, measured: Measures) -> str:
    return f"{name} [{unit}]" if unit and not measured.unitless else name


def _number(value: float | None) -> float:
    return float("nan") if value is None else float(value)


def _write(path: str | os.PathLike[str], head: Sequence[str], body: Iterable[Sequence[object]]) -> Path:
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(head)
    writer.writerows([_cell(value) for value in row] for row in body)
    target = Path(path)
    write_text(target, buffer.getvalue())
    return target


def _cell(value: object) -> str:
    """Return a number with the fewest digits that give it back; empty without a value."""
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or (isinstance(value, float) and not np.isfinite(value)):
        return ""
    return repr(value + 0.0) if isinstance(value, float) else str(value)  # no -0.0
