"""LANES consecutive numbers of an array as one vector: what pair data is stored and read with."""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from .lanes import VECTOR, lanes


@intrinsic
def lanes_at(typing_context, array, start):
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
