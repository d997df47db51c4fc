"""Parallel runs by MPI: domain decomposition; here the launcher, from the environment without loading MPI."""

import os

# Number of a process and of all, as launchers name them: MPICH and Intel MPI, Open MPI, PMIx (Slurm, PRRTE).
_VARIABLES = (("PMI_RANK", "PMI_SIZE"), ("OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE"), ("PMIX_RANK", "SLURM_NTASKS"))


def launched_rank() -> tuple[int, int]:
    """Return rank and number of processes; 0 and 1 without a launcher."""
    for rank, size in _VARIABLES:
        rank_text, size_text = os.environ.get(rank, ""), os.environ.get(size, "")
        if rank_text.isdecimal() and size_text.isdecimal() and int(size_text) > 1:
            return int(rank_text), int(size_text)
    return 0, 1


def is_first() -> bool:
    """Return whether this is the first process."""
    return launched_rank()[0] == 0
