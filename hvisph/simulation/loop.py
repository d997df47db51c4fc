"""Step loop and its schedule."""

import time as wall
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from functools import partial

import numba
import numpy as np

from hvisph import __version__
from hvisph.case.case import Case
from hvisph.case.consistency import warnings_of
from hvisph.casefile.loader import dump_case
from hvisph.core.errors import RunError
from hvisph.core.particles import copy_rows
from hvisph.core.text import Plain
from hvisph.diagnostics.budgets import Budget, Observer
from hvisph.diagnostics.sanity_checks import Failure, SanityChecks
from hvisph.integrators.time_step import Limit
from hvisph.output.checkpoint_file import Checkpoint
from hvisph.output.run_folder import RunFolder
from hvisph.parallel.collectives import COLLAPSED, GlobalLimit
from hvisph.parallel.parallel_output import Moment
from hvisph.precheck.advice import advice, contact_warnings
from hvisph.precheck.estimate import of_cores
from hvisph.schemes.stepper import PERMUTE_EVERY, Stepper
from hvisph.setup.build import Setup
from hvisph.simulation.checkpoint import CheckpointContent
from hvisph.simulation.clock import Clock, TimeStep, interpolate_state, release_arrays
from hvisph.simulation.domain_box import Domain
from hvisph.simulation.late_stages import LateStages
from hvisph.simulation.listener import Listener, Reporter, StopRequests
from hvisph.simulation.run_files import Outcome, RunFiles, exit_code_of, measure_end
from hvisph.simulation.settling import own_limit, settle
from hvisph.simulation.writer import SnapshotWriter
from hvisph.sph.neighbours.connected_components import label_components


class Run:
    """Step loop with output, checkpoints and sanity checks; starts from `checkpoint` if given."""

    def __init__(
        self, case: Case, setup: Setup, folder: RunFolder, listener: Listener, checkpoint: Checkpoint | None = None
    ):
        self.case, self.setup, self.folder, self.listener = case, setup, folder, listener
        self.checkpoint, self.text = checkpoint, dump_case(case)
        self.subdomain, self.domain = setup.subdomain, Domain(setup, case.domain)
        self.writer = SnapshotWriter(folder, setup, case, self.text)
        self.observer = Observer(setup, case)
        self.clock = Clock(case.time.end, case.snapshot_interval, case.time.step, case.begins, begun=case.begins)
        self.late = LateStages(case, setup)
        self.files = RunFiles(folder, case, self.text, self.writer, self.observer, self.clock)
        self.status = "done"
        self.failure: Failure | None = None
        self.stop = StopRequests()
        self._stopped = False  # agreed by all processes

    def go(self) -> Outcome:
        """Run to the end, a failure or an interruption, and write the summary."""
        ready = wall.perf_counter()
        if self.checkpoint is None:
            self.files.write_case()
        self._prepare()
        with self.stop:
            self._announce(wall.perf_counter() - ready)
            self._take_steps()
            return self._finish()

    def _announce(self, seconds: float) -> None:
        """Report the start after `seconds` of wall time, with the notes on the case."""
        count, world = self.subdomain.count, self.subdomain.world
        threads = of_cores(numba.get_num_threads(), numba.config.NUMBA_NUM_THREADS)
        processes = f"{world.size} processes, each with " if world.size > 1 else ""
        self.folder.log.write(
            f"hvisph {__version__}: {self.case.title or 'untitled'}; {count} particles, {processes}{threads}; ready "
            f"after {seconds:.2f} s{f'; goes on from step {self.clock.steps}' if self.checkpoint else ''}"
        )
        self.listener.start(self.folder.path, count, self.clock.end)
        warnings = [*warnings_of(self.case), *contact_warnings(self.case), *advice(self.case)]
        lines = [f"warning: {warning.splitlines()[0]}" for warning in warnings]
        lines += [self._settled] if self._settled else []
        for line in (*lines, *(f"note: {note}" for note in self.setup.notes)):
            self._report(line)
        self.reporter = Reporter(self.listener, self.setup, self.clock, self.files.state.wall_seconds)
        self.subdomain.begin()
        self._first_step = self.clock.steps

    def _report(self, text: str) -> None:
        """Write a text to the log and report it; nothing for an empty one."""
        if text:
            self.folder.log.write(text)
            self.listener.message(text)

    def _take_steps(self) -> None:
        """Advance to the end, a failure or an interruption."""
        with self.files.resume() if self.checkpoint else self._begin_files():
            try:
                if self.checkpoint is None:
                    self._begin()
                while not self._has_reached_steps() and not self._stopping():
                    self._advance()
            except Failure as failure:
                self.status, self.failure = "failed", failure
                self.folder.log.write(f"failed: {failure}")
                self.listener.message(str(failure))
            else:
                self.status = "done" if self._has_reached_steps() else "interrupted"
                if self.clock.is_finished:
                    self._report(self.late.pending())
                if not self.clock.is_finished or self.clock.fixed is not None:
                    self._checkpoint()

    def _begin_files(self) -> AbstractContextManager[object]:
        start = self.start
        del self.start  # it is in its file now
        return self.files.begin(start)

    def _prepare(self) -> None:
        """Evaluate the initial rates; restore the checkpoint when resuming."""
        separate_fragments(self.setup, 0)
        direct = type(self.setup.stepper) is Stepper and self.case.settle is None  # less memory before rates are filled
        if direct:
            self.start = self.writer.start(self.case.begins)
        self.setup.stepper.start()
        self._settled = settle(self.case, self.setup)
        if self._settled:
            self.writer.start_positions.rows[...] = self.setup.particles["position"]
        self.budget = Budget(self.setup)
        self.checks = SanityChecks(self.setup, self.case.limits, self.budget.scale - self.budget.energy)
        if not direct:
            self.start = self.writer.start(self.case.begins)
        state, series, peaks = self.files.state, self.writer.series, self.writer.peaks
        parts = self.case, self.setup, self.clock, self.budget, self.checks, state, series, peaks
        self.checkpoint_content = CheckpointContent(*parts)
        if self.checkpoint is not None:
            self.time_step = self.checkpoint_content.restore(self.checkpoint, self.late.resume)
            self.checkpoint = replace(self.checkpoint, arrays={})
            self.subdomain.note_reordering()
            self.subdomain.redistribute()

    def _stopping(self) -> bool:
        """Return whether to stop; all processes stop after the same step."""
        return self._stopped if self.subdomain.world.size > 1 else self.stop.number is not None

    def _has_reached_steps(self) -> bool:
        limit = self.case.time.max_steps
        return self.clock.is_finished or (limit is not None and self.clock.steps >= limit)

    def _begin(self) -> None:
        """Choose the first step."""
        stepper, limit = self.setup.stepper, self._limit()
        self.checks.check_step(limit, self.clock.time, 0)
        if self.setup.particles.has_previous:
            stepper.complete(0.0, 0.0)
        self.time_step = self.clock.choose(limit.dt, limit.criterion, None)
        stepper.predict(self.time_step.length)
        self.files.record(self.time_step, limit.number, 0.0, self.budget)

    def _limit(self, collapsed: RunError | None = None) -> GlobalLimit:
        """Return the step limit over all processes; `collapsed` is the error of this process, if any."""
        local = Limit(-1.0, COLLAPSED, -1) if collapsed else own_limit(self.case, self.setup)
        joint = self.subdomain.reduce_limit(local, self.stop.number or 0, self.files.checkpoint_due())
        if joint.criterion == COLLAPSED:
            error = self.subdomain.first_of(collapsed)
            raise self.checks.describe_collapse(error, self.clock.time, self.clock.steps) from collapsed
        if joint.stop and self.subdomain.world.size > 1:
            self._stopped, self.stop.number = True, self.stop.number or joint.stop
        return joint

    def _advance(self) -> None:
        """Advance by one step: rates, next step, state, schedule."""
        stepper, clock = self.setup.stepper, self.clock
        last = clock.last(self.time_step)
        if last is not None:  # shortened by the end: the checkpoint allows to extend the run
            self._checkpoint()
            self.time_step = last
            stepper.predict(last.length)
        collapsed: RunError | None = None
        try:
            stepper.evaluate()
        except RunError as error:
            collapsed = error
        limit = self._limit(collapsed)
        self.checks.check_step(limit, clock.time, clock.steps)
        following, number = clock.choose(limit.dt, limit.criterion, self.time_step), clock.outputs
        outputs = self._complete(following)
        if clock.steps % self.case.output.history_every == 0 or outputs or self.observer.due(clock.steps):
            self.files.record(self.time_step, limit.number, self.done.length, self.budget)
        self._report(self.checks.warning(clock.time))
        drift = self.budget.energy_drift(stepper.sums)
        self.checks.check_state(drift, clock.time, clock.steps)
        while outputs:  # snapshots refer to the present order of the particles
            number += 1
            self.files.write_output(outputs.pop(0)(), number)
        if self.late.is_due(clock.time, clock.steps):
            self._report(self.late.switch(clock.time, clock.steps))
            stepper.predict(following.length)
        if clock.steps % PERMUTE_EVERY == 0:
            self.writer.permute(stepper.permute())
            self.subdomain.note_reordering()
            separate_fragments(self.setup, clock.steps)
            self.domain.retire(self.budget, following.length)
            self.subdomain.rebalance(clock.steps)
        if limit.checkpoint:
            self._checkpoint()
        try:
            self.reporter.report(self.time_step, limit.body, drift)
        except KeyboardInterrupt:  # raised by the listener
            self.stop.note()

    def _complete(self, following: TimeStep) -> list[Callable[[], Moment]]:
        """Complete the step under way; return functions that create the snapshots due in it."""
        stepper, clock, particles = self.setup.stepper, self.clock, self.setup.particles
        self.done, self.time_step = self.time_step, following
        begin, moments = clock.time, clock.output_times(self.done)
        before = copy_rows(particles.data, stepper.workspace) if moments else particles.data
        stepper.complete(self.done.length, following.length)
        is_output = clock.complete(self.done)
        self.budget.record(stepper.sums, self.done.length, stepper.pressures)
        self.writer.peaks.record()
        outputs: list[Callable[[], Moment]] = [
            partial(self._interpolated_state, before, time, begin, time == moments[-1]) for time in moments
        ]
        if is_output:
            outputs.append(partial(self.writer.snapshot, clock.time, clock.steps))
        return outputs

    def _interpolated_state(self, before: np.ndarray, time: float, begin: float, last: bool) -> Moment:
        """Interpolate the state within the last step; at the `last` such time the previous state is overwritten."""
        share, state = (time - begin) / self.done.length, before if last else before.copy()
        return self.writer.snapshot(
            time, self.clock.steps, interpolate_state(state, self.setup.particles, share, self.done.length)
        )

    def _checkpoint(self) -> None:
        self.files.checkpoint(self.checkpoint_content, self.time_step, self.reporter.seconds)

    def _finish(self) -> Outcome:
        last = self.files.write_last(self.status == "failed")
        shared = self.subdomain.account(self.clock.steps - self._first_step)
        if shared:
            self.folder.log.write(shared)
        sums = self.setup.stepper.sums
        record: Plain = {
            "status": self.status,
            "time": self.clock.time,
            "steps": self.clock.steps,
            "failure": self.failure.as_dict() if self.failure else None,
            "particles": self.subdomain.count,
            "wall_seconds": self.reporter.seconds,
            "conservation": self.budget.as_dict(sums),
            "energies": self.budget.energies(sums),
            "highest_pressure": self.budget.highest(),
            "crack_area": self.budget.crack_area(),
            "materials": self.setup.substances,
        }
        for holder in (self.setup, self.writer):
            release_arrays(holder)

        def summary_of() -> Plain:
            assert last is not None
            return measure_end(self.case, self.text, self.writer, last(), record, self.listener, self.setup.origin)

        summary = self.subdomain.world.broadcast_from_first(summary_of)
        self.listener.finish(summary)
        code = exit_code_of(self.status, summary, self.stop.number or 0)
        return Outcome(self.folder.path, summary, code, self.stop.name if self.status == "interrupted" else "")


FRAGMENT_SEARCH_EVERY = 64  # steps between two searches, a multiple of those between two sortings of the state


def separate_fragments(setup: Setup, steps: int) -> None:
    """Find the connected components of bodies when due, on the first process, and renumber contact bodies."""
    stepper, share, particles = setup.stepper, setup.subdomain, setup.particles
    if not isinstance(stepper, Stepper) or stepper.pieces is None or steps % FRAGMENT_SEARCH_EVERY:
        return
    if steps == 0:
        stepper.pieces = particles.body.copy()  # in the present order
    pieces = stepper.pieces
    tags = np.stack([particles.id, particles.body, pieces], axis=1)
    tags, lengths = share.gather_rows(tags), share.gather_rows(particles["smoothing_length"])
    position = share.gather_rows(particles["position"])
    reach = stepper.formulation.kernel.reach
    if share.world.size == 1:
        components = label_components(position, lengths, reach, tags[:, 1], tags[:, 2], tags[:, 0])
    else:
        all_components = None
        if share.world.first:
            all_components = np.zeros(len(tags), np.uint32)
            all_components[tags[:, 0]] = label_components(position, lengths, reach, tags[:, 1], tags[:, 2], tags[:, 0])
        components = share.scatter_rows(all_components)
    if share.get_maxima(float((components != pieces).any()))[0]:
        stepper.split(components)
