"""Gathered rows: several rows of an array as strict lanes.

`gather(array, near, k)` stands for the rows near[k], near[k+1] ... of an array. It is read and written by row and slot
as the array is, `rows[i, SLOT]`, with one lane per row; the row index has no meaning. A function that loads, computes
and stores one particle thus does so for LANES of them.
"""

from __future__ import annotations

import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.base import BaseContext
from numba.core.typing.templates import AbstractTemplate, signature
from numba.extending import intrinsic, models, register_model

from hvisph.compiler.codegen import infer_global, lower_builtin

from .api import LANES
from .lanes import VECTOR, Lanes, splat, strict

_i8, _i32, _i64 = ir.IntType(8), ir.IntType(32), ir.IntType(64)


class Many(types.Type):
    """Type of gathered rows of an array of floats or of unsigned integers, which are read as floats."""

    def __init__(self, array: types.Array) -> None:
        super().__init__(f"many({array})")
        self.array = array


@register_model(Many)
class _ManyModel(models.StructModel):
    def __init__(self, manager: Any, kind: types.Type) -> None:
        members = [("data", types.CPointer(kind.array.dtype)), *((f"row{lane}", types.intp) for lane in range(LANES))]
        super().__init__(manager, kind, members)


@intrinsic
def gather(typing_context, array, near, k):
    """Return the rows near[k], near[k+1] ... of `array`, one- or two-dimensional; `near` is of uint32, `k` uint64."""
    if not isinstance(array, types.Array) or array.ndim > 2:
        return None

    def generate(context, builder, sig, arguments):
        rows, near, k = arguments
        view = context.make_array(sig.args[0])(context, builder, rows)
        numbers = context.make_array(sig.args[1])(context, builder, near)
        first = builder.bitcast(cgutils.gep(builder, numbers.data, k), ir.VectorType(_i32, LANES).as_pointer())
        listed = builder.load(first, align=4)
        stride = cgutils.unpack_tuple(builder, view.strides, sig.args[0].ndim)[0]
        made = cgutils.create_struct_proxy(sig.return_type)(context, builder)
        made.data = view.data
        for lane in range(LANES):
            number = builder.zext(builder.extract_element(listed, ir.Constant(_i32, lane)), _i64)
            setattr(made, f"row{lane}", builder.mul(number, stride))
        return made._getvalue()

    return Many(array)(array, near, types.uint64), generate


def _places(context: BaseContext, builder: ir.IRBuilder, kind: Many, value: ir.Value, slot: ir.Value) -> list[ir.Value]:
    """Return the pointers to `slot` of each row."""
    rows = cgutils.create_struct_proxy(kind)(context, builder, value=value)
    size = context.get_abi_sizeof(context.get_data_type(kind.array.dtype))
    offset = builder.mul(slot, ir.Constant(_i64, size))
    base = builder.bitcast(rows.data, _i8.as_pointer())
    places = (builder.gep(base, [builder.add(getattr(rows, f"row{lane}"), offset)]) for lane in range(LANES))
    return [builder.bitcast(place, rows.data.type) for place in places]


def load(context: BaseContext, builder: ir.IRBuilder, kind: Many, value: ir.Value, slot: ir.Value) -> ir.Value:
    """Return `slot` of each row as a vector."""
    made = ir.Constant(VECTOR, ir.Undefined)
    for lane, place in enumerate(_places(context, builder, kind, value, slot)):
        number = builder.load(place)
        if isinstance(kind.array.dtype, types.Integer):
            number = builder.uitofp(number, ir.DoubleType())
        made = builder.insert_element(made, number, ir.Constant(_i32, lane))
    return made


def store(
    context: BaseContext, builder: ir.IRBuilder, kind: Many, value: ir.Value, slot: ir.Value, lanes: ir.Value
) -> None:
    """Write a vector to `slot` of each row."""
    for lane, place in enumerate(_places(context, builder, kind, value, slot)):
        builder.store(builder.extract_element(lanes, ir.Constant(_i32, lane)), place)


def _slot(builder: ir.IRBuilder, index: ir.Value, value: ir.Value) -> ir.Value:
    """Return the slot of an index, 0 if rows are single numbers."""
    if not isinstance(index, types.BaseTuple):
        return ir.Constant(_i64, 0)
    slot = builder.extract_value(value, 1)
    return slot if slot.type == _i64 else builder.zext(slot, _i64)


@infer_global(operator.getitem)
class _Get(AbstractTemplate):
    def generic(self, arguments, keywords):
        rows, index = arguments
        return signature(strict, rows, index) if isinstance(rows, Many) else None


@infer_global(operator.setitem)
class _Set(AbstractTemplate):
    def generic(self, arguments, keywords):
        rows, index, value = arguments
        if not isinstance(rows, Many) or isinstance(rows.array.dtype, types.Integer):
            return None
        return signature(types.none, rows, index, value if isinstance(value, Lanes) else types.float64)


@lower_builtin(operator.getitem, Many, types.Any)
def _lower_get(context, builder, sig, arguments):
    rows, index = arguments
    return load(context, builder, sig.args[0], rows, _slot(builder, sig.args[1], index))


@lower_builtin(operator.setitem, Many, types.Any, types.Any)
def _lower_set(context, builder, sig, arguments):
    rows, index, value = arguments
    wide = value if isinstance(sig.args[2], Lanes) else splat(builder, value)
    store(context, builder, sig.args[0], rows, _slot(builder, sig.args[1], index), wide)
    return context.get_dummy_value()
