"""Rows of particles in compiled loops: prefetch, and partition of a chunk by key.

The processor loads prefetched rows from memory while it computes. Hardware prefetches sequential reads, but not rows
that a list of numbers selects. Results do not depend on it.
"""

from __future__ import annotations

import numpy as np

from hvisph.compiler.jit import inline

from .api import LANES, fetch

LINE = 8  # floats in a cache line
# Greater than any key: the key of particles that are not listed, and the successor of the largest key.
NONE = 2**62


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


@inline
def list_equal_keys(keys, count, first, key, found):
    """List the particles `first` + k, k below `count`, with keys[k] equal to `key`, in `found` (uint32).

    Return their number and the smallest greater key, or NONE. The last entry is repeated LANES times behind them.
    """
    n, above = np.uint64(0), np.uint64(NONE)
    for k in range(np.uint64(count)):
        if keys[k] == key:
            found[n] = first + k
            n += np.uint64(1)
        elif keys[k] > key:
            above = min(above, keys[k])
    for k in range(np.uint64(LANES)):
        if n > np.uint64(0):
            found[n + k] = found[n - np.uint64(1)]
    return n, above
