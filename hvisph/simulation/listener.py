"""Progress reports of a run, for a terminal, a notebook or a test."""

from __future__ import annotations

import time as wall
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hvisph.core.text import Plain

from .clock import Clock, TimeStep

# Wall time between two reports of progress [s].
REPORT_EVERY = 0.1


@dataclass(frozen=True)
class Progress:
    """State of a running simulation.

    Times in s; `dt`, `criterion` and `body` are those of the next step. `energy_drift` is the relative change of total
    energy, None without an energy equation.
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
    """Receiver of events; every method does nothing unless overridden."""

    def start(self, folder: Path, particles: int, end: float) -> None:
        """Report that the folder exists and the particles run to `end` [s]."""

    def compiling(self, name: str) -> None:
        """Report that a loop is compiled."""

    def progress(self, progress: Progress) -> None:
        """Report the progress, ten times a second."""

    def message(self, text: str) -> None:
        """Report a text to the user."""

    def finish(self, summary: Plain) -> None:
        """Report that the summary is written."""


class Reporter:
    """Sender of progress reports, ten times a second; `before` is the wall time of earlier steps [s]."""

    def __init__(self, listener: Listener, setup: Any, clock: Clock, before: float):
        self._listener, self._setup, self._clock = listener, setup, clock
        self._began = wall.perf_counter() - before
        self._last, self._last_steps = 0.0, clock.steps

    @property
    def seconds(self) -> float:
        """Wall time of all steps so far [s]."""
        return wall.perf_counter() - self._began

    def report(self, time_step: TimeStep, body: int, drift: float | None) -> None:
        """Report the next step, the body that limits it and the energy drift, when due."""
        now, clock = wall.perf_counter(), self._clock
        since = now - self._last
        if since < REPORT_EVERY:
            return
        pace = (clock.steps - self._last_steps) / since
        self._last, self._last_steps = now, clock.steps
        self._listener.progress(
            Progress(
                clock.time,
                clock.end,
                clock.steps,
                time_step.length,
                time_step.criterion,
                self._setup.bodies[body],
                now - self._began,
                pace,
                drift,
            )
        )
