"""Files written beside and renamed: a name either holds a complete file or what it held before.

Everything goes to `NAME.partial` in the same folder, is forced to the disk, and only then takes its
name. A kill at any moment leaves at most a `.partial` file, which the next write of that name replaces.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from hvisph.core.errors import OutputError

PARTIAL = ".partial"


@contextmanager
def replacing(path: str | Path) -> Iterator[BinaryIO]:
    """Give a binary file, open for writing and reading, that becomes `path` when the block ends well.

    Raises
    ------
    OutputError
        When anything of it fails: disk full, folder read-only or gone. `path` is then as before.
    """
    target = Path(path)
    partial = target.with_name(target.name + PARTIAL)
    try:
        try:
            with partial.open("w+b") as file:
                yield file
                file.flush()
                os.fsync(file.fileno())
            os.replace(partial, target)
        except BaseException:
            with suppress(OSError):
                partial.unlink()
            raise
        _sync_folder(target.parent)
    except OSError as error:
        raise OutputError(f"cannot write {target}: {reason(error)}") from error


def write_bytes(path: str | Path, content: bytes) -> None:
    """Write `content` to `path`, beside and renamed; raises `OutputError` as `replacing`."""
    with replacing(path) as file:
        file.write(content)


def write_text(path: str | Path, text: str) -> None:
    """Write `text` to `path` as UTF-8, beside and renamed; raises `OutputError` as `replacing`."""
    write_bytes(path, text.encode("utf-8"))


def reason(error: OSError) -> str:
    """Return what the operating system says was wrong, without its number and without the path."""
    return (error.strerror or str(error) or type(error).__name__).lower()


def _sync_folder(folder: Path) -> None:
    """Force the renaming itself to the disk, where the system can (Windows cannot open folders)."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
