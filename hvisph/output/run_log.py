"""The log of a run: lines of plain text with the wall-clock time, each on the disk's way at once."""

from __future__ import annotations

import os
from datetime import datetime
from pathlib import Path

from hvisph.core.errors import OutputError
from hvisph.core.text import harmless

from .atomic_write import NO_LINK, reason, write_bytes


class RunLog:
    """Appends lines to `path`, each after the local date and time to the millisecond.

    The file is opened for every line: a log is a few dozen lines, and so a folder that vanished is noticed.
    It is never opened through a link, and what would steer a terminal is spelled out.
    """

    def __init__(self, path: str | Path):
        self.path = Path(path)

    def write(self, text: str) -> None:
        """Append `text`; each of its lines becomes a line of the log.

        Raises
        ------
        OutputError
            When the file cannot be written.
        """
        stamp = datetime.now().astimezone().isoformat(sep=" ", timespec="milliseconds")
        block = "".join(f"{stamp}  {harmless(line)}\n" for line in text.splitlines() or [""])
        try:
            if self.path.exists() and self.path.lstat().st_nlink > 1:  # a backup of hard links shares the file
                write_bytes(self.path, self.path.read_bytes())
            handle = os.open(self.path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | NO_LINK, 0o666)
            with os.fdopen(handle, "a", encoding="utf-8", errors="replace", newline="\n") as file:
                file.write(block)
        except OSError as error:
            raise OutputError(f"cannot write {self.path}: {reason(error)}") from error


class SilentLog(RunLog):
    """The log of a process that writes none."""

    def write(self, text: str) -> None:
        """Write nothing."""
