"""Comparison of runs: existing ones, and cases to run first.

A case has been run when a folder holds a run whose effective case has the same hash. Nothing that
another case wrote is touched: where its folder is taken, the run goes into one with the hash in its name.
"""

import json
import os
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from hvisph.case.case import Case
from hvisph.casefile.loader import case_hash, dump_case, find_case, load_case
from hvisph.casefile.paths import bundled_name, case_folder, cases_in, run_name
from hvisph.core.errors import CaseError
from hvisph.measures.compare import Row, row
from hvisph.output import file_names
from hvisph.output.reader import list_snapshots
from hvisph.output.run_folder import looks_like_a_run
from hvisph.simulation import run
from hvisph.simulation.listener import Listener
from hvisph.simulation.run_files import Outcome

SNAPSHOTS = (".vtkhdf", ".h5", ".vtu", ".vtp", ".vtk", ".dump", ".lammpstrj")
ENDED = ("done", "failed")


@dataclass(frozen=True)
class Entry:
    """One run of a comparison, there or yet to be made."""

    name: str  # its name among the others
    folder: Path  # where the run is or goes; of another code's run, its folder or snapshot
    case: Case | None = None  # the case to run; None for files that are only read
    file: Path | None = None  # the case's file
    group: str = ""  # name of the folder that it comes from


def complete(
    entry: Entry, *, threads: int | None = None, force: bool = False, listener: Listener | None = None
) -> Outcome | None:
    """Run the case of an entry, or continue it where it was interrupted; None where it has been run.

    Raises `CaseError` when the case cannot be run; `OutputError` when a file cannot be written, or another process runs
    it.
    """
    if entry.case is None or (is_run(entry) and not force):
        return None
    # a case in its folder has the same hash, or the entry would have another folder
    return run.complete(entry.case, entry.folder, force, threads, listener)


def entries(
    sources: Sequence[str | os.PathLike[str]],
    *,
    runs: str | os.PathLike[str] = "runs",
    overrides: Sequence[str] = (),
    resolution: str | float | None = None,
) -> list[Entry]:
    """Return what `sources` name: case files, bundled cases, runs, snapshots and folders of them, all cases loaded.

    Cases run below `runs`, a bundled one by its name, another by its folder's and its file's, with `overrides` and
    `resolution`. Raises `CaseError` for anything wrong with any of them.
    """
    found_entries: list[Entry] = []
    changed = bool(overrides) or resolution is not None
    for source in sources:
        for entry in _entries_of(Path(source), Path(runs)):
            if entry.file is None:
                if changed:
                    raise CaseError(
                        f"{entry.folder} has been run: neither --resolution nor --set can change it; "
                        "name its case instead"
                    )
                found_entries.append(entry)
                continue
            case = load_case(entry.file, overrides, resolution)
            found_entries.append(replace(entry, case=case, folder=_place(entry.folder, case)))
    return _distinct(found_entries)


def compare(*sources: str | os.PathLike[str]) -> list[Row]:
    """Return a row for each source, a folder of a run or a snapshot: measures, differences, conservation, cost."""
    return [row(Path(source).name, source) for source in sources]


def is_run(entry: Entry) -> bool:
    """Return whether the run of an entry has ended."""
    with suppress(OSError, ValueError, KeyError, TypeError):
        summary = json.loads((entry.folder / file_names.SUMMARY).read_text(encoding="utf-8"))
        return entry.case is None or summary["status"] in ENDED
    return entry.case is None


def _entries_of(source: Path, runs: Path) -> Iterator[Entry]:
    if source.is_file() and source.suffix in SNAPSHOTS:
        yield Entry(source.stem, source)
    elif (folder := case_folder(source)) is not None:
        yield from _in_folder(folder, runs)
    else:
        file = find_case(source)
        yield Entry(file.stem, runs / (bundled_name(file) or run_name(file)), file=file, group=file.parent.name)


def _in_folder(folder: Path, runs: Path) -> Iterator[Entry]:
    group = folder.resolve().name
    if looks_like_a_run(folder):
        yield Entry(group, folder, group=folder.resolve().parent.name)
        return
    cases = cases_in(folder)
    for name, file in cases.items():
        bundled = bundled_name(file)
        yield Entry(name, runs / bundled if bundled else runs / group / name, file=file, group=group)
    if cases:
        return
    below = sorted(path for path in folder.iterdir() if path.is_dir())
    run_folders = [path for path in below if looks_like_a_run(path)]
    for path in run_folders:
        yield Entry(path.name, path, group=group)
    if run_folders:
        return
    if list_snapshots(folder):
        yield Entry(group, folder)
        return
    inside = [path.name for path in below if any(cases_in(path))]
    hint = f"; its folders do: {', '.join(inside)}" if inside else ""
    raise CaseError(f"{folder} holds neither cases nor runs nor snapshots{hint}")


def _place(folder: Path, case: Case) -> Path:
    """Return where `case` has been or will be run: `folder`, or one beside it where that is taken."""
    digest = case_hash(dump_case(case))
    sibling = folder.with_name(f"{folder.name}-{digest[:8]}")
    for place in (folder, sibling):
        if _hash(place) == digest:
            return place
    free = not folder.exists() or (folder.is_dir() and not any(folder.iterdir()))
    return folder if free else sibling


def _hash(folder: Path) -> str | None:
    """Return the hash of the case that a run's folder holds; None where it holds none."""
    try:
        with (folder / file_names.CASE).open(encoding="utf-8") as file:
            match = re.search(r"hash ([0-9a-f]+)", file.readline(1000))
    except (OSError, UnicodeDecodeError):
        return None
    return match[1] if match else None


def _distinct(runs: list[Entry]) -> list[Entry]:
    """Return the entries with names of their own: of those that share one, the group goes before it."""
    counts = Counter(entry.name for entry in runs)
    distinct: list[Entry] = []
    names: set[str] = set()
    for entry in runs:
        name = entry.name
        if counts[name] > 1 and entry.group:
            name = f"{entry.group}/{name}"
        number = 2
        while name in names:
            name, number = f"{name.removesuffix(f' ({number - 1})')} ({number})", number + 1
        names.add(name)
        distinct.append(replace(entry, name=name))
    return distinct
