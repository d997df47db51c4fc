"""Rows asked for before they are needed: the processor fetches them from memory while it computes.

It foresees what is read in sequence by itself, but not which rows a list of numbers names. Nothing waits for what is
asked for, and nothing hangs on it but time.
"""

from __future__ import annotations

import numpy as np

from hvisph.compiler.jit import compiled

from .api import LANES, fetch

LINE = 8  # floats in a cache line


@compiled
def fetch_row(rows, i, first, end):
    """Ask for the slots from `first` up to `end` of row `i`."""
    for slot in range(np.uint64(first), np.uint64(end), np.uint64(LINE)):
        fetch(rows, i, slot)


@compiled
def fetch_rows(rows, near, k, width):
    """Ask for the first `width` slots of the LANES rows that stand in `near` from `k` on, or of the last ones there."""
    first = min(np.uint64(k), np.uint64(near.shape[0] - LANES))
    for lane in range(np.uint64(LANES)):
        fetch_row(rows, np.uint64(near[first + lane]), np.uint64(0), width)
