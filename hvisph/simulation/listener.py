"""What a run tells while it goes on: the terminal, a notebook or a test listens."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Progress:
    """Where a run is.

    Parameters
    ----------
    time, end
        Simulated time and its end [s].
    step, dt
        Steps done and the next step [s].
    criterion, body
        What limits the step, and the body of the particle that does.
    wall_seconds, steps_per_second
        Wall time of the steps so far and the present pace.
    energy_drift
        Change of total energy over total energy at the start; None without an energy equation.
    """

    time: float
    end: float
    step: int
    dt: float
    criterion: str
    body: str
    wall_seconds: float
    steps_per_second: float
    energy_drift: float | None


class Listener:
    """Hears of a run; every method does nothing unless overridden."""

    def started(self, folder: Path, particles: int, end: float) -> None:
        """The run's folder is made; so many particles run to `end` [s]."""

    def compiling(self, name: str) -> None:
        """A loop is being compiled afresh."""

    def progress(self, progress: Progress) -> None:
        """Some ten times a second."""

    def message(self, text: str) -> None:
        """Something a user should know."""

    def finished(self, summary: dict[str, Any]) -> None:
        """The summary is written."""
