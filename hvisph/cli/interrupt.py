"""Ctrl-C that is never lost.

An interrupt that falls into a callback from compiled code, as while loops are being compiled, is
reported there and forgotten. So it is also noted, and raised again at the next word from the run.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_noted = threading.Event()
ENDING = (signal.SIGTERM, *([signal.SIGHUP] if hasattr(signal, "SIGHUP") else []))  # Windows has no SIGHUP


@contextmanager
def noted_interrupts() -> Iterator[None]:
    """Note every interrupt in this block, beside raising `KeyboardInterrupt` as always."""
    _noted.clear()
    ours = (
        threading.current_thread() is threading.main_thread()
        # a parent that had it ignored, as `nohup` does, meant it
        and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    )
    if ours:
        signal.signal(signal.SIGINT, _note)
    try:
        yield
    finally:
        if ours:
            signal.signal(signal.SIGINT, signal.default_int_handler)


def raise_noted() -> None:
    """Raise `KeyboardInterrupt` if one was noted and has not ended the block."""
    if _noted.is_set():
        _noted.clear()
        raise KeyboardInterrupt


@contextmanager
def ends_like_ctrl_c() -> Iterator[None]:
    """Take SIGTERM, and SIGHUP of a closed terminal, for Ctrl-C in this block: who is asked to end stops workers first.

    Signals that the parent had ignored stay ignored.
    """
    ours = threading.current_thread() is threading.main_thread()
    before = {number: signal.getsignal(number) for number in ENDING} if ours else {}
    for number, handler in before.items():
        if handler is signal.SIG_DFL:
            signal.signal(number, _interrupt)
    try:
        yield
    finally:
        for number, handler in before.items():
            if handler is signal.SIG_DFL:
                signal.signal(number, handler)


def _interrupt(number: int, frame: FrameType | None) -> None:
    raise KeyboardInterrupt


def _note(number: int, frame: FrameType | None) -> None:
    _noted.set()
    raise KeyboardInterrupt
