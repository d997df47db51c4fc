"""Available memory of the system, control groups and process limits; release of large arrays."""

import ctypes
import math
import os
import sys
from collections.abc import Iterator
from pathlib import Path

MOUNT = Path("/sys/fs/cgroup")
MEMBERSHIP = Path("/proc/self/cgroup")
UNLIMITED = 2.0**60  # [bytes]; version 1 says "none" by a number near 2^63


def free_memory() -> float:
    """Return the memory that a run may take [bytes].

    It is the least of what

    - the system has free,
    - the control groups of this process leave, its own and all above it, of version 1 or 2, as batch systems and
      containers set them,
    - the process may still take of its own limits of address space and data (``ulimit -v``, ``ulimit -d``).
    """
    import psutil

    return min(float(psutil.virtual_memory().available), group_memory(), own_memory())


def peak_memory() -> float:
    """Return the peak memory of this process [bytes]; 0 where it is unknown."""
    try:
        import resource
    except ImportError:  # Windows has none
        return 0.0
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1.0 if sys.platform == "darwin" else 1024.0)


def group_memory(mount: Path = MOUNT, membership: Path = MEMBERSHIP) -> float:
    """Return the memory [bytes] that the control groups of this process leave, infinite where none limits it.

    `mount`: where the groups are mounted; version 1 has the controller below it, as ``memory``.
    `membership`: the file that says which groups this process is in.
    """
    free = math.inf
    for controller, path in _memberships(membership):
        root, limit, usage = mount, "memory.max", "memory.current"
        if controller == "memory":
            root, limit, usage = mount / "memory", "memory.limit_in_bytes", "memory.usage_in_bytes"
        for folder in _upwards(root, path):
            bound, in_use = _number(folder / limit), _number(folder / usage)
            if bound < UNLIMITED:
                free = min(free, max(bound - in_use + _reclaimable(folder), 0.0))
    return free


def own_memory() -> float:
    """Return the memory left to this process by its limits of address space and data [bytes], else infinite."""
    try:
        import resource
    except ImportError:  # Windows has none
        return math.inf
    free = math.inf
    for name, field in (("RLIMIT_AS", "vms"), ("RLIMIT_DATA", "data")):
        limit = resource.getrlimit(getattr(resource, name))[0] if hasattr(resource, name) else resource.RLIM_INFINITY
        if limit != resource.RLIM_INFINITY:
            import psutil

            usage = psutil.Process(os.getpid()).memory_info()
            free = min(free, max(float(limit) - float(getattr(usage, field, usage.rss)), 0.0))
    return free


def _memberships(file: Path) -> Iterator[tuple[str, str]]:
    """Yield controller and path of the groups that may limit memory: ``memory`` in version 1, empty in version 2."""
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError):
        lines = []
    for line in lines:
        _, controllers, path = [*line.split(":", 2), "", ""][:3]
        if not controllers or "memory" in controllers.split(","):
            yield "memory" if controllers else "", path
    if not lines:  # a container that hides where it is in: its own root may still be limited
        yield "", "/"
        yield "memory", "/"


def _upwards(root: Path, path: str) -> Iterator[Path]:
    """Yield a group's folder and all above it, up to the root, which alone is there in many containers."""
    parts = [part for part in path.split("/") if part not in ("", ".", "..")]
    for depth in range(len(parts), -1, -1):
        yield root.joinpath(*parts[:depth])


def _reclaimable(folder: Path) -> float:
    """Return the memory of a group that can be reclaimed: files held in memory [bytes]."""
    try:
        text = (folder / "memory.stat").read_text(encoding="ascii")
    except (OSError, UnicodeDecodeError):
        return 0.0
    counts = dict(line.split(maxsplit=1) for line in text.splitlines() if " " in line)
    try:
        return float(counts.get("total_inactive_file", counts.get("inactive_file", 0.0)))
    except ValueError:
        return 0.0


def _number(file: Path) -> float:
    """Return the number in a file [bytes]; infinite for a limit of "max", 0 where there is none or no number."""
    try:
        text = file.read_text(encoding="ascii").strip()
        return math.inf if text == "max" else float(text)
    except (OSError, ValueError):
        return math.inf if file.name in ("memory.max", "memory.limit_in_bytes") else 0.0


_MMAP_THRESHOLD = -3  # M_MMAP_THRESHOLD of glibc's malloc.h
LARGE = 1 << 20  # [bytes]


def release_large_arrays() -> None:
    """Have arrays of more than `LARGE` bytes come from the system one by one, where glibc allocates.

    By default glibc raises its limit to the largest array that was freed, up to 32 MiB; smaller ones lie
    side by side, and a hole goes back to the system only when all behind it is free, too.
    """
    if not sys.platform.startswith("linux"):
        return
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:  # musl has none
        mallopt(_MMAP_THRESHOLD, LARGE)
