"""The log of a run: lines of plain text with the wall-clock time, each on the disk's way at once."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

from hvisph.core.errors import OutputError
from hvisph.output.atomic import reason


class RunLog:
    """Appends lines to `path`, each after the local date and time to the millisecond.

    The file is opened for every line: a log is a few dozen lines, and so a folder that vanished is noticed.
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
        block = "".join(f"{stamp}  {line}\n" for line in text.splitlines() or [""])
        try:
            with self.path.open("a", encoding="utf-8", newline="\n") as file:
                file.write(block)
        except OSError as error:
            raise OutputError(f"cannot write {self.path}: {reason(error)}") from error
