"""Long tables in compiled scalar functions: numbers read by address.

An array that is alive across branches costs numba atomic reference counts; the address of one of its
rows is a plain number, a float like those that it travels with: addresses have 48 bits, floats 53. Both
functions work alike in compiled code and in plain Python. Whoever hands an address on keeps the array alive:
in a run the stepper holds the table.
"""

from __future__ import annotations

import ctypes
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, overload

_f64, _i64 = ir.DoubleType(), ir.IntType(64)


@intrinsic
def _address(typing_context, table, m):
    """Return the address of row `m` of a two-dimensional float64 array, as a float."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        view = context.make_array(signature.args[0])(context, builder, arguments[0])
        stride = cgutils.unpack_tuple(builder, view.strides, 2)[0]
        start = builder.ptrtoint(view.data, stride.type)
        return builder.sitofp(builder.add(start, builder.mul(arguments[1], stride)), _f64)

    return types.float64(table, types.uint64), generate


@intrinsic
def _load(typing_context, address, k):
    """Return the float64 number `k` behind `address`."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        pointer = builder.inttoptr(builder.fptosi(arguments[0], _i64), _f64.as_pointer())
        return builder.load(builder.gep(pointer, [arguments[1]]))

    return types.float64(types.float64, types.int64), generate


def row_address(table: Any, m: Any) -> float:
    """Return the address of row `m` of `table`, a float64 array of shape (rows, columns) in C order."""
    return float(table.ctypes.data + int(m) * table.strides[0])


def number_at(address: float, k: int) -> float:
    """Return the float64 number `k` places behind `address`."""
    return ctypes.c_double.from_address(int(address) + 8 * k).value


@overload(row_address, jit_options={"forceinline": True})
def _row_address(table, m):
    return lambda table, m: _address(table, m)


@overload(number_at, jit_options={"forceinline": True})
def _number_at(address, k):
    return lambda address, k: _load(address, k)
