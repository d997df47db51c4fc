"""`hvisph exact`: exact solution of a one-dimensional impact."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hvisph.cli.loading import load, locate_errors
from hvisph.cli.options import CaseArgument, JsonOption, ResolutionOption, SetOption
from hvisph.cli.text.echo import say
from hvisph.cli.text.formatting import echo_json


def exact(
    case: CaseArgument,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder to write; exact/NAME unless given.")
    ] = None,
    resolution: ResolutionOption = None,
    settings: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Solve a 1D case exactly: histories at its gauges, profiles at its output times, pictures."""
    loaded = load(case, settings, resolution)
    from hvisph.casefile.paths import run_name
    from hvisph.postprocessing.exact_files import write_exact
    from hvisph.postprocessing.exact_solution import exact_solution

    with locate_errors(case):
        solution = exact_solution(loaded)
    folder = out or Path("exact") / run_name(case)
    files = write_exact(solution, loaded, folder)
    if as_json:
        gauges = {
            g.name: {"time": g.times.tolist()} | {c: g.values(c).tolist() for c in g.columns} for g in solution.gauges
        }
        echo_json({"folder": str(folder), "files": [path.name for path in files], "gauges": gauges})
        return
    say(loaded.title or case)
    kind = "barotropic layers" if solution.barotropic else "elastic-plastic plates"
    kind += f", waves down to {solution.tracked.weakest:.1g} of the strongest"
    say(f"exact: {kind}; {len(solution.tracked.fronts)} pieces of fronts")
    left_out = [name for name, gauge in loaded.gauges.items() if gauge.type == "fixed"]
    if left_out:
        say(f"left out, being fixed in space: {', '.join(left_out)}")
    say(f"{len(files)} files in {folder}")
