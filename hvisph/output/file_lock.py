"""A lock on a file that the operating system lets go when its process ends, however it ends."""

from __future__ import annotations

import errno
import os
import sys
from pathlib import Path

from .atomic_write import NO_LINK

# File systems without locks (some network ones) say so by these; a run there goes on unlocked.
_NO_LOCKS = {errno.ENOLCK, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOSYS}


class FileLock:
    """Holds `path` (made if missing) locked until `release` or the end of the process.

    Raises
    ------
    BlockingIOError
        When another process, or this one, holds it.
    OSError
        When the file cannot be opened, or is a link.
    """

    def __init__(self, path: str | Path):
        self._handle: int | None = os.open(path, os.O_RDWR | os.O_CREAT | NO_LINK, 0o644)
        try:
            _lock(self._handle)
        except OSError as error:
            if error.errno in _NO_LOCKS:
                return
            self.release()
            raise BlockingIOError(errno.EAGAIN, "another run is writing there") from error

    def release(self) -> None:
        """Let the lock go."""
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None


def _lock(handle: int) -> None:
    if sys.platform == "win32":
        import msvcrt

        msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
    else:
        import fcntl

        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
