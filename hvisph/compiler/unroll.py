"""Compilation of component functions: executed with symbolic arguments, they record types or emit instructions."""

from __future__ import annotations

from collections.abc import Iterable

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.base import BaseContext
from numba.core.typing.templates import AbstractTemplate, signature

from hvisph.compiler.vector.lanes import Lanes, lanes, reduce_lanes, singles, strict, widen
from hvisph.compiler.vector.memory_access import Many, load, store

from .codegen import infer_global, lower_builtin
from .lazy_import import PythonFunction


class _Number:
    """A symbolic number: arithmetic with it records types or emits instructions."""

    def _with(self, name: str, a: Operand, b: Operand) -> _Number:
        raise NotImplementedError

    def spread(self) -> _Number:
        """Return lanes that all hold the number."""
        return self._spread(lanes)

    def spread_singles(self) -> _Number:
        """Return the same in single precision."""
        return self._spread(singles)

    def _spread(self, kind: Lanes) -> _Number:
        raise NotImplementedError

    def __add__(self, other):
        return self._with("fadd", self, other)

    def __radd__(self, other):
        return self._with("fadd", other, self)

    def __sub__(self, other):
        return self._with("fsub", self, other)

    def __rsub__(self, other):
        return self._with("fsub", other, self)

    def __mul__(self, other):
        return self._with("fmul", self, other)

    def __rmul__(self, other):
        return self._with("fmul", other, self)

    def __truediv__(self, other):
        return self._with("fdiv", self, other)

    def __rtruediv__(self, other):
        return self._with("fdiv", other, self)

    def __neg__(self):
        return self._with("fmul", -1.0, self)


Operand = _Number | float


class _Kind(_Number):
    """A symbolic number of type `kind`, lanes or a float, without a value."""

    def __init__(self, kind: types.Type) -> None:
        self.kind = kind

    def _with(self, name: str, a: Operand, b: Operand) -> _Kind:
        return _Kind(_common((a, b)))

    def total(self) -> _Kind:
        return _Kind(types.float64)

    def _spread(self, kind: Lanes) -> _Kind:
        return _Kind(kind)

    def subtract_exactly(self, other: _Number, rest: _Number, other_rest: _Number) -> _Kind:
        return _Kind(_common((self, other)))


def _common(numbers: Iterable[object]) -> types.Type:
    """Return the type that holds all of `numbers`: lanes where one of them is."""
    kinds = (getattr(n, "kind", None) for n in numbers)
    return next((kind for kind in kinds if isinstance(kind, Lanes)), types.float64)


class _Value(_Number):
    """A number of the function under compilation."""

    def __init__(self, builder: ir.IRBuilder, value: ir.Value, kind: types.Type) -> None:
        self.builder, self.value, self.kind = builder, value, kind

    def _with(self, name: str, a: Operand, b: Operand) -> _Value:
        builder, kind = self.builder, _common((a, b))
        values = [_emitted(builder, n) for n in (a, b)]
        if isinstance(kind, Lanes):
            values = [widen(builder, n, kind.vector) for n in values]
        return _Value(builder, getattr(builder, name)(*values, flags=getattr(kind, "flags", ())), kind)

    def total(self) -> _Value:
        return _Value(self.builder, reduce_lanes(self.builder, "fadd", self.value, 0.0), types.float64)

    def _spread(self, kind: Lanes) -> _Value:
        return _Value(self.builder, widen(self.builder, self.value, kind.vector), kind)

    def subtract_exactly(self, other: _Value, rest: _Value, other_rest: _Value) -> _Value:
        """Return self - other of numbers that have a `rest` each: not to be reordered."""
        builder, kind = self.builder, _common((self, other))
        a, b, p, q = (widen(builder, n.value, kind.vector) for n in (self, other, rest, other_rest))
        return _Value(builder, builder.fadd(builder.fsub(a, b), builder.fsub(p, q)), kind)


def _emitted(builder: ir.IRBuilder, number: Operand) -> ir.Value:
    if isinstance(number, _Value):
        return number.value
    assert not isinstance(number, _Number)
    return ir.Constant(ir.DoubleType(), float(number))


class _KindOfRows:
    """A symbolic array of floats, or several of its rows, without values."""

    def __init__(self, kind: types.Type) -> None:
        self.kind = kind

    def __getitem__(self, place):
        return _Kind(self.kind)

    def __setitem__(self, place, number):
        pass


class _Rows:
    """An array of the function under compilation."""

    def __init__(self, context: BaseContext, builder: ir.IRBuilder, kind: types.Type, value: ir.Value) -> None:
        self.context, self.builder, self.kind = context, builder, kind
        self.array = context.make_array(kind)(context, builder, value)

    def _address(self, place: tuple[Operand, ...]) -> ir.Value:
        builder, count = self.builder, self.kind.ndim
        shape, strides = (cgutils.unpack_tuple(builder, t, count) for t in (self.array.shape, self.array.strides))
        index = [n.value if isinstance(n, _Value) else ir.Constant(ir.IntType(64), n) for n in place]
        return cgutils.get_item_pointer2(
            self.context, builder, self.array.data, shape, strides, self.kind.layout, index
        )

    def __getitem__(self, place):
        value = self.builder.load(self._address(place))
        if value.type == ir.FloatType():
            value = self.builder.fpext(value, ir.DoubleType())
        return _Value(self.builder, value, types.float64)

    def __setitem__(self, place, number):
        value, address = _emitted(self.builder, number), self._address(place)
        if address.type.pointee == ir.FloatType():
            value = self.builder.fptrunc(value, ir.FloatType())
        self.builder.store(value, address)


class _ManyRows:
    """Several rows of an array at once; the number of a single row has no meaning."""

    def __init__(self, context: BaseContext, builder: ir.IRBuilder, kind: types.Type, value: ir.Value) -> None:
        self.context, self.builder, self.kind, self.value = context, builder, kind, value

    def __getitem__(self, place):
        slot = ir.Constant(ir.IntType(64), place[1])
        return _Value(self.builder, load(self.context, self.builder, self.kind, self.value, slot), strict)

    def __setitem__(self, place, number):
        slot, value = ir.Constant(ir.IntType(64), place[1]), _emitted(self.builder, number)
        store(self.context, self.builder, self.kind, self.value, slot, widen(self.builder, value, strict.vector))


def _stand_in(kind: types.Type) -> object:
    """Return the symbolic argument of type `kind` for type inference."""
    if isinstance(kind, types.Literal):
        return kind.literal_value
    if isinstance(kind, types.BaseTuple):
        return tuple(_stand_in(part) for part in kind)
    if isinstance(kind, (types.Array, Many)):
        return _KindOfRows(strict if isinstance(kind, Many) else types.float64)
    return _Kind(kind)


def _argument(context: BaseContext, builder: ir.IRBuilder, kind: types.Type, value: ir.Value) -> object:
    """Return the symbolic argument for a value of type `kind`."""
    if isinstance(kind, types.Literal):
        return kind.literal_value
    if isinstance(kind, types.BaseTuple):
        parts = cgutils.unpack_tuple(builder, value, len(kind))
        return tuple(_argument(context, builder, k, v) for k, v in zip(kind, parts, strict=True))
    rows = {types.Array: _Rows, Many: _ManyRows}.get(type(kind))
    return rows(context, builder, kind, value) if rows else _Value(builder, value, kind)


def _passed(kind: types.Type) -> types.Type:
    """Return the type to which an argument of type `kind` is converted; plain integers are indices."""
    if isinstance(kind, types.Literal) or not isinstance(kind, types.Integer):
        return types.float64 if isinstance(kind, types.Float) else kind
    return types.uint64


def register_operation(write: PythonFunction) -> None:
    """Let compiled functions call an operation, see `compiler.lazy_import`."""

    class Operation(AbstractTemplate):
        key, prefer_literal = write, True

        def generic(self, arguments, keywords):
            try:
                result = write(*map(_stand_in, arguments))
            except (TypeError, IndexError, KeyError, ValueError, AttributeError):
                return None  # no such operation on these
            kinds = map(_passed, arguments)
            if result is None:
                return signature(types.none, *kinds)
            if isinstance(result, tuple):
                return signature(types.UniTuple(_common(result), len(result)), *kinds)
            return signature(_common((result,)), *kinds)

    def generate(context, builder, sig, values):
        result = write(*(_argument(context, builder, k, v) for k, v in zip(sig.args, values, strict=True)))
        if result is None:
            return context.get_dummy_value()
        kind = sig.return_type
        parts = [_emitted(builder, part) for part in (result if isinstance(result, tuple) else (result,))]
        element = getattr(kind, "dtype", kind)
        if isinstance(element, Lanes):
            parts = [widen(builder, part, element.vector) for part in parts]
        return context.make_tuple(builder, kind, parts) if isinstance(result, tuple) else parts[0]

    infer_global(write, types.Function(Operation))
    lower_builtin(write, types.VarArg(types.Any))(generate)
