"""Progress of a run as lines of text, and no output for `--quiet`."""

from __future__ import annotations

import time as wall
from pathlib import Path
from typing import TYPE_CHECKING

from hvisph.cli.guard import raise_noted
from hvisph.simulation.listener import Listener, Progress

from .formatting import duration, quantity, say

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

    Parameters
    ----------
    case
        The case, for its title and unit of time.
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
    """Return one line that says where a run is and what limits it."""
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
