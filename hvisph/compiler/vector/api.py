"""Vector operations by name, and the number of lanes; numba and their modules are imported when a loop is compiled.

Long tables are read by address in compiled scalar functions. An array that is alive across branches costs numba atomic
reference counts. The address of one of its rows is a plain number and is passed as a float: addresses have 48 bits,
floats 53. `row_address` and `number_at` work alike in compiled code and in plain Python. The caller keeps the array
alive; in a run the stepper holds the table.
"""

from __future__ import annotations

import ctypes
import os
from typing import Any

import numpy as np
from llvmlite import binding

from hvisph.compiler.lazy_import import LazyFunction


def _has_wide_vectors() -> bool:
    """Whether the processor that numba compiles for has AVX-512."""
    features = os.environ.get("NUMBA_CPU_FEATURES")
    if features is not None:
        return "+avx512f" in features
    return bool(binding.get_host_cpu_features().get("avx512f", False))


EIGHT, SIXTEEN = 8, 16  # candidates that the first and the second neighbour filter test at once, on every machine
LANES = 8 if _has_wide_vectors() else 4
SINGLES = 2 * LANES  # float32 numbers in a vector
# Whether lists hold numbers of particles or indices of candidates: only AVX-512 has an instruction for the former.
NUMBERED = LANES == EIGHT


def _from(module: str, *names: str) -> Any:
    return (LazyFunction(module, name) for name in names)


broadcast_lanes, broadcast_strict = _from("vector.lanes", "broadcast_lanes", "broadcast_strict")
(broadcast_singles,) = _from("vector.lanes", "broadcast_singles")
any_positive, elementwise_max = _from("vector.lanes", "any_positive", "elementwise_max")
lane_max, lane_sum = _from("vector.lanes", "lane_max", "lane_sum")
select, first_lanes, extract_lane = _from("vector.lane_masks", "select", "first_lanes", "extract_lane")
add_rounded, neighbours = _from("vector.intrinsics", "add_rounded", "neighbours")
restore_mode, flush_tiny = _from("vector.intrinsics", "restore_mode", "flush_tiny")
append_near_box, mark_near = _from("vector.neighbour_filter", "append_near_box", "mark_near")
(append_marked,) = _from("vector.neighbour_filter", "append_marked")
load_lanes, put_lanes = _from("vector.memory_access", "load_lanes", "put_lanes")
load_row_lanes, put_row_lanes = _from("vector.memory_access", "load_row_lanes", "put_row_lanes")
gather, fetch = _from("vector.memory_access", "gather", "fetch")
thread_count, atomic_max, atomic_min = _from("thread_primitives", "thread_count", "atomic_max", "atomic_min")
make_counters, increment_counter = _from("thread_primitives", "make_counters", "increment_counter")
COUNTERS = 64  # number of counters of `make_counters`


def row_address(table: np.ndarray, m: int) -> float:
    """Return the address of row `m` of `table`, a float64 array of shape (rows, columns) in C order."""
    return float(table.ctypes.data + int(m) * table.strides[0])


def number_at(address: float, k: int) -> float:
    """Return the float64 number with index `k` behind `address`."""
    return ctypes.c_double.from_address(int(address) + 8 * k).value
