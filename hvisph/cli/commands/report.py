"""`hvisph report`: HTML report of runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hvisph.cli.options import QuietOption
from hvisph.cli.text.echo import say


def report(
    runs: Annotated[list[str], typer.Argument(metavar="RUN...", help="Folders of runs, or of one sweep.")],
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="FILE", help="Page to write; report.html in the run's folder."),
    ] = None,
    each: Annotated[bool, typer.Option("--each", help="For a sweep, also write a page for every run.")] = False,
    quiet: QuietOption = False,
) -> None:
    """Write one self-contained page: verdict, player, measures, warnings, set-up."""
    from hvisph.visualization.html.report import report as build
    from hvisph.visualization.html.sweep import is_sweep, sweep_report

    path = sweep_report(runs[0], out, each=each) if len(runs) == 1 and is_sweep(runs[0]) else build(runs, out)
    if not quiet:
        say(str(path))
