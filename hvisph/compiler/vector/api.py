"""What passes over many numbers at once name: how many lanes there are, and the functions over them.

Each is written in the module that it is taken from here; see `compiler.lazy_import`.
"""

from __future__ import annotations

import os
from typing import Any

from llvmlite import binding

from hvisph.compiler.lazy_import import Later


def _has_wide_vectors() -> bool:
    """Whether the processor that numba compiles for has AVX-512."""
    chosen = os.environ.get("NUMBA_CPU_FEATURES")
    if chosen is not None:
        return "+avx512f" in chosen
    return bool(binding.get_host_cpu_features().get("avx512f", False))


EIGHT = 8  # candidates that the first filter takes at once, on every machine
SIXTEEN = 16  # and the second
LANES = 8 if _has_wide_vectors() else 4
# Whether lists hold numbers of particles, or places among the candidates: without AVX-512 nothing compresses a vector.
NUMBERED = LANES == EIGHT


def _from(module: str, *names: str) -> Any:
    return (Later(module, name) for name in names)


all_lanes, all_strict, anywhere = _from("vector.lanes", "all_lanes", "all_strict", "anywhere")
larger_lanes, largest, total = _from("vector.lanes", "larger_lanes", "largest", "total")
chosen, first_lanes, lane = _from("vector.lane_masks", "chosen", "first_lanes", "lane")
add_rounded, neighbours = _from("vector.intrinsics", "add_rounded", "neighbours")
as_before, flush_tiny = _from("vector.intrinsics", "as_before", "flush_tiny")
append_near, append_near_box = _from("vector.neighbour_filter", "append_near", "append_near_box")
lanes_at, put_lanes = _from("vector.contiguous_load", "lanes_at", "put_lanes")
row_lanes, put_row_lanes = _from("vector.contiguous_load", "row_lanes", "put_row_lanes")
(many,) = _from("vector.gather", "many")
(fetch,) = _from("vector.pointers", "fetch")
count_up, crew, fresh_counters = _from("threads.primitives", "count_up", "crew", "fresh_counters")
keep_largest, keep_least = _from("threads.primitives", "keep_largest", "keep_least")
COUNTERS = 64  # that `fresh_counters` makes
