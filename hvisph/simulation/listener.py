"""What a run tells while it goes on: the terminal, a notebook or a test listens."""

from __future__ import annotations

import time as wall
from dataclasses import dataclass
from pathlib import Path
from typing import Any

# Wall time between two reports of progress [s].
REPORT_EVERY = 0.1


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

    def start(self, folder: Path, particles: int, end: float) -> None:
        """Hear that the run's folder is made and so many particles run to `end` [s]."""

    def compiling(self, name: str) -> None:
        """Hear that a loop is being compiled afresh."""

    def progress(self, progress: Progress) -> None:
        """Hear where the run is, some ten times a second."""

    def message(self, text: str) -> None:
        """Something a user should know."""

    def finish(self, summary: dict[str, Any]) -> None:
        """Hear that the summary is written."""


class Reporter:
    """Tells a listener where the run is, some ten times a second.

    Parameters
    ----------
    listener
        Who hears it.
    setup, clock
        The run.
    before
        Wall time of its earlier steps [s].
    """

    def __init__(self, listener: Listener, setup: Any, clock: Any, before: float):
        self._listener, self._setup, self._clock = listener, setup, clock
        self._began = wall.perf_counter() - before
        self._last, self._last_steps = 0.0, clock.steps

    @property
    def seconds(self) -> float:
        """Wall time of all steps so far [s]."""
        return wall.perf_counter() - self._began

    def report(self, time_step: Any, body: int, drift: float | None) -> None:
        """Report, if it is time, with the next step, the body that limits it and the energy drift."""
        now, clock = wall.perf_counter(), self._clock
        since = now - self._last
        if since < REPORT_EVERY:
            return
        pace = (clock.steps - self._last_steps) / since
        self._last, self._last_steps = now, clock.steps
        self._listener.progress(
            Progress(clock.time, clock.end, clock.steps, time_step.length, time_step.criterion,
                     self._setup.bodies[body], now - self._began, pace, drift)
        )  # fmt: skip
