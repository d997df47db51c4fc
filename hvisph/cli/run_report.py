"""Progress of a run, as a bar on a terminal or as lines of text, and its final report with the exit code."""

import sys
import time as wall
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import typer
from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.spinner import Spinner
from rich.table import Table
from rich.text import Text

from hvisph.case.case import Case
from hvisph.cli.commands.references import correlations_text
from hvisph.cli.formatting import deaf, duration, echo_json, quantity, say, show
from hvisph.cli.guard import FAILED, noted_interrupts, raise_noted
from hvisph.core.errors import HvisphError
from hvisph.core.measure_catalogue import format_share
from hvisph.core.text import Plain, sanitize
from hvisph.measures.tables import headline
from hvisph.parallel import is_first
from hvisph.simulation.listener import Listener, Progress
from hvisph.simulation.run_files import Outcome
from hvisph.visualization.html.report import report

from .results_table import bodies_table, results_table, sections_table

EVERY_SHARE = 0.2  # of the simulated time
EVERY_SECONDS = 60.0


class SilentListener(Listener):
    """Listener without output that re-raises interrupts."""

    def opening(self) -> None:
        """Before anything slow is imported."""

    def compiling(self, name: str) -> None:
        """Raise interrupts that were recorded."""
        raise_noted()

    def progress(self, progress: Progress) -> None:
        """Raise interrupts that were recorded."""
        raise_noted()

    def close(self) -> None:
        """Restore the terminal."""


class LineListener(SilentListener):
    """A line per event, per fifth of the simulated time, and at least every minute."""

    def __init__(self, case: Case):
        self._title = case.title
        self._unit = "s" if case.units == "si" else ""
        self._share, self._said = EVERY_SHARE, wall.monotonic()
        self._compiling = False

    def opening(self) -> None:
        say(self._title or "untitled case")

    def compiling(self, name: str) -> None:
        raise_noted()
        if not self._compiling:
            self._compiling = True
            say("compiling kernels (once; later runs use the cache)")

    def start(self, folder: Path, particles: int, end: float) -> None:
        say(f"{particles} particles to t = {quantity(end, self._unit)}, into {folder}")

    def progress(self, progress: Progress) -> None:
        raise_noted()
        share, clock = progress.time / progress.end, wall.monotonic()
        if share < self._share and clock - self._said < EVERY_SECONDS:
            return
        self._share = max(self._share, (share // EVERY_SHARE + 1) * EVERY_SHARE)
        self._said = clock
        say(f"{share:4.0%}  {status_text(progress, self._unit)}")

    def message(self, text: str) -> None:
        say(text)


def status_text(progress: Progress, unit: str) -> str:
    """Return one line with the progress of a run and the limit of its step."""
    drift = "" if progress.energy_drift is None else f", energy drift {1e2 * progress.energy_drift:+.1e} %"
    seconds_left = time_left(progress)
    note = f", {duration(seconds_left)} left" if seconds_left is not None else ""
    return (
        f"t = {quantity(progress.time, unit)}, step {progress.step}, "
        f"dt = {quantity(progress.dt, unit, 3)}, limited by {progress.criterion} in {progress.body}, "
        f"{progress.steps_per_second:.0f} steps/s{drift}, {duration(progress.wall_seconds)} elapsed{note}"
    )


def time_left(progress: Progress) -> float | None:
    """Return the wall time to the end at the mean pace so far [s]; None before there is one."""
    if progress.time <= 0.0:
        return None
    return progress.wall_seconds * (progress.end - progress.time) / progress.time


class _Terminal(Console):
    """Terminal that may be closed during the run; its output is then discarded."""

    def _write_buffer(self) -> None:
        try:
            super()._write_buffer()
        except OSError as error:
            if not deaf(error):
                raise
            del self._buffer[:]


class BarListener(LineListener):
    """Progress bar with simulated and wall time, step and its limit, pace, energy drift and time left."""

    def __init__(self, case: Case, console: Console | None = None):
        super().__init__(case)
        self._console = console or _Terminal(highlight=False)
        self._display = Live(console=self._console, refresh_per_second=10, transient=True, redirect_stderr=False)
        self._end = 1.0

    def opening(self) -> None:
        self._console.print(Text(sanitize(self._title or "untitled case"), style="bold"))
        self._display.start()
        self._display.update(Spinner("dots", "preparing"))

    def compiling(self, name: str) -> None:
        raise_noted()
        loop = name.rsplit("_", 1)[0]
        self._display.update(Spinner("dots", f"compiling kernels ({loop}); later runs use the cache"), refresh=True)

    def start(self, folder: Path, particles: int, end: float) -> None:
        self._end = end
        words = f"{particles} particles to t = {quantity(end, self._unit)}, into {folder}"
        self._console.print(Text(sanitize(words)))

    def progress(self, progress: Progress) -> None:
        raise_noted()
        self._display.update(self.drawing(progress))

    def drawing(self, progress: Progress) -> Group:
        """Return the bar and its line."""
        unit, seconds_left = self._unit, time_left(progress)
        bar = Table.grid(padding=(0, 1))
        bar.add_row(
            ProgressBar(total=progress.end, completed=progress.time, width=32),
            f"{progress.time / progress.end:4.0%}",
            f"t = {quantity(progress.time, unit)} of {quantity(progress.end, unit)}",
            Text(f"{duration(progress.wall_seconds)}", style="cyan"),
            Text(f"{duration(seconds_left)} left" if seconds_left is not None else "", style="dim"),
        )
        line = f"dt {quantity(progress.dt, unit, 3)} ({progress.criterion}, {progress.body})"
        line += f"   {progress.steps_per_second:.0f} steps/s"
        if progress.energy_drift is not None:
            line += f"   energy drift {1e2 * progress.energy_drift:+.1e} %"
        return Group(bar, Text(line, style="dim", no_wrap=True, overflow="ellipsis"))

    def message(self, text: str) -> None:
        self._console.print(Text(sanitize(text)))

    def close(self) -> None:
        self._display.stop()


@contextmanager
def shown_progress(case: Case, silent: bool) -> Iterator[Listener]:
    """Give the listener of a run, a progress bar on a terminal, lines elsewhere; interrupts are noted meanwhile."""
    listener_type = BarListener if sys.stdout.isatty() else LineListener
    listener = SilentListener() if silent or not is_first() else listener_type(case)
    listener.opening()
    try:
        with noted_interrupts():
            yield listener
    finally:
        listener.close()


def conclude(
    outcome: Outcome, unitless: bool, quiet: bool, as_json: bool, report: bool = False, everything: bool = False
) -> None:
    """Print the result of a run, with `report` after writing its page, and exit with its code."""
    if not is_first():  # of several processes one speaks
        raise typer.Exit(outcome.exit_code)
    page = _page(outcome.folder) if report else None
    if as_json:
        echo_json(outcome.summary)
    elif not quiet:
        show(_results(outcome.summary, outcome.folder, unitless, everything))
        if page is not None:
            say(f"Report: {page}")
    failure = outcome.summary["failure"]
    if failure is not None:
        say(f"error: the run failed: {failure['message']}", err=True, red=True)
    if outcome.summary["status"] == "interrupted":
        say(f"stopped by {outcome.signal}; continue with: hvisph resume {outcome.folder}", err=True)
    raise typer.Exit(outcome.exit_code or (FAILED if failure is not None else 0))


@contextmanager
def interrupt_notice(folder: Path | str) -> Iterator[None]:
    """Print how to resume a run that a second Ctrl-C ends in this block."""
    try:
        yield
    except KeyboardInterrupt:
        resumable = any(Path(folder).glob("checkpoint/*.h5")) and not (Path(folder) / "summary.json").exists()
        if resumable and is_first():
            say(f"stopped before its summary; continue with: hvisph resume {folder}", err=True)
        raise


def _page(folder: Path) -> Path | None:
    """Write and return the report of a run; None, with a warning, where it cannot be written."""
    try:
        return report([folder])
    except HvisphError as error:
        say(f"warning: no report: {error}", err=True)
        return None


SHARES = {
    "failed": "failed",
    "above_melting": "above melting",
    "beyond_range": "beyond the range of its material",
    "negative_energy": "with negative energy",
}
MOST_BODIES = 8  # in the table of bodies


def _conservation(summary: Plain) -> str:
    """Return drifts of conserved quantities and mass fractions in one line."""
    drifts = [
        f"{name.replace('_', ' ')} {value:.1e}"
        for name, value in summary["conservation"].items()
        if value is not None and name.endswith("drift")
    ]
    shares = summary.get("shares") or {}
    parts = [f"{format_share(shares[name])} {word}" for name, word in SHARES.items() if shares.get(name)]
    mass = f"; mass fractions: {', '.join(parts)}" if parts else ""
    return f"Conservation: {', '.join(drifts)}{mass}"


def _unsettled(summary: Plain) -> str:
    """Return how many measures are not settled at the end; empty if all are."""
    sections = [summary, *(summary.get("layers") or []), summary.get("projectile") or {}, summary.get("cloud") or {}]
    values = [m for part in sections for m in (part.get("measures") or {}).values() if m["value"] is not None]
    changing = sum(m.get("settled") is False for m in values)
    return f"{changing} of {len(values)} measures are not settled: run longer" if changing else ""


def _results(summary: Plain, folder: Path, unitless: bool, everything: bool) -> str:
    pace = summary["microseconds_per_particle_step"]
    cost = f", {pace:.3f} us per particle-step" if pace is not None else ""
    state = {"done": "Done", "failed": "Failed", "interrupted": "Interrupted"}[summary["status"]]
    lines = ["", *([summary["answer"], ""] if summary["answer"] else [])]
    if everything:
        lines += _all_results(summary, unitless)
    else:
        expected = [entry | {"source": ""} for entry in summary["expected"]]
        lines += [results_table(headline(summary), expected, unitless), ""]
        if not (summary.get("layers") or len(summary["bodies"]) > MOST_BODIES):
            lines += [bodies_table(summary, unitless), ""]
        lines += [_conservation(summary), *filter(None, [_unsettled(summary)])]
    lines.append(
        f"{state} after {summary['steps']} steps in {duration(summary['wall_seconds'])} "
        f"on {summary['threads']} thread{'s' if summary['threads'] > 1 else ''}{cost}: {sanitize(folder)}"
    )
    if not everything:
        lines.append(f"All measures: hvisph measure {sanitize(folder)}; a page: hvisph report {sanitize(folder)}")
    missed = [entry["name"] for entry in summary["expected"] if not entry["passed"]]
    if missed:
        lines.append(f"Not as expected: {', '.join(missed)}")
    return "\n".join(lines)


def _all_results(summary: Plain, unitless: bool) -> list[str]:
    """Return all measures, sections, bodies and correlations as text."""
    drifts = {name: value for name, value in summary["conservation"].items() if value is not None}
    lines = [results_table(summary["measures"], summary["expected"], unitless, drifts), ""]
    lines += [f"{text}\n" for text in (sections_table(summary, unitless), bodies_table(summary, unitless)) if text]
    pressures = summary.get("pressures") or {}
    if pressures.get("impedance_match") and pressures.get("highest"):
        scale, unit = (1.0, "") if unitless else (1e-9, " GPa")
        highest, estimate = (scale * pressures[name] for name in ("highest", "impedance_match"))
        lines.append(
            f"Highest pressure {highest:.3g}{unit}; {estimate:.3g}{unit} by impedance matching of a flat impact"
        )
    lines.append(_conservation(summary))
    return [*lines, *(["", correlations_text(summary["correlations"])] if summary.get("correlations") else []), ""]
