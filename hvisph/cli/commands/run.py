"""`hvisph run`, `resume` and `watch`: compute a case, continue a run, follow its progress."""

import sys
import time
from collections.abc import Sequence
from pathlib import Path

import typer

from hvisph.cli import options
from hvisph.cli.options import argument, option
from hvisph.cli.results_table import results_table
from hvisph.cli.run_report import conclude, interrupt_notice, shown_progress
from hvisph.core.errors import CaseError
from hvisph.parallel import is_first
from hvisph.postprocessing.run_data import run_progress, shown_moments
from hvisph.simulation.run import has_ended, resume_case, resume_run
from hvisph.simulation.run import run as run_case
from hvisph.sweeps.driver import update_sweep_of
from hvisph.visualization.particles import Look, usual_view, view_picture


def run(
    case: options.CaseArgument,
    out: options.OutOption = None,
    resolution: options.ResolutionOption = None,
    settings: options.SetOption = None,
    threads: options.ThreadsOption = None,
    force: bool = option("--force", "Replace an earlier run in the folder.", False),
    report: options.ReportOption = False,
    everything: options.AllOption = False,
    quiet: options.QuietOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Run a case and write its folder. Exit codes: 0 done, 1 missed an expectation, 2 invalid input, 3 failed."""
    loaded = options.load(case, settings, resolution)
    folder = out or options.run_folder(case)
    with options.locate_errors(case), interrupt_notice(folder), shown_progress(loaded, quiet or as_json) as listener:
        outcome = run_case(loaded, folder, force=force, threads=threads, listener=listener)
    conclude(outcome, loaded.units == "none", quiet, as_json, report or loaded.output.report, everything)


def resume(
    folder: Path = argument("RUN", "Folder of the run."),
    end: str | None = option("--end TIME", "New end time: 10us; the case's unless given.", None),
    max_steps: int | None = option("--max-steps N", "Steps after which to stop; 0 for no limit.", None, min=0),
    threads: options.ThreadsOption = None,
    report: options.ReportOption = False,
    everything: options.AllOption = False,
    quiet: options.QuietOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Continue a run from its newest checkpoint."""
    case = resume_case(folder, end, max_steps)
    if end is None and max_steps is None and has_ended(folder) and not (quiet or as_json) and is_first():
        typer.echo("the run has ended: its summary is written anew; --end TIME continues it", err=True)
    with interrupt_notice(folder), shown_progress(case, quiet or as_json) as listener:
        outcome = resume_run(folder, case, threads=threads, listener=listener)
    if is_first():
        update_sweep_of(folder)
    conclude(outcome, case.units == "none", quiet, as_json, report or case.output.report, everything)


BARS = "▁▂▃▄▅▆▇█"
WIDTH = 55


def watch(
    folder: Path = argument("RUN", "Folder of a run, under way or ended."),
    interval: float = option("--every S", "Seconds between updates.", 2.0, min=0.2),
    once: bool = option("--once", "Print the present state and exit.", False),
    picture: Path | None = option("--picture FILE", "Draw the newest state at every update.", None),
) -> None:
    """Show progress, histories and measures of a run until it ends."""
    if not folder.is_dir():
        raise CaseError(f"there is no run at {folder}")
    if picture is not None:
        options.refuse_format(picture, "--picture")
    pictured, text_before = -1, ""
    while True:
        text, ended, snapshots = _look(folder)
        if text != text_before:
            if not once and sys.stdout.isatty():
                typer.echo("\x1b[2J\x1b[H", nl=False)
            typer.echo(text)
            text_before = text
        if picture is not None and snapshots > pictured:
            moments = shown_moments(folder, None, False)
            view_picture(moments, picture, Look(view=usual_view(moments[0])))
            pictured = snapshots
        if once or ended:
            return
        time.sleep(interval)


def _look(folder: Path) -> tuple[str, bool, int]:
    """Return progress and measures as text, whether the run has ended, and its number of snapshots."""
    sight = run_progress(folder)
    lines = [f"{folder}: {sight.status}", sight.progress, ""]
    lines += [f"  {name:28s} {sparkline(values)}  {values[-1]:.4g}" for name, values in sight.histories.items()]
    if sight.measures:
        lines += ["", f"measured at the newest of {sight.snapshots} snapshots:", results_table(sight.measures)]
    if sight.answer:
        lines += ["", sight.answer]
    return "\n".join(lines), sight.ended, sight.snapshots


def sparkline(values: Sequence[float]) -> str:
    """Return numbers as a row of bars, at most WIDTH of them."""
    finite = [value for value in values if value == value]
    if not finite:
        return ""
    step = max(len(finite) / WIDTH, 1.0)
    thin = [finite[int(k * step)] for k in range(int(len(finite) / step))]
    low, high = min(thin), max(thin)
    scale = (len(BARS) - 1) / (high - low) if high > low else 0.0
    return "".join(BARS[int((value - low) * scale)] for value in thin)
