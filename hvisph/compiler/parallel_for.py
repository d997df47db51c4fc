"""Parallel loop over all particles, defined by a function of one particle or of a chunk of particles.

Each thread starts with its own share, the same in all loops, so that its cache may hold part of the data. A thread that
has finished takes chunks of other shares; no thread waits for one that started late, had more work or lost its core.
A chunk does not depend on others, so any number of threads gives the same bits.
"""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from functools import cache

import numpy as np

from hvisph.compiler.vector.api import COUNTERS, increment_counter, make_counters, thread_count
from hvisph.core.errors import RunError

from .jit import inline, prange, specialise

CHUNK = 256

# numba passes tuples to threads, but not tuples of tuples: the loop has the same arguments as the function it calls.
_TEXT = """
def {name}(count, {given}):
    count = np.uint64(count)
    chunks = (count + np.uint64(CHUNK - 1)) // np.uint64(CHUNK)
{alone}    workers, counters = thread_count(), make_counters()
    for worker in prange(workers):
        chunk = next_chunk(counters, np.uint64(worker), workers, chunks)
        while chunk < chunks:
            visit(chunk, count, {given})
            chunk = next_chunk(counters, np.uint64(worker), workers, chunks)
"""


# What a loop over a single chunk does without threads, which take a microsecond.
_ALONE = """
    if chunks == np.uint64(1):
        visit(np.uint64(0), count, {given})
        return
"""


@inline
def next_chunk(counters, worker, workers, chunks):
    """Return the next free chunk, of the share of `worker` if one is left, or `chunks` if there is none."""
    shares = min(workers, np.uint64(COUNTERS))
    for k in range(shares):
        share = (worker + k) % shares
        chunk = share * chunks // shares + increment_counter(counters, share)
        if chunk < (share + np.uint64(1)) * chunks // shares:
            return chunk
    return chunks


def _visit(chunk, count, *given):
    first = chunk * np.uint64(CHUNK)
    for i in range(first, min(first + np.uint64(CHUNK), count)):
        one(i, *given)


@cache
def _loop(name: str, given: tuple[str, ...], short: bool) -> PythonFunction:
    namespace: dict[str, object] = {
        **{"np": np, "prange": prange, "next_chunk": next_chunk},
        **{"thread_count": thread_count, "make_counters": make_counters, "__name__": __name__},
    }
    branch = _ALONE if short else ""
    exec(_TEXT.format(name=name, alone=branch, given="{given}").format(given=", ".join(given)), namespace)  # noqa: S102
    return namespace[name]


def chunk_loop(visit: CompiledFunction, chunk: int = CHUNK, short: bool = False) -> CompiledFunction:
    """Return `loop(count, *given)`, which calls the compiled function `visit(k, count, *given)` for all chunks.

    The k-th chunk begins at particle `k * chunk`; both numbers are uint64. `short` says that the function is: the loop
    contains it twice.
    """
    code = visit.py_func.__code__
    loop = _loop(code.co_name, code.co_varnames[2 : code.co_argcount], short)
    return specialise(loop, parallel=True, visit=visit, CHUNK=chunk)


def particle_loop(one: CompiledFunction, short: bool = False) -> CompiledFunction:
    """Return `loop(count, *given)`, which calls the compiled function `one(i, *given)` for i below `count`."""
    code = one.py_func.__code__
    visit = specialise(_visit, one=one)
    loop = _loop(code.co_name, code.co_varnames[1 : code.co_argcount], short)
    return specialise(loop, parallel=True, visit=visit, CHUNK=CHUNK)


_unusable = False


def refuse_fork() -> None:
    """Raise `RunError` in a child that was forked after its parent had used threads.

    GNU OpenMP cannot start threads there. It kills such a child by a signal, and a parent that waits for it, as
    `multiprocessing.Pool` does, never returns. One thread is no remedy: it also enters a parallel region. The message
    names the remedies.
    """
    if _unusable:
        raise RunError(
            "this process was forked from one that had already used threads, and GNU OpenMP cannot start them here; "
            "run before forking, or start processes afresh: multiprocessing.get_context('spawn'), or hvisph sweep"
        )


def _note_fork() -> None:
    """Record in a forked child whether its parent had started threads."""
    global _unusable
    numba = sys.modules.get("numba")
    with suppress(ValueError):  # numba has started no threads
        _unusable = _unusable or (numba is not None and numba.threading_layer() == "omp")


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_note_fork)
