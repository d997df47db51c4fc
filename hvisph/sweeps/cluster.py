"""Workers on a Dask cluster: Dask only starts them, the folder says who computes what.

Needs `hvisph[dask]`. The sweep's folder must be on a disk that all machines share.
"""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from contextlib import suppress
from typing import Any
from uuid import uuid4

from hvisph.core.errors import CaseError
from hvisph.sweeps.driver import worker_command
from hvisph.sweeps.folder import CLAIMS, SweepFolder

PATIENCE = 60.0  # wall time that workers have to write a checkpoint [s]
KINDS = {"slurm": "SLURMCluster", "pbs": "PBSCluster", "sge": "SGECluster"}


class DaskCrew:
    """Workers of a sweep, each a task of a Dask cluster that starts the command of a worker.

    Parameters
    ----------
    folder
        The sweep's.
    client
        A client of `distributed`.
    threads
        Threads of each worker.
    options
        Further options of the command.
    """

    def __init__(self, folder: SweepFolder, client: Any, threads: int, options: Sequence[str] = ()):
        home = SweepFolder(folder.path.resolve())
        self.client = client
        # workers on other machines hear no signal of this one: they work as long as this file is there
        self.wanted = home.path / CLAIMS / f"crew-{uuid4().hex[:12]}"
        self.wanted.touch()
        self.command = worker_command(home, threads, (*options, "--while", str(self.wanted)))
        self.tasks: list[Any] = []

    def keep(self, wanted: int) -> int:
        """Submit workers until as many are under way as wanted."""
        self.tasks = [task for task in self.tasks if not task.done()]
        while len(self.tasks) < wanted:
            self.tasks.append(self.client.submit(_work, self.command, pure=False))
        return len(self.tasks)

    def stop(self) -> None:
        """Ask all to keep what they have and end, and wait for them, a minute at most."""
        self.wanted.unlink(missing_ok=True)
        distributed = _imported("distributed")
        with suppress(TimeoutError, distributed.TimeoutError):
            if self.tasks:
                distributed.wait(self.tasks, timeout=PATIENCE)
        self.client.close()


def _work(command: list[str]) -> int:
    """Run the command of a worker: in a process of its own, which hears signals and outlives no machine."""
    nothing = subprocess.DEVNULL
    return subprocess.run(command, check=False, stdin=nothing, stdout=nothing).returncode  # noqa: S603 our own command


def connected(address: str) -> Any:
    """Return a client of a running scheduler; raises `CaseError` where there is none."""
    distributed = _imported("distributed")
    try:
        return distributed.Client(address, timeout=10)
    except (OSError, ValueError) as error:
        raise CaseError(f"no Dask scheduler answers at {address}: {error}", where="--dask") from None


def launched(kind: str, workers: int, threads: int) -> Any:
    """Return a client of a cluster whose workers are jobs of a queue; set up by Dask's own configuration files."""
    jobqueue = _imported("dask_jobqueue")
    distributed = _imported("distributed")
    try:
        cluster = getattr(jobqueue, KINDS[kind])(cores=threads, processes=1)
        cluster.scale(jobs=workers)
    except (ValueError, OSError, RuntimeError) as error:
        raise CaseError(f"{kind}: {error}", where="--cluster") from None
    return distributed.Client(cluster)


def _imported(name: str) -> Any:
    from importlib import import_module

    try:
        return import_module(name)
    except ImportError:
        raise CaseError(f"needs the package {name}; install hvisph[dask]", where="--dask") from None
