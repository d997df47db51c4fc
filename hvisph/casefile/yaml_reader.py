"""Reading of YAML files from disk with checks of type and size."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from hvisph.core.errors import FEW, CaseError

from .yaml_text import Document, parse

LARGEST = 1_000_000  # [bytes]; a thousand times a usual case


def read_yaml(path: Path) -> Document:
    """Return what the YAML file at `path` holds.

    Raises
    ------
    CaseError
        If it is missing, not a regular file, unreadable, larger than `LARGEST`, not UTF-8, no
        YAML, or not a mapping.
    """
    name = str(path)
    try:
        status = os.stat(path)
        if stat.S_ISDIR(status.st_mode):
            held = sorted(one.name for one in path.glob("*.yaml"))[:FEW]
            inside = f"; it holds {', '.join(held)}" if held else ""
            raise CaseError(f"is a folder, not a case file{inside}", file=name)
        if not stat.S_ISREG(status.st_mode):
            raise CaseError("is not a regular file", file=name)
        # what pretends to be a regular file and then waits, as /proc/kmsg does, is not waited for
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
        with open(handle, "rb") as stream:
            raw = stream.read(LARGEST + 1)
    except FileNotFoundError:
        raise CaseError("there is no such file", file=name) from None
    except (OSError, ValueError) as error:  # ValueError: a path with a null byte
        raise CaseError(f"cannot be read: {getattr(error, 'strerror', None) or error}", file=name) from None
    if raw is None:
        raise CaseError("cannot be read: it has nothing to give now", file=name)
    if len(raw) > LARGEST:
        raise CaseError(f"is larger than {LARGEST / 1e6:g} MB, too large for a case file", file=name)
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise CaseError("is not UTF-8 text; save it in that encoding", file=name, line=line) from None
    document = parse(text, name)
    if not isinstance(document.value, dict):
        raise CaseError("holds no mapping of keys", file=name)
    return document
