"""A worker of a sweep: claims a free case, runs or continues it, and takes the next one.

No scheduler: any number of workers, on any machines that share the folder. Kill some, start more.
"""

import time
from collections.abc import Callable, Sequence
from pathlib import Path

from hvisph.case.sweep import Sweep
from hvisph.core.errors import INTERRUPTED, HvisphError
from hvisph.output import file_names
from hvisph.output.checkpoint_file import list_checkpoints
from hvisph.output.run_folder import delete_snapshots
from hvisph.simulation.listener import Listener, Progress
from hvisph.simulation.run import complete
from hvisph.simulation.run_files import Outcome

from .folder import ENDED, STEPPING, Selection, SweepFolder, TableKeeper
from .plan import Member, Plan

POLL = 0.5  # wall time between two searches while other workers compute all remaining cases [s]
LOOK = 1.0  # wall time between two checks whether the worker is still wanted [s]


class _Limited(Listener):
    """Interrupts a run after a wall time or at the end of the sweep; reports the first step of the first case."""

    def __init__(self, seconds: float | None, stepping: Callable[[], None], is_needed: Callable[[], bool]):
        self.end = None if seconds is None else time.monotonic() + seconds
        self.stepping, self.wanted, self.reached = stepping, is_needed, False
        self.look = time.monotonic() + LOOK

    def progress(self, progress: Progress) -> None:
        self.stepping()
        clock = time.monotonic()
        if clock > self.look:
            self.look = clock + LOOK
            if not self.wanted():
                raise KeyboardInterrupt
        if self.end is not None and clock > self.end:
            self.reached = True
            raise KeyboardInterrupt


class Worker:
    """Computes cases until none is left, or until the file `wanted` is gone where it is given."""

    def __init__(
        self,
        folder: SweepFolder,
        threads: int | None = None,
        selection: Selection | None = None,
        presence: Path | None = None,
    ):
        self.folder, self.threads, self.selection = folder, threads, selection or Selection()
        self.file = presence
        self.plan: Plan = folder.plan()
        self.sweep: Sweep = self.plan.sweep
        self.table = TableKeeper(folder, self.sweep.record)
        self.stepping = False

    def work(self) -> int:
        """Compute until no case is left; return 0, or 130 after a signal."""
        while True:
            members = self.folder.members()
            waiting = busy = 0
            for member in self.selection.by_cost(members):
                if self._enough_failures(members):
                    return 0
                if not self._is_active():
                    return INTERRUPTED
                if not self.selection.takes(member, self.folder.standing(member)):
                    continue
                waiting += 1
                with self.folder.claim(member) as claimed:
                    standing = self.folder.standing(member, held=claimed)
                    if not claimed:
                        busy += 1
                    elif self.selection.takes(member, standing) and not self._compute(member):
                        return INTERRUPTED
                self.table.write(members)
            if waiting == 0:
                return 0
            if busy == waiting:
                time.sleep(POLL)

    def _is_active(self) -> bool:
        return self.file is None or self.file.exists()

    def _enough_failures(self, members: Sequence[Member]) -> bool:
        top = self.sweep.stop_after_failures
        return top is not None and sum(self.folder.standing(member).status in ENDED[1:] for member in members) >= top

    def _compute(self, member: Member) -> bool:
        """Run a case to its end, its limit or a signal; False after a signal."""
        newest = next(iter(list_checkpoints(self.folder.run_folder(member) / file_names.CHECKPOINT)), None)
        self.folder.note(member, "start", checkpoint=newest.name if newest else None)
        listener = _Limited(self.sweep.time_limit, lambda: self._report_compiled(member), self._is_active)
        try:
            outcome = self._run(member, listener)
        except KeyboardInterrupt:
            self.folder.note(member, "end", reason="signal")
            return False
        except Exception as error:  # a bug in one case leaves the others alone
            unexpected = f"unexpected {type(error).__name__}: {error}"[:500]
            text = "out of memory" if isinstance(error, MemoryError) else unexpected
            self.folder.note(member, "error", message=str(error) if isinstance(error, HvisphError) else text)
            return True
        interrupted = outcome.summary["status"] == "interrupted"
        self.folder.note(member, "end", reason="limit" if listener.reached else "signal" if interrupted else "")
        if outcome.summary["status"] == "done" and self.sweep.keep != "all":
            delete_snapshots(Path(outcome.folder), last=self.sweep.keep == "last")
        return not interrupted or listener.reached

    def _run(self, member: Member, listener: Listener) -> Outcome:
        case, path = self.plan.case(member.values, member.number), self.folder.run_folder(member)
        failed, end = self.folder.has_failed(member), self.folder.extended_end(member)
        return complete(case, path, failed, self.threads, listener, end)

    def _report_compiled(self, member: Member) -> None:
        """Say once that loops are compiled: other workers may then begin."""
        if not self.stepping:
            self.stepping = True
            (self.folder.path / STEPPING).touch()
