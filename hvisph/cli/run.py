"""`hvisph run`: compute a case, live on the terminal."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hvisph.cli.guard import FAILED
from hvisph.cli.options import CaseArgument, JsonOption, OutOption, ResolutionOption, SetOption, ThreadsOption

if TYPE_CHECKING:
    from hvisph.simulation.listener import Listener


def run(
    case: CaseArgument,
    out: OutOption = None,
    resolution: ResolutionOption = None,
    settings: SetOption = None,
    threads: ThreadsOption = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an earlier run in the folder.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="Print nothing but errors.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Run a case and write its folder.

    Exit codes: 0 done and as expected, 1 ran but missed an expectation, 2 bad input, 3 failed.
    """
    from hvisph.case.loader import load_case

    loaded = load_case(case, settings or (), resolution)
    listener = _listener(loaded, quiet or as_json)
    listener.opening()
    from hvisph.simulation.run import run as run_case

    try:
        outcome = run_case(
            loaded, out or Path("runs") / Path(case).stem, force=force, threads=threads, listener=listener
        )
    finally:
        listener.close()
    if as_json:
        from hvisph.cli.words import echo_json

        echo_json(outcome.summary)
    elif not quiet:
        _close(outcome.summary, outcome.folder, unitless=loaded.units == "none")
    failure = outcome.summary["failure"]
    if failure is not None:
        typer.secho(f"error: the run failed: {failure['message']}", err=True, fg=typer.colors.RED)
    raise typer.Exit(outcome.exit_code or (FAILED if failure is not None else 0))


def _listener(case: Any, silent: bool) -> Listener:
    """Return what tells people how the run goes: a live display on a terminal, lines elsewhere."""
    from hvisph.cli.lines import Lines, Silence

    if silent:
        return Silence()
    if not sys.stdout.isatty():
        return Lines(case)
    from hvisph.cli.live import Live

    return Live(case)


def _close(summary: dict[str, Any], folder: Path, unitless: bool) -> None:
    from hvisph.cli.results import conservation_rows, results_table
    from hvisph.cli.words import duration

    typer.echo()
    typer.echo(results_table(summary["measures"], summary["expected"], unitless, conservation_rows(summary)))
    pace = summary["microseconds_per_particle_step"]
    cost = f", {pace:.3f} us per particle-step" if pace is not None else ""
    state = {"done": "Done", "failed": "Failed", "interrupted": "Interrupted"}[summary["status"]]
    typer.echo(
        f"\n{state} after {summary['steps']} steps in {duration(summary['wall_seconds'])} "
        f"on {summary['threads']} thread{'s' if summary['threads'] > 1 else ''}{cost}: {folder}"
    )
    missed = [entry["name"] for entry in summary["expected"] if not entry["passed"]]
    if missed:
        typer.echo(f"Not as expected: {', '.join(missed)}")
