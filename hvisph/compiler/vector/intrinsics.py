"""Vector operations that the compiler does not find by itself: transposition of rows, exact sums, control register.

They are written in LLVM's target-independent vector code and give the same results on every machine.
"""

from __future__ import annotations

import platform

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.base import BaseContext
from numba.extending import intrinsic

from .api import EIGHT, LANES, SINGLES
from .lanes import lanes, singles, splat, strict

_i8, _i32, _i64 = ir.IntType(8), ir.IntType(32), ir.IntType(64)
_f32, _f64 = ir.FloatType(), ir.DoubleType()

# Bits of the x86 control register: results, and operands, below 2.2e-308 count as zero.
_FLUSHES = 0x8040
HAS_REGISTER = platform.machine().lower() in ("x86_64", "amd64")


def _lane_table() -> ir.Constant:
    """Return, for each mask of eight bits, the numbers of its set bits, then zeros."""
    row = ir.ArrayType(_i8, EIGHT)
    rows = []
    for mask in range(256):
        bits = [bit for bit in range(EIGHT) if mask >> bit & 1]
        rows.append(ir.Constant(row, bits + [0] * (EIGHT - len(bits))))
    return ir.Constant(ir.ArrayType(row, 256), rows)


def _address(
    context: BaseContext,
    builder: ir.IRBuilder,
    array_type: types.Type,
    array: ir.Value,
    indices: list[ir.Value],
    target: ir.Type,
) -> ir.Value:
    """Return a pointer to `array[indices]` as a pointer to `target`."""
    view = context.make_array(array_type)(context, builder, array)
    strides = cgutils.unpack_tuple(builder, view.strides, array_type.ndim)
    offset = ir.Constant(_i64, 0)
    for index, stride in zip(indices, strides, strict=True):
        offset = builder.add(offset, builder.mul(index, stride))
    base = builder.bitcast(view.data, _i8.as_pointer())
    return builder.bitcast(builder.gep(base, [offset]), target.as_pointer())


@intrinsic
def neighbours(typing_context, rows, indices, k, width):
    """Return the first slots of the rows indices[k], indices[k+1] ... as vectors, one a slot, a lane a row.

    Parameters
    ----------
    rows
        Array (count, `width` or more, rounded up to an even number) of float64; of float32, whose vectors have SINGLES
        lanes in an order of their own, rounded up to a multiple of eight.
    indices
        Array of uint32 with the rows' numbers.
    k
        First place in `indices`; LANES rows are read, SINGLES of float32.
    width
        Number of slots, a literal.

    Returns
    -------
    A tuple of `width` vectors; unused ones are removed by the compiler.
    """
    if not isinstance(width, types.Literal):
        return None
    slots, single = width.literal_value, rows.dtype == types.float32
    kind, count, size, element = (singles, SINGLES, 4, _f32) if single else (lanes, LANES, 8, _f64)
    signature = types.UniTuple(kind, slots)(rows, indices, types.uint64, width)

    def generate(context, builder, signature, arguments):
        rows, indices, k, _ = arguments

        def join_vectors(a, b, order):
            return builder.shuffle_vector(a, b, ir.Constant(ir.VectorType(_i32, len(order)), order))

        address = _address(context, builder, signature.args[1], indices, [k], ir.VectorType(_i32, count))
        numbers = builder.load(address, align=4)
        first, places = ir.Constant(_i64, 0), []
        for lane in range(count):
            index = builder.zext(builder.extract_element(numbers, ir.Constant(_i32, lane)), _i64)
            places.append(_address(context, builder, signature.args[0], rows, [index, first], element))

        def side_by_side(selection, slot, length):
            """Return `length` slots from `slot` on of the chosen rows, one row after the other."""
            pointer, number = ir.VectorType(element, length).as_pointer(), ir.Constant(_i64, slot)
            addresses = [builder.bitcast(builder.gep(places[row], [number]), pointer) for row in selection]
            parts = [builder.load(address, align=size) for address in addresses]
            while len(parts) > 1:
                order = list(range(2 * parts[0].type.count))
                parts = [join_vectors(a, b, order) for a, b in zip(parts[::2], parts[1::2], strict=True)]
            return parts[0]

        def transpose_fours(blocks):
            """Return the columns within each four lanes of four vectors."""
            vectors, fours = [], range(0, SINGLES, 4)
            for pair in (0, 2):
                order = [f + pair + part + side for f in fours for part in (0, 1) for side in (0, SINGLES)]
                ab, cd = (join_vectors(blocks[j], blocks[j + 1], order) for j in (0, 2))
                for part in (0, 2):
                    of_two = [f + part + j + side for f in fours for side in (0, SINGLES) for j in (0, 1)]
                    vectors.append(join_vectors(ab, cd, of_two))
            return vectors

        columns = []
        if single and count == 8:
            for slot in range(0, slots, 4):
                columns += transpose_fours([side_by_side(range(j, count, 4), slot, 4) for j in range(4)])
            return context.make_tuple(builder, signature.return_type, columns[:slots])
        for slot in range(0, slots if single else 0, 8):  # eight slots of rows j and j + 8: few addresses at once
            blocks = [side_by_side((j, j + 8), slot, 8) for j in range(8)]
            firsts, seconds = transpose_fours(blocks[:4]), transpose_fours(blocks[4:])
            for half in (0, 4):
                order = [f + half + j + side for side in (0, SINGLES) for f in (0, 8) for j in range(4)]
                columns += [join_vectors(q, p, order) for q, p in zip(firsts, seconds, strict=True)]
        if single:
            return context.make_tuple(builder, signature.return_type, columns[:slots])
        # Four slots at once, of every second of LANES/2 rows: exchanges within pairs of lanes, then of pairs.
        step, lanes_of_pairs = LANES // 4, range(0, LANES, 2)
        for slot in range(0, slots - 3, 4):
            starts = (row for row in range(LANES) if row % (2 * step) < 2)
            a, b, c, d = (side_by_side(range(row, row + 2 * step, 2), slot, 4) for row in starts)
            for pair in (0, 2):
                for part in (0, 1):
                    order = [lane + part + side for lane in lanes_of_pairs for side in (0, LANES)]
                    place = [lane + side for lane in lanes_of_pairs for side in (0, 1) if lane % 4 == pair]
                    ab, cd = join_vectors(a, b, order), join_vectors(c, d, order)
                    columns.append(join_vectors(ab, cd, place + [LANES + lane for lane in place]))
        for slot in range(len(columns), slots, 2):
            # Even and odd rows separately: one exchange of lanes remains, the rest are loads.
            even, odd = (side_by_side(range(parity, LANES, 2), slot, 2) for parity in (0, 1))
            for part in (0, 1):
                order = [lane + part + side for lane in lanes_of_pairs for side in (0, LANES)]
                columns.append(join_vectors(even, odd, order))
        return context.make_tuple(builder, signature.return_type, columns[:slots])

    return signature, generate


@intrinsic
def add_rounded(typing_context, sums, k, terms, rounder, finer):
    """Round lanes to whole numbers and finer ones, and add them to sums[0, k] and sums[1, k].

    Parameters
    ----------
    sums
        Contiguous array of int64 (2, columns, LANES): whole numbers and finer ones.
    k
        Column of it.
    terms, rounder
        Strict lanes, and what rounds them, see `compiler.exact_sum`.
    finer
        Bits of the finer part, a literal.
    """
    if not isinstance(finer, types.Literal):
        return None
    share = 2.0**-finer.literal_value
    signature = types.void(sums, types.uint64, strict, types.float64, finer)

    def generate(context, builder, signature, arguments):
        array, column, term, rounder, _ = arguments
        integers = ir.VectorType(_i64, LANES)
        fine = splat(builder, builder.fmul(rounder, ir.Constant(_f64, share)))
        rounder = splat(builder, rounder)
        coarse = builder.fadd(term, rounder)
        residual = builder.fadd(builder.fsub(term, builder.fsub(coarse, rounder)), fine)
        for part, (number, base) in enumerate(((coarse, rounder), (residual, fine))):
            count = builder.sub(builder.bitcast(number, integers), builder.bitcast(base, integers))
            place = [ir.Constant(_i64, part), column, ir.Constant(_i64, 0)]
            address = _address(context, builder, signature.args[0], array, place, integers)
            builder.store(builder.add(builder.load(address, align=8), count), address, align=8)
        return context.get_dummy_value()

    return signature, generate


@intrinsic
def flush_tiny(typing_context):
    """Treat numbers below 2.2e-308 as zero in this thread; return the previous mode for `restore_mode`.

    Products of weak disturbances ahead of a wave are that small, and each would take 150 cycles.
    """

    def generate(context, builder, signature, arguments):
        if not HAS_REGISTER:
            return ir.Constant(_i32, 0)
        mode = builder.load(_with_register(builder, "stmxcsr", cgutils.alloca_once(builder, _i32)))
        _with_register(
            builder, "ldmxcsr", cgutils.alloca_once_value(builder, builder.or_(mode, ir.Constant(_i32, _FLUSHES)))
        )
        return mode

    return types.uint32(), generate


@intrinsic
def restore_mode(typing_context, mode):
    """Restore the mode that `flush_tiny` returned."""

    def generate(context, builder, signature, arguments):
        if HAS_REGISTER:
            _with_register(builder, "ldmxcsr", cgutils.alloca_once_value(builder, arguments[0]))
        return context.get_dummy_value()

    return types.void(types.uint32), generate


def _with_register(builder: ir.IRBuilder, name: str, place: ir.Value) -> ir.Value:
    """Store the control register in a place of 32 bits, or load it from there; return the place."""
    kind = ir.FunctionType(ir.VoidType(), [_i8.as_pointer()])
    function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.x86.sse.{name}")
    builder.call(function, [builder.bitcast(place, _i8.as_pointer())])
    return place
