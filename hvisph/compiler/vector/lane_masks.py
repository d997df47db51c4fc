"""Masks of strict lanes: comparisons, logical operations and selection.

A comparison of lanes is a mask, one truth value per lane. `mask_and`, `mask_or` and `mask_not` combine masks and truth
values of all lanes; `select` takes one of two values, tuples included, lane by lane. `compiler.if_conversion` converts
the branches of a scalar function into these.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.base import BaseContext
from numba.core.typeconv import Conversion
from numba.core.typing.templates import ConcreteTemplate, signature
from numba.extending import intrinsic, models, register_model

from hvisph.compiler.codegen import infer_global, lower_builtin, lower_cast

from .api import LANES
from .lanes import VECTOR, splat, strict

_i1, _i32, _i64 = ir.IntType(1), ir.IntType(32), ir.IntType(64)
Types = tuple[types.Type, ...]
Pairs = tuple[tuple[types.Type, ir.Value], ...]
_MASK, _BITS = ir.VectorType(_i1, LANES), ir.IntType(LANES)


class Mask(types.Type):
    """Type of LANES truth values."""

    def __init__(self) -> None:
        super().__init__("mask")

    def can_convert_from(self, typing_context, other):
        """Convert a truth value to that of all lanes."""
        return Conversion.unsafe if isinstance(other, types.Boolean) else None

    def unify(self, typing_context, other):
        """Return the type of a variable that is of this type or of another one."""
        return self if isinstance(other, types.Boolean) else None


mask = Mask()


@register_model(Mask)
class _MaskModel(models.PrimitiveModel):
    def __init__(self, manager: object, kind: types.Type) -> None:
        super().__init__(manager, kind, _MASK)


@lower_cast(types.Boolean, Mask)
def _from_truth(context, builder, kind, target, value):
    return splat(builder, value)


def _compare(function: Callable[..., object], sign: str) -> None:
    cases = [(strict, strict), (strict, types.float64), (types.float64, strict)]
    template = {"key": function, "cases": [signature(mask, *case) for case in cases]}
    infer_global(function)(type("_Template", (ConcreteTemplate,), template))

    def lower(context, builder, sig, arguments):
        pairs = zip(arguments, sig.args, strict=True)
        a, b = (value if kind == strict else splat(builder, value) for value, kind in pairs)
        return (builder.fcmp_unordered if sign == "!=" else builder.fcmp_ordered)(sign, a, b)

    for case in cases:
        lower_builtin(function, *case)(lower)


for _comparison, _sign in (
    (operator.lt, "<"),
    (operator.le, "<="),
    (operator.gt, ">"),
    (operator.ge, ">="),
    (operator.eq, "=="),
    (operator.ne, "!="),
):
    _compare(_comparison, _sign)


def _lane_by_lane(function: Callable[..., object], count: int) -> None:
    """Define `function` of `count` floats for lanes: one lane after the other, by the code for floats."""
    cases = [(strict,)] if count == 1 else [(strict, strict), (strict, types.float64), (types.float64, strict)]
    template = {"key": function, "cases": [signature(strict, *case) for case in cases]}
    infer_global(function)(type("_Template", (ConcreteTemplate,), template))

    def lower(context, builder, sig, arguments):
        single = signature(types.float64, *(types.float64,) * count)
        call = context.get_function(function, single)
        result = ir.Constant(VECTOR, ir.Undefined)
        for k in range(LANES):
            index = ir.Constant(_i32, k)
            values = (builder.extract_element(v, index) if v.type == VECTOR else v for v in arguments)
            result = builder.insert_element(result, call(builder, list(values)), index)
        return result

    for case in cases:
        lower_builtin(function, *case)(lower)


for _of_one in (math.exp, math.log, math.sin, math.cos, math.tan, math.acos):
    _lane_by_lane(_of_one, 1)
for _of_two in (operator.pow, operator.ipow):
    _lane_by_lane(_of_two, 2)


def _is_truth(kind: types.Type) -> bool:
    return isinstance(kind, (types.Boolean, Mask))


def _common_type(a: types.Type, b: types.Type, by_lanes: bool) -> types.Type | None:
    """Return the type of a selection between values of types `a` and `b`, or None."""
    if isinstance(a, types.BaseTuple) and isinstance(b, types.BaseTuple) and len(a) == len(b):
        parts = [_common_type(p, q, by_lanes) for p, q in zip(a, b, strict=True)]
        if None in parts:
            return None
        base = a if isinstance(a, types.BaseNamedTuple) else None
        return types.BaseTuple.from_types(parts, base.instance_class if base else None)
    if isinstance(a, Mask) or isinstance(b, Mask) or (by_lanes and _is_truth(a)):
        return mask if _is_truth(a) and _is_truth(b) else None
    if _is_truth(a) or _is_truth(b):
        return types.boolean if a == b else None
    numbers = (types.Float, types.Integer, type(strict))
    if not isinstance(a, numbers) or not isinstance(b, numbers):
        return None
    return strict if by_lanes or strict in (a, b) else types.float64


def _pick(context: BaseContext, builder: ir.IRBuilder, condition: ir.Value, kind: types.Type, parts: Pairs) -> ir.Value:
    """Return the selection, of type `kind`, between two pairs of type and value."""
    (a_kind, a), (b_kind, b) = parts
    if isinstance(kind, types.BaseTuple):
        pairs = [zip(k, cgutils.unpack_tuple(builder, v, len(k)), strict=True) for k, v in parts]
        items = (_pick(context, builder, condition, k, p) for k, p in zip(kind, zip(*pairs, strict=True), strict=True))
        return context.make_tuple(builder, kind, list(items))
    a, b = _as(context, builder, a_kind, a, kind), _as(context, builder, b_kind, b, kind)
    return builder.select(condition, a, b)


def _as(context: BaseContext, builder: ir.IRBuilder, kind: types.Type, value: ir.Value, target: types.Type) -> ir.Value:
    """Convert a number or a truth value to the type `target`."""
    if kind == target:
        return value
    if target == strict:
        return splat(builder, context.cast(builder, value, kind, types.float64))
    return context.cast(builder, value, kind, target)


@intrinsic
def select(typing_context, condition, a, b):
    """Return `a` where the condition holds and `b` elsewhere: numbers, truth values or tuples of them."""
    result = _common_type(a, b, isinstance(condition, Mask)) if _is_truth(condition) else None
    if result is None:
        return None

    def generate(context, builder, sig, arguments):
        flag, *values = arguments
        return _pick(context, builder, flag, result, tuple(zip(sig.args[1:], values, strict=True)))

    return result(condition, a, b), generate


def _combination(name: str) -> Callable[..., ir.Value]:
    @intrinsic
    def combine(typing_context, a, b):
        if not _is_truth(a) or not _is_truth(b):
            return None
        result = mask if Mask in (type(a), type(b)) else types.boolean

        def generate(context, builder, sig, arguments):
            values = (_as(context, builder, k, v, result) for k, v in zip(sig.args, arguments, strict=True))
            return getattr(builder, name)(*values)

        return result(a, b), generate

    return combine


mask_and, mask_or = _combination("and_"), _combination("or_")


@intrinsic
def mask_not(typing_context, a):
    """Return the negation of a mask or a truth value."""
    return (a(a), lambda context, builder, sig, arguments: builder.not_(arguments[0])) if _is_truth(a) else None


def _truth_reduction(all_lanes: bool) -> Callable[..., ir.Value]:
    @intrinsic
    def ask(typing_context, a):
        if not _is_truth(a):
            return None

        def generate(context, builder, sig, arguments):
            if a == types.boolean:
                return arguments[0]
            bits = builder.bitcast(arguments[0], _BITS)
            return builder.icmp_unsigned("==" if all_lanes else "!=", bits, ir.Constant(_BITS, -1 if all_lanes else 0))

        return types.boolean(a), generate

    return ask


any_true, all_true = _truth_reduction(False), _truth_reduction(True)


@intrinsic
def first_lanes(typing_context, count):
    """Return a mask of the first `count` lanes."""

    def generate(context, builder, sig, arguments):
        kind = ir.VectorType(_i64, LANES)
        numbers = ir.Constant(kind, list(range(LANES)))
        return builder.icmp_unsigned("<", numbers, splat(builder, arguments[0]))

    return mask(types.uint64), generate


# Single lanes, for functions that are called once per lane.


def _of_lane(kind: types.Type) -> types.Type:
    if isinstance(kind, types.BaseTuple):
        base = kind.instance_class if isinstance(kind, types.BaseNamedTuple) else None
        return types.BaseTuple.from_types([_of_lane(k) for k in kind], base)
    return {strict: types.float64, mask: types.boolean}.get(kind, kind)


def _of_lanes(kind: types.Type) -> types.Type:
    if isinstance(kind, types.BaseTuple):
        base = kind.instance_class if isinstance(kind, types.BaseNamedTuple) else None
        return types.BaseTuple.from_types([_of_lanes(k) for k in kind], base)
    if isinstance(kind, types.Boolean):
        return mask
    return strict if isinstance(kind, (types.Float, types.Integer)) else kind


def _lane(context: BaseContext, builder: ir.IRBuilder, kind: types.Type, value: ir.Value, k: ir.Value) -> ir.Value:
    if isinstance(kind, types.BaseTuple):
        parts = zip(kind, cgutils.unpack_tuple(builder, value, len(kind)), strict=True)
        return context.make_tuple(builder, _of_lane(kind), [_lane(context, builder, q, v, k) for q, v in parts])
    return builder.extract_element(value, k) if kind in (strict, mask) else value


def _with_lane(
    context: BaseContext, builder: ir.IRBuilder, kinds: Types, values: tuple[ir.Value, ...], k: ir.Value
) -> ir.Value:
    """Return a value of type kinds[0] with lane `k` of that of kinds[1]."""
    kind, single = kinds
    if isinstance(kind, types.BaseTuple):
        columns = [cgutils.unpack_tuple(builder, value, len(kind)) for value in values]
        parts = zip(zip(kind, single, strict=True), zip(*columns, strict=True), strict=True)
        return context.make_tuple(builder, kind, [_with_lane(context, builder, *part, k) for part in parts])
    number = _as(context, builder, single, values[1], types.boolean if kind == mask else types.float64)
    return builder.insert_element(values[0], number, k)


@intrinsic
def extract_lane(typing_context, value, k):
    """Return lane `k` of a value or of a tuple of values; values without lanes are returned unchanged."""

    def generate(context, builder, sig, arguments):
        value = _lane(context, builder, sig.args[0], *arguments)
        if context.enable_nrt:  # arrays among them are a further reference
            context.nrt.incref(builder, sig.return_type, value)
        return value

    return _of_lane(value)(value, types.uint64), generate


@intrinsic
def insert_lane(typing_context, wide, k, value):
    """Return `wide`, a value of `empty_lanes`, with lane `k` set to `value`."""

    def generate(context, builder, sig, arguments):
        vector, index, single = arguments
        return _with_lane(context, builder, (sig.args[0], sig.args[2]), (vector, single), index)

    return wide(wide, types.uint64, value), generate


@intrinsic
def empty_lanes(typing_context, sample):
    """Return lanes of zeros for values such as `sample`."""
    result = _of_lanes(sample)
    return result(sample), lambda context, builder, sig, arguments: context.get_constant_null(result)
