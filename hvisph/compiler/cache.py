"""The cache of compiled loops: one file a loop, named by what the loop is made of.

A loop is taken from the cache when its fingerprint, argument types and processor agree, so an edit costs
only the loops that it concerns, and versions of the package share what they have in common. What cannot be read,
is damaged or cannot be written is as good as absent: neither stops a run.

Loops are unpickled and run, so a folder is as trusted as the program itself: the user's own, or one that
the user names in HVISPH_CACHE_DIR. A folder under the shared temporary folder is used only if it is the
user's own, closed to others and no link.
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

from numba.core import compiler, serialize
from numba.core.caching import _Cache
from numba.core.environment import Environment, lookup_environment
from numba.core.runtime import rtsys

from .codegen import know
from .fingerprint import fingerprint

_SUFFIX = ".loop"
_PATIENCE, _LOOK = 120.0, 0.02  # wall time that another process has to make a loop, and between two looks for it [s]
_SEAL = 32  # bytes of the hash before the pickled loop


@cache
def cache_folder() -> Path | None:
    """Folder of the compiled loops, made if need be; None where there is none to write or to read from."""
    from platformdirs import user_cache_path

    asked = os.environ.get("HVISPH_CACHE_DIR")
    named = Path(asked or user_cache_path("hvisph", appauthor=False)) / "loops"
    # the home may be somebody else's, as under sudo: what lies there is not run
    if asked or not named.is_dir() or _is_own(named, 0o022):
        if _writable(named):
            return named
        if named.is_dir() and any(named.glob(f"*{_SUFFIX}")):
            return named
    return _private_folder()


def _writable(folder: Path) -> bool:
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        folder.mkdir(mode=0o700, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _private_folder() -> Path | None:
    """Return a folder under the temporary one that nobody else can write to, or None."""
    try:
        folder = Path(tempfile.gettempdir()) / f"hvisph-cache-{os.getuid() if hasattr(os, 'getuid') else ''}"
    except OSError:  # no usable temporary folder at all
        return None
    try:
        folder.mkdir(mode=0o700)
    except FileExistsError:
        if not _is_own(folder, 0o077):
            return None
    except OSError:
        return None
    return folder if _writable(folder) else None


def _is_own(folder: Path, closed: int) -> bool:
    """Tell whether a folder is the user's, no link, and has none of the permissions `closed`; Windows has its own."""
    status = folder.lstat()
    if not hasattr(os, "getuid"):
        return stat.S_ISDIR(status.st_mode)
    return stat.S_ISDIR(status.st_mode) and status.st_uid == os.getuid() and not status.st_mode & closed


in_passing = False  # whether a loop that another process is making is left to it


class MadeElsewhereError(Exception):
    """Another process is making a loop."""


class LoopCache(_Cache):
    """The compiled forms of one function in the cache folder; `missed` is called before one is compiled."""

    def __init__(self, function: Any, folder: Path, missed: Callable[[], object]) -> None:
        self._function, self._folder, self._missed = function, folder, missed
        self._print: str | None = None
        self._enabled = True
        self._turn = ExitStack()

    @property
    def cache_path(self) -> str:
        """Folder of the compiled loops."""
        return str(self._folder)

    def enable(self) -> None:
        """Read and write from now on."""
        self._enabled = True

    def disable(self) -> None:
        """Neither read nor write from now on."""
        self._enabled = False

    def flush(self) -> None:
        """Keep what is there: it is filed by content and never stale."""

    def _path(self, signature: Any, context: Any) -> Path:
        if self._print is None:
            self._print = fingerprint(self._function)
        machine = repr((signature, context.codegen().magic_tuple())).encode()
        digest = hashlib.sha256(self._print.encode() + machine).hexdigest()[:32]
        return self._folder / f"{self._function.__name__.split('_')[0] or 'loop'}-{digest}{_SUFFIX}"

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the loop compiled for `sig`, or None where it is absent, damaged or of another make."""
        if not self._enabled:
            self._missed()
            return None
        # What a finished loop calls; numba's compiler, which takes 0.3 s to load, is for a loop that is not there.
        rtsys.initialize(target_context)
        path = self._path(sig, target_context)
        loop = _loop(path, target_context)
        if loop is None:
            self._turn = ExitStack()
            self._turn.enter_context(_turn(path))
            loop = _loop(path, target_context)  # another process may have had its turn before
            if loop is None:
                self._turn.enter_context(_seldom_collected())
                self._missed()
        return loop

    def end_turn(self) -> None:
        """Let other processes look for the loop again, made or not."""
        self._turn.close()

    def forget_turn(self) -> None:
        """Leave the turn to the process that this one was forked from: it is neither ended nor collected here."""
        self._forgotten, self._turn = self._turn, ExitStack()

    def save_overload(self, sig: Any, data: Any) -> None:
        """Write the loop beside its place and rename it; a folder that takes no files is no error."""
        if not self._enabled or data.lifted or data.library.has_dynamic_globals:
            return
        loop = serialize.dumps(data._reduce())
        path = self._path(sig, data.target_context)
        try:
            with tempfile.NamedTemporaryFile(dir=self._folder, prefix=".", suffix=".partial", delete=False) as file:
                file.write(hashlib.sha256(loop).digest() + loop)
            os.replace(file.name, path)
        except OSError:
            if "file" in locals():
                Path(file.name).unlink(missing_ok=True)


def _loop(path: Path, target_context: Any) -> Any:
    """Return the loop that a file holds, or None."""
    try:
        data = path.read_bytes()
        if hashlib.sha256(data[_SEAL:]).digest() != data[:_SEAL]:
            return None
        parts = _Reader(io.BytesIO(data[_SEAL:])).load()
        _, function, *_, environments = parts
        know((function.llvm_cpython_wrapper_name, *(one.env_name for one in environments)))
        return compiler.CompileResult._rebuild(target_context, *parts)
    except Exception:  # whatever a file of another make brings up: the loop is compiled anew
        return None


class _Reader(pickle.Unpickler):
    """Reads loops without the modules that their functions stand in: numba's own of arrays take 0.1 s to load."""

    def find_class(self, module: str, name: str) -> Any:
        """Return what a name in a pickled loop means."""
        return _environment if name == "_rebuild_env" else super().find_class(module, name)


def _environment(module: str, constants: list[Any], name: str) -> Any:
    """Return what a compiled function finds its exceptions by; only one that Python interprets reads the module."""
    made = lookup_environment(name)
    if made is None:
        made = Environment({"__name__": module})
        made.consts[:] = constants
        made.env_name = name
        Environment._memo[name] = made
    return made


@contextmanager
def _turn(path: Path) -> Iterator[None]:
    """Have this process' turn to make a loop that others may want too: they wait, for a while, and find it made.

    Where there are no locks, or nothing can be written, everybody makes his own.
    """
    held = path.with_suffix(".turn")
    handle = -1
    with suppress(OSError, ImportError):
        import fcntl

        handle = os.open(held, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o600)
        for _ in range(round(_PATIENCE / _LOOK)):
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                if in_passing:
                    os.close(handle)
                    raise MadeElsewhereError from None
                time.sleep(_LOOK)
    try:
        yield
    finally:
        if handle >= 0:
            with suppress(OSError):
                held.unlink(missing_ok=True)
                os.close(handle)


@contextmanager
def _seldom_collected() -> Iterator[None]:
    """Leave Python's collector what there is: the compiler's many objects have it look through all again and again.

    That took a seventh of the time.
    """
    usual, frozen = gc.get_threshold(), gc.get_freeze_count()
    gc.freeze()
    gc.set_threshold(20_000, 20, 100)
    try:
        yield
    finally:
        gc.set_threshold(*usual)
        if not frozen:
            gc.unfreeze()
