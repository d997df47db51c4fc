"""Rows asked for before they are needed: the processor fetches them from memory while it computes.

It foresees what is read in sequence by itself, but not which rows a list of numbers names. Nothing waits for what is
asked for, and nothing hangs on it but time.
"""

from __future__ import annotations

import numpy as np

from .jit import compiled
from .vectors import fetch

LINE = 8  # floats in a cache line


@compiled
def fetch_row(rows, i, first, end):
    """Ask for the slots from `first` up to `end` of row `i`."""
    for slot in range(np.uint64(first), np.uint64(end), np.uint64(LINE)):
        fetch(rows, i, slot)


@compiled
def fetch_rows(rows, near, begin, end, width):
    """Ask for the first `width` slots of the rows that stand in `near` from `begin` up to `end`."""
    for k in range(np.uint64(begin), np.uint64(end)):
        fetch_row(rows, np.uint64(near[k]), np.uint64(0), width)
