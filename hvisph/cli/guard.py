"""Errors and interrupts of commands as one message and an exit code.

An interrupt that falls into a callback from compiled code, as while loops are being compiled, is
reported there and forgotten. So it is also noted, and raised again at the next progress of the run.
"""

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from types import FrameType
from typing import Any

import typer

from hvisph.cli.formatting import say
from hvisph.core.errors import INTERRUPTED, HvisphError
from hvisph.parallel import is_first

FAILED = 3
DEBUG = "HVISPH_DEBUG"


def guard_errors(command: Callable[..., None]) -> Callable[..., None]:
    """Return `command` with its errors turned into a message on standard error and an exit code.

    Errors of hvisph have a message and an exit code: 2 for bad input, 3 for a failed run.
    Anything else is a bug: it is named as one with code 3, and its traceback shown if the variable
    ``HVISPH_DEBUG`` is set.
    """

    @wraps(command)
    def call(*arguments: Any, **options: Any) -> None:
        for stream in (sys.stdout, sys.stderr):
            if hasattr(stream, "reconfigure"):  # a terminal without a character gets a question mark
                stream.reconfigure(errors="replace")
        try:
            command(*arguments, **options)
            sys.stdout.flush()
        except (typer.Exit, typer.Abort, typer.BadParameter):
            raise
        except KeyboardInterrupt:
            _end("interrupted", INTERRUPTED)
        except BrokenPipeError:
            # the reader has gone, as in `hvisph cases | head`: nothing more to say, not even at exit
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            raise typer.Exit(0) from None
        except HvisphError as error:
            _end(f"error: {error}" if is_first() else "", error.exit_code)
        except MemoryError:
            _end("error: out of memory; use a coarser resolution or a larger machine", FAILED)
        except Exception as error:
            if os.environ.get(DEBUG):
                raise
            if getattr(error, "shared", False) and not is_first():  # of several processes one speaks
                raise typer.Exit(FAILED) from None
            first = (str(error).strip().splitlines() or [""])[0]
            description = f"{type(error).__name__}: {first[:300]}".rstrip(": ")
            _end(
                f"error: unexpected {description}\nThis is a bug in hvisph. Please report it with the command "
                f"and the case; {DEBUG}=1 shows where it happened.",
                FAILED,
            )

    return call


def _end(message: str, code: int) -> None:
    if message:  # of several processes one speaks
        say(message, err=True, red=code == FAILED)
    raise typer.Exit(code) from None


_noted = threading.Event()
ENDING = (signal.SIGTERM, *([signal.SIGHUP] if hasattr(signal, "SIGHUP") else []))  # Windows has no SIGHUP


@contextmanager
def noted_interrupts() -> Iterator[None]:
    """Record every interrupt in this block, in addition to raising `KeyboardInterrupt`."""
    _noted.clear()
    takes_signal = (
        threading.current_thread() is threading.main_thread()
        # a parent that had it ignored, as `nohup` does, meant it
        and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    )
    if takes_signal:
        signal.signal(signal.SIGINT, _note)
    try:
        yield
    finally:
        if takes_signal:
            signal.signal(signal.SIGINT, signal.default_int_handler)


def raise_noted() -> None:
    """Raise `KeyboardInterrupt` if one was noted and has not ended the block."""
    if _noted.is_set():
        _noted.clear()
        raise KeyboardInterrupt


@contextmanager
def ends_like_ctrl_c() -> Iterator[None]:
    """Treat SIGTERM, and SIGHUP of a closed terminal, as Ctrl-C, unless the parent ignores them."""
    in_main_thread = threading.current_thread() is threading.main_thread()
    handlers = {number: signal.getsignal(number) for number in ENDING} if in_main_thread else {}
    for number, handler in handlers.items():
        if handler is signal.SIG_DFL:
            signal.signal(number, signal.default_int_handler)
    try:
        yield
    finally:
        for number, handler in handlers.items():
            if handler is signal.SIG_DFL:
                signal.signal(number, handler)


def _note(number: int, frame: FrameType | None) -> None:
    _noted.set()
    raise KeyboardInterrupt
