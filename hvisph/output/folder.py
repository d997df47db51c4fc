"""The folder of a run: made or taken over safely, locked while it is written, nothing outside it."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from types import TracebackType
from typing import Any

from hvisph.core.errors import CaseError, OutputError
from hvisph.output import atomic, names
from hvisph.output.atomic import reason
from hvisph.output.lock import FileLock
from hvisph.output.log import RunLog


class RunFolder:
    """One run's folder, locked for this process until `close`.

    Made by `create` for a new run or by `open` to go on with one.
    """

    def __init__(self, path: Path, lock: FileLock):
        self.path = path
        self.log = RunLog(path / names.LOG)
        self._lock = lock

    @classmethod
    def create(cls, path: str | Path, force: bool = False) -> RunFolder:
        """Make the folder and its sub-folders and lock it.

        Parameters
        ----------
        path
            The folder; one that exists must be empty, or a run's with `force`.
        force
            Delete what an earlier run wrote there. Files that hvisph does not write stay.

        Raises
        ------
        CaseError
            When the folder is in use for something: an earlier run without `force`, or anything else.
        OutputError
            When another run is writing it or it cannot be written.
        """
        folder = Path(path)
        if folder.exists() and not folder.is_dir():
            raise CaseError(f"{folder} is a file, not a folder; nothing was changed", where="--out")
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if not looks_like_a_run(folder) and any(folder.iterdir()):
                raise CaseError(f"{folder} is not empty and not a run of hvisph; nothing was changed", where="--out")
            lock = _locked(folder)
            try:
                if _content(folder):
                    if not force:
                        raise CaseError(
                            f"{folder} holds a run; --force replaces it; nothing was changed", where="--out"
                        )
                    _clear(folder)
                for name in names.FOLDERS:
                    (folder / name).mkdir(exist_ok=True)
            except BaseException:
                lock.release()
                raise
        except OSError as error:
            raise OutputError(f"cannot write {folder}: {reason(error)}") from error
        return cls(folder, lock)

    @classmethod
    def open(cls, path: str | Path) -> RunFolder:
        """Lock the folder of an earlier run, to go on with it.

        Raises
        ------
        CaseError
            When there is no such folder or it is not a run's.
        OutputError
            When another run is writing it.
        """
        folder = Path(path)
        if not folder.is_dir() or not looks_like_a_run(folder):
            raise CaseError(f"{folder} is not the folder of a run")
        lock = _locked(folder)
        try:
            for name in names.FOLDERS:
                (folder / name).mkdir(exist_ok=True)
        except OSError as error:
            lock.release()
            raise OutputError(f"cannot write {folder}: {reason(error)}") from error
        return cls(folder, lock)

    def snapshot_path(self, number: int | str) -> Path:
        """Return the name of the HDF5 snapshot with this number, or of one with a name of its own."""
        return self.path / names.SNAPSHOTS / f"{_stem(number)}.h5"

    def vtu_path(self, number: int | str) -> Path:
        """Return the name of the VTU snapshot with this number, or of one with a name of its own."""
        return self.path / names.VTU / f"{_stem(number)}.vtu"

    @property
    def history_path(self) -> Path:
        """The history's file."""
        return self.path / names.HISTORY

    @property
    def checkpoint_path(self) -> Path:
        """The checkpoints' folder."""
        return self.path / names.CHECKPOINT

    def write_text(self, name: str, text: str) -> None:
        """Write a text file of the folder, beside and renamed; raises `OutputError`."""
        atomic.write_text(self.path / name, text)

    def write_json(self, name: str, content: Any) -> None:
        """Write `content` as indented JSON, beside and renamed; raises `OutputError`."""
        self.write_text(name, json.dumps(content, indent=2, ensure_ascii=False) + "\n")

    def close(self) -> None:
        """Let the lock go."""
        self._lock.release()

    def __enter__(self) -> RunFolder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def looks_like_a_run(folder: Path) -> bool:
    """Tell whether hvisph wrote this folder: it left its mark, or its effective case beside a history."""
    marked = (folder / names.LOCK).is_file()
    return marked or ((folder / names.CASE).is_file() and (folder / names.HISTORY).is_file())


def _locked(folder: Path) -> FileLock:
    try:
        return FileLock(folder / names.LOCK)
    except BlockingIOError as error:
        raise OutputError(f"cannot write {folder}: another run is writing it") from error
    except OSError as error:
        raise OutputError(f"cannot write {folder}: {reason(error)}") from error


def _content(folder: Path) -> list[Path]:
    """Return what the folder holds beside its mark."""
    return [path for path in folder.iterdir() if path.name != names.LOCK]


def _clear(folder: Path) -> None:
    """Delete what hvisph writes, and only that."""
    for name in names.FILES:
        for path in (folder / name, folder / (name + atomic.PARTIAL)):
            path.unlink(missing_ok=True)
    for name in names.FOLDERS:
        # a link is taken away without following it: what it points to may be anything
        if (folder / name).is_symlink():
            (folder / name).unlink()
        elif (folder / name).is_dir():
            shutil.rmtree(folder / name)


def _stem(number: int | str) -> str:
    return f"{number:06d}" if isinstance(number, int) else number
