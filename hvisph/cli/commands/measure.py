"""`hvisph measure`: measures of a run or a snapshot."""

import textwrap
from collections.abc import Sequence
from pathlib import Path

from hvisph.case.case import Case
from hvisph.cli.formatting import SCREEN, echo_json, quantity, say, show, table, times
from hvisph.cli.options import JsonOption, argument, case_of_run, option, parse_option
from hvisph.cli.results_table import bodies_table, fragments_series, fragments_text, results_table, sections_table
from hvisph.core.errors import CaseError
from hvisph.core.text import Plain, sanitize
from hvisph.measures.compare import compare_expected
from hvisph.measures.fragments import FEWEST_PARTICLES
from hvisph.measures.measure import Measures
from hvisph.measures.measure import measure as measure_source
from hvisph.measures.tables import rows, write_fragments, write_series
from hvisph.visualization.curves import series_picture, witness_picture

HEADING = 14  # of a column's name, which is broken where it is longer
FAR = 0.1  # largest relative distance of the nearest snapshot from the requested time without a note


def measure(
    source: str = argument("SOURCE", "Folder of a run, or a snapshot; of another code VTU, VTP, VTK or LAMMPS dump."),
    at: str | None = option("--at TIME|all", "Snapshot nearest to a time (4us), or all; the last unless given.", None),
    fragments: bool = option("--fragments", "List the fragments of every body: groups linked at 2 dx.", False),
    smallest: int | None = option(
        "--smallest N", "With --fragments: fewest particles of one listed (5); smaller ones are summed.", None, min=1
    ),
    csv: Path | None = option("--csv FILE", "Write a row per snapshot or fragment; SI units.", None),
    plot: Path | None = option("--plot FILE", "Draw all measures over time; FILE.png or .pdf.", None),
    witness: Path | None = option("--witness FILE", "Draw the debris at a witness plane; FILE.png.", None),
    plane: str | None = option("--plane X", "Witness plane along the shot line, 100mm; the case's unless given.", None),
    units: str = option(
        "--units L,M,T", "For files of other codes: units of length, mass and time, such as mm,g,us.", ""
    ),
    field: list[str] | None = option("--field QUANTITY=NAME", "Another code's name of a quantity: density=rho0.", None),
    as_json: JsonOption = False,
) -> None:
    """Measure a run: crater, penetration, pressures, plug, fragments; at one time or over time."""
    _refuse(at, fragments, smallest, plot)
    moment = at if at in (None, "all") else parse_option(at, "TIME", "--at", ", or all")
    plane_position = None if plane is None else parse_option(plane, "LENGTH", "--plane")
    moments = "all" if plot is not None else moment
    measured = measure_source(source, moments, names=_names(field or []), units=_units(units), witness=plane_position)
    if isinstance(moment, float) and abs(measured.time - moment) > FAR * max(abs(moment), measured.time):
        say(f"note: there is no snapshot near --at {at}; this is the nearest", err=True)
    if csv is not None:
        (write_fragments if fragments else write_series)(measured, csv)
    if plot is not None or witness is not None:
        if plot is not None:
            series_picture(measured, plot)
        if witness is not None:
            witness_picture(measured.cloud, witness, measured.title)
    fewest = smallest or FEWEST_PARTICLES
    if as_json:
        echo_json(measured.fragments_as_dict(fewest) if fragments else measured.as_dict())
        return
    text = _fragments(measured, fewest) if fragments else _measures(source, measured, at)
    show(f"{sanitize(measured.title or source)}\n{text}")
    for file in (csv, plot, witness):
        if file is not None:
            say(str(file))


def _refuse(at: str | None, fragments: bool, smallest: int | None, plot: Path | None) -> None:
    """Raise `CaseError` for options that exclude each other."""
    if smallest is not None and not fragments:
        raise CaseError("it is an option of --fragments", where="--smallest")
    if plot is not None and fragments:
        reason = "fragments as a list have no picture; without --fragments it shows how they develop"
        raise CaseError(reason, where="--plot")
    if plot is not None and at not in (None, "all"):
        raise CaseError("a picture shows all moments; leave --at out", where="--plot")


def _names(fields: list[str]) -> dict[str, str]:
    """Return the file's name of each quantity, from `--field`."""
    names = {}
    for text in fields:
        quantity, equals, name = text.partition("=")
        if not (quantity.strip() and equals and name.strip()):
            raise CaseError(f"'{text}' is no QUANTITY=NAME, such as density=rho", where="--field")
        names[quantity.strip().replace(" ", "_").replace("-", "_")] = name.strip()
    return names


def _units(text: str) -> tuple[float, float, float] | None:
    """Return units of length, mass and time in SI; None where none are given."""
    if not text:
        return None
    parts = [part.strip() for part in text.split(",")]
    if len(parts) != 3 or not all(part and part[0].isalpha() for part in parts):
        raise CaseError(f"'{text}' is no length, mass and time, such as mm,g,us", where="--units")
    remedy, kinds = "; give length, mass and time, such as mm,g,us", ("LENGTH", "MASS", "TIME")
    length, mass, time = (
        parse_option(f"1 {part}", dimension, "--units", remedy) for part, dimension in zip(parts, kinds, strict=True)
    )
    return length, mass, time


def _fragments(measured: Measures, fewest: int) -> str:
    if measured.series:
        return fragments_series(measured.series, fewest)
    time = quantity(measured.time, "" if measured.unitless else "s")
    return f"t = {time}, step {measured.step}; fragments are linked at 2 dx\n\n{fragments_text(measured, fewest)}"


def _measures(source: str, measured: Measures, at: str | None) -> str:
    """Return the measures of the moment with their expected values, or of all moments."""
    if measured.series:
        return _series(measured.series, measured.unitless)
    case = case_of_run(Path(source))
    expected = _compare_expected(case, measured) if at is None else []
    time = quantity(measured.time, "" if measured.unitless else "s")
    content, unitless = measured.as_dict(), measured.unitless
    parts = (
        results_table(content["measures"], expected, unitless, variants=True),
        sections_table(content, unitless, variants=True),
        bodies_table(content, unitless),
    )
    text = "\n\n".join(part for part in parts if part)
    head = f"{measured.answer}\n\n" if measured.answer else ""
    return f"t = {time}, step {measured.step}\n\n{head}{text}"


def _compare_expected(case: Case | None, measured: Measures) -> list[Plain]:
    """Return the comparison with the expected values of the case at its end; none before."""
    if case is None or measured.time < case.time.end * (1.0 - 1e-9):
        return []
    comparable = {name: entry for name, entry in case.expected.items() if name in measured.results}
    return compare_expected(measured.results, comparable.items())


def _series(series: Sequence[Measures], unitless: bool) -> str:
    """Return one line a moment, one column a measure that ever has a value, in tables that fit a screen."""
    moments = [{row.name: row for row in rows(moment.results, unitless=unitless)} for moment in series]
    names = [name for name in moments[0] if any(cells[name].value != "-" for cells in moments)]
    first = ["t", *times([moment.time for moment in series], "" if unitless else "s")]
    blocks: list[list[list[str]]] = []
    width = SCREEN
    for name in names:
        values = [cells[name].value for cells in moments]
        heading = textwrap.wrap(moments[0][name].label, HEADING)
        column = [*heading, *([] if unitless else [_unit(values)]), *(value.split(" ")[0] for value in values)]
        column_width = max(map(len, column)) + 2
        if width + column_width > SCREEN:
            blocks.append([first])
            width = max(map(len, first)) + 4  # with the indent
        blocks[-1].append(column)
        width += column_width
    return "\n\n".join(table(_lines(block)) for block in blocks)


def _lines(columns: list[list[str]]) -> list[list[str]]:
    """Return the rows of columns that are aligned at their ends; the first column has its head in the first row."""
    first, *columns_right = columns
    height = max(map(len, columns_right))
    padded = [[first[0], *[""] * (height - len(first)), *first[1:]]]
    padded += [[*[""] * (height - len(column)), *column] for column in columns_right]
    return [list(line) for line in zip(*padded, strict=True)]


def _unit(values: list[str]) -> str:
    last = next(value for value in values if value != "-").split(" ")[-1]
    return "" if last[-1].isdigit() else last
