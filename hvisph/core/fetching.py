"""Rows asked for before they are needed: the processor fetches them from memory while it computes.

It foresees what is read in sequence by itself, but not which rows a list of numbers names. Nothing waits for what is
asked for, and nothing hangs on it but time.
"""

from __future__ import annotations

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from .jit import compiled

_i8, _i32 = ir.IntType(8), ir.IntType(32)
LINE = 8  # floats in a cache line


@intrinsic
def fetch(typing_context, array, i, slot):
    """Ask for the cache line of array[i, slot], or of array[i + slot]; both are uint64."""
    if not isinstance(array, types.Array) or array.ndim > 2:
        return None

    def generate(context, builder, sig, arguments):
        rows, i, slot = arguments
        view = context.make_array(sig.args[0])(context, builder, rows)
        row, *within = cgutils.unpack_tuple(builder, view.strides, sig.args[0].ndim)
        place = builder.add(builder.mul(i, row), builder.mul(slot, within[0] if within else row))
        byte = _i8.as_pointer()
        address = builder.gep(builder.bitcast(view.data, byte), [place])
        kind = ir.FunctionType(ir.VoidType(), [byte, _i32, _i32, _i32])
        function = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0i8")
        to_read, for_long, data = (ir.Constant(_i32, number) for number in (0, 3, 1))
        builder.call(function, [address, to_read, for_long, data])
        return context.get_dummy_value()

    return types.void(array, types.uint64, types.uint64), generate


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
