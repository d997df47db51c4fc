"""Who may be carried together: of a chunk of particles those that are alike, listed in whole vectors."""

from __future__ import annotations

import numpy as np

from hvisph.compiler.jit import compiled

from .api import LANES

# More than any key: of a particle that is not listed, and what is above the largest key.
NONE = 2**62


@compiled
def listed(keys, count, first, key, found):
    """List the particles `first` + k, k below `count`, whose keys[k] is `key`, in `found` (uint32).

    Returns how many, and the least key above, or NONE. Behind them the list repeats its last for LANES.
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
