"""Workers on a Dask cluster: Dask only starts them, the folder assigns the cases.

Needs `hvisph[dask]`. The sweep's folder must be on a disk that all machines share.
"""

import subprocess
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any
from uuid import uuid4
from warnings import warn

from hvisph.core.errors import CaseError, OutputError

from .driver import Failures, worker_command
from .folder import CLAIMS, SweepFolder

PATIENCE = 60.0  # wall time that workers have to write a checkpoint [s]
LOOK = 2.0  # wall time between two checks of the cluster's workers [s]
SILENCE = 10.0  # wall time without any worker after which this is reported [s]
KEPT = 2000  # number of last characters kept of a worker's standard error
KINDS = {"slurm": "SLURMCluster", "pbs": "PBSCluster", "sge": "SGECluster"}


class DaskCrew:
    """Workers of a sweep, each a task of a Dask cluster that starts the command of a worker.

    `client`: a client of `distributed`.
    `tell`: receives the messages that there is no worker, and that there are some again.
    """

    waits_for_first = True  # machines may share a disk without locks

    def __init__(
        self,
        folder: SweepFolder,
        client: Any,
        threads: int,
        options: Sequence[str] = (),
        tell: Callable[[str], None] = warn,
    ):
        home = SweepFolder(folder.path.resolve())
        self.client, self.tell = client, tell
        self.address = client.scheduler.address
        # workers on other machines receive no signals of this one: they work as long as this file exists
        self.wanted = home.path / CLAIMS / f"crew-{uuid4().hex[:12]}"
        self.wanted.touch()
        self.command = worker_command(home, threads, (*options, "--while", str(self.wanted)))
        self.tasks: list[Any] = []
        self.failures = Failures()
        self.look, self.reported = 0.0, False  # when to look next, and whether the silence was reported
        self.alone: float | None = None  # no worker has been there since

    def keep(self, workers: int) -> int:
        """Keep the wanted number of workers; `OutputError` without a scheduler, or where all end with errors."""
        for task in self.tasks:
            if task.done():
                self.failures.add(*_end(task))
        self.tasks = [task for task in self.tasks if not task.done()]
        if self.client.status == "closed":
            raise OutputError(
                f"the Dask scheduler at {self.address} has gone; start one and continue with the same command, or "
                "without Dask: nothing is lost"
            )
        while len(self.tasks) < workers:
            self.tasks.append(self.client.submit(_work, self.command, pure=False))
        if time.monotonic() >= self.look:
            self._watch()
        return len(self.tasks)

    def _watch(self) -> None:
        """Report once that there has been no worker for a while, and once that there are some again."""
        number = self._workers()
        now = time.monotonic()
        self.look = now + LOOK
        if number:
            if self.reported:
                self.tell(f"the Dask cluster has {number} worker{'s' * (number > 1)} again")
            self.alone, self.reported = None, False
        elif self.alone is None:
            self.alone = now
        elif not self.reported and now - self.alone >= SILENCE:
            self.reported = True
            self.tell(
                f"no worker on the Dask cluster at {self.address} for {now - self.alone:.0f} s: the sweep waits until "
                f"there are some. Start them with `dask worker {self.address}`, or look at the jobs of the queue; "
                "Ctrl-C ends, nothing is lost, and the same command continues"
            )

    def _workers(self) -> int:
        """Return how many workers the cluster has, none where its scheduler does not answer."""
        try:
            return len(self.client.nthreads())
        except (OSError, ValueError, TimeoutError):
            return 0

    def stop(self) -> None:
        """Ask all workers to write checkpoints and end, and wait for them, a minute at most."""
        self.wanted.unlink(missing_ok=True)
        distributed = _import("distributed")
        end = time.monotonic() + PATIENCE
        while self.client.status == "running" and self._workers() and time.monotonic() < end:
            with suppress(TimeoutError, distributed.TimeoutError):
                if self.tasks:
                    distributed.wait(self.tasks, timeout=1.0)
                break
        self.client.close()


def _work(command: list[str]) -> tuple[int, str]:
    """Run a worker's command as a process; return its exit code and the end of its standard error."""
    nothing = subprocess.DEVNULL
    process = subprocess.run(  # noqa: S603 our own command
        command, check=False, stdin=nothing, stdout=nothing, stderr=subprocess.PIPE, text=True, errors="replace"
    )
    return process.returncode, process.stderr[-KEPT:]


def _end(task: Any) -> tuple[int, str]:
    """Return how a task of Dask has ended, as of `_work`; one whose worker was killed counts as killed."""
    if task.status == "finished":
        code, error_text = task.result()
        return int(code), str(error_text)
    if task.status == "error" and type(error := task.exception()).__name__ != "KilledWorker":
        return 1, f"{type(error).__name__}: {error}"
    return -1, ""


def connect(address: str) -> Any:
    """Return a client of a running scheduler; raises `CaseError` where there is none."""
    distributed = _import("distributed")
    try:
        return distributed.Client(address, timeout=10)
    except (OSError, ValueError) as error:
        raise CaseError(f"no Dask scheduler answers at {address}: {error}", where="--dask") from None


def launch(scheduler: str, workers: int, threads: int) -> Any:
    """Return a client of a cluster whose workers are jobs of a queue; set up by Dask's own configuration files."""
    jobqueue = _import("dask_jobqueue")
    distributed = _import("distributed")
    try:
        cluster = getattr(jobqueue, KINDS[scheduler])(cores=threads, processes=1)
        cluster.scale(jobs=workers)
    except (ValueError, OSError, RuntimeError) as error:
        raise CaseError(f"{scheduler}: {error}", where="--cluster") from None
    return distributed.Client(cluster)


def _import(name: str) -> Any:
    from importlib import import_module

    try:
        return import_module(name)
    except ImportError:
        raise CaseError(f"needs the package {name}: pip install 'hvisph[dask]'", where="--dask") from None
