"""Loops that threads share: every chunk is computed once, whoever takes it."""

import numba
import numpy as np
import pytest

from hvisph.compiler.jit import specialise
from hvisph.compiler.parallel_for import chunk_loop, particle_loop

CHUNK = 4


def visited(chunk, count, seen, calls):
    """Count who is visited, and how often a chunk is; early chunks take far longer than late ones."""
    calls[chunk] += 1
    for i in range(chunk * np.uint64(4), min(chunk * np.uint64(4) + np.uint64(4), count)):
        for _ in range(20_000 if chunk < np.uint64(8) else 1):
            seen[i] = np.sqrt(seen[i] * seen[i]) + 0.0
        seen[i] += 1.0


def one_more(i, seen):
    """Count who is visited."""
    seen[i] += 1.0


@pytest.mark.parametrize("count", [0, 1, 4, 5, 6, 1023])
@pytest.mark.parametrize("threads", [1, 2, 3])
def test_every_chunk_is_computed_once(count, threads):
    before = numba.get_num_threads()
    if threads > before:
        pytest.skip("needs more threads")
    numba.set_num_threads(threads)
    try:
        seen, calls = np.zeros(count), np.zeros(-(-count // CHUNK))
        chunk_loop(specialise(visited), CHUNK)(count, seen, calls)
        np.testing.assert_array_equal(seen, 1.0)
        np.testing.assert_array_equal(calls, 1.0)
        particle_loop(specialise(one_more))(count, seen)
        np.testing.assert_array_equal(seen, 2.0)
    finally:
        numba.set_num_threads(before)
