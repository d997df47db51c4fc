"""Progress of a run: a bar on a terminal, lines of text elsewhere, nothing for `--quiet`."""

from __future__ import annotations

import time as wall
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console, Group
from rich.live import Live as Display
from rich.progress_bar import ProgressBar
from rich.spinner import Spinner
from rich.table import Table
from rich.text import Text

from hvisph.cli.guard import raise_noted
from hvisph.cli.text.formatting import deaf, duration, quantity, say
from hvisph.core.text import sanitize
from hvisph.simulation.listener import Listener, Progress

if TYPE_CHECKING:
    from hvisph.case.case import Case

EVERY_SHARE = 0.2  # of the simulated time
EVERY_SECONDS = 60.0


class Silence(Listener):
    """Listener without output that re-raises interrupts."""

    def opening(self) -> None:
        """Before anything slow is imported."""

    def compiling(self, name: str) -> None:
        """Go on."""
        raise_noted()

    def progress(self, progress: Progress) -> None:
        """Go on."""
        raise_noted()

    def close(self) -> None:
        """Leave the terminal as it was."""


class Lines(Silence):
    """A line when something happens, at every tenth of the simulated time, and at least every minute.

    `case`: the case, for its title and unit of time.
    """

    def __init__(self, case: Case):
        self._title = case.title
        self._unit = "s" if case.units == "si" else ""
        self._share, self._said = EVERY_SHARE, wall.monotonic()
        self._compiling = False

    def opening(self) -> None:
        """Print the title of the case."""
        say(self._title or "untitled case")

    def compiling(self, name: str) -> None:
        """Print once that loops are being compiled."""
        raise_noted()
        if not self._compiling:
            self._compiling = True
            say("compiling kernels (once; they are kept for later runs)")

    def start(self, folder: Path, particles: int, end: float) -> None:
        """Print the number of particles and the end time."""
        say(f"{particles} particles to t = {quantity(end, self._unit)}, into {folder}")

    def progress(self, progress: Progress) -> None:
        """Print the progress at intervals."""
        raise_noted()
        share, now = progress.time / progress.end, wall.monotonic()
        if share < self._share and now - self._said < EVERY_SECONDS:
            return
        self._share = max(self._share, (share // EVERY_SHARE + 1) * EVERY_SHARE)
        self._said = now
        say(f"{share:4.0%}  {status_text(progress, self._unit)}")

    def message(self, text: str) -> None:
        """Pass it on."""
        say(text)


def status_text(progress: Progress, unit: str) -> str:
    """Return one line with the progress of a run and the limit of its step."""
    drift = "" if progress.energy_drift is None else f", energy drift {1e2 * progress.energy_drift:+.1e} %"
    left = time_left(progress)
    remaining = f", {duration(left)} left" if left is not None else ""
    return (
        f"t = {quantity(progress.time, unit)}, step {progress.step}, "
        f"dt = {quantity(progress.dt, unit, 3)} by {progress.criterion} in {progress.body}, "
        f"{progress.steps_per_second:.0f} steps/s{drift}, {duration(progress.wall_seconds)} gone{remaining}"
    )


def time_left(progress: Progress) -> float | None:
    """Return the wall time to the end at the mean pace so far [s]; None before there is one."""
    if progress.time <= 0.0:
        return None
    return progress.wall_seconds * (progress.end - progress.time) / progress.time


REFRESH = 10  # per second


class _Terminal(Console):
    """A terminal that may be closed during the run; output that it cannot receive is discarded."""

    def _write_buffer(self) -> None:
        try:
            super()._write_buffer()
        except OSError as error:
            if not deaf(error):
                raise
            del self._buffer[:]


class Live(Lines):
    """Simulated and wall time, the step and its limit, pace, energy drift, time left.

    `case`: the case, for its title and unit of time.
    `console`: where to draw; standard output unless given.
    """

    def __init__(self, case: Case, console: Console | None = None):
        super().__init__(case)
        self._console = console or _Terminal(highlight=False)
        self._display = Display(
            console=self._console, refresh_per_second=REFRESH, transient=True, redirect_stderr=False
        )
        self._end = 1.0

    def opening(self) -> None:
        """Begin with the title, and a sign of life while modules load."""
        self._console.print(Text(sanitize(self._title or "untitled case"), style="bold"))
        self._display.start()
        self._display.update(Spinner("dots", "preparing"))

    def compiling(self, name: str) -> None:
        """Show which loop is being compiled."""
        raise_noted()
        loop = name.rsplit("_", 1)[0]
        self._display.update(Spinner("dots", f"compiling kernels ({loop}); they are kept for later runs"), refresh=True)

    def start(self, folder: Path, particles: int, end: float) -> None:
        """Print the number of particles and the end time."""
        self._end = end
        words = f"{particles} particles to t = {quantity(end, self._unit)}, into {folder}"
        self._console.print(Text(sanitize(words)))

    def progress(self, progress: Progress) -> None:
        """Draw where the run is."""
        raise_noted()
        self._display.update(self.drawing(progress))

    def drawing(self, progress: Progress) -> Group:
        """Return the bar and its line."""
        unit, left = self._unit, time_left(progress)
        bar = Table.grid(padding=(0, 1))
        bar.add_row(
            ProgressBar(total=progress.end, completed=progress.time, width=32),
            f"{progress.time / progress.end:4.0%}",
            f"t = {quantity(progress.time, unit)} of {quantity(progress.end, unit)}",
            Text(f"{duration(progress.wall_seconds)}", style="cyan"),
            Text(f"{duration(left)} left" if left is not None else "", style="dim"),
        )
        line = f"dt {quantity(progress.dt, unit, 3)} ({progress.criterion}, {progress.body})"
        line += f"   {progress.steps_per_second:.0f} steps/s"
        if progress.energy_drift is not None:
            line += f"   energy drift {1e2 * progress.energy_drift:+.1e} %"
        return Group(bar, Text(line, style="dim", no_wrap=True, overflow="ellipsis"))

    def message(self, text: str) -> None:
        """Print it above the bar."""
        self._console.print(Text(sanitize(text)))

    def close(self) -> None:
        """Take the bar away."""
        self._display.stop()
