"""Signals that stop a run after the step under way."""

from __future__ import annotations

import signal
import threading
from types import FrameType, TracebackType
from typing import Any

HANGUP = getattr(signal, "SIGHUP", None)  # a dropped ssh session; Windows has none
STOPPING = (signal.SIGINT, signal.SIGTERM, *([HANGUP] if HANGUP is not None else []))


class StopRequests:
    """Context that records SIGINT, SIGTERM and SIGHUP in `number`; a second SIGINT or SIGTERM interrupts at once.

    Signals ignored by the parent process, as with `nohup`, stay ignored. Outside the main thread nothing is caught.
    """

    def __init__(self) -> None:
        self.number: int | None = None
        self._before: dict[int, Any] = {}

    @property
    def name(self) -> str:
        """Name of the signal received, such as ``SIGTERM``."""
        return signal.Signals(self.number).name if self.number is not None else ""

    def __enter__(self) -> StopRequests:
        if threading.current_thread() is threading.main_thread():
            for number in STOPPING:
                before = signal.getsignal(number)
                if before is not None and before != signal.SIG_IGN:
                    self._before[number] = before
                    signal.signal(number, self._note)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
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
