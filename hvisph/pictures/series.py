"""Measures and fragments over time: as columns, as CSV files and as a picture."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hvisph.core.errors import CaseError
from hvisph.core.measures import look_of
from hvisph.measures.measure import Measures
from hvisph.measures.plug import FEWEST, LIP, PLUG
from hvisph.output.atomic import write_text
from hvisph.pictures.curves import Curve, curves_picture

# Panels of the picture in their order, and their SI units.
KINDS = {"length": "m", "length, plug and lip": "m", "velocity": "m/s", "pressure": "Pa", "ratio": "", "number": ""}


@dataclass(frozen=True)
class Column:
    """One quantity over time.

    Parameters
    ----------
    unit
        SI unit; empty for plain numbers.
    values
        One a moment; NaN where it has none.
    """

    unit: str
    values: np.ndarray


def moments(found: Measures) -> tuple[Measures, ...]:
    """Return the series of what was measured: one moment where only one was asked for."""
    return found.series or (found,)


def columns(found: Measures) -> dict[str, Column]:
    """Return every measure over time by its name, and what the fragments of each body come to.

    Of the fragments: ``fragments.<body>.number`` (of five particles or more), ``.loose_mass_share`` (in smaller ones),
    ``.largest_mass_share``, ``.largest_velocity_x`` (``_y``, ``_z``) and ``.largest_speed`` [m/s].
    """
    rows: list[dict[str, tuple[str, float | None]]] = []
    for moment in moments(found):
        row = {name: (result.unit, result.value) for name, result in moment.results.items()}
        for part in moment.fragments:
            head, largest = f"fragments.{part.body}.", part.fragments[0]
            row[head + "number"] = "", part.number()
            row[head + "loose_mass_share"] = "", part.share(part.counts < FEWEST)
            row[head + "largest_mass_share"] = "", part.share([0])
            for axis, speed in zip("xyz", largest.velocity, strict=False):
                row[f"{head}largest_velocity_{axis}"] = "m/s", float(speed)
            row[head + "largest_speed"] = "m/s", largest.speed
        rows.append(row)
    units = {name: unit for row in rows for name, (unit, _) in row.items()}
    return {
        name: Column(unit, np.array([_number(row.get(name, (unit, None))[1]) for row in rows]))
        for name, unit in units.items()
    }


def write_series(found: Measures, path: str | os.PathLike[str]) -> Path:
    """Write one row a moment: time, step, and the columns; empty where a measure has no value.

    The header names each column with its SI unit, as in ``crater_diameter [m]``; a case without units has none.

    Raises
    ------
    OutputError
        When it cannot be written; an earlier file of that name is then untouched.
    """
    table = columns(found)
    head = [_headed("time", "s", found), "step", *(_headed(name, table[name].unit, found) for name in table)]
    body = [
        [moment.time, moment.step, *(column.values[row] for column in table.values())]
        for row, moment in enumerate(moments(found))
    ]
    return _write(path, head, body)


def write_fragments(found: Measures, path: str | os.PathLike[str]) -> Path:
    """Write one row a fragment, single particles included, of every body and moment.

    Fragments are numbered from 1, the one with most particles. ``number_at_least`` and ``mass_share_at_least`` are
    the body's cumulative distribution: how many of its fragments have this mass or more, and their share of it.

    Raises
    ------
    OutputError
        When it cannot be written; an earlier file of that name is then untouched.
    """
    axes = "xyz"[: found.dimensions]
    head = [
        _headed("time", "s", found),
        "body",
        "fragment",
        "role",
        "particles",
        _headed("mass", found.mass_unit, found),
    ]
    head += ["mass_share", "number_at_least", "mass_share_at_least"]
    head += [_headed(f"velocity_{axis}", "m/s", found) for axis in axes] + [_headed("speed", "m/s", found)]
    head += [_headed(f"{name}_{axis}", "m", found) for name in ("centre", "extent") for axis in axes]
    body: list[list[Any]] = []
    for moment in moments(found):
        for part in moment.fragments:
            for number, (piece, role) in enumerate(zip(part.fragments, part.roles, strict=True), 1):
                heavier = part.distribution.at(piece.mass) or (None, None)
                share = piece.mass / part.mass if part.mass > 0.0 else None
                body.append([moment.time, part.body, number, role, piece.count, piece.mass, share, *heavier,
                             *piece.velocity, piece.speed, *piece.centre, *piece.extent])  # fmt: skip
    return _write(path, head, body)


def series_picture(found: Measures, path: str | os.PathLike[str]) -> Path:
    """Draw the measures over time and store the picture: a panel each kind of quantity.

    Of the fragments it shows how many there are, the largest one's share of the mass, and its axial velocity.

    Raises
    ------
    CaseError
        Where there is one moment only.
    """
    shown = moments(found)
    if len(shown) < 2:
        raise CaseError("one moment makes no history; give the folder of a run with two snapshots or more")
    time = np.array([moment.time for moment in shown])
    panels: dict[str, list[Curve]] = {kind: [] for kind in KINDS}
    for name, column in columns(found).items():
        if np.isfinite(column.values).any() and _drawn(name):
            panels[_kind(name, column.unit)].append(Curve(_legend(name), time, column.values, marked=True))
    panels = {kind: curves for kind, curves in panels.items() if curves}
    return curves_picture(panels, path, title=found.title, unitless=found.unitless, units=KINDS, legends="beside")


def _drawn(name: str) -> bool:
    """Whether a column is drawn: not what another column shows, or what few look for."""
    if not name.startswith("fragments."):
        return True
    return name.rpartition(".")[2] in ("number", "largest_mass_share", "largest_velocity_x")


def _kind(name: str, unit: str) -> str:
    """Return the panel that a column belongs to."""
    if name == "target_fragments" or name.endswith(".number"):
        return "number"
    if unit == "m" and name in (*PLUG, *LIP):
        return "length, plug and lip"
    return next(kind for kind, own in KINDS.items() if own == unit)


def _legend(name: str) -> str:
    if not name.startswith("fragments."):
        return look_of(name).label
    body, _, what = name.removeprefix("fragments.").rpartition(".")
    words = {
        "number": f"fragments of {FEWEST} particles or more",
        "largest_mass_share": "mass share of the largest",
        "largest_velocity_x": "largest, axial velocity",
    }
    return f"{body}: {words[what]}"


def _headed(name: str, unit: str, found: Measures) -> str:
    return f"{name} [{unit}]" if unit and not found.unitless else name


def _number(value: float | None) -> float:
    return float("nan") if value is None else float(value)


def _write(path: str | os.PathLike[str], head: Sequence[str], body: Iterable[Sequence[Any]]) -> Path:
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(head)
    writer.writerows([_cell(value) for value in row] for row in body)
    target = Path(path)
    write_text(target, buffer.getvalue())
    return target


def _cell(value: Any) -> str:
    """Return a number with the fewest digits that give it back; nothing for what has no value."""
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or (isinstance(value, float) and not np.isfinite(value)):
        return ""
    return repr(value + 0.0) if isinstance(value, float) else str(value)  # no -0.0
