"""Folder of the compiled loops and names of its files; numba is not imported.

Loops are unpickled and executed. The folder is therefore the user's own, or one that the user names in
HVISPH_CACHE_DIR. A folder below the shared temporary folder is used only if it belongs to the user, is closed to
others and is not a link.
"""

import os
import stat
import tempfile
from functools import cache
from pathlib import Path

from .fingerprint import fingerprint
from .lazy_import import PythonFunction

SUFFIX = ".loop"


@cache
def cache_folder() -> Path | None:
    """Return the folder of the compiled loops, or None where no folder can be written or read."""
    from platformdirs import user_cache_path

    setting = os.environ.get("HVISPH_CACHE_DIR")
    folder = Path(setting or user_cache_path("hvisph", appauthor=False)) / "loops"
    # the home may belong to somebody else, as under sudo: its loops are not executed
    is_trusted = setting or not folder.is_dir() or _belongs_to_user(folder, 0o022)
    if is_trusted and (_is_writable(folder) or any(folder.glob(f"*{SUFFIX}"))):
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
    """Return a folder below the temporary folder that no other user can write to, or None."""
    try:
        folder = Path(tempfile.gettempdir()) / f"hvisph-cache-{os.getuid() if hasattr(os, 'getuid') else ''}"
        folder.mkdir(mode=0o700, exist_ok=True)
    except OSError:  # there is no usable temporary folder
        return None
    return folder if _belongs_to_user(folder, 0o077) and _is_writable(folder) else None


def _belongs_to_user(folder: Path, forbidden: int) -> bool:
    """Whether a folder is the user's, no link, and has none of the `forbidden` permissions; Windows has its own."""
    status = folder.lstat()
    is_owner = not hasattr(os, "getuid") or (status.st_uid == os.getuid() and not status.st_mode & forbidden)
    return stat.S_ISDIR(status.st_mode) and is_owner


def file_stem(function: PythonFunction) -> str:
    """Return the name of a loop's file up to the hash of its argument types and processor."""
    return f"{function.__name__.split('_')[0] or 'loop'}-{fingerprint(function)}"
