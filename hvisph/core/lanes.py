"""Eight numbers at once: a number type of compiled loops, with the arithmetic of floats.

A pair law is written for one neighbour and runs over eight. All operations are element by element;
a plain float beside a vector counts for all of its lanes. They are LLVM's target-independent vectors:
one register on AVX-512, two on AVX2, with the same results.
"""

from __future__ import annotations

import operator
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import ConcreteTemplate, signature
from numba.extending import intrinsic, lower_builtin, lower_cast, models, register_model, typeof_impl
from numba.core.typing.templates import infer_global

LANES = 8
FAST = ("reassoc", "contract", "arcp", "nsz", "afn")
_f64, _i32 = ir.DoubleType(), ir.IntType(32)
VECTOR = ir.VectorType(_f64, LANES)


class Lanes(types.Type):
    """Type of eight float64."""

    def __init__(self) -> None:
        super().__init__("lanes")

    def can_convert_from(self, typing_context, other):
        """Take a float for eight equal ones."""
        if isinstance(other, (types.Float, types.Integer)):
            return typing_context.can_convert(other, types.float64) and 4 or None
        return None


lanes = Lanes()


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, VECTOR)


def splat(builder: Any, value: Any) -> Any:
    """Return a vector with `value` in all lanes."""
    vector = ir.VectorType(value.type, LANES)
    single = builder.insert_element(ir.Constant(vector, ir.Undefined), value, ir.Constant(_i32, 0))
    zeros = ir.Constant(ir.VectorType(_i32, LANES), [0] * LANES)
    return builder.shuffle_vector(single, ir.Constant(vector, ir.Undefined), zeros)


def _call(name: str):
    def generate(builder, *arguments):
        kind = ir.FunctionType(VECTOR, [VECTOR] * len(arguments))
        function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{LANES}f64")
        return builder.call(function, arguments, fastmath=FAST)

    return generate


def _larger(comparison: str):
    def generate(builder, a, b):
        return builder.select(builder.fcmp_ordered(comparison, a, b, flags=FAST), a, b)

    return generate


def _define(functions: tuple[Any, ...], count: int, generate: Any) -> None:
    if count == 1:
        cases = [(lanes,)]
    else:
        cases = [(lanes, lanes), (lanes, types.float64), (types.float64, lanes)]
    for function in functions:
        template = type("_Template", (ConcreteTemplate,), {"key": function, "cases": [signature(lanes, *c) for c in cases]})
        infer_global(function)(template)
        for case in cases:

            def lower(context, builder, sig, arguments):
                vectors = [
                    a if kind == lanes else splat(builder, a) for a, kind in zip(arguments, sig.args, strict=True)
                ]
                return generate(builder, *vectors)

            lower_builtin(function, *case)(lower)


_define((operator.add, operator.iadd), 2, lambda builder, a, b: builder.fadd(a, b, flags=FAST))
_define((operator.sub, operator.isub), 2, lambda builder, a, b: builder.fsub(a, b, flags=FAST))
_define((operator.mul, operator.imul), 2, lambda builder, a, b: builder.fmul(a, b, flags=FAST))
_define((operator.truediv, operator.itruediv), 2, lambda builder, a, b: builder.fdiv(a, b, flags=FAST))
_define((operator.neg,), 1, lambda builder, a: builder.fneg(a, flags=FAST))
_define((min,), 2, _larger("<"))
_define((max,), 2, _larger(">"))
_define((abs,), 1, _call("fabs"))
_define((np.sqrt,), 1, _call("sqrt"))
_define((np.copysign,), 2, _call("copysign"))


@lower_cast(types.Float, Lanes)
@lower_cast(types.Integer, Lanes)
def _from_float(context, builder, kind, target, value):
    return splat(builder, context.cast(builder, value, kind, types.float64))


@intrinsic
def all_lanes(typing_context, value):
    """Return a vector with `value` in all lanes."""

    def generate(context, builder, sig, arguments):
        return splat(builder, arguments[0])

    return lanes(types.float64), generate


@intrinsic
def larger_lanes(typing_context, a, b):
    """Return the larger, NaN where either is."""

    def generate(context, builder, sig, arguments):
        return _call("maximum")(builder, *arguments)

    return lanes(lanes, lanes), generate


def _reduction(name: str, start: float | None):
    def declare(typing_context, value):
        def generate(context, builder, sig, arguments):
            kinds = [VECTOR] if start is None else [_f64, VECTOR]
            kind = ir.FunctionType(_f64, kinds)
            function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.vector.reduce.{name}.v{LANES}f64")
            first = [] if start is None else [ir.Constant(_f64, start)]
            return builder.call(function, [*first, *arguments], fastmath=FAST)

        return types.float64(lanes), generate

    return intrinsic(declare)


total = _reduction("fadd", 0.0)
largest = _reduction("fmaximum", None)
