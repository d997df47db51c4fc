"""Helpers that compile the loops of a first run beside it: processes that go through its start and compute nothing.

What they make lies in the cache, where the run finds it, or waits for what one of them is at. They are made when the
first loop has to be compiled, on Linux alone, before any loop has run on threads, and where there is a second core.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any, NoReturn

from hvisph.compiler.cache import cache_folder
from hvisph.compiler.jit import heard_compiling, loops_there, rehearse
from hvisph.schemes.derived_fields import diagnose
from hvisph.schemes.protocol import AnyStepper

PATIENCE = 120  # wall time after which a helper ends in any case [s]
_OPEN = 3, 4096  # files that a helper inherits and closes: locks among them


@contextmanager
def compiling_ahead(stepper: AnyStepper, limit: Callable[[], Any]) -> Iterator[None]:
    """Have helpers compile, once something is compiled in this block, what the first step needs.

    Parameters
    ----------
    stepper
        As it was built.
    limit
        Finds the first step.
    """
    h = stepper.h_max

    def forces() -> None:
        stepper.h_max = h  # that of nothing computed is none
        stepper.evaluate()

    rest = partial(diagnose, stepper.particles, stepper.table, stepper.models), limit
    begun: list[str] = []

    def begin(name: str) -> None:
        begun.append(name)
        if len(begun) == 1 and _possible():
            _start((stepper.start, forces, *rest))
            _start((*rest, stepper.start, forces))

    with heard_compiling(begin):
        yield


def _possible() -> bool:
    cache = cache_folder()
    return (
        sys.platform == "linux"
        and len(os.sched_getaffinity(0)) > 1
        and threading.active_count() == 1
        and cache is not None
        and os.access(cache, os.W_OK)
        and not loops_there()
    )


def _start(calls: Sequence[Callable[[], Any]]) -> None:
    """Start a helper that is nobody's child: it ends by itself."""
    with suppress(OSError):
        child = os.fork()
        if child:
            os.waitpid(child, 0)
        else:
            _help(calls)


def _help(calls: Sequence[Callable[[], Any]]) -> NoReturn:
    """Make the calls in a child of this process, and end."""
    try:
        if os.fork():
            os._exit(0)
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGALRM):
            signal.signal(number, signal.SIG_DFL)
        signal.alarm(PATIENCE)
        os.closerange(*_OPEN)
        nowhere = os.open(os.devnull, os.O_RDWR)
        for standard in range(3):
            os.dup2(nowhere, standard)
        rehearse()
        for call in calls:
            with suppress(Exception):
                call()
    finally:
        os._exit(0)
