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
def fetch_rows(rows, indices, k, width):
    """Prefetch the first `width` slots of the LANES rows listed in `indices` from `k` on, or of the last ones."""
    first = min(np.uint64(k), np.uint64(indices.shape[0] - LANES))
    for lane in range(np.uint64(LANES)):
        fetch_row(rows, np.uint64(indices[first + lane]), np.uint64(0), width)


@inline
def list_equal_keys(keys, count, first, key, indices):
    """List the particles `first` + k, k below `count`, with keys[k] equal to `key`, in `indices` (uint32).

    Return their number and the smallest greater key, or NONE. The last entry is repeated LANES times behind them.
    """
    n, next_key = np.uint64(0), np.uint64(NONE)
    for k in range(np.uint64(count)):
        if keys[k] == key:
            indices[n] = first + k
            n += np.uint64(1)
        elif keys[k] > key:
            next_key = min(next_key, keys[k])
    for k in range(np.uint64(LANES)):
        if n > np.uint64(0):
            indices[n + k] = indices[n - np.uint64(1)]
    return n, next_key
