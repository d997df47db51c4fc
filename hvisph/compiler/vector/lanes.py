"""Number types of several floats in compiled loops, with the arithmetic of floats.

A pair law is written for one neighbour and computes LANES of them: eight on processors with AVX-512, otherwise four.
All operations are element by element; a float beside a vector is used for all of its lanes.

There are two types. `lanes` are for sums over neighbours: the compiler may reorder, contract and approximate. `strict`
lanes round as single floats do, to the last bit, so that the state of a particle does not depend on the particles that
it is computed with; see `compiler.vector.lane_masks` for their comparisons.
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

from .api import LANES

# Emits instructions from a builder, flags and vectors.
Generator = Callable[..., ir.Value]
FAST = ("reassoc", "contract", "arcp", "nsz", "afn")
_f64, _i32 = ir.DoubleType(), ir.IntType(32)
VECTOR = ir.VectorType(_f64, LANES)


class Lanes(types.Type):
    """Type of LANES float64, with the flags of their arithmetic."""

    def __init__(self, name: str, flags: tuple[str, ...]) -> None:
        super().__init__(name)
        self.flags = flags

    def can_convert_from(self, typing_context, other):
        """Convert a float to LANES equal ones, where branches of a template give either."""
        return Conversion.unsafe if isinstance(other, types.Float) else None

    def unify(self, typing_context, other):
        """Return the type of a variable that is of this type or of another one."""
        return self if isinstance(other, types.Float) else None


lanes, strict = Lanes("lanes", FAST), Lanes("strict lanes", ())


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: object, kind: object) -> None:
        super().__init__(manager, kind, VECTOR)


def splat(builder: ir.IRBuilder, value: ir.Value, count: int = LANES) -> ir.Value:
    """Return a vector with `value` in all lanes."""
    vector = ir.VectorType(value.type, count)
    single = builder.insert_element(ir.Constant(vector, ir.Undefined), value, ir.Constant(_i32, 0))
    zeros = ir.Constant(ir.VectorType(_i32, count), [0] * count)
    return builder.shuffle_vector(single, ir.Constant(vector, ir.Undefined), zeros)


def _call(name: str) -> Generator:
    """Return a generator of LLVM's function `name`."""

    def generate(builder, flags, *arguments):
        kind = ir.FunctionType(VECTOR, [VECTOR] * len(arguments))
        function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{LANES}f64")
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
    for kind in (lanes, strict):
        mixed = [(kind, kind), (kind, types.float64), (types.float64, kind)]
        cases += [signature(kind, *case) for case in ([(kind,)] if count == 1 else mixed)]

    def lower(context, builder, sig, arguments):
        pairs = zip(arguments, sig.args, strict=True)
        wide = (a if isinstance(kind, Lanes) else splat(builder, a) for a, kind in pairs)
        return generate(builder, sig.return_type.flags, *wide)

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
    return splat(builder, context.cast(builder, value, kind, types.float64))


@intrinsic
def broadcast_lanes(typing_context, value):
    """Return a vector with `value` in all lanes."""

    def generate(context, builder, sig, arguments):
        return splat(builder, arguments[0])

    return lanes(types.float64), generate


@intrinsic
def broadcast_strict(typing_context, value):
    """Return strict lanes that all hold `value`."""

    def generate(context, builder, sig, arguments):
        return splat(builder, arguments[0])

    return strict(types.float64), generate


@intrinsic
def elementwise_max(typing_context, a, b):
    """Return the larger of each two lanes, NaN where either is; `max` would lose it."""

    def generate(context, builder, sig, arguments):
        return _call("maximum")(builder, FAST, *arguments)

    return lanes(lanes, lanes), generate


@intrinsic
def any_positive(typing_context, value):
    """Return whether any lane is above zero."""

    def generate(context, builder, sig, arguments):
        above = builder.fcmp_ordered(">", arguments[0], ir.Constant(VECTOR, [0.0] * LANES))
        bits = builder.bitcast(above, ir.IntType(LANES))
        return builder.icmp_unsigned("!=", bits, ir.Constant(ir.IntType(LANES), 0))

    return types.boolean(lanes), generate


def reduce_lanes(builder: ir.IRBuilder, name: str, value: ir.Value, start: float | None = None) -> ir.Value:
    """Return LLVM's reduction `name` of a vector."""
    kinds = [VECTOR] if start is None else [_f64, VECTOR]
    kind, full = ir.FunctionType(_f64, kinds), f"llvm.vector.reduce.{name}.v{LANES}f64"
    function = cgutils.get_or_insert_function(builder.module, kind, full)
    first = [] if start is None else [ir.Constant(_f64, start)]
    return builder.call(function, [*first, value], fastmath=FAST)


def _reduction(name: str, start: float | None) -> Callable[[ir.Value], ir.Value]:
    """Return a compiled function from a vector to a number: LLVM's reduction `name`."""

    def declare(typing_context, value):
        def generate(context, builder, sig, arguments):
            return reduce_lanes(builder, name, arguments[0], start)

        return types.float64(lanes), generate

    return intrinsic(declare)


lane_sum = _reduction("fadd", 0.0)
lane_max = _reduction("fmaximum", None)
