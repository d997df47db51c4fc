"""The cache of compiled loops: one file per loop, named by the fingerprint of its code, argument types and processor.

A change of the program invalidates only the loops that it concerns, and several versions share the others. A file that
cannot be read, is damaged or cannot be written counts as absent.

Loops are unpickled and executed; `cache_folder` says which folders are trusted.
"""

import gc
import hashlib
import io
import os
import pickle
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from numba.core.base import BaseContext
from numba.core.caching import NullCache
from numba.core.compiler import CompileResult
from numba.core.environment import Environment
from numba.core.serialize import dumps
from numba.core.typing.templates import Signature

from .cache_folder import SUFFIX, cache_folder, file_stem
from .lazy_import import PythonFunction

_TIMEOUT, _INTERVAL = 120.0, 0.02  # longest wait for another process that compiles a loop, and between checks [s]
_DIGEST = 32  # length of the hash in front of the pickled loop [bytes]


class LoopCache(NullCache):
    """The compiled forms of one function in the cache folder; `prepare` is called before one is compiled."""

    def __init__(self, function: PythonFunction, prepare: Callable[[], object]) -> None:
        self._function, self._folder, self._prepare = function, cache_folder(), prepare
        self._path: Path | None = None
        self._compilation = ExitStack()

    @property
    def cache_path(self) -> str | None:
        """Folder of the compiled loops."""
        return str(self._folder) if self._folder else None

    def load_overload(self, sig: Signature, target_context: BaseContext) -> CompileResult | None:
        """Return the loop compiled for `sig`, or None if it is to be compiled now."""
        loop = None
        if self._folder:
            processor = repr((sig, target_context.codegen().magic_tuple()))
            digest = hashlib.sha256(processor.encode()).hexdigest()[:16]
            self._path = self._folder / f"{file_stem(self._function)}-{digest}{SUFFIX}"
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

    def save_overload(self, sig: Signature, data: CompileResult) -> None:
        """Write the loop that was just compiled."""
        if self._path is None or data.library.has_dynamic_globals:
            return
        loop = dumps(data._reduce())
        with suppress(OSError), tempfile.TemporaryDirectory(dir=self._folder, prefix=".") as folder:
            file = Path(folder) / self._path.name
            file.write_bytes(hashlib.sha256(loop).digest() + loop)
            file.replace(self._path)


def _read(path: Path, target_context: BaseContext) -> CompileResult | None:
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

    def find_class(self, module: str, name: str) -> object:
        """Return the object of a name in a pickled loop."""
        return _environment if name == "_rebuild_env" else super().find_class(module, name)


def _environment(module: str, constants: list[object], name: str) -> Environment:
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
    thresholds, count = gc.get_threshold(), gc.get_freeze_count()
    gc.freeze()
    gc.set_threshold(20_000, 20, 100)
    try:
        yield
    finally:
        gc.set_threshold(*thresholds)
        if not count:
            gc.unfreeze()
