"""The history of a run: one line of a CSV file per record, exact numbers, whole lines only."""

import csv
import io
import os
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from hvisph.core.errors import OutputError
from hvisph.core.text import PlainMapping

from .atomic_write import csv_text, reason, write_errors, write_text


class HistoryWriter:
    """Writer of records to a new CSV file whose first line names the columns.

    Floats have the fewest digits that give them back exactly. Records are written together, as whole lines, when
    `flush_seconds` of wall time have passed. Raises `OutputError` when that fails; the file ends with a whole line.
    """

    def __init__(self, path: str | Path, columns: Sequence[str], flush_seconds: float = 1.0):
        write_text(path, csv_text([columns]))
        self._start(Path(path), columns, flush_seconds)

    @classmethod
    def resume(cls, path: str | Path, columns: Sequence[str], step: int) -> "HistoryWriter":
        """Continue a file, without its records after `step`; raises `OutputError` if they are damaged."""
        try:
            content = Path(path).read_bytes()
            text = content[: content.rfind(b"\n") + 1].decode("utf-8")
            header, *rows = csv.reader(io.StringIO(text, newline=""))
            if header != list(columns):
                raise OutputError(f"cannot go on with {path}: its columns are {', '.join(header)}")
            at = header.index("step")
            complete = []
            for number, row in enumerate(rows):
                if len(row) != len(header):
                    raise ValueError(f"line {number + 2} has not {len(header)} columns; it is damaged")
                if float(row[at]) <= step:
                    complete.append(row)
        except OSError as error:
            raise OutputError(f"cannot read {path}: {reason(error)}") from error
        except (ValueError, csv.Error) as error:
            raise OutputError(f"cannot go on with {path}: it is not a history ({error})") from error
        write_text(path, csv_text([header, *complete]))
        writer = cls.__new__(cls)
        writer._start(Path(path), columns)
        writer.last_step = int(complete[-1][at]) if complete else None
        return writer

    def _start(self, path: Path, columns: Sequence[str], flush_seconds: float = 1.0) -> None:
        self.path, self.columns = path, tuple(columns)
        self._flush_seconds = flush_seconds
        self._pending: list[Sequence[object]] = []
        self.last_step: int | None = None  # of the last record that a resumed file holds
        self._last = time.monotonic()
        with write_errors(path):
            self._handle: int | None = os.open(path, os.O_WRONLY | os.O_APPEND | getattr(os, "O_BINARY", 0))
            self._size = os.fstat(self._handle).st_size

    def append(self, record: PlainMapping | Sequence[object]) -> None:
        """Add one record: a value for each column, by name or in their order."""
        if isinstance(record, Mapping):
            if record.keys() != set(self.columns):
                names = sorted(record.keys() ^ set(self.columns))
                raise ValueError(f"record and columns differ in {', '.join(names)}")
            record = [record[name] for name in self.columns]
        elif len(record) != len(self.columns):
            raise ValueError(f"{len(record)} values for {len(self.columns)} columns")
        self._pending.append(record)
        if time.monotonic() - self._last >= self._flush_seconds:
            self.flush()

    def flush(self) -> None:
        """Write pending records; on failure shorten the file to its last complete line."""
        self._last = time.monotonic()
        if not self._pending or self._handle is None:
            return
        block = csv_text(self._pending).encode("utf-8")
        try:
            if not os.path.exists(self.path):
                raise FileNotFoundError(2, "it has vanished")
            count = 0
            while count < len(block):
                count += os.write(self._handle, block[count:])
        except OSError as error:
            if os.fstat(self._handle).st_size > self._size:
                os.ftruncate(self._handle, self._size)
            raise OutputError(f"cannot write {self.path}: {reason(error)}") from error
        self._size += len(block)
        self._pending.clear()

    def sync(self) -> None:
        """Write pending records and flush them to the disk."""
        if self._handle is None:
            return
        self.flush()
        with write_errors(self.path):
            os.fsync(self._handle)

    def close(self) -> None:
        """Write pending records, flush them to the disk, and close the file."""
        if self._handle is None:
            return
        try:
            self.sync()
        finally:
            os.close(self._handle)
            self._handle = None

    def __enter__(self) -> "HistoryWriter":
        return self

    def __exit__(self, *error: object) -> None:
        self.close()
