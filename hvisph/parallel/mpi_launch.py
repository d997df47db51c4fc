"""Whether a launcher of MPI started this process as one of several: told by its environment, before MPI is loaded."""

from __future__ import annotations

import os

# Number of a process and of all, as launchers name them: MPICH and Intel MPI, Open MPI, PMIx (Slurm, PRRTE).
_VARIABLES = (("PMI_RANK", "PMI_SIZE"), ("OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE"), ("PMIX_RANK", "SLURM_NTASKS"))


def launched_rank() -> tuple[int, int]:
    """Return the number of this process and how many there are: 0 and 1 where none of several was started."""
    for rank, size in _VARIABLES:
        here, all_ = os.environ.get(rank, ""), os.environ.get(size, "")
        if here.isdecimal() and all_.isdecimal() and int(all_) > 1:
            return int(here), int(all_)
    return 0, 1


def is_first() -> bool:
    """Whether this process is the one that speaks: the first of several, or alone."""
    return launched_rank()[0] == 0
