"""Atomic writing of files by renaming.

Content is written to `NAME.partial` in the same folder, forced to the disk, and then renamed. A process
killed at any moment leaves at most a `.partial` file, which the next write of that name replaces.
Links are neither followed nor overwritten.
"""

import csv
import errno
import io
import os
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from hvisph.core.errors import CaseError, OutputError

from .file_names import PARTIAL

NO_LINK = getattr(os, "O_NOFOLLOW", 0)  # refuses links, where the system can (Windows cannot)


@contextmanager
def write_errors(path: str | Path) -> Iterator[None]:
    """Raise an `OutputError` that names `path` for errors of writing it in this block."""
    try:
        yield
    except OSError as error:
        raise OutputError(f"cannot write {path}: {reason(error)}") from error


@contextmanager
def read_errors(path: str | Path, what: str) -> Iterator[None]:
    """Raise an `OutputError` on reading `path`, a file of the kind `what`, for any error of this block."""
    try:
        yield
    except (CaseError, MemoryError):
        raise
    except OutputError as error:
        raise OutputError(f"cannot read {path}: {error}") from error
    except OSError as error:
        raise OutputError(f"cannot read {path}: {reason(error)}") from error
    except Exception as error:
        text = f"it is truncated, damaged or not {what} ({str(error) or type(error).__name__})"
        raise OutputError(f"cannot read {path}: {text}") from error


@contextmanager
def replacing(path: str | Path) -> Iterator[BinaryIO]:
    """Return a context with a binary file that replaces `path` if the block ends without an error.

    Raises `OutputError` for any failure: disk full, folder read-only or missing. `path` is then unchanged.
    """
    target = Path(path)
    partial = target.with_name(target.name + PARTIAL)
    with write_errors(target):
        if target.is_symlink():
            raise FileExistsError(errno.EEXIST, "it is a link, and nothing is written over links")
        file = _new(partial)
        try:
            with file:
                yield file
                file.flush()
                os.fsync(file.fileno())
            os.replace(partial, target)
        except BaseException:
            with suppress(OSError):
                partial.unlink()
            raise
        _sync_folder(target.parent)


def _new(path: Path) -> BinaryIO:
    """Return a new file `path`, open for writing and reading; remains of a killed process are replaced."""
    try:
        if stat.S_ISREG(path.lstat().st_mode):
            path.unlink()
    except FileNotFoundError:
        pass
    # never through a link, and never into a file that another process has just created
    handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666)
    return os.fdopen(handle, "w+b")


def write_bytes(path: str | Path, content: bytes) -> None:
    """Write `content` to `path` atomically; raises `OutputError` as `replacing`."""
    with replacing(path) as file:
        file.write(content)


def write_text(path: str | Path, text: str) -> None:
    """Write `text` to `path` as UTF-8, atomically; raises `OutputError` as `replacing`."""
    write_bytes(path, text.encode("utf-8"))


def csv_text(rows: Iterable[Iterable[object]]) -> str:
    """Return rows as CSV; floats have the fewest digits that represent them exactly."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def write_csv(path: str | Path, rows: Iterable[Iterable[object]]) -> None:
    """Write rows as CSV, atomically; raises `OutputError` as `replacing`."""
    write_text(path, csv_text(rows))


def reason(error: OSError) -> str:
    """Return the message of the operating system, without its number and without the path."""
    return (error.strerror or str(error) or type(error).__name__).lower()


def _sync_folder(folder: Path) -> None:
    """Force the renaming itself to the disk, where the system can (Windows cannot open folders)."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
