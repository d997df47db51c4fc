"""Tables: measures and bodies as rows of text in units of the field; measures and fragments over time, also as CSV."""

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hvisph.core.measure_catalogue import HEADLINES, PER_DEPTH, NumberFormat, format_of
from hvisph.core.text import Plain, PlainMapping
from hvisph.output.atomic_write import write_csv

from .correlations import FINAL_VELOCITY
from .fragments import FEWEST_PARTICLES
from .measure import Measures
from .result import Result

# Units of fractions and angles, whose small values are not enlarged; and what counts as zero in any unit of tables.
UNSCALED_UNITS = ("", "%", "deg")
NEGLIGIBLE = 1e-6
LARGEST_FIXED = 1e6  # numbers above it are shown by powers of ten
KILOJOULES = 1e4  # [J]; kinetic energies above it are shown in kJ
MOST_HEADLINES = 8  # measures printed at the end of a run
_TIME = NumberFormat("time", "t", "us", 2)


def angular_velocity(position: np.ndarray, velocity: np.ndarray, mass: np.ndarray) -> list[float]:
    """Return angular velocities [rad/s] of particles as one rigid body: about z in 2D, x, y, z in 3D, else none."""
    dim = position.shape[1] if position.ndim > 1 else 1
    if dim == 1:
        return []
    r, u = np.zeros((2, len(mass), 3))
    r[:, :dim] = position - mass @ position / mass.sum()
    u[:, :dim] = velocity - mass @ velocity / mass.sum()
    inertia = np.eye(3) * (mass @ (r * r).sum(axis=1)) - (mass[:, None] * r).T @ r
    rate = np.linalg.lstsq(inertia, mass @ np.cross(r, u), rcond=1e-9)[0]
    return list(map(float, rate[0 if dim == 3 else 2 :]))


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    # the measure's name in files, and in words
    name: str
    label: str
    # texts with uncertainty or tolerance and unit; `value` is a dash where there is none, `expected` is empty where
    # nothing is expected
    value: str
    expected: str = ""
    passed: bool | None = None  # None where nothing is expected
    note: str = ""  # when a peak was reached, where the expected value comes from, or why there is no value


def rows(
    results: Mapping[str, Result | float | None],
    expected: Sequence[PlainMapping] = (),
    unitless: bool = False,
    variants: bool = False,
) -> list[Row]:
    """Return the table's rows; `expected` is of `compare_expected`, with `variants` these have rows, too."""
    by_name = {entry["name"]: entry for entry in expected}
    table = []
    for name, value in results.items():
        result = value if isinstance(value, Result) else Result(value)
        table.append(_row(name, result, by_name.get(name), unitless))
        if variants:
            variant_results = [*result.variants.items()][1:]
            table += [_row(f"{name}.{variant}", part, None, unitless) for variant, part in variant_results]
    return table


def _row(name: str, result: Result, entry: PlainMapping | None, unitless: bool) -> Row:
    display = format_of(name, result.unit, unitless)
    notes = [result.reason, result.note, "" if result.settled else "not settled"]
    if result.time is not None:
        notes.append(f"at t = {result.time:.4g}" if unitless else f"at {_format_number(result.time, None, _TIME)}")
    value, target = _format_measure(name, result.value, result.uncertainty, display), ""
    if entry is not None:
        target = _format_measure(name, entry["expected"], entry["tolerance"], display)
        notes.append(entry["source"])
    passed = entry["passed"] if entry is not None else None
    return Row(name, display.label, value, target, passed, "; ".join(note for note in notes if note))


def body_rows(plain: PlainMapping, unitless: bool = False) -> list[tuple[str, str, str, str]]:
    """Return every body's name, mass, velocity (and Gurney's, if driven) and kinetic energy as text."""
    correlations = plain.get("correlations") or []
    gurney = {entry["quantity"].removeprefix(FINAL_VELOCITY): entry["value"] for entry in correlations}
    table = []
    for name, body in (plain.get("bodies") or {}).items():
        space = 3 if plain["whole"]["kind"] == "revolution" else len(body["velocity"])

        def quantity(value: float, unit: str, space: int = space) -> str:
            return _format_number(value, None, NumberFormat("", "", "" if unitless else unit + PER_DEPTH[space], -1))

        energy = body["kinetic_energy"]
        parts = ", ".join(f"{component + 0.0:.4g}" for component in body["velocity"])
        velocity = f"({parts})" if len(body["velocity"]) > 1 else parts
        velocity += "" if unitless else " m/s"
        turns = body.get("angular_velocity") or [0.0]
        rate = sum(component * component for component in turns) ** 0.5
        velocity += f", turning at {rate:.4g}{'' if unitless else ' rad/s'}" if rate > 0.0 else ""
        velocity += f", Gurney {gurney[name]:.4g} m/s" if name in gurney else ""
        unit = "kJ" if energy >= KILOJOULES else "J"
        table.append((name, quantity(body["mass"], "g"), velocity, quantity(energy, unit)))
    return table


def headline(summary: PlainMapping) -> Plain:
    """Return the main measures for the kind of case, those with an expected value first."""
    loaded = [layer for layer in summary.get("layers") or [] if (layer["measures"]["impulse"]["value"] or 0.0) != 0.0]
    decisive = loaded[-1] if loaded else None
    sections = {"layer": decisive, "projectile": summary.get("projectile"), "cloud": summary.get("cloud")}
    results: Plain = dict(summary["measures"])
    for section, content in sections.items():
        for name, result in ((content or {}).get("measures") or {}).items():
            results[f"{section}.{name}"] = result | {"note": (content or {}).get("body", section)}
    defined = {name for name, result in results.items() if result["value"] is not None}
    kind = next((kind for kind in ("bar", "plate impact", "shell") if HEADLINES[kind][0] in defined), "")
    if not kind and decisive is not None:
        kind = "perforation" if decisive["measures"]["perforated"]["value"] else "crater"
    names = [entry["name"] for entry in summary["expected"] if entry["name"] in results]
    names += [name for name in HEADLINES.get(kind, tuple(summary["measures"])) if name in defined and name not in names]
    return {name.rpartition(".")[2]: results[name] for name in names[: max(MOST_HEADLINES, len(summary["expected"]))]}


def _format_measure(name: str, value: float | None, spread: float | None, display: NumberFormat) -> str:
    if name == "perforated" and value is not None:
        return "yes" if value else "no"
    return _format_number(value, spread, display)


def _format_number(value: float | None, spread: float | None, display: NumberFormat) -> str:
    if value is None:
        return "-"

    display = display.scale_to(max(abs(value), abs(spread or 0.0)))
    # a size may be too small for the digits of its kind, and known better: of dust, or of a gas; or too large
    last, size = 10.0**-display.decimals, abs(value) * display.factor
    is_exact = abs(spread or 0.0) * display.factor < 0.5 * last
    is_tiny = display.unit not in UNSCALED_UNITS and is_exact and NEGLIGIBLE < size < 10.0 * last
    fixed = display.decimals >= 0 and not is_tiny and size < LARGEST_FIXED

    def number(figure: float) -> str:
        figure *= display.factor
        text = f"{figure:.{display.decimals}f}" if fixed else f"{figure:.3g}"
        return text if float(text) else text.lstrip("-")  # zero has no sign

    # an uncertainty that rounds to zero is not shown
    spread_text = f" ± {number(spread)}" if spread and float(number(spread)) > 0.0 else ""
    return f"{number(value)}{spread_text} {display.unit}".rstrip()


@dataclass(frozen=True)
class Column:
    """One quantity over time: its SI unit, empty for plain numbers, and its values, NaN where undefined."""

    unit: str
    values: np.ndarray


def moments(measured: Measures) -> tuple[Measures, ...]:
    """Return the moments of a series, or the single moment."""
    return measured.series or (measured,)


def columns(measured: Measures, sections: bool = False) -> dict[str, Column]:
    """Return every measure over time by its name, and number, shares and velocity of the fragments of each body.

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
            row[head + "loose_mass_share"] = "", part.share(part.counts < FEWEST_PARTICLES)
            row[head + "largest_mass_share"] = "", part.share([0])
            for axis, speed in zip("xyz", largest.velocity, strict=False):
                row[f"{head}largest_velocity_{axis}"] = "m/s", float(speed)
            row[head + "largest_speed"] = "m/s", largest.speed
        for section in [*moment.sections][1:] if sections else ():
            row |= _cells(f"{section}.", moment.sections[section])
        rows.append(row)
    valued = {name for row in rows for name, (_, value) in row.items() if value is not None}
    inner = ("projectile.", "cloud.", "layer.")
    cells = (cell for row in rows for cell in row.items() if cell[0] in valued or not cell[0].startswith(inner))
    units = {name: unit for name, (unit, _) in cells}
    return {
        name: Column(unit, np.array([row.get(name, (unit, None))[1] for row in rows], float))
        for name, unit in units.items()
    }


def _cells(head: str, results: Mapping[str, Result]) -> dict[str, tuple[str, float | None]]:
    """Return unit and value of each result, and of its further variants that have one, by the name of the column."""
    cells: dict[str, tuple[str, float | None]] = {}
    for name, result in results.items():
        cells[f"{head}{name}"] = result.unit, result.value
        for variant, part in [*result.variants.items()][1:]:
            if part.value is not None:
                cells[f"{head}{name}.{variant}"] = part.unit, part.value
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
    head = [_heading("time", "s", measured), "body", "fragment", "role", "particles"]
    head += [_heading("mass", measured.mass_unit, measured), "mass_share", "number_at_least", "mass_share_at_least"]
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


def _write(path: str | os.PathLike[str], head: Sequence[str], body: Iterable[Sequence[object]]) -> Path:
    def cell(value: object) -> object:
        if not isinstance(value, float):
            return value
        return value + 0.0 if np.isfinite(value) else ""  # no -0.0

    write_csv(Path(path), [head, *(map(cell, row) for row in body)])
    return Path(path)
