"""The cache of compiled loops: one file per loop, named by the fingerprint of its code, argument types and processor.

A change of the program invalidates only the loops that it concerns, and several versions share the others. A file that
cannot be read, is damaged or cannot be written counts as absent.

Loops are unpickled and executed. The folder is therefore the user's own, or one that the user names in
HVISPH_CACHE_DIR. A folder below the shared temporary folder is used only if it belongs to the user, is closed to
others and is not a link.
"""

from __future__ import annotations

import gc
import hashlib
import io
import os
import pickle
import stat
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

from numba.core.base import BaseContext
from numba.core.caching import NullCache
from numba.core.compiler import CompileResult
from numba.core.environment import Environment
from numba.core.serialize import dumps

from .fingerprint import fingerprint

_SUFFIX = ".loop"
_TIMEOUT, _INTERVAL = 120.0, 0.02  # longest wait for another process that compiles a loop, and between checks [s]
_DIGEST = 32  # length of the hash in front of the pickled loop [bytes]


@cache
def cache_folder() -> Path | None:
    """Return the folder of the compiled loops, or None where no folder can be written or read."""
    from platformdirs import user_cache_path

    chosen = os.environ.get("HVISPH_CACHE_DIR")
    folder = Path(chosen or user_cache_path("hvisph", appauthor=False)) / "loops"
    # the home may belong to somebody else, as under sudo: its loops are not executed
    trusted = chosen or not folder.is_dir() or _belongs_to_user(folder, 0o022)
    if trusted and (_is_writable(folder) or any(folder.glob(f"*{_SUFFIX}"))):
        return folder
    return _private_folder()


def _is_writable(folder: Path) -> bool:
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        folder.mkdir(mode=0o700, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _private_folder() -> Path | None:
    """Return a folder below the temporary folder that nobody else can write to, or None."""
    try:
        folder = Path(tempfile.gettempdir()) / f"hvisph-cache-{os.getuid() if hasattr(os, 'getuid') else ''}"
        folder.mkdir(mode=0o700, exist_ok=True)
    except OSError:  # there is no usable temporary folder
        return None
    return folder if _belongs_to_user(folder, 0o077) and _is_writable(folder) else None


def _belongs_to_user(folder: Path, forbidden: int) -> bool:
    """Whether a folder is the user's, no link, and has none of the `forbidden` permissions; Windows has its own."""
    status = folder.lstat()
    owned = not hasattr(os, "getuid") or (status.st_uid == os.getuid() and not status.st_mode & forbidden)
    return stat.S_ISDIR(status.st_mode) and owned


class LoopCache(NullCache):
    """The compiled forms of one function in the cache folder; `prepare` is called before one is compiled."""

    def __init__(self, function: Any, prepare: Callable[[], object]) -> None:
        self._function, self._folder, self._prepare = function, cache_folder(), prepare
        self._path: Path | None = None
        self._compilation = ExitStack()

    @property
    def cache_path(self) -> str | None:
        """Folder of the compiled loops."""
        return str(self._folder) if self._folder else None

    def load_overload(self, sig: Any, target_context: BaseContext) -> Any:
        """Return the loop compiled for `sig`, or None if it is to be compiled now."""
        loop = None
        if self._folder:
            processor = repr((sig, target_context.codegen().magic_tuple()))
            digest = hashlib.sha256((fingerprint(self._function) + processor).encode()).hexdigest()[:32]
            self._path = self._folder / f"{self._function.__name__.split('_')[0] or 'loop'}-{digest}{_SUFFIX}"
            loop = _read(self._path, target_context)
            if loop is None:
                self._compilation.enter_context(_lock(self._path))
                loop = _read(self._path, target_context)  # another process may have compiled it
        if loop is None:
            self._compilation.enter_context(_rare_garbage_collection())
            self._prepare()
        return loop

    def end_compilation(self) -> None:
        """Release the lock of the loop, whether it was compiled or not."""
        self._compilation.close()

    def save_overload(self, sig: Any, data: Any) -> None:
        """Write the loop that was just compiled."""
        if self._path is None or data.library.has_dynamic_globals:
            return
        loop = dumps(data._reduce())
        with suppress(OSError), tempfile.TemporaryDirectory(dir=self._folder, prefix=".") as folder:
            file = Path(folder) / self._path.name
            file.write_bytes(hashlib.sha256(loop).digest() + loop)
            file.replace(self._path)


def _read(path: Path, target_context: object) -> Any:
    """Return the loop in a file, or None."""
    try:
        data = path.read_bytes()
        if hashlib.sha256(data[_DIGEST:]).digest() != data[:_DIGEST]:
            return None
        return CompileResult._rebuild(target_context, *_Reader(io.BytesIO(data[_DIGEST:])).load())
    except Exception:  # any error in a file of another version: the loop is compiled again
        return None


class _Reader(pickle.Unpickler):
    """Read a loop without importing the modules of its functions: numba's modules of arrays take 0.1 s."""

    def find_class(self, module: str, name: str) -> Any:
        """Return the object of a name in a pickled loop."""
        return _environment if name == "_rebuild_env" else super().find_class(module, name)


def _environment(module: str, constants: list[Any], name: str) -> Any:
    """Return the environment of a compiled function, which holds the arguments of its exceptions."""
    environment = Environment({"__name__": module})
    environment.consts[:] = constants
    environment.env_name = name
    return environment


@contextmanager
def _lock(path: Path) -> Iterator[None]:
    """Wait for other processes that compile the same loop; without file locks each process compiles its own."""
    lock, handle = path.with_suffix(".lock"), -1
    with suppress(OSError, ImportError):
        import fcntl

        handle = os.open(lock, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o600)
        for _ in range(round(_TIMEOUT / _INTERVAL)):
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                time.sleep(_INTERVAL)
    try:
        yield
    finally:
        if handle >= 0:
            with suppress(OSError):
                lock.unlink(missing_ok=True)
                os.close(handle)


@contextmanager
def _rare_garbage_collection() -> Iterator[None]:
    """Let Python search for cyclic garbage rarely: with the compiler's many objects it takes a seventh of the time."""
    thresholds, frozen = gc.get_threshold(), gc.get_freeze_count()
    gc.freeze()
    gc.set_threshold(20_000, 20, 100)
    try:
        yield
    finally:
        gc.set_threshold(*thresholds)
        if not frozen:
            gc.unfreeze()
