"""Progress bar of a run on the terminal."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console, Group
from rich.live import Live as Display
from rich.progress_bar import ProgressBar
from rich.spinner import Spinner
from rich.table import Table
from rich.text import Text

from hvisph.cli.guard import raise_noted
from hvisph.core.text import sanitize
from hvisph.simulation.listener import Progress

from .formatting import deaf, duration, quantity
from .text_log import Lines, time_left

if TYPE_CHECKING:
    from hvisph.case.case import Case

REFRESH = 10  # per second


class _Terminal(Console):
    """A terminal that may be closed while the run goes on: what it cannot be told is left out."""

    def _write_buffer(self) -> None:
        try:
            super()._write_buffer()
        except OSError as error:
            if not deaf(error):
                raise
            del self._buffer[:]


class Live(Lines):
    """Simulated and wall time, the step and what limits it, pace, energy drift, time left.

    Parameters
    ----------
    case
        The case, for its title and unit of time.
    console
        Where to draw; standard output unless given.
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
