"""What can be wrong with the folder of compiled loops: read-only, or damaged. Neither stops a run."""

from __future__ import annotations

import atexit
import shutil
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

from numba.core.caching import IndexDataCacheFile


@cache
def usable(folder: Path) -> Path | None:
    """Return `folder`, or where it is read-only a copy for this process; None where there is no room for one.

    numba passes over a cache that it cannot write, even to read from it.
    """
    try:
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError:
        pass
    try:
        copy = Path(tempfile.mkdtemp(prefix="hvisph-cache-"))
        atexit.register(shutil.rmtree, copy, ignore_errors=True)
        # without permissions, which would make the copy read-only as well
        for path in folder.rglob("*"):
            target = copy / path.relative_to(folder)
            if path.is_dir():
                target.mkdir(parents=True, exist_ok=True)
            else:
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(path, target)
    except OSError:
        return None
    return copy


class _Forgiving(IndexDataCacheFile):
    """The index and the compiled loops of one function: what cannot be read is not there."""

    def load(self, key: Any) -> Any:
        try:
            return super().load(key)
        except Exception:  # whatever unpickling a damaged file brings up
            return None

    def _load_index(self) -> Any:
        try:
            return super()._load_index()
        except Exception:  # as above
            return {}


def forgive_damage(loop: Any) -> None:
    """Let a loop whose cache is damaged be compiled anew, as after a power failure, and not fail."""
    file = getattr(getattr(loop, "_cache", None), "_cache_file", None)
    if type(file) is IndexDataCacheFile:
        file.__class__ = _Forgiving
