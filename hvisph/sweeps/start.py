"""Beginning a sweep, or going on with one: from Python and from the commands."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from hvisph.core.errors import CaseError
from hvisph.precheck.estimate import available_threads

from .driver import Crew, Driver, LocalCrew
from .folder import SweepFolder
from .plan import load_plan
from .selection import Selection
from .table import Row

SWEEPS = Path("sweeps")
Source = str | os.PathLike[str] | Mapping[str, Any]


def sweep(source: Source, out: str | os.PathLike[str] | None = None, *, workers: int | None = None,
          threads: int | None = None, only: str | None = None) -> Iterator[Row]:  # fmt: skip
    """Compute a sweep, giving the row of each case as it ends.

    Parameters
    ----------
    source
        A sweep's file, its content, or the folder of one that was begun.
    out
        The sweep's folder; ``sweeps/NAME`` unless given.
    workers
        Number of worker processes; one a core unless given.
    threads
        Threads of each; the cores shared out unless given.
    only
        ``failed``, ``interrupted``, or numbers such as ``3..7``.

    Returns
    -------
    Rows with `number`, `values`, `status`, `measures`, `wall_seconds`, `folder`; ended ones are not given again.

    Raises
    ------
    CaseError
        For anything wrong with the sweep or one of its cases, before anything runs.
    """
    folder = begin(source, out)
    return driver(folder, workers, threads, Selection.parse(only), only).go()


def begin(source: Source, out: str | os.PathLike[str] | None = None) -> SweepFolder:
    """Return the folder of a sweep, begun if it was not; arguments and errors as of `sweep`."""
    if not isinstance(source, Mapping):
        there = SweepFolder(source)
        if there.exists:
            if out is not None and Path(out).resolve() != there.path.resolve():
                raise CaseError(f"{source} is a sweep that was begun, and goes on where it is; leave this out, or give "
                                "the sweep's own file to begin it elsewhere", where="--out")  # fmt: skip
            return there
        if there.path.is_dir():
            raise CaseError(f"{source} is no sweep's folder")
    elif out is None:
        raise CaseError("a sweep given as a mapping needs a folder", where="out")
    plan = load_plan(source)
    members = plan.first()
    folder = SweepFolder(out if out is not None else SWEEPS / Path(str(source)).stem)
    folder.begin(plan, members)
    return folder


def existing(path: str | os.PathLike[str]) -> SweepFolder:
    """Return the folder of a sweep that was begun; raises `CaseError` where there is none."""
    folder = SweepFolder(path)
    if not folder.exists:
        raise CaseError(f"{path} is not the folder of a sweep")
    return folder


def driver(folder: SweepFolder, workers: int | None, threads: int | None, selection: Selection, only: str | None,
           crew: Callable[[SweepFolder, int, tuple[str, ...]], Crew] | None = None) -> Driver:  # fmt: skip
    """Return what drives the sweep in `folder`; a crew other than this machine's workers is made by `crew`."""
    selection.require(folder.members())
    cores = available_threads()
    count = workers or cores
    share = threads or max(1, cores // count)
    options = ("--only", only) if only is not None and only[:1].isdigit() else ()
    return Driver(folder, (crew or LocalCrew)(folder, share, options), count, selection)
