"""A compiled loop on all threads against plain NumPy: whether compiled code works on this machine."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from .jit import prange, report_compilation, specialise

COUNT = 200_000


def self_test() -> dict[str, Any]:
    """Compile, or take from the cache, a small parallel loop and compare its result.

    Returns
    -------
    dict
        `passed`, `reason` (empty if passed), `cached`, `seconds` until the first result, `threads`.
    """
    import numba

    heard: list[str] = []
    x = np.linspace(0.5, 2.0, COUNT)
    computed = np.zeros(COUNT)
    start = time.perf_counter()
    reason = ""
    with report_compilation(heard.append):
        try:
            specialise(_powers, parallel=True)(x, computed)
        except Exception as error:  # whatever the compiler says is the answer
            reason = f"{type(error).__name__}: {error}"
    seconds = time.perf_counter() - start
    if not reason and not np.allclose(computed, x**1.5, rtol=1e-13, atol=0.0):
        reason = "a compiled loop gives wrong numbers"
    return {
        "passed": not reason,
        "reason": reason,
        "cached": not heard and not reason,
        "seconds": seconds,
        "threads": numba.get_num_threads(),
    }


def _powers(x, out):
    for k in prange(len(x)):
        out[k] = np.sqrt(x[k]) * x[k]
