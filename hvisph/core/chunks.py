"""The loop over all particles, of which each thread takes a chunk at a time: a pass is the text of a single one."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from .jit import prange, specialise

CHUNK = 256

# numba hands threads tuples, but no tuples of such: so the loop has as many arguments as what it calls.
_TEXT = """
def {name}(count, {given}):
    count = np.uint64(count)
    for chunk in prange((count + np.uint64(CHUNK - 1)) // np.uint64(CHUNK)):
        visit(np.uint64(chunk), count, ({given},))
"""


def _visit(chunk, count, given):
    first = chunk * np.uint64(CHUNK)
    for i in range(first, min(first + np.uint64(CHUNK), count)):
        one(i, *given)


@cache
def _loop(name: str, given: tuple[str, ...]) -> Any:
    made: dict[str, Any] = {"np": np, "prange": prange, "CHUNK": CHUNK, "__name__": __name__}
    exec(_TEXT.format(name=name, given=", ".join(given)), made)  # noqa: S102
    return made[name]


def each(one: Any) -> Any:
    """Return the loop, `loop(count, *given)`, that calls the compiled function `one(i, *given)` for i below `count`."""
    code = one.py_func.__code__
    visit = specialise(_visit, one=one)
    return specialise(_loop(code.co_name, code.co_varnames[1 : code.co_argcount]), parallel=True, visit=visit)
