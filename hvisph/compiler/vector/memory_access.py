"""Access to memory: rows gathered as strict lanes, contiguous loads and stores, tables by address, prefetch.

`gather(array, indices, k)` stands for the rows indices[k], indices[k+1] ... of an array. It is read and written by row
and slot as the array is, `rows[i, SLOT]`, with one lane per row; the row index has no meaning. A function that loads,
computes and stores one particle thus does so for LANES of them.
"""

from __future__ import annotations

import operator

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.base import BaseContext
from numba.core.typing.templates import AbstractTemplate, Signature, signature
from numba.extending import intrinsic, models, overload, register_model

from hvisph.compiler.codegen import infer_global, lower_builtin

from .api import LANES, number_at, row_address
from .intrinsics import _address
from .lanes import VECTOR, Lanes, lanes, splat, strict

_i8, _i32, _i64, _f64 = ir.IntType(8), ir.IntType(32), ir.IntType(64), ir.DoubleType()


class Many(types.Type):
    """Type of gathered rows of an array of floats or of unsigned integers, which are read as floats."""

    def __init__(self, array: types.Array) -> None:
        super().__init__(f"many({array})")
        self.array = array


@register_model(Many)
class _ManyModel(models.StructModel):
    def __init__(self, manager: object, kind: types.Type) -> None:
        members = [("data", types.CPointer(kind.array.dtype)), *((f"row{lane}", types.intp) for lane in range(LANES))]
        super().__init__(manager, kind, members)


@intrinsic
def gather(typing_context, array, indices, k):
    """Return rows indices[k], indices[k+1] ... of `array`, one- or two-dimensional; `indices`: uint32, `k`: uint64."""
    if not isinstance(array, types.Array) or array.ndim > 2:
        return None

    def generate(context, builder, sig, arguments):
        rows, indices, k = arguments
        view = context.make_array(sig.args[0])(context, builder, rows)
        numbers = context.make_array(sig.args[1])(context, builder, indices)
        first = builder.bitcast(cgutils.gep(builder, numbers.data, k), ir.VectorType(_i32, LANES).as_pointer())
        vector = builder.load(first, align=4)
        stride = cgutils.unpack_tuple(builder, view.strides, sig.args[0].ndim)[0]
        result = cgutils.create_struct_proxy(sig.return_type)(context, builder)
        result.data = view.data
        for lane in range(LANES):
            number = builder.zext(builder.extract_element(vector, ir.Constant(_i32, lane)), _i64)
            setattr(result, f"row{lane}", builder.mul(number, stride))
        return result._getvalue()

    return Many(array)(array, indices, types.uint64), generate


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
    result = ir.Constant(VECTOR, ir.Undefined)
    for lane, place in enumerate(_places(context, builder, kind, value, slot)):
        number = builder.load(place)
        if isinstance(kind.array.dtype, types.Integer):
            number = builder.uitofp(number, ir.DoubleType())
        result = builder.insert_element(result, number, ir.Constant(_i32, lane))
    return result


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
    vector = value if isinstance(sig.args[2], Lanes) else splat(builder, value)
    store(context, builder, sig.args[0], rows, _slot(builder, sig.args[1], index), vector)
    return context.get_dummy_value()


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
    kind = types.UniTuple(lanes, count.literal_value)

    def generate(context, builder, signature, arguments):
        rows, i, _ = arguments
        firsts = [ir.Constant(_i64, k * LANES) for k in range(len(kind))]
        places = [_address(context, builder, signature.args[0], rows, [i, first], VECTOR) for first in firsts]
        return context.make_tuple(builder, kind, [builder.load(place, align=8) for place in places])

    return kind(rows, i, count), generate


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


@intrinsic
def _row_pointer(typing_context, table, m):
    """Return the address of row `m` of a two-dimensional float64 array, as a float."""

    def generate(
        context: BaseContext, builder: ir.IRBuilder, signature: Signature, arguments: list[ir.Value]
    ) -> ir.Value:
        view = context.make_array(signature.args[0])(context, builder, arguments[0])
        stride = cgutils.unpack_tuple(builder, view.strides, 2)[0]
        start = builder.ptrtoint(view.data, stride.type)
        return builder.sitofp(builder.add(start, builder.mul(arguments[1], stride)), _f64)

    return types.float64(table, types.uint64), generate


@intrinsic
def _load(typing_context, address, k):
    """Return the float64 number `k` behind `address`."""

    def generate(
        context: BaseContext, builder: ir.IRBuilder, signature: Signature, arguments: list[ir.Value]
    ) -> ir.Value:
        pointer = builder.inttoptr(builder.fptosi(arguments[0], _i64), _f64.as_pointer())
        return builder.load(builder.gep(pointer, [arguments[1]]))

    return types.float64(types.float64, types.int64), generate


@overload(row_address, jit_options={"forceinline": True})
def _row_address(table, m):
    return lambda table, m: _row_pointer(table, m)


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
