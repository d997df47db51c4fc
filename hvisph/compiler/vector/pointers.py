"""Intrinsics on addresses: numbers of tables read by address, and prefetch of a cache line."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.base import BaseContext
from numba.extending import intrinsic, overload

from .table_access import number_at, row_address

_i8, _i32, _i64, _f64 = ir.IntType(8), ir.IntType(32), ir.IntType(64), ir.DoubleType()


@intrinsic
def _address(typing_context, table, m):
    """Return the address of row `m` of a two-dimensional float64 array, as a float."""

    def generate(context: BaseContext, builder: ir.IRBuilder, signature: Any, arguments: Any) -> ir.Value:
        view = context.make_array(signature.args[0])(context, builder, arguments[0])
        stride = cgutils.unpack_tuple(builder, view.strides, 2)[0]
        start = builder.ptrtoint(view.data, stride.type)
        return builder.sitofp(builder.add(start, builder.mul(arguments[1], stride)), _f64)

    return types.float64(table, types.uint64), generate


@intrinsic
def _load(typing_context, address, k):
    """Return the float64 number `k` behind `address`."""

    def generate(context: BaseContext, builder: ir.IRBuilder, signature: Any, arguments: Any) -> ir.Value:
        pointer = builder.inttoptr(builder.fptosi(arguments[0], _i64), _f64.as_pointer())
        return builder.load(builder.gep(pointer, [arguments[1]]))

    return types.float64(types.float64, types.int64), generate


@overload(row_address, jit_options={"forceinline": True})
def _row_address(table, m):
    return lambda table, m: _address(table, m)


@overload(number_at, jit_options={"forceinline": True})
def _number_at(address, k):
    return lambda address, k: _load(address, k)


@intrinsic
def fetch(typing_context, array, i, slot):
    """Prefetch the cache line of array[i, slot], or of array[i + slot]; both are uint64."""
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
