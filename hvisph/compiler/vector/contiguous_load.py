"""Contiguous loads and stores: LANES consecutive numbers of an array as one vector, or several vectors of a row."""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from .api import LANES
from .intrinsics import _address
from .lanes import VECTOR, lanes

_i64 = ir.IntType(64)


@intrinsic
def load_lanes(typing_context, array, start):
    """Return array[start] to array[start + LANES - 1] of a contiguous array of floats; `start` is uint64."""

    def generate(context, builder, signature, arguments):
        values, first = arguments
        view = context.make_array(signature.args[0])(context, builder, values)
        pointer = cgutils.gep(builder, view.data, first)
        return builder.load(builder.bitcast(pointer, ir.PointerType(VECTOR)), align=8)

    return lanes(array, types.uint64), generate


@intrinsic
def put_lanes(typing_context, array, start, value):
    """Write `value` to array[start] to array[start + LANES - 1] of a contiguous array of floats; `start`: uint64."""

    def generate(context, builder, signature, arguments):
        values, first, value = arguments
        view = context.make_array(signature.args[0])(context, builder, values)
        pointer = cgutils.gep(builder, view.data, first)
        builder.store(value, builder.bitcast(pointer, ir.PointerType(VECTOR)), align=8)
        return context.get_dummy_value()

    return types.void(array, types.uint64, lanes), generate


@intrinsic
def load_row_lanes(typing_context, rows, i, count):
    """Return the first numbers of row `i` as `count` vectors, a literal; `i` is uint64."""
    if not isinstance(count, types.Literal):
        return None
    made = types.UniTuple(lanes, count.literal_value)

    def generate(context, builder, signature, arguments):
        rows, i, _ = arguments
        firsts = [ir.Constant(_i64, k * LANES) for k in range(len(made))]
        places = [_address(context, builder, signature.args[0], rows, [i, first], VECTOR) for first in firsts]
        return context.make_tuple(builder, made, [builder.load(place, align=8) for place in places])

    return made(rows, i, count), generate


@intrinsic
def put_row_lanes(typing_context, rows, i, values):
    """Write a tuple of vectors side by side into row `i`, uint64, of a contiguous array."""

    def generate(context, builder, signature, arguments):
        rows, i, values = arguments
        for k, value in enumerate(cgutils.unpack_tuple(builder, values, len(signature.args[2]))):
            place = [i, ir.Constant(_i64, k * LANES)]
            builder.store(value, _address(context, builder, signature.args[0], rows, place, VECTOR), align=8)
        return context.get_dummy_value()

    return types.void(rows, types.uint64, values), generate
