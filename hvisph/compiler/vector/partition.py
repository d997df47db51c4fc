"""Partition of a chunk of particles by key, in whole vectors."""

from __future__ import annotations

import numpy as np

from hvisph.compiler.jit import inline

from .api import LANES

# Greater than any key: the key of particles that are not listed, and the successor of the largest key.
NONE = 2**62


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
