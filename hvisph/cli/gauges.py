"""`hvisph gauges`: a picture of what the gauges of a run recorded, beside the exact solution if wanted."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def gauges(
    run: Annotated[str, typer.Argument(metavar="RUN", help="Folder of a run.")],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="Picture to write; RUN/gauges.png unless given."),
    ] = None,
    exact: Annotated[bool, typer.Option("--exact", help="Draw the exact solution beside (1D).")] = False,
) -> None:
    """Draw the gauges of a run: one panel a field, one line a gauge."""
    from hvisph.case.loader import load_case
    from hvisph.measure.curves import curves_picture, gauge_panels, steps

    folder = Path(run)
    case = load_case(folder / "case.yaml")
    beside = {}
    if exact:
        from hvisph.simulation.exact_solution import exact_solution

        for gauge in exact_solution(case).gauges:
            for column in gauge.columns:
                beside[f"gauge.{gauge.name}.{column}"] = steps(gauge.times, gauge.values(column), case.time.end)
    picture = curves_picture(
        gauge_panels(folder, beside), out or folder / "gauges.png", title=case.title, unitless=case.units == "none"
    )
    typer.echo(str(picture))
