"""From errors to one message and an exit code: no command ends in a traceback."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from functools import wraps
from typing import Any

import typer

from hvisph.cli.text.echo import say
from hvisph.core.errors import INTERRUPTED, HvisphError
from hvisph.parallel.mpi_launch import is_first

FAILED = 3
DEBUG = "HVISPH_DEBUG"


def guarded(command: Callable[..., None]) -> Callable[..., None]:
    """Return `command` with its errors turned into a message on standard error and an exit code.

    Errors of hvisph's own say what is wrong and bring their code: 2 for bad input, 3 for a failed run.
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
            what = f"{type(error).__name__}: {first[:300]}".rstrip(": ")
            _end(
                f"error: unexpected {what}\nThis is a bug in hvisph. Please report it with the command "
                f"and the case; {DEBUG}=1 shows where it happened.",
                FAILED,
            )

    return call


def _end(message: str, code: int) -> None:
    if message:  # of several processes one speaks
        say(message, err=True, red=code == FAILED)
    raise typer.Exit(code) from None
