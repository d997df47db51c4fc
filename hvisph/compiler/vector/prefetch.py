"""Prefetch of rows: the processor loads them from memory while it computes.

Hardware prefetches sequential reads, but not rows that a list of numbers selects. Results do not depend on it.
"""

from __future__ import annotations

import numpy as np

from hvisph.compiler.jit import inline

from .api import LANES, fetch

LINE = 8  # floats in a cache line


@inline
def fetch_row(rows, i, first, end):
    """Prefetch the slots from `first` up to `end` of row `i`."""
    for slot in range(np.uint64(first), np.uint64(end), np.uint64(LINE)):
        fetch(rows, i, slot)


@inline
def fetch_rows(rows, near, k, width):
    """Prefetch the first `width` slots of the LANES rows listed in `near` from `k` on, or of the last ones."""
    first = min(np.uint64(k), np.uint64(near.shape[0] - LANES))
    for lane in range(np.uint64(LANES)):
        fetch_row(rows, np.uint64(near[first + lane]), np.uint64(0), width)
