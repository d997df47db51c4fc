"""`hvisph gauges`: gauge histories with the optional exact solution."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hvisph.cli.text.echo import say
from hvisph.core.errors import CaseError


def gauges(
    run: Annotated[str, typer.Argument(metavar="RUN", help="Folder of a run.")],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="Picture to write; RUN/gauges.png unless given."),
    ] = None,
    exact: Annotated[bool, typer.Option("--exact", help="Draw the exact solution as well (1D).")] = False,
) -> None:
    """Draw the gauges of a run: one panel per field, one line per gauge."""
    from hvisph.casefile.loader import load_case
    from hvisph.postprocessing.gauge_overlay import overlay
    from hvisph.visualization.curves import curves_picture

    folder = Path(run)
    made = overlay({folder.name: folder}, exact)
    for reason in made.without.values():
        raise CaseError(f"there is no exact solution to draw: {reason}", where="--exact")
    title = load_case(folder / "case.yaml").title
    say(str(curves_picture(made.panels, out or folder / "gauges.png", title=title, unitless=made.unitless)))
