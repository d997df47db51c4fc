"""A run from its case or a checkpoint to the end: set-up, step loop, summary, on one or several processes."""

import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numba
import numpy as np

from hvisph.case.case import Case
from hvisph.casefile.loader import load_case
from hvisph.casefile.paths import run_name
from hvisph.compiler.jit import report_compilation
from hvisph.compiler.parallel_for import refuse_fork
from hvisph.core.errors import CaseError, OutputError, RunError, computable
from hvisph.core.memory import release_large_arrays
from hvisph.diagnostics.budgets import observed_particles
from hvisph.output import file_names
from hvisph.output.checkpoint_file import Checkpoint, newest_checkpoint
from hvisph.output.reader import read_summary
from hvisph.output.run_folder import RunFolder, SilentFolder, clear_unfinished, looks_like_a_run
from hvisph.parallel.subdomain import Parts
from hvisph.parallel.world import SingleProcess, detect_processes
from hvisph.precheck.estimate import fed_threads, fewer_threads_reason, refuse_impossible, worthwhile_threads
from hvisph.setup.build import set_up
from hvisph.setup.initial_state import InitialState, begin
from hvisph.simulation.checkpoint import refuse_changed
from hvisph.simulation.listener import Listener
from hvisph.simulation.loop import Run
from hvisph.simulation.run_files import Outcome


def run(
    case: Case | str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    force: bool = False,
    threads: int | None = None,
    listener: Listener | None = None,
) -> Outcome:
    """Run a case and write its folder.

    `case`: a loaded case, the path of a case file or the name of a bundled case.
    `out`: the run's folder; by default ``runs/NAME`` with the name of the case's file.
    `force`: whether what an earlier run wrote there is replaced.
    `threads`: number of threads; by default as many as a step's work is worth, at most one per core. The results are
    the same bits for any number.
    `listener`: receives the progress of the run.
    Raises `CaseError`, without writing anything, when the case cannot be run or the folder is in use; `OutputError`
    when a file cannot be written.
    """
    name = "case"
    if not isinstance(case, Case):
        name = run_name(case) if out is None else name
        case = load_case(case)
    world, path = detect_processes(), Path("runs") / name if out is None else Path(out)
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


def complete(
    case: Case, folder: Path, anew: bool, threads: int | None, listener: Listener | None, end: float | None = None
) -> Outcome:
    """Continue the run of `case` in `folder`; begin it where it cannot be continued, or is to be run `anew`."""
    if (folder / file_names.CASE).is_file() and not anew:
        with suppress(CaseError, OutputError):  # the case begins again, or fails for the same reason
            return resume(folder, end, threads=threads, listener=listener)
    return run(case, folder, force=folder.exists(), threads=threads, listener=listener)


def prepare_process(
    case: Case, world: SingleProcess, make: Callable[[], InitialState]
) -> tuple[InitialState, Parts | None]:
    """Return the part of the initial state for this process and the decomposition, if memory allows."""
    with computable():
        with world.raise_together():
            refuse_impossible(case, processes=world.size, beside=world.peers, begins=world.first and world.size > 1)
        return distribute(world, make, case)


def folder_of(world: SingleProcess, path: Path, make: Callable[[], RunFolder]) -> RunFolder:
    """Return the run's folder, created by the first process; the others write nothing."""
    folders: list[RunFolder] = []
    world.broadcast_from_first(lambda: folders.append(make()))
    return folders[0] if folders else SilentFolder(path)


def with_threads(case: Case, start: InitialState, threads: int | None, world: SingleProcess) -> InitialState:
    """Set the number of threads as `set_threads` does, and note it in the initial state."""
    count = -(-start.count // world.size)
    set_threads(threads, worthwhile_threads(case, count), world.peers)
    note = fewer_threads_reason(threads, case, count) if threads else ""
    if not note:
        return start
    set_threads(fed_threads(case, count))
    return replace(start, notes=(*start.notes, note))


def set_threads(threads: int | None, worthwhile: int | None = None, beside: int = 1) -> None:
    """Use so many threads, or `worthwhile`, or the share of `beside` processes; `CaseError` for too many."""
    refuse_fork()
    release_large_arrays()
    limit = numba.config.NUMBA_NUM_THREADS
    if threads is not None and not 1 <= threads <= limit:
        raise CaseError(
            f"{threads} threads asked for; allowed: 1 to {limit}, the cores of this machine", where="--threads"
        )
    numba.set_num_threads(threads or max(1, min(worthwhile or limit, limit // beside)))


def resume(
    run: str | os.PathLike[str],
    end: str | float | None = None,
    *,
    max_steps: int | None = None,
    threads: int | None = None,
    listener: Listener | None = None,
) -> Outcome:
    """Continue a run from its newest checkpoint, with the same bits as without the stop.

    A run killed before its first checkpoint begins again. One that has reached its end writes its summary again, unless
    the end is later now.

    `run`: the run's folder.
    `end`: a new end: a number [s] or text with a unit, as ``"10 us"``.
    `max_steps`: a new number of steps at which to stop early; 0 for none.
    `threads`: number of threads; by default as many as a step's work is worth, at most one per core.
    `listener`: receives the progress of the run.
    Raises `CaseError`, without changing anything, when the folder is not a run's, its case has changed, another version
    wrote the checkpoint, or the new end is before it; `OutputError` when no checkpoint is whole, or a file cannot be
    written.
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


def resume_run(
    run: str | os.PathLike[str], case: Case, *, threads: int | None = None, listener: Listener | None = None
) -> Outcome:
    """Continue a run by a case of `resume_case`; arguments and errors as of `resume`."""
    world, path = detect_processes(), Path(run)
    listener = listener if listener and world.first else Listener()
    with world.end_together(), folder_of(world, path, lambda: RunFolder.open(path)) as folder:
        checkpoints: list[Checkpoint | None] = []

        def make() -> InitialState:
            checkpoint = newest_checkpoint(folder.checkpoint_path, listener.message, lazily=world.size > 1)
            if checkpoint is None:
                listener.message("there is no checkpoint yet; beginning again")
            else:
                refuse_changed(checkpoint, case)
            checkpoints.append(checkpoint)
            return begin(case)

        start, parts = prepare_process(case, world, make)
        checkpoint = checkpoints[0] if checkpoints else None
        header = world.broadcast_from_first(lambda: checkpoint and replace(checkpoint, arrays={}))
        with report_compilation(listener.compiling):
            with world.raise_together():
                start = with_threads(case, start, threads, world)
                setup = set_up(case, start)
            setup.subdomain.join(world, parts)
            world.broadcast_from_first(lambda: clear_unfinished(path))
            compile_for_all(world, case, start)
            return Run(case, setup, folder, listener, checkpoint or header).go()


COMPILED_PARTICLES = 16  # particles of each body with which loops are compiled


def distribute(world: SingleProcess, make: Callable[[], InitialState], case: Case) -> tuple[InitialState, Parts | None]:
    """Return the initial state of this process, and the decomposition of several processes.

    `world`: the processes.
    `make`: makes the whole, on the first of them.
    Raises `CaseError` where `make` does, on all of them, and where there are fewer particles than processes.
    """
    if world.size == 1:
        return make(), None
    stored: list[tuple[InitialState, np.ndarray]] = []

    def prepare() -> tuple[InitialState, Parts]:
        state = make()
        particles = state.particles
        if state.formulation.stepper.keeps_order:  # lists are sorted in this order
            from hvisph.schemes.adaptive.stepper import order_of

            particles.permute(order_of(particles, state.formulation.kernel.reach * state.longest))
            state = replace(state, sequence=np.arange(particles.count, dtype=np.uint64))
        observed = observed_particles(particles, state.planes, case)
        parts = Parts(world.size, particles["position"], particles.id)
        owner = parts.owner(particles["position"], particles.id)
        if np.bincount(owner, minlength=world.size).min() == 0:
            raise CaseError(f"{particles.count} particles are too few for {world.size} processes; start fewer")
        stored.append((state, owner))
        return replace(state, particles=particles.like(0), sequence=None, observed=observed), parts

    part, parts = world.broadcast_from_first(prepare)
    start, owner = stored.pop() if stored else (part, None)
    owned = None if owner is None else [np.flatnonzero(owner == rank) for rank in range(world.size)]
    part.particles.data = world.scatter_rows(start.particles.data, owned)
    part.particles.tags = world.scatter_rows(start.particles.tags, owned)
    if part.formulation.stepper.keeps_order:
        part = replace(part, sequence=world.scatter_rows(start.sequence, owned))
    return part, parts


def compile_for_all(world: SingleProcess, case: Case, start: InitialState) -> None:
    """Compile the loops on the first process of each machine with a few particles, for the others to load."""

    def evaluate() -> None:
        particles = start.particles
        bodies = np.unique(particles.body)
        rows = np.concatenate([np.flatnonzero(particles.body == body)[:COMPILED_PARTICLES] for body in bodies])
        sample = particles.like(0)
        sample.data, sample.tags = particles.data[rows], particles.tags[rows]
        with suppress(RunError):
            set_up(case, replace(start, particles=sample, sequence=None, boundaries=None)).stepper.start()

    world.prepare_per_machine(evaluate)
