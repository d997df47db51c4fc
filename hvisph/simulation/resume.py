"""Continuation of a stopped, killed or finished run."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

from hvisph.case.case import Case
from hvisph.casefile.loader import load_case
from hvisph.compiler.jit import report_compilation
from hvisph.core.errors import CaseError, OutputError
from hvisph.output import file_names
from hvisph.output.checkpoint_file import Checkpoint, newest_checkpoint
from hvisph.output.reader import read_summary
from hvisph.output.run_folder import RunFolder, clear_unfinished, looks_like_a_run
from hvisph.parallel.world import world_here
from hvisph.setup.build import set_up
from hvisph.setup.initial_state import Beginning, begin

from .checkpoint import refuse_changed
from .distribute import compile_for_all
from .finalize import Outcome
from .listener import Listener
from .loop import Run
from .run import folder_of, prepare_process, with_threads


def resume(run: str | os.PathLike[str], end: str | float | None = None, *, max_steps: int | None = None,
           threads: int | None = None, listener: Listener | None = None) -> Outcome:  # fmt: skip
    """Continue a run from its newest checkpoint, bit for bit as without the stop.

    A run that was killed before its first checkpoint begins again. One that has reached its end only sums up
    anew, unless the end is later now.

    Parameters
    ----------
    run
        The run's folder.
    end
        A new end: a number [s] or text with a unit, as ``"10 us"``.
    max_steps
        A new number of steps at which to stop early; 0 for none.
    threads
        Number of threads; by default as many as a step's work is worth, at most one per core.
    listener
        Hears of the run while it goes on.

    Raises
    ------
    CaseError
        When the folder is not a run's, its case has changed, another version wrote the checkpoint, or the
        new end is behind it: nothing is changed then.
    OutputError
        When no checkpoint is whole, or a file cannot be written.
    """
    return resume_run(run, resume_case(run, end, max_steps), threads=threads, listener=listener)


def has_ended(run: str | os.PathLike[str]) -> bool:
    """Return whether a run has reached its end."""
    try:
        return bool(read_summary(Path(run))["status"] == "done")
    except OutputError:
        return False


def resume_case(run: str | os.PathLike[str], end: str | float | None = None, max_steps: int | None = None) -> Case:
    """Return the case that a run continues with; arguments and errors as of `resume`."""
    folder = Path(run)
    if not folder.is_dir() or not looks_like_a_run(folder):
        raise CaseError(f"{folder} is not the folder of a run")
    file = folder / file_names.CASE
    if not file.is_file():
        raise CaseError(f"{folder} holds no {file_names.CASE}: the run never began, or it was deleted")
    changes = [f"time.end={end!s}"] if end is not None else []
    changes += [f"time.max_steps={max_steps or 'null'}"] if max_steps is not None else []
    return load_case(file, changes)


def resume_run(run: str | os.PathLike[str], case: Case, *, threads: int | None = None,
               listener: Listener | None = None) -> Outcome:  # fmt: skip
    """Continue a run by a case of `resume_case`; arguments and errors as of `resume`."""
    world, path = world_here(), Path(run)
    listener = listener if listener and world.first else Listener()
    with world.end_together(), folder_of(world, path, lambda: RunFolder.open(path)) as folder:
        found: list[Checkpoint | None] = []

        def make() -> Beginning:
            checkpoint = newest_checkpoint(folder.checkpoint_path, listener.message, lazily=world.size > 1)
            if checkpoint is None:
                listener.message("there is no checkpoint yet; beginning again")
            else:
                refuse_changed(checkpoint, case)
            found.append(checkpoint)
            return begin(case)

        start, parts = prepare_process(case, world, make)
        checkpoint = found[0] if found else None
        header = world.from_first(lambda: checkpoint and replace(checkpoint, arrays={}))
        with report_compilation(listener.compiling):
            with world.raise_together():
                start = with_threads(case, start, threads, world)
                setup = set_up(case, start)
            setup.subdomain.join(world, parts)
            world.from_first(lambda: clear_unfinished(path))
            compile_for_all(world, case, start)
            return Run(case, setup, folder, listener, checkpoint or header).go()
