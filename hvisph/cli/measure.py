"""`hvisph measure`: lengths, peaks and voids of a run or a snapshot, from its files alone."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any

import typer

from hvisph.cli.options import JsonOption


def measure(
    source: Annotated[str, typer.Argument(metavar="SOURCE", help="Folder of a run, or one snapshot: HDF5 or VTU.")],
    at: Annotated[
        str | None,
        typer.Option(
            "--at",
            metavar="TIME|all",
            help="Snapshot nearest to a time (4us), or all; the last unless given.",
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Measure a run: crater, penetration, pressures, voids."""
    from hvisph.measure.measures import measure as measure_source

    found = measure_source(source, _moment(at))
    if as_json:
        from hvisph.cli.words import echo_json

        echo_json(found.as_dict())
        return
    case = _case_of(Path(source))
    unitless = case is not None and case.units == "none"
    typer.echo(found.title or str(source))
    if found.series:
        typer.echo(_series(found.series, unitless))
        return
    expected = _expected(case, found) if at is None else []
    from hvisph.cli.results import results_table
    from hvisph.cli.words import quantity

    typer.echo(f"t = {quantity(found.time, '' if unitless else 's')}, step {found.step}\n")
    typer.echo(results_table(found.as_dict()["measures"], expected, unitless))


def _moment(text: str | None) -> float | str | None:
    """Return `--at` as the room of measures wants it: None, seconds or ``all``."""
    if text is None or text == "all":
        return text
    from hvisph.case.dimensions import TIME
    from hvisph.case.units import parse_quantity
    from hvisph.core.errors import CaseError

    try:
        return parse_quantity(text, TIME)
    except ValueError as error:
        raise CaseError(f"{error}, or all", where="--at") from None


def _case_of(folder: Path) -> Any:
    """Return the effective case of a run's folder; None where there is none that can be read."""
    path = folder / "case.yaml"
    if path.is_file():
        from hvisph.case.loader import load_case
        from hvisph.core.errors import CaseError

        # of a later version, say: the files can be measured all the same
        with suppress(CaseError):
            return load_case(path)
    return None


def _expected(case: Any, found: Any) -> list[dict[str, Any]]:
    """Return the comparison with what the case expects at its end; none before that."""
    if case is None or found.time < case.time.end * (1.0 - 1e-9):
        return []
    from hvisph.measure.expected import compare

    asked = {name: entry for name, entry in case.expected.items() if name in found.results}
    return compare(found.results, asked)


def _series(series: Any, unitless: bool) -> str:
    """Return one line a moment, one column a measure that ever has a value."""
    from hvisph.cli.words import quantity, table
    from hvisph.measure.table import rows

    shown = [{row.name: row for row in rows(moment.results, unitless=unitless)} for moment in series]
    names = [name for name in shown[0] if any(found[name].value != "-" for found in shown)]
    table_rows = [["t", *(shown[0][name].label for name in names)]]
    if not unitless:
        table_rows.append(["", *(_unit([found[name].value for found in shown]) for name in names)])
    for moment, found in zip(series, shown, strict=True):
        time = quantity(moment.time, "" if unitless else "s", 3)
        table_rows.append([time, *(found[name].value.split(" ")[0] for name in names)])
    return table(table_rows)


def _unit(values: list[str]) -> str:
    """Return the unit that stands behind the numbers in `values`."""
    last = next(value for value in values if value != "-").split(" ")[-1]
    return "" if last[-1].isdigit() else last
