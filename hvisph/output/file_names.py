"""Names of the files of a run.

Own files are those with exactly the names that hvisph writes, and no links: others are never deleted or replaced.
"""

import re
from collections.abc import Iterator
from pathlib import Path

SNAPSHOTS = "snapshots"
VTU = "vtu"
REGIONS = "regions"
CHECKPOINT = "checkpoint"
CASE = "case.yaml"
SERIES = "series.pvd"
TIME_SERIES = "series.vtkhdf"  # one file that refers to all snapshots
HISTORY = "history.csv"
SUMMARY = "summary.json"
LOG = "run.log"
REPORT = "report.html"
LOCK = ".hvisph"  # marks the folder of a run, and is locked while a process writes there
CASE_HEAD = "# Effective case of a run by hvisph"  # how `CASE` begins
POST_MORTEM = "post_mortem"  # stem of the snapshot of a failure
SNAPSHOT_ENDING = ".vtkhdf"
OLD_ENDING = ".h5"  # of snapshots by earlier versions
PARTIAL = ".partial"  # ends the name of a file that is being written

FOLDERS = (SNAPSHOTS, VTU, REGIONS, CHECKPOINT)
CREATED_FIRST = (SNAPSHOTS, CHECKPOINT)  # created with the run; others with their first file
FILES = (CASE, SERIES, TIME_SERIES, HISTORY, SUMMARY, LOG, REPORT)
# What each sub-folder holds.
PATTERNS = {
    SNAPSHOTS: re.compile(rf"([0-9]{{6,}}|{POST_MORTEM})\.(vtkhdf|h5)", re.ASCII),
    REGIONS: re.compile(r"[A-Za-z0-9_]+\.[0-9]{6,}\.vtkhdf", re.ASCII),
    VTU: re.compile(r"[0-9]{6,}\.vtu", re.ASCII),
    CHECKPOINT: re.compile(r"[0-9]{12}\.h5", re.ASCII),
}


def is_own(path: Path) -> bool:
    """Return whether `path`, in a sub-folder of a run, has the name of a file of hvisph, complete or partial."""
    pattern = PATTERNS.get(path.parent.name)
    return pattern is not None and pattern.fullmatch(path.name.removesuffix(PARTIAL)) is not None


def number_of(path: Path) -> int | None:
    """Return the number in the name of a snapshot, of the whole or of a region; None for other files."""
    number = path.stem.rpartition(".")[2]
    return int(number) if number.isdecimal() else None


def own_files(folder: Path) -> Iterator[Path]:
    """Yield hvisph's own files in a run's folder except the lock; also unfinished files and links of these names."""
    for name in FILES:
        for path in (folder / name, folder / (name + PARTIAL)):
            if path.is_symlink() or path.exists():
                yield path
    for name in FOLDERS:
        if is_plain_folder(folder / name):
            yield from sorted(path for path in (folder / name).iterdir() if is_own(path))


def is_plain(path: Path) -> bool:
    """Return whether `path` is a file, and no link to one."""
    return path.is_file() and not path.is_symlink()


def is_plain_folder(path: Path) -> bool:
    """Return whether `path` is a folder, and no link to one."""
    return path.is_dir() and not path.is_symlink()
