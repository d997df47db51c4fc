"""Memory allocation: release of large arrays to the system."""

from __future__ import annotations

import ctypes
import sys

_MMAP_THRESHOLD = -3  # M_MMAP_THRESHOLD of glibc's malloc.h
LARGE = 1 << 20  # [bytes]


def give_back_large() -> None:
    """Have arrays of more than `LARGE` bytes come from the system one by one, where glibc allocates.

    Left to itself glibc raises its limit to the largest array that was freed, up to 32 MiB; what is below lies
    side by side, and a hole goes back to the system only when all behind it is free, too.
    """
    if not sys.platform.startswith("linux"):
        return
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:  # musl has none
        mallopt(_MMAP_THRESHOLD, LARGE)
