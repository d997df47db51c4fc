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


all_lanes, all_strict, anywhere = _from("lanes", "all_lanes", "all_strict", "anywhere")
larger_lanes, largest, total = _from("lanes", "larger_lanes", "largest", "total")
chosen, first_lanes, lane = _from("masks", "chosen", "first_lanes", "lane")
add_rounded, neighbours = _from("simd", "add_rounded", "neighbours")
as_before, flush_tiny = _from("simd", "as_before", "flush_tiny")
append_near, append_near_box = _from("nearby", "append_near", "append_near_box")
lanes_at, put_lanes = _from("blocks", "lanes_at", "put_lanes")
row_lanes, put_row_lanes = _from("blocks", "row_lanes", "put_row_lanes")
(many,) = _from("many", "many")
(fetch,) = _from("addresses", "fetch")
count_up, crew, fresh_counters = _from("sharing", "count_up", "crew", "fresh_counters")
keep_largest, keep_least = _from("sharing", "keep_largest", "keep_least")
COUNTERS = 64  # that `fresh_counters` makes
