"""Machine code by which threads share a loop: how many there are, and places that they count up."""

from __future__ import annotations

from llvmlite import ir
from numba import get_num_threads, types
from numba.core import cgutils
from numba.extending import intrinsic

from .vectors import COUNTERS

__all__ = ["count_up", "crew", "fresh_counters"]

crew = get_num_threads

_i64 = ir.IntType(64)
LINE = 8  # numbers in a line of the cache: each counter has one of its own


@intrinsic
def fresh_counters(typing_context):
    """Return the address of COUNTERS zeros, which stay as long as the calling function runs."""

    def generate(context, builder, signature, arguments):
        room = cgutils.alloca_once(builder, _i64, size=ir.Constant(ir.IntType(32), COUNTERS * LINE))
        cgutils.memset(builder, room, ir.Constant(_i64, 8 * COUNTERS * LINE), 0)
        return builder.ptrtoint(room, _i64)

    return types.uint64(), generate


@intrinsic
def count_up(typing_context, counters, which):
    """Return the value of a counter and raise it by one, at once for all threads; both arguments are uint64."""

    def generate(context, builder, signature, arguments):
        counters, which = arguments
        room = builder.inttoptr(counters, _i64.as_pointer())
        place = builder.gep(room, [builder.mul(which, ir.Constant(_i64, LINE))])
        return builder.atomic_rmw("add", place, ir.Constant(_i64, 1), "monotonic")

    return types.uint64(types.uint64, types.uint64), generate
