"""Words for people: what steers a terminal is spelled out, and a terminal that is gone ends nothing."""

from __future__ import annotations

import errno
import os
import sys

import typer

from hvisph.core.text import harmless

# What writing ends with when nobody reads any more: the reader of a pipe has gone, or the terminal was closed.
_NOBODY = {errno.EPIPE, errno.EIO}


def say(text: object = "", *, err: bool = False, red: bool = False, nl: bool = True) -> None:
    """Print `text`, in red on a terminal where asked for."""
    show(typer.style(harmless(text), fg=typer.colors.RED) if red else harmless(text), err=err, nl=nl)


def show(text: str, *, err: bool = False, nl: bool = True) -> None:
    """Print text of our own making as it is, colours included."""
    try:
        typer.echo(text, err=err, nl=nl)
    except OSError as error:
        if not deaf(error):
            raise


def deaf(error: OSError) -> bool:
    """Tell whether `error` says that nobody listens; what is printed from then on goes nowhere."""
    if error.errno not in _NOBODY:
        return False
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except (OSError, ValueError):
            os.dup2(nowhere, stream.fileno())
    os.close(nowhere)
    return True
