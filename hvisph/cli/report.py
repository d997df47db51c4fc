"""`hvisph report`: one page that shows runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hvisph.cli.options import QuietOption
from hvisph.cli.say import say


def report(
    runs: Annotated[list[str], typer.Argument(metavar="RUN...", help="Folders of runs, side by side.")],
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="FILE", help="Page to write; report.html in the run's folder."),
    ] = None,
    quiet: QuietOption = False,
) -> None:
    """Write one self-contained page: verdict, player, measures, health, set-up. It needs no network."""
    from hvisph.report.build import report as build

    path = build(runs, out)
    if not quiet:
        say(str(path))
