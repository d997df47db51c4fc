"""Both filters of the traversal: particles near the box around a group, and neighbours of one particle among them.

They are written in LLVM's target-independent vector code, as `compiler.vector.intrinsics`. The first filter is
conservative. The second tests in single precision and, for pairs within its rounding error, in double precision
without contraction: its list is the same on every machine, and that of a plain test in double precision.
"""

from __future__ import annotations

from collections.abc import Callable

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.base import BaseContext
from numba.extending import intrinsic

from .api import EIGHT, NUMBERED, SIXTEEN
from .intrinsics import _address, _lane_table
from .lanes import splat

# Stores a vector at a place of an array.
Store = Callable[[ir.Value, ir.Value], None]
_i8, _i32, _i64 = ir.IntType(8), ir.IntType(32), ir.IntType(64)
_f32, _f64 = ir.FloatType(), ir.DoubleType()
_FAST = ("reassoc", "contract", "arcp", "nsz")


def _lane_numbers(kind: ir.Type, count: int) -> ir.Constant:
    return ir.Constant(ir.VectorType(kind, count), list(range(count)))


def _bits(builder: ir.IRBuilder, mask: ir.Value) -> ir.Value:
    """Return a mask as an integer of 64 bits."""
    return builder.zext(builder.bitcast(mask, ir.IntType(mask.type.count)), _i64)


def _append_lanes(builder: ir.IRBuilder, mask: ir.Value, first: ir.Value, store: Store, n: ir.Value) -> ir.Value:
    """Store `first` plus the lanes that a mask of eight keeps, side by side; return the new length."""
    bits = _bits(builder, mask)
    table = cgutils.global_constant(builder, "kept_lanes", _lane_table())
    entry = builder.gep(table, [ir.Constant(_i64, 0), bits])
    entry = builder.bitcast(entry, ir.VectorType(_i8, EIGHT).as_pointer())
    lanes = builder.zext(builder.load(entry, align=1), ir.VectorType(_i32, EIGHT))
    store(builder.add(splat(builder, builder.trunc(first, _i32), EIGHT), lanes), n)
    return builder.add(n, builder.ctpop(bits))


def _append_selected(
    builder: ir.IRBuilder, mask: ir.Value, numbers: ir.Value, first: ir.Value, store: Store, n: ir.Value
) -> ir.Value:
    """Store the numbers that a mask of sixteen keeps, or their places from `first` on; return the new length."""
    if NUMBERED:
        kind = numbers.type
        shape = ir.FunctionType(kind, [kind, mask.type, kind])
        compress = cgutils.get_or_insert_function(builder.module, shape, "llvm.experimental.vector.compress.v16i32")
        store(builder.call(compress, [numbers, mask, ir.Constant(kind, ir.Undefined)]), n)
        return builder.add(n, builder.ctpop(_bits(builder, mask)))
    for half in range(0, SIXTEEN, EIGHT):
        order = ir.Constant(ir.VectorType(_i32, EIGHT), list(range(half, half + EIGHT)))
        part = builder.shuffle_vector(mask, mask, order)
        n = _append_lanes(builder, part, builder.add(first, ir.Constant(_i64, half)), store, n)
    return n


def _store_function(context: BaseContext, builder: ir.IRBuilder, kind: types.Type, array: ir.Value) -> ir.Value:
    """Return a function that stores a vector at a place of a one-dimensional array of uint32."""

    def store(value: ir.Value, place: ir.Value) -> None:
        builder.store(value, _address(context, builder, kind, array, [place], value.type), align=4)

    return store


def _column(
    context: BaseContext,
    builder: ir.IRBuilder,
    kind: types.Type,
    array: ir.Value,
    f: int,
    place: ir.Value,
    vector: ir.Value,
) -> ir.Value:
    """Return the numbers of column `f` from `place` on as a vector."""
    address = _address(context, builder, kind, array, [ir.Constant(_i64, f), place], vector)
    return builder.load(address, align=vector.element.get_abi_size(context.target_data))


@intrinsic
def append_near_box(typing_context, columns, dim, j, end, box, h, half_reach, numbers, n):
    """Append to `numbers`, from index `n` on, the particles j to j+7 that may be neighbours of one inside a box.

    Parameters
    ----------
    columns
        Array (dim + 1, count + 8): position components and, last, smoothing length.
    dim
        Number of dimensions, a literal.
    j, end
        First of the eight, and the end of their range: particles from `end` on are not included.
    box
        Array (dim or more, 3): a point, and the box's middle relative to it and half its edge, along each axis.
    h
        Largest smoothing length inside.
    half_reach
        Half the kernel's reach, slightly increased for round-off.
    numbers, n
        Array of uint32 with space for eight more, and its used length.

    Returns
    -------
    The new used length.
    """
    if not isinstance(dim, types.Literal):
        return None
    dimensions = dim.literal_value
    signature = types.uint64(
        columns, dim, types.uint64, types.uint64, box, types.float64, types.float64, numbers, types.uint64
    )

    def generate(context, builder, signature, arguments):
        table, _, j, end, box, h, half_reach, numbers, n = arguments
        eight = ir.VectorType(_f64, EIGHT)
        fabs = cgutils.get_or_insert_function(builder.module, ir.FunctionType(eight, [eight]), "llvm.fabs.v8f64")

        def box_number(f, part):
            place = [ir.Constant(_i64, f), ir.Constant(_i64, part)]
            number = builder.load(_address(context, builder, signature.args[4], box, place, _f64), align=8)
            return splat(builder, number, EIGHT)

        def column(f):
            return _column(context, builder, signature.args[0], table, f, j, eight)

        r2, zero = None, ir.Constant(eight, [0.0] * EIGHT)
        for f in range(dimensions):
            d = builder.fsub(builder.fsub(column(f), box_number(f, 0)), box_number(f, 1))
            d = builder.fsub(builder.call(fabs, [d]), box_number(f, 2), flags=_FAST)
            d = builder.select(builder.fcmp_ordered(">", d, zero), d, zero)
            d2 = builder.fmul(d, d, flags=_FAST)
            r2 = d2 if r2 is None else builder.fadd(r2, d2, flags=_FAST)
        limit = builder.fadd(splat(builder, h, EIGHT), column(dimensions), flags=_FAST)
        limit = builder.fmul(limit, splat(builder, half_reach, EIGHT), flags=_FAST)
        indices = builder.add(splat(builder, j, EIGHT), _lane_numbers(_i64, EIGHT))
        mask = builder.icmp_unsigned("<", indices, splat(builder, end, EIGHT))
        mask = builder.and_(mask, builder.fcmp_ordered("<=", r2, builder.fmul(limit, limit, flags=_FAST)))
        return _append_lanes(builder, mask, j, _store_function(context, builder, signature.args[7], numbers), n)

    return signature, generate


@intrinsic
def mark_near(typing_context, singles, doubles, numbers, dim, k, i, centre, box, half_reach, slack):
    """Return a bit for each of sixteen candidates from index `k` on, 1 for those that are neighbours of `i`, uint64.

    Parameters
    ----------
    singles, doubles
        Arrays (dim + 1, size) of float32 and float64: position components, in `singles` relative to the box's point,
        and, last, smoothing length.
    numbers
        Numbers of the candidates, uint32.
    dim
        Number of dimensions, a literal.
    k, i
        The first candidate's index, and the particle's number; it is no neighbour of itself.
    centre
        The particle's x, y, z and smoothing length.
    box
        As in `append_near_box`.
    half_reach
        Half the kernel's reach: neighbours are closer than `half_reach` times the sum of both lengths.
    slack
        Bound of the error of a squared distance in single precision.
    """
    if not isinstance(dim, types.Literal):
        return None
    dimensions = dim.literal_value
    signature = types.uint64(
        singles, doubles, numbers, dim, types.uint64, types.uint64, centre, box, types.float64, types.float64
    )

    def generate(context, builder, signature, arguments):
        singles, doubles, numbers, _, k, i, centre, box, half_reach, slack = arguments
        centre = cgutils.unpack_tuple(builder, centre, 4)

        def spread(value, element):
            value = value if value.type == element else builder.fptrunc(value, element)
            return splat(builder, value, SIXTEEN)

        def test_distances(kind, array, position, element, flags):
            """Return the squared distances and the squared limits."""
            wide, r2 = ir.VectorType(element, SIXTEEN), None
            for f in range(dimensions):
                d = builder.fsub(spread(position[f], element), _column(context, builder, kind, array, f, k, wide))
                d2 = builder.fmul(d, d, flags=flags)
                r2 = d2 if r2 is None else builder.fadd(r2, d2, flags=flags)
            h = _column(context, builder, kind, array, dimensions, k, wide)
            limit = builder.fmul(builder.fadd(spread(centre[3], element), h), spread(half_reach, element), flags=flags)
            return r2, builder.fmul(limit, limit, flags=flags)

        offsets = []
        for f in range(dimensions):
            place = [ir.Constant(_i64, f), ir.Constant(_i64, 0)]
            origin = builder.load(_address(context, builder, signature.args[7], box, place, _f64), align=8)
            offsets.append(builder.fsub(centre[f], origin))
        r2, limit = test_distances(signature.args[0], singles, offsets, _f32, _FAST)
        margin = builder.fsub(limit, r2)
        slack = spread(slack, _f32)
        inside = builder.fcmp_ordered(">", margin, slack)
        bound = builder.fcmp_ordered(">=", margin, builder.fneg(slack))
        is_doubtful = builder.icmp_unsigned("!=", _bits(builder, inside), _bits(builder, bound))
        start = builder.basic_block
        with builder.if_then(is_doubtful, likely=False):
            r2, limit = test_distances(signature.args[1], doubles, centre, _f64, ())
            exact = builder.fcmp_ordered("<", r2, limit)
            last = builder.basic_block
        mask = builder.phi(inside.type)
        mask.add_incoming(inside, start)
        mask.add_incoming(exact, last)

        integers = ir.VectorType(_i32, SIXTEEN)
        candidates = builder.load(_address(context, builder, signature.args[2], numbers, [k], integers), align=4)
        others = builder.icmp_unsigned("!=", candidates, splat(builder, builder.trunc(i, _i32), SIXTEEN))
        return _bits(builder, builder.and_(mask, others))

    return signature, generate


@intrinsic
def append_marked(typing_context, numbers, bits, k, indices, n):
    """Append to `indices`, from index `n` on, those of sixteen candidates from index `k` on with a bit of `mark_near`.

    Parameters
    ----------
    numbers, bits, k
        Numbers of the candidates, uint32, the bits, and the index of the first.
    indices, n
        Array of uint32 with space for sixteen more, and its used length. It receives numbers of particles if
        NUMBERED, else indices of candidates.

    Returns
    -------
    The new used length.
    """
    signature = types.uint64(numbers, types.uint64, types.uint64, indices, types.uint64)

    def generate(context, builder, signature, arguments):
        numbers, bits, k, indices, n = arguments
        integers = ir.VectorType(_i32, SIXTEEN)
        candidates = builder.load(_address(context, builder, signature.args[0], numbers, [k], integers), align=4)
        mask = builder.bitcast(builder.trunc(bits, ir.IntType(SIXTEEN)), ir.VectorType(ir.IntType(1), SIXTEEN))
        store = _store_function(context, builder, signature.args[3], indices)
        return _append_selected(builder, mask, candidates, k, store, n)

    return signature, generate
