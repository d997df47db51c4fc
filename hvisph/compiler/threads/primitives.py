"""Machine code by which threads share a loop: how many there are, what they count up, the least and largest of all."""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from hvisph.compiler.vector.api import COUNTERS

_i64 = ir.IntType(64)
LINE = 8  # numbers in a line of the cache: each counter has one of its own


@intrinsic
def crew(typing_context):
    """Return how many threads share a loop; numba's own function for it is bound by address, which no cache keeps."""

    def generate(context, builder, signature, arguments):
        kind = ir.FunctionType(_i64, [])
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, "get_num_threads"), [])

    return types.uint64(), generate


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


@intrinsic
def keep_least(typing_context, values, k, value):
    """Make values[k] the least of itself and `value`, at once for all threads: uint32, `k` uint64."""
    return _kept("umin", values)


@intrinsic
def keep_largest(typing_context, values, k, value):
    """Make values[k] the largest of itself and `value`, at once for all threads: uint32, `k` uint64."""
    return _kept("umax", values)


def _kept(which, values):
    def generate(context, builder, signature, arguments):
        values, k, value = arguments
        view = context.make_array(signature.args[0])(context, builder, values)
        builder.atomic_rmw(which, cgutils.gep(builder, view.data, k), value, "monotonic")
        return context.get_dummy_value()

    return types.void(values, types.uint64, types.uint32), generate
