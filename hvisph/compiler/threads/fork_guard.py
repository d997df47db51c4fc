"""Guard against forked processes: GNU OpenMP cannot start threads in a child whose parent has used them.

GNU OpenMP kills such a child by a signal, and a parent that waits for it, as `multiprocessing.Pool` does, never
returns. The child therefore raises an error first. One thread is no remedy: it also enters a parallel region.
"""

from __future__ import annotations

import os

from hvisph.core.errors import RunError

_unusable = False


def refuse_fork() -> None:
    """Raise `RunError` in a child that was forked after its parent had used threads.

    Raises
    ------
    RunError
        With the remedies.
    """
    if _unusable:
        raise RunError(
            "this process was forked from one that had already used threads, and GNU OpenMP cannot start them here; "
            "run before forking, or start processes afresh: multiprocessing.get_context('spawn'), or hvisph sweep"
        )


def _note_fork() -> None:
    """Record in a forked child whether its parent had started threads."""
    global _unusable
    from numba.np.ufunc import parallel

    _unusable = _unusable or (parallel._is_initialized and _layer() == "omp")


def _layer() -> str:
    from numba.np.ufunc import parallel

    try:
        return str(parallel.threading_layer())
    except ValueError:  # none has been used
        return ""


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_note_fork)
