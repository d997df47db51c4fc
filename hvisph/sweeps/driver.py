"""Execution of a sweep: beginning, workers, rounds and results.

All decisions of the driver follow from the folder: if the driver is killed, workers finish the present cases; a
new driver continues.
"""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import date
from pathlib import Path
from typing import Protocol

from hvisph import __version__
from hvisph.casefile.document import dump
from hvisph.core.errors import INTERRUPTED, CaseError, OutputError
from hvisph.core.text import Plain, PlainMapping
from hvisph.output import atomic_write, file_names
from hvisph.precheck.estimate import available_threads

from .analysis import following, undecided_shots, verdict
from .calibration import material_document
from .comparison import beside_limit
from .folder import ENDED, RESULTS, STEPPING, Row, Selection, SweepFolder, TableKeeper, row, rows
from .plan import Member, load_plan

LONGEST = 4.0  # times the end of a case: how far an undecided shot continues by default
POLL = 0.1  # least wall time between two checks [s]
MOST_FAILURES = 5  # of workers in a row that end with an error


class Crew(Protocol):
    """Interface of the workers of a sweep."""

    waits_for_first: bool  # whether others start only after the first worker has compiled its loops

    def keep(self, workers: int) -> int:
        """Have up to `workers` workers at work, and return how many there are."""

    def stop(self) -> None:
        """Ask all workers to write checkpoints and end, and wait for them."""


class Failures:
    """Counts workers that end with an error one after the other: a crew of such would be renewed for ever."""

    def __init__(self) -> None:
        self.count = 0

    def add(self, code: int, output: str = "") -> None:
        """Record the exit code of a worker, negative if killed; raises `OutputError` after too many errors."""
        if code <= 0 or code == INTERRUPTED:
            self.count = 0 if code == 0 else self.count
            return
        self.count += 1
        if self.count >= MOST_FAILURES:
            last = f": {output.strip().splitlines()[-1]}" if output.strip() else ""
            raise OutputError(f"{self.count} workers in a row could not work, the last with exit code {code}{last}")


class LocalCrew:
    """Worker processes on this machine, each with its threads."""

    waits_for_first = False  # workers wait for loops that others compile

    def __init__(self, folder: SweepFolder, threads: int, options: Sequence[str] = ()):
        self.folder, self.threads, self.options = folder, threads, tuple(options)
        self.processes: list[subprocess.Popen[bytes]] = []
        self.failures = Failures()

    def keep(self, workers: int) -> int:
        """Start workers until there are as many as wanted; raises `OutputError` when they end with errors."""
        for process in self.processes:
            code = process.poll()
            if code is not None:
                self.failures.add(code)
        self.processes = [process for process in self.processes if process.poll() is None]
        while len(self.processes) < workers:
            self.processes.append(self._start())
        return len(self.processes)

    def _start(self) -> subprocess.Popen[bytes]:
        command = worker_command(self.folder, self.threads, self.options)
        environment = os.environ | {"NUMBA_NUM_THREADS": str(self.threads), "OMP_NUM_THREADS": str(self.threads)}
        # a session of its own, so that Ctrl-C reaches it once, through `stop`
        return subprocess.Popen(  # noqa: S603 our own command
            command, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, start_new_session=True
        )

    def stop(self) -> None:
        """Ask all workers to write checkpoints and end, and wait for them."""
        for process in self.processes:
            if process.poll() is None:
                process.send_signal(signal.SIGTERM)
        for process in self.processes:
            process.wait()


def worker_command(folder: SweepFolder, threads: int, options: Sequence[str] = ()) -> list[str]:
    """Return the command of one worker."""
    return [sys.executable, "-m", "hvisph", "sweep", str(folder.path), "--worker", "--threads", str(threads), *options]


class Driver:
    """Execution of a sweep."""

    def __init__(self, folder: SweepFolder, crew: Crew, workers: int, selection: Selection):
        self.folder, self.crew, self.workers = folder, crew, workers
        self.selection = selection
        self.plan = folder.plan()
        self.sweep = self.plan.sweep
        self.table = TableKeeper(folder, self.sweep.record)
        self.members: list[Member] = folder.members()

    @property
    def title(self) -> str:
        """The sweep's title, that of its case, or the name of its folder."""
        return self.sweep.title or str(self.plan.base.value.get("title", "")) or self.folder.path.resolve().name

    def go(self) -> Iterator[Row]:
        """Compute the remaining cases, yield the row of each at its end, and write the results."""
        for member in self.members:
            if self.folder.standing(member).status in self.selection.statuses:
                self.folder.begin_again(member)
        try:
            while True:
                yield from self._round()
                added = self._bisection_round()
                if not added and not self._prolong():
                    break
                self.members += added
                self.folder.write_members(self.members)
        finally:
            self.crew.stop()
            self.conclude()

    def conclude(self) -> Plain:
        """Write the present table and results, and return the results."""
        self.table.write(self.members, last=True)
        results = verdict(self.sweep.vary, self.plan.base.value, rows(self.folder, self.members), self.sweep.record)
        for limit in results.get("limits", []):
            limit |= beside_limit(self.plan, limit)
        if (results.get("fit") or {}).get("material"):
            fit = results["fit"]  # dated by its last run
            day = max((self.folder.run_folder(member) / file_names.SUMMARY).stat().st_mtime for member in self.members)
            document = material_document(fit, date.fromtimestamp(day).isoformat(), __version__)
            atomic_write.write_text(self.folder.path / f"{fit['material']['name']}.yaml", dump(document))
        atomic_write.write_text(self.folder.path / RESULTS, json.dumps(results, indent=2, ensure_ascii=False) + "\n")
        return results

    def _round(self) -> Iterator[Row]:
        waiting = [member for member in self.members if self.selection.takes(member, self.folder.standing(member))]
        failures = len(self._failures())
        while waiting:
            start = time.monotonic()
            compiles = self.crew.waits_for_first and not (self.folder.path / STEPPING).exists()  # it compiles for all
            self.crew.keep(1 if compiles else min(self.workers, len(waiting)))
            time.sleep(POLL)
            unfinished = []
            for member in waiting:
                standing = self.folder.standing(member)
                if self.selection.takes(member, standing):
                    unfinished.append(member)
                else:
                    yield row(self.folder, member, standing)
                    failures += standing.status in ENDED[1:]
            waiting = unfinished
            self.table.write(self.members)
            if self.sweep.stop_after_failures is not None and failures >= self.sweep.stop_after_failures:
                return
            # checking ten thousand cases takes a while: limit its share of the time
            time.sleep(min(5.0 * max(time.monotonic() - start - POLL, 0.0), 5.0))

    def _prolong(self) -> bool:
        """Extend undecided shots of a limit to twice their time; return False where none may be extended."""
        numbers = set(undecided_shots(self.sweep.vary, rows(self.folder, self.members)))
        prolonged = False
        for member in self.members:
            if member.number not in numbers:
                continue
            first = self.plan.case(member.values).time.end
            longest = getattr(self.sweep.vary, "longest", None) or LONGEST * first
            end = self.folder.extended_end(member) or first
            if end < longest:
                self.folder.begin_again(member, end=min(2.0 * end, longest))
                prolonged = True
        return prolonged

    def _failures(self) -> list[Member]:
        return [member for member in self.members if self.folder.standing(member).status in ENDED[1:]]

    def _bisection_round(self) -> list[Member]:
        if self._failures():
            return []
        points = getattr(self.sweep.vary, "points", None) or self.workers
        cases = following(self.sweep.vary, self.plan.base.value, rows(self.folder, self.members), points)
        return self.plan.members(cases, len(self.members))


SWEEPS = Path("sweeps")
Source = str | os.PathLike[str] | PlainMapping


def sweep(
    source: Source,
    out: str | os.PathLike[str] | None = None,
    *,
    workers: int | None = None,
    threads: int | None = None,
    only: str | None = None,
) -> Iterator[Row]:
    """Compute a sweep, giving the row of each case as it ends.

    `source`: a sweep's file, its content, or the folder of one that was begun.
    `out`: the sweep's folder; ``sweeps/NAME`` unless given.
    `workers`: number of worker processes; one a core unless given.
    `threads`: threads of each; the cores shared out unless given.
    `only`: ``failed``, ``interrupted``, or numbers such as ``3..7``.
    Returns rows with `number`, `values`, `status`, `measures`, `wall_seconds`, `folder`; ended ones are not given
    again.
    Raises `CaseError` for anything wrong with the sweep or one of its cases, before anything runs.
    """
    folder = begin(source, out)
    return driver(folder, workers, threads, only).go()


def begin(source: Source, out: str | os.PathLike[str] | None = None) -> SweepFolder:
    """Return the folder of a sweep, begun if it was not; arguments and errors as of `sweep`."""
    if not isinstance(source, Mapping):
        home = SweepFolder(source)
        if home.exists:
            if out is not None and Path(out).resolve() != home.path.resolve():
                raise CaseError(
                    f"{source} is a sweep that has begun and continues in its folder; leave this out, or give "
                    "the sweep's own file to begin it elsewhere",
                    where="--out",
                )
            return home
        if home.path.is_dir():
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


def update_sweep_of(run: Path) -> Path | None:
    """Write the table and the results of the sweep that has the case `run`, and return its folder; None without one."""
    folder = SweepFolder(run.resolve().parent.parent)
    if not folder.exists:
        return None
    driver(folder).conclude()
    return folder.path


def driver(
    folder: SweepFolder,
    workers: int | None = None,
    threads: int | None = None,
    only: str | None = None,
    crew: Callable[[SweepFolder, int, tuple[str, ...]], Crew] | None = None,
) -> Driver:
    """Return the driver of the sweep in `folder`; `crew` creates workers other than those of this machine."""
    selection = Selection.parse(only)
    selection.require(folder.members())
    cores = available_threads()
    count = workers or cores
    share = threads or max(1, cores // count)
    options = ("--only", only) if only is not None and only[:1].isdigit() else ()
    return Driver(folder, (crew or LocalCrew)(folder, share, options), count, selection)
