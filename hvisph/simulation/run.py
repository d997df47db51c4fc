"""A case from start to end: set-up, step loop and summary, on one or several processes."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numba

from hvisph.case.case import Case
from hvisph.casefile.loader import load_case
from hvisph.casefile.paths import run_name
from hvisph.compiler.jit import report_compilation
from hvisph.compiler.parallel_for import refuse_fork
from hvisph.core.errors import CaseError, computable
from hvisph.core.memory import give_back_large
from hvisph.output.run_folder import RunFolder, SilentFolder
from hvisph.parallel.subdomain import Parts
from hvisph.parallel.world import Alone, world_here
from hvisph.precheck.estimate import fed_threads, fewer_threads_reason, refuse_impossible, worthwhile_threads
from hvisph.setup.build import set_up
from hvisph.setup.initial_state import Beginning, begin

from .distribute import compile_for_all, distribute
from .finalize import Outcome
from .listener import Listener
from .loop import Run


def run(case: Case | str | os.PathLike[str], out: str | os.PathLike[str] | None = None, *, force: bool = False,
        threads: int | None = None, listener: Listener | None = None) -> Outcome:  # fmt: skip
    """Run a case and write its folder.

    Parameters
    ----------
    case
        A loaded case, the path of a case file or the name of a bundled case.
    out
        The run's folder; by default ``runs/NAME`` with the name of the case's file.
    force
        Replace what an earlier run wrote there.
    threads
        Number of threads, at most as many as a step finds work for; by default as many as its work is worth, at most
        one per core. The results are the same bits for any number.
    listener
        Hears of the run while it goes on.

    Raises
    ------
    CaseError
        When the case cannot be run or the folder is in use: nothing is written then.
    OutputError
        When a file cannot be written; what was written before is intact.
    """
    name = "case"
    if not isinstance(case, Case):
        name = run_name(case) if out is None else name
        case = load_case(case)
    world, path = world_here(), Path("runs") / name if out is None else Path(out)
    listener = listener if listener and world.first else Listener()
    start, parts = prepare_process(case, world, lambda: begin(case))
    with world.raise_together():
        start = with_threads(case, start, threads, world)
        with report_compilation(listener.compiling), computable():
            setup = set_up(case, start)
    setup.subdomain.join(world, parts)
    with (
        report_compilation(listener.compiling),
        world.end_together(),
        folder_of(world, path, lambda: RunFolder.create(path, force)) as folder,
    ):
        compile_for_all(world, case, start)
        return Run(case, setup, folder, listener).go()


def prepare_process(case: Case, world: Alone, make: Callable[[], Beginning]) -> tuple[Beginning, Parts | None]:
    """Return the part of the initial state for this process and the decomposition, if memory allows."""
    with computable():
        with world.raise_together():
            refuse_impossible(case, processes=world.size, beside=world.beside, begins=world.first and world.size > 1)
        return distribute(world, make, case.resolution)


def folder_of(world: Alone, path: Path, make: Callable[[], RunFolder]) -> RunFolder:
    """Return the run's folder, created by the first process; the others write nothing."""
    made: list[RunFolder] = []
    world.from_first(lambda: made.append(make()))
    return made[0] if made else SilentFolder(path)


def with_threads(case: Case, start: Beginning, threads: int | None, world: Alone) -> Beginning:
    """Set the number of threads as `set_threads` does, and note it in the initial state."""
    count = -(-start.count // world.size)
    set_threads(threads, worthwhile_threads(case, count), world.beside)
    note = fewer_threads_reason(threads, case, count) if threads else ""
    if not note:
        return start
    set_threads(fed_threads(case, count))
    return replace(start, notes=(*start.notes, note))


def set_threads(threads: int | None, worthwhile: int | None = None, beside: int = 1) -> None:
    """Use so many threads, or `worthwhile`, or one per core; of `beside` processes of this machine each has its share.

    Raises
    ------
    CaseError
        For more than there are, or where none can work.
    """
    refuse_fork()
    give_back_large()
    most = numba.config.NUMBA_NUM_THREADS
    if threads is not None and not 1 <= threads <= most:
        raise CaseError(
            f"{threads} threads asked for; allowed: 1 to {most}, the cores of this machine", where="--threads"
        )
    numba.set_num_threads(threads or max(1, min(worthwhile or most, most // beside)))
