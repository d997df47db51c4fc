"""`hvisph run`: computation of a case with progress on the terminal."""

from __future__ import annotations

from typing import Annotated

import typer

from hvisph.cli.guard import noted_interrupts
from hvisph.cli.loading import load, locate_errors, run_folder
from hvisph.cli.options import (
    AllOption,
    CaseArgument,
    JsonOption,
    OutOption,
    QuietOption,
    ReportOption,
    ResolutionOption,
    SetOption,
    ThreadsOption,
)
from hvisph.cli.text.run_report import conclude, interrupt_notice, listener_for


def run(
    case: CaseArgument,
    out: OutOption = None,
    resolution: ResolutionOption = None,
    settings: SetOption = None,
    threads: ThreadsOption = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an earlier run in the folder.")] = False,
    report: ReportOption = False,
    everything: AllOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run a case and write its folder.

    Exit codes: 0 done, 1 an expectation was missed, 2 invalid input, 3 failed.
    """
    loaded = load(case, settings, resolution)
    listener = listener_for(loaded, quiet or as_json)
    listener.opening()
    from hvisph.simulation.run import run as run_case

    folder = out or run_folder(case)
    try:
        with locate_errors(case), interrupt_notice(folder), noted_interrupts():
            outcome = run_case(loaded, folder, force=force, threads=threads, listener=listener)
    finally:
        listener.close()
    conclude(outcome, loaded.units == "none", quiet, as_json, report or loaded.output.report, everything)
