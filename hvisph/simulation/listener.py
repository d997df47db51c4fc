"""Progress reports of a run, for a terminal, a notebook or a test, and signals that stop it."""

import signal
import threading
import time as wall
from dataclasses import dataclass
from pathlib import Path
from types import FrameType, TracebackType
from typing import Any

from hvisph.core.text import Plain

from .clock import Clock, TimeStep

REPORT_EVERY = 0.1  # wall time between two reports of progress [s]


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
        """Report that the folder exists and the run to `end` [s] begins."""

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
        instant, clock = wall.perf_counter(), self._clock
        interval = instant - self._last
        if interval < REPORT_EVERY:
            return
        pace = (clock.steps - self._last_steps) / interval
        self._last, self._last_steps = instant, clock.steps
        elapsed, limit, where = instant - self._began, time_step.criterion, self._setup.bodies[body]
        progress = Progress(clock.time, clock.end, clock.steps, time_step.length, limit, where, elapsed, pace, drift)
        self._listener.progress(progress)


HANGUP = getattr(signal, "SIGHUP", None)  # a dropped ssh session; Windows has none
STOPPING = (signal.SIGINT, signal.SIGTERM, *([HANGUP] if HANGUP is not None else []))


class StopRequests:
    """Context that records SIGINT, SIGTERM and SIGHUP in `number`; a second SIGINT or SIGTERM stops immediately.

    Signals ignored by the parent process, as with `nohup`, stay ignored. Outside the main thread nothing is caught.
    """

    def __init__(self) -> None:
        self.number: int | None = None
        self._before: dict[int, Any] = {}

    @property
    def name(self) -> str:
        """Name of the signal received, such as ``SIGTERM``."""
        return signal.Signals(self.number).name if self.number is not None else ""

    def __enter__(self) -> "StopRequests":
        if threading.current_thread() is threading.main_thread():
            for number in STOPPING:
                before = signal.getsignal(number)
                if before is not None and before != signal.SIG_IGN:
                    self._before[number] = before
                    signal.signal(number, self._note)
        return self

    def __exit__(
        self, error_type: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        for number, before in self._before.items():
            signal.signal(number, before)

    def note(self, number: int = signal.SIGINT) -> None:
        """Request a stop by the signal `number`."""
        self.number = number

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self.number is None:
            self.number = number
        elif number != HANGUP:
            raise KeyboardInterrupt
