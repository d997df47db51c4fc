"""The loop over all particles that threads share: a pass is the text of a chunk of them, or of a single one.

Every thread begins with a share of its own, the same in all loops, of which its cache may still have something; whoever
is done takes chunks of others, so that none waits for one that was woken late, had more to do, or has lost its core to
another process. What a chunk computes hangs on no other, so any number of threads gives the same bits.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from hvisph.compiler.jit import compiled, prange, specialise
from hvisph.compiler.vector.api import COUNTERS, count_up, crew, fresh_counters

CHUNK = 256

# numba hands threads tuples, but no tuples of such: so the loop has as many arguments as what it calls.
_TEXT = """
def {name}(count, {given}):
    count = np.uint64(count)
    chunks = (count + np.uint64(CHUNK - 1)) // np.uint64(CHUNK)
    workers, counters = crew(), fresh_counters()
    for worker in prange(workers):
        chunk = next_chunk(counters, np.uint64(worker), workers, chunks)
        while chunk < chunks:
            visit(chunk, count, {given})
            chunk = next_chunk(counters, np.uint64(worker), workers, chunks)
"""


@compiled
def next_chunk(counters, worker, workers, chunks):
    """Return a chunk that nobody has taken, of the share of `worker` if there is one left, or `chunks`."""
    shares = min(workers, np.uint64(COUNTERS))
    for k in range(shares):
        share = (worker + k) % shares
        chunk = share * chunks // shares + count_up(counters, share)
        if chunk < (share + np.uint64(1)) * chunks // shares:
            return chunk
    return chunks


def _visit(chunk, count, *given):
    first = chunk * np.uint64(CHUNK)
    for i in range(first, min(first + np.uint64(CHUNK), count)):
        one(i, *given)


@cache
def _loop(name: str, given: tuple[str, ...]) -> Any:
    made: dict[str, Any] = {
        **{"np": np, "prange": prange, "crew": crew, "fresh_counters": fresh_counters, "next_chunk": next_chunk},
        "__name__": __name__,
    }
    exec(_TEXT.format(name=name, given=", ".join(given)), made)  # noqa: S102
    return made[name]


def shared(visit: Any, chunk: int = CHUNK) -> Any:
    """Return the loop, `loop(count, *given)`, that calls `visit(k, count, *given)` for chunks of so many of `count`.

    The k-th chunk begins at `k * chunk`; both numbers are uint64. `visit` is a compiled function.
    """
    code = visit.py_func.__code__
    loop = _loop(code.co_name, code.co_varnames[2 : code.co_argcount])
    return specialise(loop, parallel=True, visit=visit, CHUNK=chunk)


def each(one: Any) -> Any:
    """Return the loop, `loop(count, *given)`, that calls the compiled function `one(i, *given)` for i below `count`."""
    code = one.py_func.__code__
    visit = specialise(_visit, one=one)
    loop = _loop(code.co_name, code.co_varnames[1 : code.co_argcount])
    return specialise(loop, parallel=True, visit=visit, CHUNK=CHUNK)
