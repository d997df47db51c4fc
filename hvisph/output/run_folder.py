"""The folder of a run: creation, lock, log and clean-up."""

import errno
import json
import os
import sys
from collections.abc import Callable
from contextlib import suppress
from datetime import datetime
from pathlib import Path

from hvisph.core.errors import CaseError, OutputError
from hvisph.core.text import sanitize

from . import atomic_write, file_names
from .atomic_write import NO_LINK, reason, write_bytes, write_errors


class RunLog:
    """Log that appends lines to `path`, each with the local date and time to the millisecond.

    The file is opened for every text, so that a vanished folder is noticed, but never through a link. Control
    characters are escaped.
    """

    def __init__(self, path: str | Path):
        self.path = Path(path)

    def write(self, text: str) -> None:
        """Append `text` to the log, line by line; raises `OutputError` when it cannot be written."""
        stamp = datetime.now().astimezone().isoformat(sep=" ", timespec="milliseconds")
        block = "".join(f"{stamp}  {sanitize(line)}\n" for line in text.splitlines() or [""])
        with write_errors(self.path):
            if self.path.exists() and self.path.lstat().st_nlink > 1:  # a backup of hard links shares the file
                write_bytes(self.path, self.path.read_bytes())
            handle = os.open(self.path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | NO_LINK, 0o666)
            with os.fdopen(handle, "a", encoding="utf-8", errors="replace", newline="\n") as file:
                file.write(block)


class SilentLog(RunLog):
    """Log of a process that writes none."""

    def write(self, text: str) -> None:
        """Write nothing."""


# Errors of file systems without locks, as some network ones; a run there continues unlocked.
_NO_LOCKS = {errno.ENOLCK, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOSYS}


class FileLock:
    """Lock on the file `path`, created if missing, until `release` or the end of the process.

    Raises `BlockingIOError` when another process, or this one, holds it; `OSError` when the file cannot be opened, or
    is a link.
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
        """Release the lock."""
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


class RunFolder:
    """Folder of a run, made by `create` or `open`, and locked for this process until `close`."""

    def __init__(self, path: Path, lock: FileLock):
        self.path = path
        self.log = RunLog(path / file_names.LOG)
        self._lock = lock

    @classmethod
    def create(cls, path: str | Path, force: bool = False) -> "RunFolder":
        """Make the folder and its sub-folders and lock it.

        `path`: the folder; one that exists must be empty, or a run's with `force`.
        `force`: delete what an earlier run wrote there. Files that hvisph does not write stay.
        Raises `CaseError` when the folder is in use for something: an earlier run without `force`, a link where hvisph
        writes, or anything else; `OutputError` when another run is writing it or it cannot be written.
        """
        folder = Path(path)
        if folder.exists() and not folder.is_dir():
            raise CaseError(f"{folder} is a file, not a folder; nothing was changed", where="--out")
        with write_errors(folder):
            folder.mkdir(parents=True, exist_ok=True)
            if not looks_like_a_run(folder) and any(folder.iterdir()):
                raise CaseError(f"{folder} is not empty and not a run of hvisph; nothing was changed", where="--out")
            refuse_links(folder)
            lock = _lock_folder(folder)
            try:
                if any(path.name != file_names.LOCK for path in folder.iterdir()):  # beside its mark
                    if not force:
                        raise CaseError(f"{folder} holds a run; --force replaces it; unchanged", where="--out")
                    for path in filter(file_names.is_plain, file_names.own_files(folder)):
                        path.unlink()
                for name in file_names.CREATED_FIRST:
                    (folder / name).mkdir(exist_ok=True)
            except BaseException:
                lock.release()
                raise
        return cls(folder, lock)

    @classmethod
    def open(cls, path: str | Path) -> "RunFolder":
        """Lock the folder of an earlier run in order to continue it.

        Raises `CaseError` when there is no such folder, it is not a run's, or a name that hvisph writes is a link;
        `OutputError` when another run is writing it.
        """
        folder = Path(path)
        if not folder.is_dir() or not looks_like_a_run(folder):
            raise CaseError(f"{folder} is not the folder of a run")
        refuse_links(folder)
        lock = _lock_folder(folder)
        try:
            for name in file_names.CREATED_FIRST:
                (folder / name).mkdir(exist_ok=True)
        except OSError as error:
            lock.release()
            raise OutputError(f"cannot write {folder}: {reason(error)}") from error
        return cls(folder, lock)

    def snapshot_path(self, number: int | str) -> Path:
        """Return the name of the VTKHDF snapshot with this number, or of one with a name of its own."""
        return self.path / file_names.SNAPSHOTS / f"{_stem(number)}{file_names.SNAPSHOT_ENDING}"

    def vtu_path(self, number: int | str) -> Path:
        """Return the name of the VTU snapshot with this number, or of one with a name of its own."""
        return self.path / file_names.VTU / f"{_stem(number)}.vtu"

    def region_path(self, region: str, number: int) -> Path:
        """Return the name of the VTKHDF snapshot of a region with this number."""
        return self.path / file_names.REGIONS / f"{region}.{_stem(number)}{file_names.SNAPSHOT_ENDING}"

    @property
    def history_path(self) -> Path:
        """The history's file."""
        return self.path / file_names.HISTORY

    @property
    def checkpoint_path(self) -> Path:
        """The checkpoints' folder."""
        return self.path / file_names.CHECKPOINT

    def write_text(self, name: str, text: str) -> None:
        """Write a text file of the folder atomically; raises `OutputError`."""
        atomic_write.write_text(self.path / name, text)

    def write_json(self, name: str, content: object) -> None:
        """Write `content` as indented JSON atomically; raises `OutputError`."""
        self.write_text(name, json.dumps(content, indent=2, ensure_ascii=False) + "\n")

    def close(self) -> None:
        """Release the lock."""
        self._lock.release()

    def __enter__(self) -> "RunFolder":
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


class SilentFolder(RunFolder):
    """Folder of a run for a process that writes nothing there, because another one does."""

    def __init__(self, path: Path):
        self.path, self.log = path, SilentLog(path / file_names.LOG)

    def write_text(self, name: str, text: str) -> None:
        """Write nothing."""

    def close(self) -> None:
        """Do nothing: there is no lock."""


def looks_like_a_run(folder: Path) -> bool:
    """Return whether hvisph wrote this folder: it contains the lock file, or an effective case and a history."""
    if (folder / file_names.LOCK).is_file():
        return True
    try:
        with (folder / file_names.CASE).open("rb") as file:
            begins = file.read(len(file_names.CASE_HEAD)) == file_names.CASE_HEAD.encode("ascii")
    except OSError:
        return False
    return begins and (folder / file_names.HISTORY).is_file()


def refuse_links(folder: Path) -> None:
    """Raise `CaseError` if a name that hvisph uses belongs to a link or anything but a plain file or folder."""
    folders = (folder / name for name in file_names.FOLDERS)
    links = [path for path in folders if not _plain_or_absent(path, file_names.is_plain_folder)]
    files = folder / file_names.LOCK, *file_names.own_files(folder)
    links += [path for path in files if not _plain_or_absent(path, file_names.is_plain)]
    if links:
        noun = (
            "link" if links[0].is_symlink() else "plain folder" if links[0].name in file_names.FOLDERS else "plain file"
        )
        raise CaseError(
            f"{links[0]} is {'a' if noun == 'link' else 'no'} {noun}, and hvisph writes and deletes nothing through "
            "links; move it away, or run into another folder; nothing was changed",
            where="--out",
        )


def clear_unfinished(folder: str | Path) -> None:
    """Delete unfinished files of killed processes in a run's folder."""
    for path in file_names.own_files(Path(folder)):
        if path.name.endswith(file_names.PARTIAL) and file_names.is_plain(path):
            with suppress(OSError):
                path.unlink()


def _plain_or_absent(path: Path, is_plain: Callable[[Path], bool]) -> bool:
    return is_plain(path) or not (path.is_symlink() or path.exists())


def _lock_folder(folder: Path) -> FileLock:
    try:
        return FileLock(folder / file_names.LOCK)
    except BlockingIOError as error:
        raise OutputError(f"cannot write {folder}: another run is writing it") from error
    except OSError as error:
        raise OutputError(f"cannot write {folder}: {reason(error)}") from error


def _stem(number: int | str) -> str:
    return f"{number:06d}" if isinstance(number, int) else number


def delete_snapshots(path: Path, last: bool) -> None:
    """Delete snapshots and checkpoints of an ended run; `last`: keep the last snapshot. Links are not followed."""
    for series in (file_names.SERIES, file_names.TIME_SERIES):  # of deleted snapshots
        if file_names.is_plain(path / series):
            (path / series).unlink()
    for name in file_names.FOLDERS:
        folder = path / name
        if not file_names.is_plain_folder(folder):
            continue
        numbered = sorted(
            file for file in folder.iterdir() if file_names.is_own(file) and file_names.number_of(file) is not None
        )
        latest = numbered[-1:] if last and name not in (file_names.CHECKPOINT, file_names.REGIONS) else []
        for file in numbered:
            if file not in latest and not file.is_symlink():
                file.unlink(missing_ok=True)
