"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

CaseArgument = Annotated[
    str, typer.Argument(metavar="CASE", help="Case file, or name of a bundled case (see `hvisph cases`).")
]
ResolutionOption = Annotated[
    str | None,
    typer.Option("--resolution", metavar="LENGTH", help="Particle spacing in place of the case's: 0.2mm."),
]
SetOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="PATH=VALUE", help="Set any field of the case: time.end=2us. Repeatable."),
]
ThreadsOption = Annotated[
    int | None,
    typer.Option(
        "--threads",
        min=1,
        metavar="N",
        help="Number of threads; unless given as many as the work of a step is worth.",
    ),
]
PictureOption = Annotated[
    str | None, typer.Option("--picture", metavar="FILE", help="Draw the set-up into this file: setup.png.")
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON only, in SI units.")]
ReportOption = Annotated[bool, typer.Option("--report", help="Write the run's report.html when it ends.")]
AllOption = Annotated[bool, typer.Option("--all", help="Print all measures when the run ends.")]
QuietOption = Annotated[bool, typer.Option("--quiet", help="Print nothing but errors.")]
OutOption = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="Folder of the run; runs/NAME unless given.")
]
