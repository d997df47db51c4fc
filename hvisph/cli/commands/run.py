"""`hvisph run` and `hvisph resume`: compute a case, or continue a run."""

from __future__ import annotations

from pathlib import Path
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
from hvisph.parallel.mpi_launch import is_first


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


def resume(
    folder: Annotated[Path, typer.Argument(metavar="RUN", help="Folder of the run.")],
    end: Annotated[
        str | None, typer.Option("--end", metavar="TIME", help="New end time: 10us; the case's unless given.")
    ] = None,
    max_steps: Annotated[
        int | None,
        typer.Option("--max-steps", min=0, metavar="N", help="Number of steps after which to stop; 0 for no limit."),
    ] = None,
    threads: ThreadsOption = None,
    report: ReportOption = False,
    everything: AllOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Continue a run from its newest checkpoint."""
    from hvisph.simulation.resume import has_ended, resume_case, resume_run

    case = resume_case(folder, end, max_steps)
    if end is None and max_steps is None and has_ended(folder) and not (quiet or as_json) and is_first():
        typer.echo("the run has ended: this only sums it up anew; --end TIME goes on", err=True)
    listener = listener_for(case, quiet or as_json)
    listener.opening()
    try:
        with interrupt_notice(folder), noted_interrupts():
            outcome = resume_run(folder, case, threads=threads, listener=listener)
    finally:
        listener.close()
    conclude(outcome, case.units == "none", quiet, as_json, report or case.output.report, everything)
