"""Runs in a process that was forked: GNU OpenMP cannot start threads in a child whose parent has used them.

It ends such a child by a signal, and whoever waits for it, as `multiprocessing.Pool` does, waits for ever. So the
child is told before anything is compiled or written. One thread is no way out: it too works in a parallel region.
"""

from __future__ import annotations

import os

from hvisph.core.errors import RunError

_spoiled = False


def refuse_fork() -> None:
    """Raise `RunError` in a child that was forked after its parent had used threads.

    Raises
    ------
    RunError
        Naming the ways out.
    """
    if _spoiled:
        raise RunError(
            "this process was forked from one that had already used threads, and GNU OpenMP cannot start them here; "
            "run before forking, or start processes afresh: multiprocessing.get_context('spawn'), or hvisph sweep"
        )


def _note_fork() -> None:
    """Note, in a child just forked, whether threads had been started before."""
    global _spoiled
    from numba.np.ufunc import parallel

    _spoiled = _spoiled or (parallel._is_initialized and _layer() == "omp")


def _layer() -> str:
    from numba.np.ufunc import parallel

    try:
        return str(parallel.threading_layer())
    except ValueError:  # none has been used
        return ""


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_note_fork)
