"""What a step costs, and how many threads it is worth.

Speeds were measured on a laptop core: they tell a minute from a day.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hvisph.case.case import Case

# Time on one core, by formulation and dimensions [us a particle-step].
MICROSECONDS = {"eulerian": {1: 0.15, 2: 0.25, 3: 0.85}, "riemann": {1: 0.3, 2: 0.6, 3: 2.4},
                "projection": {1: 0.1, 2: 0.25, 3: 1.2}, "total_lagrangian": {1: 0.2, 2: 0.3, 3: 0.9},
                "adaptive": {1: 0.3, 2: 0.45, 3: 1.2}}  # fmt: skip
STEP_OVERHEAD = 2e-4  # whatever the number of particles [s]
THREAD_GAIN = 0.85  # of each further thread
# Work of a step that a further thread must find [s]. A step shares out its work four to eight times, and each costs
# the waking of a thread, 0.05 ms and far more on a busy machine: `benchmarks/small_cases.py`.
WORTH_A_THREAD = 1.5e-3
# And below which it waits for longer than it works, on a quiet machine too [s].
FEEDS_A_THREAD = 0.5e-3


def worthwhile_threads(case: Case, particles: int) -> int:
    """Return how many threads the case is worth, at most those that this process may use."""
    return max(1, min(available_threads(), int(_work(case, particles) / WORTH_A_THREAD)))


def fed_threads(case: Case, particles: int) -> int:
    """Return the most threads that a step finds work for: with more of them it takes longer."""
    return max(1, int(_work(case, particles) / FEEDS_A_THREAD))


def fewer_threads_reason(threads: int, case: Case, particles: int) -> str:
    """Return why a run uses fewer threads than requested; empty where it does not."""
    fed = fed_threads(case, particles)
    if threads <= fed:
        return ""
    work = 1e3 * _work(case, particles)
    return (
        f"{of_cores(fed, threads)} asked for: a step of {particles} particles is {work:.2g} ms of work, and a thread "
        f"that finds less than {1e3 * FEEDS_A_THREAD:g} ms makes it slower; the results are the same"
    )


def step_seconds(case: Case, particles: int, threads: int) -> float:
    """Return the wall time of a step on so many threads [s]."""
    return STEP_OVERHEAD + _work(case, particles) / (1.0 + THREAD_GAIN * (threads - 1))


def available_threads() -> int:
    """Return how many threads this process may use: a processor each, or fewer by ``NUMBA_NUM_THREADS``."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    asked = os.environ.get("NUMBA_NUM_THREADS", "")
    return max(1, int(asked)) if asked.isdigit() else cores


def of_cores(threads: int, cores: int) -> str:
    """Return a number of threads in words, with the number there could be where that is more."""
    words = f"{threads} thread{'s' if threads > 1 else ''}"
    return f"{words} of {cores}" if threads < cores else words


def _work(case: Case, particles: int) -> float:
    pace = MICROSECONDS.get(case.formulation.type, MICROSECONDS["eulerian"])[case.dim]
    return 1e-6 * pace * particles
