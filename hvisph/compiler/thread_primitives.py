"""Primitives of parallel loops: number of threads, shared counters, atomic minimum and maximum."""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from hvisph.compiler.vector.api import COUNTERS

_i64 = ir.IntType(64)
LINE = 8  # numbers in a cache line: each counter has one of its own


@intrinsic
def thread_count(typing_context):
    """Return the number of threads; numba's function is bound by its address, which prevents caching."""

    def generate(context, builder, signature, arguments):
        kind = ir.FunctionType(_i64, [])
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, "get_num_threads"), [])

    return types.uint64(), generate


@intrinsic
def make_counters(typing_context):
    """Return the address of COUNTERS zeros, which is valid until the calling function returns."""

    def generate(context, builder, signature, arguments):
        counters = cgutils.alloca_once(builder, _i64, size=ir.Constant(ir.IntType(32), COUNTERS * LINE))
        cgutils.memset(builder, counters, ir.Constant(_i64, 8 * COUNTERS * LINE), 0)
        return builder.ptrtoint(counters, _i64)

    return types.uint64(), generate


@intrinsic
def increment_counter(typing_context, counters, number):
    """Return the value of a counter and increment it atomically; both arguments are uint64."""

    def generate(context, builder, signature, arguments):
        counters, number = arguments
        first = builder.inttoptr(counters, _i64.as_pointer())
        place = builder.gep(first, [builder.mul(number, ir.Constant(_i64, LINE))])
        return builder.atomic_rmw("add", place, ir.Constant(_i64, 1), "monotonic")

    return types.uint64(types.uint64, types.uint64), generate


@intrinsic
def atomic_min(typing_context, values, k, value):
    """Set values[k] to the smaller of itself and `value` atomically: uint32, `k` uint64."""
    return _atomic("umin", values)


@intrinsic
def atomic_max(typing_context, values, k, value):
    """Set values[k] to the larger of itself and `value` atomically: uint32, `k` uint64."""
    return _atomic("umax", values)


def _atomic(operation, values):
    def generate(context, builder, signature, arguments):
        values, k, value = arguments
        view = context.make_array(signature.args[0])(context, builder, values)
        builder.atomic_rmw(operation, cgutils.gep(builder, view.data, k), value, "monotonic")
        return context.get_dummy_value()

    return types.void(values, types.uint64, types.uint32), generate
