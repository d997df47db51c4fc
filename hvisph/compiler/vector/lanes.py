"""Number types of several floats in compiled loops, with the arithmetic of floats.

A pair law is written for one neighbour and computes LANES of them: eight on processors with AVX-512, otherwise four.
All operations are element by element; a float beside a vector is used for all of its lanes.

There are three types. `lanes` are for sums over neighbours: the compiler may reorder, contract and approximate.
`singles` are the same in float32, twice as many; floats beside them are rounded, and reductions are made in double
precision. `strict` lanes round as single floats do, to the last bit, so that the state of a particle does not depend on
the particles that it is computed with; see `compiler.vector.lane_masks` for their comparisons.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typeconv import Conversion
from numba.core.typing.templates import ConcreteTemplate, signature
from numba.extending import intrinsic, models, register_model

from hvisph.compiler.codegen import infer_global, lower_builtin, lower_cast

from .api import LANES, SINGLES

# Emits instructions from a builder, flags and vectors.
Generator = Callable[..., ir.Value]
FAST = ("reassoc", "contract", "arcp", "nsz", "afn")
_f64, _f32, _i32 = ir.DoubleType(), ir.FloatType(), ir.IntType(32)
VECTOR, SINGLE = ir.VectorType(_f64, LANES), ir.VectorType(_f32, SINGLES)


class Lanes(types.Type):
    """Type of several floats, `vector` in LLVM, with the flags of their arithmetic."""

    def __init__(self, name: str, flags: tuple[str, ...], vector: ir.VectorType = VECTOR) -> None:
        super().__init__(name)
        self.flags, self.vector = flags, vector

    def can_convert_from(self, typing_context, other):
        """Convert a float to equal ones, where branches of a template give either."""
        return Conversion.unsafe if isinstance(other, types.Float) else None

    def unify(self, typing_context, other):
        """Return the type of a variable that is of this type or of another one."""
        return self if isinstance(other, types.Float) else None


lanes, singles, strict = Lanes("lanes", FAST), Lanes("single lanes", FAST, SINGLE), Lanes("strict lanes", ())


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: object, kind: Lanes) -> None:
        super().__init__(manager, kind, kind.vector)


def splat(builder: ir.IRBuilder, value: ir.Value, count: int = LANES) -> ir.Value:
    """Return a vector with `value` in all lanes."""
    vector = ir.VectorType(value.type, count)
    single = builder.insert_element(ir.Constant(vector, ir.Undefined), value, ir.Constant(_i32, 0))
    zeros = ir.Constant(ir.VectorType(_i32, count), [0] * count)
    return builder.shuffle_vector(single, ir.Constant(vector, ir.Undefined), zeros)


def widen(builder: ir.IRBuilder, value: ir.Value, vector: ir.VectorType) -> ir.Value:
    """Return a number, rounded where the elements of `vector` are float32, in all lanes; vectors as they are."""
    if isinstance(value.type, ir.VectorType):
        return value
    if value.type != vector.element:
        value = builder.fptrunc(value, vector.element)
    return splat(builder, value, vector.count)


def _suffix(vector: ir.VectorType) -> str:
    """Return LLVM's suffix of functions of `vector`."""
    return f"v{vector.count}{'f64' if vector.element == _f64 else 'f32'}"


def _call(name: str) -> Generator:
    """Return a generator of LLVM's function `name`."""

    def generate(builder, flags, *arguments):
        vector = arguments[0].type
        kind = ir.FunctionType(vector, [vector] * len(arguments))
        function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.{_suffix(vector)}")
        return builder.call(function, arguments, fastmath=flags)

    return generate


def _choose(comparison: str) -> Generator:
    """Return a generator that takes of two the one for which the comparison with the other holds.

    Of two that are equal or no numbers strict lanes take the first, as compiled code does of single numbers.
    """

    def generate(builder, flags, a, b):
        if flags:
            return builder.select(builder.fcmp_ordered(comparison, a, b, flags=flags), a, b)
        return builder.select(builder.fcmp_ordered(comparison, b, a), b, a)

    return generate


def _emit(name: str) -> Generator:
    """Return a generator of LLVM's instruction `name`."""
    return lambda builder, flags, *arguments: getattr(builder, name)(*arguments, flags=flags)


def _define(functions: tuple[Callable[..., object], ...], count: int, generate: Generator) -> None:
    """Define `functions` of `count` arguments for vectors by `generate(builder, flags, *vectors)`."""
    cases = []
    for kind in (lanes, singles, strict):
        mixed = [(kind, kind), (kind, types.float64), (types.float64, kind)]
        cases += [signature(kind, *case) for case in ([(kind,)] if count == 1 else mixed)]

    def lower(context, builder, sig, arguments):
        vectors = (widen(builder, a, sig.return_type.vector) for a in arguments)
        return generate(builder, sig.return_type.flags, *vectors)

    for function in functions:
        infer_global(function)(type("_Template", (ConcreteTemplate,), {"key": function, "cases": cases}))
        for case in cases:
            lower_builtin(function, *case.args)(lower)


_define((operator.add, operator.iadd), 2, _emit("fadd"))
_define((operator.sub, operator.isub), 2, _emit("fsub"))
_define((operator.mul, operator.imul), 2, _emit("fmul"))
_define((operator.truediv, operator.itruediv), 2, _emit("fdiv"))
_define((operator.neg,), 1, _emit("fneg"))
_define((min,), 2, _choose("<"))
_define((max,), 2, _choose(">"))
_define((abs,), 1, _call("fabs"))
_define((np.sqrt, math.sqrt), 1, _call("sqrt"))
_define((np.copysign,), 2, _call("copysign"))


@lower_cast(types.Float, Lanes)
def _from_float(context, builder, kind, target, value):
    return widen(builder, context.cast(builder, value, kind, types.float64), target.vector)


def _broadcast(kind: Lanes) -> Callable[[float], ir.Value]:
    """Return a compiled function from a number to lanes of type `kind` that all hold it."""

    def declare(typing_context, value):
        def generate(context, builder, sig, arguments):
            return widen(builder, arguments[0], kind.vector)

        return kind(types.float64), generate

    return intrinsic(declare)


broadcast_lanes, broadcast_singles, broadcast_strict = _broadcast(lanes), _broadcast(singles), _broadcast(strict)


@intrinsic
def elementwise_max(typing_context, a, b):
    """Return the larger of each two lanes, NaN where either is; `max` would lose it."""

    def generate(context, builder, sig, arguments):
        return _call("maximum")(builder, FAST, *(widen(builder, a, kind.vector) for a in arguments))

    kind = singles if singles in (a, b) else lanes
    return kind(*(kind if operand == kind else types.float64 for operand in (a, b))), generate


@intrinsic
def any_positive(typing_context, value):
    """Return whether any lane is above zero."""

    def generate(context, builder, sig, arguments):
        vector = arguments[0].type
        positive = builder.fcmp_ordered(">", arguments[0], ir.Constant(vector, [0.0] * vector.count))
        bits = builder.bitcast(positive, ir.IntType(vector.count))
        return builder.icmp_unsigned("!=", bits, ir.Constant(bits.type, 0))

    return types.boolean(value), generate


def reduce_lanes(builder: ir.IRBuilder, name: str, value: ir.Value, start: float | None = None) -> ir.Value:
    """Return LLVM's reduction `name` of a vector, in double precision."""
    if value.type == SINGLE:
        value = builder.fpext(value, ir.VectorType(_f64, SINGLES))
    kinds = [value.type] if start is None else [_f64, value.type]
    kind, symbol = ir.FunctionType(_f64, kinds), f"llvm.vector.reduce.{name}.{_suffix(value.type)}"
    function = cgutils.get_or_insert_function(builder.module, kind, symbol)
    starts = [] if start is None else [ir.Constant(_f64, start)]
    return builder.call(function, [*starts, value], fastmath=FAST)


def _reduction(name: str, start: float | None) -> Callable[[ir.Value], ir.Value]:
    """Return a compiled function from a vector to a number: LLVM's reduction `name`."""

    def declare(typing_context, value):
        def generate(context, builder, sig, arguments):
            return reduce_lanes(builder, name, arguments[0], start)

        return types.float64(value), generate

    return intrinsic(declare)


lane_sum = _reduction("fadd", 0.0)
lane_max = _reduction("fmaximum", None)
