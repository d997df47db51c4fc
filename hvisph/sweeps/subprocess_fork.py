"""A process of our own, made by forking this one: what is imported here need not be imported there.

For commands alone, whose process holds nothing of somebody else's, and before any loop has run in it: a fork cannot use
threads that its parent has started.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable
from typing import NoReturn

from hvisph.compiler.jit import loops_there


def can_fork() -> bool:
    """Whether this process may be forked into workers."""
    return sys.platform == "linux" and threading.active_count() == 1 and not loops_there()


class Forked:
    """A child of this process that calls `work` and ends with what it returns; used as `subprocess.Popen` is.

    It hears no Ctrl-C of the terminal, reads nothing and says only errors.
    """

    def __init__(self, work: Callable[[], int]):
        self.returncode: int | None = None
        sys.stdout.flush()
        self.pid = os.fork() or _child(work)

    def poll(self) -> int | None:
        """Return its exit code, negative the signal that ended it; None while it lives."""
        return self._wait(os.WNOHANG)

    def wait(self) -> int | None:
        """Wait for its end; return as `poll`."""
        return self._wait(0)

    def _wait(self, how: int) -> int | None:
        if self.returncode is None:
            pid, status = os.waitpid(self.pid, how)
            if pid:
                self.returncode = os.waitstatus_to_exitcode(status)
        return self.returncode

    def send_signal(self, number: int) -> None:
        """Send it a signal, if it has not ended."""
        if self.poll() is None:
            os.kill(self.pid, number)


def _child(work: Callable[[], int]) -> NoReturn:
    code = 1
    try:
        os.setsid()
        for number, handler in ((signal.SIGINT, signal.default_int_handler), (signal.SIGTERM, signal.SIG_DFL)):
            if signal.getsignal(number) != signal.SIG_IGN:
                signal.signal(number, handler)
        nowhere = os.open(os.devnull, os.O_RDWR)
        for standard in range(2):
            os.dup2(nowhere, standard)
        code = work()
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(code)
