"""`hvisph measure` and `compare`: measures of a run or a snapshot; tables and pictures of several runs."""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from hvisph.cli.formatting import SCREEN, echo_json, quantity, say, show, table, times
from hvisph.cli.guard import FAILED, case_of_run, locate_errors, noted_interrupts, parse_option, refuse_format
from hvisph.cli.options import JsonOption, QuietOption, ResolutionOption, SetOption, ThreadsOption, argument, option
from hvisph.cli.results_table import bodies_table, comparison_tables, gauge_table, results_table, sections_table
from hvisph.core.errors import CaseError, suggest_nearest
from hvisph.core.text import Plain, sanitize

if TYPE_CHECKING:
    from hvisph.case.case import Case
    from hvisph.measures.measure import Measures
    from hvisph.postprocessing.comparison import Entry
    from hvisph.postprocessing.exact_solution import Overlay

HEADING = 14  # of a column's name, which is broken where it is longer
# Largest relative distance of the nearest snapshot from the requested time without a note.
FAR = 0.1


def measure(
    source: str = argument("SOURCE", "Folder of a run, or a snapshot; of another code VTU, VTP, VTK or LAMMPS dump."),
    at: str | None = option("--at TIME|all", "Snapshot nearest to a time (4us), or all; the last unless given.", None),
    fragments: bool = option("--fragments", "List the fragments of every body: groups linked at 2 dx.", False),
    smallest: int | None = option(
        "--smallest N",
        "With --fragments: smallest number of particles to list, 5 unless given; smaller ones are summed.",
        None,
        min=1,
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
    from hvisph.measures.fragments import FEWEST
    from hvisph.measures.measure import measure as measure_source

    moment = at if at in (None, "all") else parse_option(at, "TIME", "--at", ", or all")
    along = None if plane is None else parse_option(plane, "LENGTH", "--plane")
    chosen = "all" if plot is not None else moment
    measured = measure_source(source, chosen, names=_names(field or []), units=_units(units), witness=along)
    if isinstance(moment, float) and abs(measured.time - moment) > FAR * max(abs(moment), measured.time):
        say(f"note: there is no snapshot near --at {at}; this is the nearest", err=True)
    if csv is not None:
        from hvisph.measures.tables import write_fragments, write_series

        (write_fragments if fragments else write_series)(measured, csv)
    if plot is not None or witness is not None:
        from hvisph.visualization.curves import series_picture, witness_picture

        if plot is not None:
            series_picture(measured, plot)
        if witness is not None:
            witness_picture(measured.cloud, witness, measured.title)
    fewest = smallest or FEWEST
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
    chosen = {}
    for text in fields:
        quantity, equals, name = text.partition("=")
        if not (quantity.strip() and equals and name.strip()):
            raise CaseError(f"'{text}' is no QUANTITY=NAME, such as density=rho", where="--field")
        chosen[quantity.strip().replace(" ", "_").replace("-", "_")] = name.strip()
    return chosen


def _units(text: str) -> tuple[float, float, float] | None:
    """Return units of length, mass and time in SI; None where none are given."""
    if not text:
        return None
    parts = [part.strip() for part in text.split(",")]
    if len(parts) != 3 or not all(part and part[0].isalpha() for part in parts):
        raise CaseError(f"'{text}' is no length, mass and time, such as mm,g,us", where="--units")
    remedy, kinds = "; give length, mass and time, such as mm,g,us", ("LENGTH", "MASS", "TIME")
    length, mass, time = (
        parse_option(f"1 {part}", kind, "--units", remedy) for part, kind in zip(parts, kinds, strict=True)
    )
    return length, mass, time


def _fragments(measured: Measures, fewest: int) -> str:
    from hvisph.cli.results_table import fragments_series, fragments_text

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
    plain = measured.as_dict()
    unitless = measured.unitless
    parts = (
        results_table(plain["measures"], expected, unitless, variants=True),
        sections_table(plain, unitless, variants=True),
        bodies_table(plain, unitless),
    )
    shown = "\n\n".join(part for part in parts if part)
    head = f"{measured.answer}\n\n" if measured.answer else ""
    return f"t = {time}, step {measured.step}\n\n{head}{shown}"


def _compare_expected(case: Case | None, measured: Measures) -> list[Plain]:
    """Return the comparison with the expected values of the case at its end; none before."""
    if case is None or measured.time < case.time.end * (1.0 - 1e-9):
        return []
    from hvisph.measures.compare import compare_expected

    known = {name: entry for name, entry in case.expected.items() if name in measured.results}
    return compare_expected(measured.results, known)


def _series(series: Sequence[Measures], unitless: bool) -> str:
    """Return one line a moment, one column a measure that ever has a value, in tables that fit a screen."""
    from hvisph.measures.tables import rows

    shown = [{row.name: row for row in rows(moment.results, unitless=unitless)} for moment in series]
    names = [name for name in shown[0] if any(cells[name].value != "-" for cells in shown)]
    first = ["t", *times([moment.time for moment in series], "" if unitless else "s")]
    blocks: list[list[list[str]]] = []
    width = SCREEN
    for name in names:
        values = [cells[name].value for cells in shown]
        heading = textwrap.wrap(shown[0][name].label, HEADING)
        column = [*heading, *([] if unitless else [_unit(values)]), *(value.split(" ")[0] for value in values)]
        own = max(map(len, column)) + 2
        if width + own > SCREEN:
            blocks.append([first])
            width = max(map(len, first)) + 4  # with the indent
        blocks[-1].append(column)
        width += own
    return "\n\n".join(table(_lines(block)) for block in blocks)


def _lines(columns: list[list[str]]) -> list[list[str]]:
    """Return the rows of columns that are aligned at their ends; the first column has its head in the first row."""
    first, *others = columns
    height = max(map(len, others))
    padded = [[first[0], *[""] * (height - len(first)), *first[1:]]]
    padded += [[*[""] * (height - len(column)), *column] for column in others]
    return [list(line) for line in zip(*padded, strict=True)]


def _unit(values: list[str]) -> str:
    last = next(value for value in values if value != "-").split(" ")[-1]
    return "" if last[-1].isdigit() else last


def compare(
    sources: list[str] = argument(
        "SOURCE...", "Folders of runs, snapshots, case files, names of bundled cases, folders of any of these."
    ),
    runs: Path = option("--runs DIR", "Folder for cases that have not been run.", Path("runs")),
    resolution: ResolutionOption = None,
    settings: SetOption = None,
    threads: ThreadsOption = None,
    field: str | None = option("--field NAME", "Field that colours the picture; pressure unless given.", None),
    picture: Path | None = option("--picture FILE", "Draw the final states into one picture: png, pdf, svg.", None),
    gauges: Path | None = option(
        "--gauges FILE",
        "Draw all gauges into one picture, in 1D with the exact solution and a table of differences.",
        None,
    ),
    every: bool = option("--all", "Show all measures, not only the main ones.", False),
    force: bool = option("--force", "Run all cases again.", False),
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Compare runs: measures, differences from published values, conservation, cost.

    Cases that have not been run are run first. Exit codes: 0 done, 2 invalid input, 3 a run failed.
    """
    if field is not None and picture is None:
        raise CaseError("needs --picture FILE, which it colours", where="--field")
    from hvisph.postprocessing.comparison import entries

    chosen = entries(sources, runs=runs, overrides=settings or (), resolution=resolution)
    if picture is not None and any(entry.case is not None for entry in chosen):
        _refuse_picture(picture, field)
    if gauges is not None:
        refuse_format(gauges, "--gauges")
    _complete(chosen, threads, force, quiet or as_json)
    from hvisph.measures.compare import row

    rows = [row(entry.name, entry.folder) for entry in chosen]
    if picture is not None:
        from hvisph.postprocessing.run_data import draw_last_states

        draw_last_states({entry.name: entry.folder for entry in chosen}, picture, field or "pressure")
    overlaid = None if gauges is None else _draw_gauges({entry.name: entry.folder for entry in chosen}, gauges)
    if as_json:
        plain: Plain = {"rows": [r.as_dict() for r in rows], "picture": None if picture is None else str(picture)}
        if overlaid is not None:
            plain["gauges"] = {
                name: {column: asdict(one) for column, one in columns.items()}
                for name, columns in overlaid.differences.items()
            }
        echo_json(plain)
    elif not quiet:
        unitless = any(_unitless(entry) for entry in chosen)
        show(comparison_tables(rows, unitless, every))
        if overlaid is not None:
            say(gauge_table(overlaid))
        for drawn in (picture, gauges):
            if drawn is not None:
                say(f"\n{drawn}")
    failed = [r.name for r in rows if r.status == "failed"]
    if failed:
        say(f"error: failed: {', '.join(failed)}", err=True, red=True)
        raise typer.Exit(FAILED)


def _refuse_picture(picture: Path, field: str | None) -> None:
    """Refuse an invalid picture before anything runs."""
    from hvisph.core.fields import CATALOGUE

    refuse_format(picture, "--picture")
    if field not in (None, "body", *CATALOGUE):
        raise CaseError(
            f"there is no field '{field}'{suggest_nearest(str(field), ['body', *CATALOGUE])}", where="--field"
        )


def _draw_gauges(folders: dict[str, Path], picture: Path) -> Overlay:
    from hvisph.postprocessing.exact_solution import overlay
    from hvisph.visualization.curves import curves_picture

    made = overlay(folders)
    curves_picture(made.panels, picture, title="Gauges", unitless=made.unitless)
    return made


def _complete(chosen: Sequence[Entry], threads: int | None, force: bool, silent: bool) -> None:
    """Run the cases without results; an interrupt ends the command."""
    from hvisph.postprocessing.comparison import is_run

    todo = [entry for entry in chosen if entry.case is not None and (force or not is_run(entry))]
    if not todo:
        return
    from hvisph.cli.run_report import listener_for
    from hvisph.postprocessing.comparison import complete

    for number, entry in enumerate(todo, 1):
        if not silent:
            say(f"[{number}/{len(todo)}] {entry.name}")
        assert entry.case is not None
        listener = listener_for(entry.case, silent)
        listener.opening()
        try:
            with locate_errors(str(entry.file)), noted_interrupts():
                outcome = complete(entry, threads=threads, force=force, listener=listener)
        finally:
            listener.close()
        if outcome is not None and outcome.summary["status"] == "interrupted":
            say(f"interrupted; the same command goes on with {entry.name}", err=True)
            raise typer.Exit(outcome.exit_code)
        if not silent:
            sys.stdout.flush()


def _unitless(entry: Entry) -> bool:
    case = entry.case or case_of_run(entry.folder)
    return case is not None and case.units == "none"
