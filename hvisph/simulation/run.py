"""A run from start to end: the step loop, with everything that happens on a schedule."""

from __future__ import annotations

import os
import time as wall
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numba
import numpy as np

from hvisph import __version__
from hvisph.case.case import Case
from hvisph.case.loader import dump_case, load_case
from hvisph.core.errors import CaseError, HvisphError
from hvisph.core.jit import heard_compiling
from hvisph.formulations import update
from hvisph.formulations.stepper import PERMUTE_EVERY
from hvisph.output import names
from hvisph.output.folder import RunFolder
from hvisph.output.history import HistoryWriter
from hvisph.output.reader import read_history
from hvisph.simulation.bodies import placed_bodies
from hvisph.simulation.build import Setup, build
from hvisph.simulation.clock import Clock, Step
from hvisph.simulation.estimate import refuse_impossible
from hvisph.simulation.listener import Listener, Progress
from hvisph.simulation.monitors import Budget, Failure, Observer, Watch
from hvisph.simulation.summary import case_hash, summarise
from hvisph.simulation.writer import SnapshotWriter

# Wall time between two reports of progress [s].
REPORT_EVERY = 0.1


@dataclass
class Outcome:
    """How a run ended.

    Parameters
    ----------
    folder
        The run's folder.
    summary
        The content of its ``summary.json``.
    exit_code
        0 done and as expected, 1 missed an expectation, 3 failed, 130 interrupted.
    """

    folder: Path
    summary: dict[str, Any]
    exit_code: int


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
        Number of threads; by default one per core. The results are the same bits for any number.
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
        name = Path(case).stem
        case = load_case(case)
    listener = listener or Listener()
    _set_threads(threads)
    refuse_impossible(case)
    bodies = placed_bodies(case)
    with heard_compiling(listener.compiling):
        setup = build(case, bodies)
        with RunFolder.create(out if out is not None else Path("runs") / name, force) as folder:
            return _Run(case, setup, folder, listener).go()


def _set_threads(threads: int | None) -> None:
    most = numba.config.NUMBA_NUM_THREADS
    if threads is not None and not 1 <= threads <= most:
        raise CaseError(f"{threads} threads asked for; allowed: 1 to {most}, the cores of this machine", where="--threads")
    numba.set_num_threads(threads or most)


class _Run:
    """The step loop and its schedule."""

    def __init__(self, case: Case, setup: Setup, folder: RunFolder, listener: Listener):
        self.case, self.setup, self.folder, self.listener = case, setup, folder, listener
        self.text = dump_case(case)
        head = f"# Effective case of a run by hvisph {__version__}; hash {case_hash(self.text)}\n"
        folder.write_text(names.CASE, head + self.text)
        metadata = {"spacing": case.resolution, "kinematics": case.kinematics, "title": case.title,
                    "units": case.units, "code_version": __version__, "case": self.text}  # fmt: skip
        axis = self._mirror_axis()
        if axis is not None:
            metadata["axis"] = axis.tolist()
        self.writer = SnapshotWriter(folder, setup, case.output.formats, metadata)
        self.observer = Observer(setup, case.resolution, axis)
        self.clock = Clock(case.time.end, case.output.every, case.time.step)
        self.status, self.failure = "done", None
        self._wall = self._reported = 0.0
        self._reported_steps = 0

    def _mirror_axis(self) -> np.ndarray | None:
        """Return the shot line of a problem cut by symmetry planes, which its particles alone do not show."""
        if not any(plane.axis for plane in self.setup.planes):
            return None
        position = self.setup.particles["position"][self.setup.particles.body == 0]
        centre = 0.5 * (position.min(axis=0) + position.max(axis=0))
        for plane in self.setup.planes:
            centre[plane.axis] = plane.at
        return centre[1:]

    def go(self) -> Outcome:
        """Run to the end, to a failure or to an interruption, and sum up."""
        stepper = self.setup.stepper
        started = wall.perf_counter()
        stepper.start()
        self.budget, self.watch = Budget(self.setup), Watch(self.setup)
        start = self.writer.first(0.0, 0)
        limit = self._limit()
        self.watch.check(limit, 0.0, 0)
        if self.setup.particles.has_previous:
            stepper.complete(0.0, 0.0)
        self.step = self.clock.choose(limit.dt, limit.criterion, None)
        self.limiting = limit.particle
        stepper.predict(self.step.length)
        self.folder.log.write(
            f"hvisph {__version__}: {self.case.title or 'untitled'}; {self.setup.particles.count} particles, "
            f"{numba.get_num_threads()} threads; ready after {wall.perf_counter() - started:.2f} s"
        )
        self.listener.started(self.folder.path, self.setup.particles.count, self.clock.end)
        self._began = wall.perf_counter()
        with HistoryWriter(self.folder.history_path, self.observer.columns) as history:
            self._record(history, limit.particle, 0.0)
            try:
                while not self.clock.done and not self._enough():
                    self._advance(history)
            except Failure as failure:
                self._fail(failure)
            except KeyboardInterrupt:
                self.status = "interrupted"
        self._wall = wall.perf_counter() - self._began
        now = self.writer.snapshot(self.clock.time, self.clock.steps)
        if self.status == "failed":
            self.writer.write(now, "post_mortem")
        elif self.clock.steps and not self._written():
            self.writer.write(now, self.clock.outputs + 1)
        return self._finish(start, now)

    def _enough(self) -> bool:
        return self.case.time.max_steps is not None and self.clock.steps >= self.case.time.max_steps

    def _limit(self) -> Any:
        stepper = self.setup.stepper
        return self.setup.criteria.limit(stepper.lengths, stepper.signals, stepper.rates, stepper.place)

    def _advance(self, history: HistoryWriter) -> None:
        """Take one step: forces, the next step from the criteria, the state carried on, the schedule."""
        stepper, clock = self.setup.stepper, self.clock
        stepper.evaluate()
        limit = self._limit()
        self.watch.check(limit, clock.time, clock.steps)
        following = clock.choose(limit.dt, limit.criterion, self.step)
        limiting = int(self.setup.particles.id[limit.particle])
        stepper.complete(self.step.length, following.length)
        done, self.step = self.step, following
        at_output = clock.complete(done)
        self.budget.record(stepper.sums, done.length)
        self.watch.check_speed(float(stepper.sums[update.FASTEST]), clock.time, clock.steps)
        if clock.steps % PERMUTE_EVERY == 0:
            stepper.permute()
            self.observer.locate()
        if clock.steps % self.case.output.history_every == 0 or at_output:
            self._record(history, limiting, done.length)
        if at_output:
            self._write_output()
        self._report(limit)

    def _record(self, history: HistoryWriter, limiting: int, length: float) -> None:
        clock = self.clock
        drift = self.budget.energy_drift(self.setup.stepper.sums)
        history.append(self.observer.record(clock.steps, clock.time, length, self.step.criterion, limiting, drift))

    def _write_output(self) -> None:
        clock = self.clock
        self.writer.write(self.writer.snapshot(clock.time, clock.steps), clock.outputs)
        self._last_written = clock.steps
        self.folder.log.write(f"snapshot {clock.outputs} at {clock.time:.6g} s, step {clock.steps}")

    def _written(self) -> bool:
        return getattr(self, "_last_written", -1) == self.clock.steps

    def _report(self, limit: Any) -> None:
        now = wall.perf_counter()
        since = now - self._reported
        if since < REPORT_EVERY:
            return
        clock, setup = self.clock, self.setup
        pace = (clock.steps - self._reported_steps) / since
        self._reported, self._reported_steps = now, clock.steps
        self.listener.progress(
            Progress(
                clock.time, clock.end, clock.steps, self.step.length, self.step.criterion,
                setup.bodies[int(setup.particles.body[limit.particle])], now - self._began, pace,
                self.budget.energy_drift(setup.stepper.sums),
            )
        )  # fmt: skip

    def _fail(self, failure: Failure) -> None:
        self.status, self.failure = "failed", failure
        self.folder.log.write(f"failed: {failure}")
        self.listener.message(str(failure))

    def _finish(self, start: Any, now: Any) -> Outcome:
        sums = self.setup.stepper.sums
        conservation = {"energy_drift": self.budget.energy_drift(sums), "momentum_drift": self.budget.momentum_drift(sums)}
        summary = summarise(
            self.case, self.text, status=self.status, time=self.clock.time,
            failure=self.failure.as_dict() if self.failure else None, particles=self.setup.particles.count,
            steps=self.clock.steps, threads=numba.get_num_threads(), wall_seconds=self._wall,
            conservation={k: v if v is not None and np.isfinite(v) else None for k, v in conservation.items()},
            start=start, now=now, history=read_history(self.folder.path),
        )  # fmt: skip
        self.folder.write_json(names.SUMMARY, summary)
        self.folder.log.write(f"{self.status} at {self.clock.time:.6g} s after {self.clock.steps} steps, {self._wall:.2f} s")
        self.listener.finished(summary)
        code = {"failed": HvisphError.exit_code, "interrupted": 130}.get(self.status)
        if code is None:
            code = 0 if all(row["passed"] for row in summary["expected"]) else 1
        return Outcome(self.folder.path, summary, code)
