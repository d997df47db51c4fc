"""`hvisph compare`: tables and pictures of several runs."""

import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import typer

from hvisph.cli import options
from hvisph.cli.formatting import echo_json, say, show
from hvisph.cli.guard import FAILED
from hvisph.cli.options import argument, option
from hvisph.cli.results_table import comparison_tables, gauge_table
from hvisph.cli.run_report import shown_progress
from hvisph.core.errors import CaseError, suggest_nearest
from hvisph.core.fields import CATALOGUE
from hvisph.core.text import Plain
from hvisph.measures.compare import row
from hvisph.postprocessing.comparison import Entry, complete, entries, is_run
from hvisph.postprocessing.exact_solution import overlay
from hvisph.postprocessing.run_data import draw_last_states
from hvisph.visualization.curves import curves_picture


def compare(
    sources: list[str] = argument(
        "SOURCE...", "Folders of runs, snapshots, case files, names of bundled cases, folders of any of these."
    ),
    runs: Path = option("--runs DIR", "Folder for cases that have not been run.", Path("runs")),
    resolution: options.ResolutionOption = None,
    settings: options.SetOption = None,
    threads: options.ThreadsOption = None,
    field: str | None = option("--field NAME", "Field that colours the picture; pressure unless given.", None),
    picture: Path | None = option("--picture FILE", "Draw the final states into one picture: png, pdf, svg.", None),
    gauges: Path | None = option(
        "--gauges FILE", "Draw all gauges, in 1D with the exact solution and a table of differences.", None
    ),
    all_measures: bool = option("--all", "Show all measures, not only the main ones.", False),
    force: bool = option("--force", "Run all cases again.", False),
    quiet: options.QuietOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Compare runs: measures, differences from published values, conservation, cost.

    Cases that have not been run are run first. Exit codes: 0 done, 2 invalid input, 3 a run failed.
    """
    if field is not None and picture is None:
        raise CaseError("needs --picture FILE, which it colours", where="--field")
    run_entries = entries(sources, runs=runs, overrides=settings or (), resolution=resolution)
    if picture is not None and any(entry.case is not None for entry in run_entries):
        _refuse_picture(picture, field)
    if gauges is not None:
        options.refuse_format(gauges, "--gauges")
    _complete(run_entries, threads, force, quiet or as_json)
    rows = [row(entry.name, entry.folder) for entry in run_entries]
    folders = {entry.name: entry.folder for entry in run_entries}
    if picture is not None:
        draw_last_states(folders, picture, field or "pressure")
    overlaid = None if gauges is None else overlay(folders)
    if overlaid is not None and gauges is not None:
        curves_picture(overlaid.panels, gauges, title="Gauges", unitless=overlaid.unitless)
    if as_json:
        content: Plain = {"rows": [r.as_dict() for r in rows], "picture": None if picture is None else str(picture)}
        if overlaid is not None:
            content["gauges"] = {
                name: {column: asdict(difference) for column, difference in columns.items()}
                for name, columns in overlaid.differences.items()
            }
        echo_json(content)
    elif not quiet:
        unitless = any(_unitless(entry) for entry in run_entries)
        show(comparison_tables(rows, unitless, all_measures))
        if overlaid is not None:
            say(gauge_table(overlaid))
        for file in (picture, gauges):
            if file is not None:
                say(f"\n{file}")
    failed = [r.name for r in rows if r.status == "failed"]
    if failed:
        say(f"error: failed: {', '.join(failed)}", err=True, red=True)
        raise typer.Exit(FAILED)


def _refuse_picture(picture: Path, field: str | None) -> None:
    """Refuse an invalid picture before anything runs."""
    options.refuse_format(picture, "--picture")
    if field not in (None, "body", *CATALOGUE):
        raise CaseError(
            f"there is no field '{field}'{suggest_nearest(str(field), ['body', *CATALOGUE])}", where="--field"
        )


def _complete(run_entries: Sequence[Entry], threads: int | None, force: bool, silent: bool) -> None:
    """Run the cases without results; an interrupt ends the command."""
    todo = [entry for entry in run_entries if entry.case is not None and (force or not is_run(entry))]
    if not todo:
        return
    for number, entry in enumerate(todo, 1):
        if not silent:
            say(f"[{number}/{len(todo)}] {entry.name}")
        assert entry.case is not None
        with options.locate_errors(str(entry.file)), shown_progress(entry.case, silent) as listener:
            outcome = complete(entry, threads=threads, force=force, listener=listener)
        if outcome is not None and outcome.summary["status"] == "interrupted":
            say(f"interrupted; the same command continues with {entry.name}", err=True)
            raise typer.Exit(outcome.exit_code)
        if not silent:
            sys.stdout.flush()


def _unitless(entry: Entry) -> bool:
    case = entry.case or options.case_of_run(entry.folder)
    return case is not None and case.units == "none"
