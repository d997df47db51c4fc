"""Two vector operations that no compiler finds by itself: filtering and transposing eight at a time.

They are written in LLVM's own target-independent vector code: one instruction or a few on
AVX-512, and what the compiler makes of it elsewhere, with the same results.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from .lanes import LANES, lanes

_i1, _i8, _i32, _i64, _f64 = ir.IntType(1), ir.IntType(8), ir.IntType(32), ir.IntType(64), ir.DoubleType()
_lane_numbers = ir.Constant(ir.VectorType(_i64, LANES), list(range(LANES)))


def _splat(builder: Any, value: Any) -> Any:
    """Return a vector with `value` in all lanes."""
    vector = ir.VectorType(value.type, LANES)
    single = builder.insert_element(ir.Constant(vector, ir.Undefined), value, ir.Constant(_i32, 0))
    zeros = ir.Constant(ir.VectorType(_i32, LANES), [0] * LANES)
    return builder.shuffle_vector(single, ir.Constant(vector, ir.Undefined), zeros)


def _pointer(context: Any, builder: Any, array_type: Any, array: Any, indices: list[Any], element: Any) -> Any:
    """Return a pointer to `array[indices]` as a pointer to a vector of `element`s."""
    view = context.make_array(array_type)(context, builder, array)
    strides = cgutils.unpack_tuple(builder, view.strides, array_type.ndim)
    offset = ir.Constant(_i64, 0)
    for index, stride in zip(indices, strides, strict=True):
        offset = builder.add(offset, builder.mul(index, stride))
    base = builder.bitcast(view.data, _i8.as_pointer())
    return builder.bitcast(builder.gep(base, [offset]), ir.VectorType(element, LANES).as_pointer())


@intrinsic
def append_near(typing_context, columns, dim, j, end, i, x, y, z, h, half_reach, near, n):
    """Append to `near`, from place `n` on, those of the particles j to j+7 that are neighbours of `i`.

    Parameters
    ----------
    columns
        Array (dim + 1, count + 8): position components and, last, smoothing length.
    dim
        Number of dimensions, a literal.
    j, end
        First of the eight, and the end of their run: particles from `end` on are not meant.
    i, x, y, z, h
        The particle, its position and smoothing length; it is no neighbour of itself.
    half_reach
        Half the kernel's reach: a pair meets within `half_reach` times the sum of both lengths.
    near, n
        Array of uint32 with room for eight more, and its used length.

    Returns
    -------
    The new used length.
    """
    if not isinstance(dim, types.Literal):
        return None
    dimensions = dim.literal_value
    signature = types.uint64(
        columns, dim, types.uint64, types.uint64, types.uint64, types.float64, types.float64, types.float64,
        types.float64, types.float64, near, types.uint64,
    )  # fmt: skip

    def generate(context, builder, signature, arguments):
        cols, _, j, end, i, x, y, z, h, half_reach, near, n = arguments
        fast = ("reassoc", "contract", "arcp", "nsz")

        def column(f):
            pointer = _pointer(context, builder, signature.args[0], cols, [ir.Constant(_i64, f), j], _f64)
            return builder.load(pointer, align=8)

        lanes = builder.add(_splat(builder, j), _lane_numbers)
        mask = builder.icmp_unsigned("<", lanes, _splat(builder, end))
        mask = builder.and_(mask, builder.icmp_unsigned("!=", lanes, _splat(builder, i)))
        r2 = None
        for f, own in enumerate((x, y, z)[:dimensions]):
            d = builder.fsub(_splat(builder, own), column(f), flags=fast)
            d2 = builder.fmul(d, d, flags=fast)
            r2 = d2 if r2 is None else builder.fadd(r2, d2, flags=fast)
        limit = builder.fadd(_splat(builder, h), column(dimensions), flags=fast)
        limit = builder.fmul(limit, _splat(builder, half_reach), flags=fast)
        mask = builder.and_(mask, builder.fcmp_ordered("<", r2, builder.fmul(limit, limit, flags=fast)))

        vector, masks = ir.VectorType(_i32, LANES), ir.VectorType(_i1, LANES)
        compress = cgutils.get_or_insert_function(
            builder.module,
            ir.FunctionType(vector, [vector, masks, vector]),
            f"llvm.experimental.vector.compress.v{LANES}i32",
        )
        short = builder.trunc(lanes, vector)
        kept = builder.call(compress, [short, mask, ir.Constant(vector, ir.Undefined)])
        builder.store(kept, _pointer(context, builder, signature.args[10], near, [n], _i32), align=4)
        bits = builder.zext(builder.bitcast(mask, _i8), _i64)
        return builder.add(n, builder.ctpop(bits))

    return signature, generate


@intrinsic
def transpose_eight(typing_context, rows, near, k, slot, block):
    """Copy slots `slot` to `slot` + 7 of the eight rows near[k] to near[k+7] into block[slot.., k..k+7].

    Parameters
    ----------
    rows
        Array (count, width), width a multiple of eight.
    near
        Array of uint32 with the rows' numbers.
    k, slot
        First place in `near` and in the block's columns; first slot, both multiples of eight.
    block
        Array (width or more, room), one row a slot.
    """
    signature = types.void(rows, near, types.uint64, types.uint64, block)

    def generate(context, builder, signature, arguments):
        rows, near, k, slot, block = arguments
        vector = ir.VectorType(_f64, LANES)
        undefined = ir.Constant(vector, ir.Undefined)

        def shuffled(a, b, order):
            return builder.shuffle_vector(a, b, ir.Constant(ir.VectorType(_i32, LANES), list(order)))

        # Half rows are loaded in pairs: two of the three rounds of exchanges remain for shuffles.
        half, halves = LANES // 2, []
        numbers = builder.load(_pointer(context, builder, signature.args[1], near, [k], _i32), align=4)
        for lane in range(LANES):
            index = builder.zext(builder.extract_element(numbers, ir.Constant(_i32, lane)), _i64)
            pointer = _pointer(context, builder, signature.args[0], rows, [index, slot], _f64)
            pointer = builder.bitcast(pointer, ir.VectorType(_f64, half).as_pointer())
            halves.append([builder.load(builder.gep(pointer, [ir.Constant(_i64, part)]), align=8) for part in (0, 1)])
        v = [shuffled(halves[lane % half][lane // half], halves[lane % half + half][lane // half], range(LANES))
             for lane in range(LANES)]
        for span in (1, 2):
            low = [lane if not lane & span else lane - span + LANES for lane in range(LANES)]
            high = [lane + span if not lane & span else lane + LANES for lane in range(LANES)]
            nxt = [undefined] * LANES
            for lane in range(LANES):
                if not lane & span:
                    nxt[lane] = shuffled(v[lane], v[lane + span], low)
                    nxt[lane + span] = shuffled(v[lane], v[lane + span], high)
            v = nxt
        for f in range(LANES):
            row = builder.add(slot, ir.Constant(_i64, f))
            builder.store(v[f], _pointer(context, builder, signature.args[4], block, [row, k], _f64), align=8)
        return context.get_dummy_value()

    return signature, generate


@intrinsic
def neighbours(typing_context, rows, near, k, width):
    """Return the rows near[k] to near[k+7] as `width` vectors, one a slot.

    Parameters
    ----------
    rows
        Array (count, width or more), contiguous.
    near
        Array of uint32 with the rows' numbers.
    k
        First place in `near`.
    width
        Number of slots to return, a literal; a multiple of eight.
    """
    if not isinstance(width, types.Literal):
        return None
    slots = width.literal_value
    signature = types.UniTuple(lanes, slots)(rows, near, types.uint64, width)

    def generate(context, builder, signature, arguments):
        rows, near, k, _ = arguments
        half = ir.VectorType(_f64, LANES // 2)

        def shuffled(a, b, order):
            return builder.shuffle_vector(a, b, ir.Constant(ir.VectorType(_i32, LANES), list(order)))

        numbers = builder.load(_pointer(context, builder, signature.args[1], near, [k], _i32), align=4)
        places = []
        for lane in range(LANES):
            index = builder.zext(builder.extract_element(numbers, ir.Constant(_i32, lane)), _i64)
            pointer = _pointer(context, builder, signature.args[0], rows, [index, ir.Constant(_i64, 0)], _f64)
            places.append(builder.bitcast(pointer, half.as_pointer()))

        def part(row, number):
            return builder.load(builder.gep(places[row], [ir.Constant(_i64, number)]), align=8)

        found = []
        for first in range(0, slots // (LANES // 2), 2):
            # Half rows are loaded in pairs: two of the three rounds of exchanges remain for shuffles.
            v = [shuffled(part(lane % 4, first + lane // 4), part(lane % 4 + 4, first + lane // 4), range(LANES))
                 for lane in range(LANES)]
            for span in (1, 2):
                low = [lane if not lane & span else lane - span + LANES for lane in range(LANES)]
                high = [lane + span if not lane & span else lane + LANES for lane in range(LANES)]
                for lane in range(LANES):
                    if not lane & span:
                        a, b = v[lane], v[lane + span]
                        v[lane], v[lane + span] = shuffled(a, b, low), shuffled(a, b, high)
            found += v
        return context.make_tuple(builder, signature.return_type, found)

    return signature, generate
