"""Vectors and tensors of compiled loops: tuples of floats, or of lanes, as long as the dimensions ask.

| rank | components in 1, 2 and 3 dimensions |
| --- | --- |
| vector | x, y, z: 1, 2, 3 |
| symmetric | xx / xx yy xy / xx yy zz xy xz yz: 1, 3, 6 |
| gradient | row by row, xy = du_x/dy: 1, 4, 9 |
| symmetric_gradient | a vector for each component of a symmetric tensor: 1, 6, 18 |

What is solid in all directions whatever the dimensions, the stress update, takes six components and nine;
`full_symmetric`, `full_gradient` and `in_plane` lead there and back.

Every operation is written once, in plain Python over its components, and `operation` hands that very text to the
compiler, unrolled: called from Python it is its own plain twin. Sizes are known from lengths and from the tables
below, so that a further set of components (an in-plane tensor with a hoop component) is a line in them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin

from .lanes import FAST, VECTOR, lanes, reduced, splat

# How many components each rank has in 1, 2 and 3 dimensions.
SIZE = {"vector": (1, 2, 3), "symmetric": (1, 3, 6), "gradient": (1, 4, 9), "symmetric_gradient": (1, 6, 18)}
# By the length of a symmetric tensor: where its matrix finds its components, and how many diagonal ones come first.
_PLACES = {1: ((0,),), 3: ((0, 2), (2, 1)), 6: ((0, 3, 4), (3, 1, 5), (4, 5, 2))}
_DIAGONAL = {1: 1, 3: 2, 6: 3}
# By the length of a gradient: its diagonal.
_TRACE = {1: (0,), 4: (0, 3), 9: (0, 4, 8)}
# By dimensions: the components of a full symmetric tensor that lie in the plane, and those that the state stores.
_IN_PLANE = {1: (0,), 2: (0, 1, 3), 3: (0, 1, 2, 3, 4, 5)}
_STORED = {1: 3, 2: 4, 3: 6}


class _Number:
    """What stands for a number while an operation is compiled: it notes, or emits, the arithmetic done with it."""

    def _with(self, name: str, a: Any, b: Any) -> Any:
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


class _Kind(_Number):
    """A number whose type alone is known: `kind` is that of lanes or of a float."""

    def __init__(self, kind: Any) -> None:
        self.kind = kind

    def _with(self, name: str, a: Any, b: Any) -> _Kind:
        return _Kind(_common((a, b)))

    def total(self) -> _Kind:
        return _Kind(types.float64)

    def spread(self) -> _Kind:
        return _Kind(lanes)


def _common(numbers: Any) -> Any:
    """Return the type that holds all of `numbers`: lanes where one of them is."""
    return lanes if any(getattr(n, "kind", None) == lanes for n in numbers) else types.float64


class _Value(_Number):
    """A number of the function under compilation."""

    def __init__(self, builder: Any, value: Any) -> None:
        self.builder, self.value = builder, value

    def _with(self, name: str, a: Any, b: Any) -> _Value:
        builder = self.builder
        a, b = (_emitted(builder, n) for n in (a, b))
        wide = VECTOR in (a.type, b.type)
        if wide:
            a, b = (n if n.type == VECTOR else splat(builder, n) for n in (a, b))
        return _Value(builder, getattr(builder, name)(a, b, flags=FAST if wide else ()))

    def total(self) -> _Value:
        return _Value(self.builder, reduced(self.builder, "fadd", self.value, 0.0))

    def spread(self) -> _Value:
        return _Value(self.builder, splat(self.builder, self.value))


def _emitted(builder: Any, number: Any) -> Any:
    return number.value if isinstance(number, _Value) else ir.Constant(ir.DoubleType(), float(number))


class _KindOfRows:
    """An array of floats whose numbers are not known yet."""

    def __getitem__(self, place):
        return _Kind(types.float64)

    def __setitem__(self, place, number):
        pass


class _Rows:
    """An array of the function under compilation."""

    def __init__(self, context: Any, builder: Any, kind: Any, value: Any) -> None:
        self.context, self.builder, self.kind = context, builder, kind
        self.array = context.make_array(kind)(context, builder, value)

    def _address(self, place: tuple[Any, ...]) -> Any:
        builder, count = self.builder, self.kind.ndim
        shape, strides = (cgutils.unpack_tuple(builder, t, count) for t in (self.array.shape, self.array.strides))
        index = [n.value if isinstance(n, _Value) else ir.Constant(ir.IntType(64), n) for n in place]
        return cgutils.get_item_pointer2(
            self.context, builder, self.array.data, shape, strides, self.kind.layout, index
        )

    def __getitem__(self, place):
        return _Value(self.builder, self.builder.load(self._address(place)))

    def __setitem__(self, place, number):
        self.builder.store(_emitted(self.builder, number), self._address(place))


def _stand_in(kind: Any) -> Any:
    """Return what `kind` is to an operation that is asked for the type of its result."""
    if isinstance(kind, types.Literal):
        return kind.literal_value
    if isinstance(kind, types.BaseTuple):
        return tuple(_stand_in(part) for part in kind)
    return _KindOfRows() if isinstance(kind, types.Array) else _Kind(kind)


def _argument(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """Return what a value of type `kind` is to an operation under compilation."""
    if isinstance(kind, types.Literal):
        return kind.literal_value
    if isinstance(kind, types.BaseTuple):
        parts = cgutils.unpack_tuple(builder, value, len(kind))
        return tuple(_argument(context, builder, k, v) for k, v in zip(kind, parts, strict=True))
    return _Rows(context, builder, kind, value) if isinstance(kind, types.Array) else _Value(builder, value)


def _passed(kind: Any) -> Any:
    """Return the type as which an argument of type `kind` reaches the operation; plain integers are indices."""
    if isinstance(kind, types.Literal) or not isinstance(kind, types.Integer):
        return types.float64 if isinstance(kind, types.Float) else kind
    return types.uint64


def operation(write: Callable[..., Any]) -> Any:
    """Let compiled functions call `write`, which computes with components of tuples, or with items of rows.

    `write` stays the plain Python function that it is. In compiled code its literal integers are Python's, its
    integers row numbers, its floats, lanes and tuples of them numbers with +, -, *, /, and its arrays what one
    reads and writes by row and slot. It may decide by lengths and literals, never by values.
    """

    class Operation(AbstractTemplate):
        key, prefer_literal = write, True

        def generic(self, arguments, keywords):
            try:
                found = write(*map(_stand_in, arguments))
            except (TypeError, IndexError, KeyError, ValueError, AttributeError):
                return None  # no such operation on these
            passed = map(_passed, arguments)
            if found is None:
                return signature(types.none, *passed)
            if isinstance(found, tuple):
                return signature(types.UniTuple(_common(found), len(found)), *passed)
            return signature(_common((found,)), *passed)

    def generate(context, builder, sig, values):
        found = write(*(_argument(context, builder, k, v) for k, v in zip(sig.args, values, strict=True)))
        if found is None:
            return context.get_dummy_value()
        kind = sig.return_type
        parts = [_emitted(builder, part) for part in (found if isinstance(found, tuple) else (found,))]
        if lanes in (kind, getattr(kind, "dtype", None)):
            parts = [part if part.type == VECTOR else splat(builder, part) for part in parts]
        return context.make_tuple(builder, kind, parts) if isinstance(found, tuple) else parts[0]

    infer_global(write, types.Function(Operation))
    lower_builtin(write, types.VarArg(types.Any))(generate)
    write.py_func = write  # type: ignore[attr-defined]  # as compiled functions have it: the text that is compiled
    return write


def _sum(terms):
    first, *others = terms
    for term in others:
        first = first + term
    return first


# Rows and lanes


def _size(rank, dim):
    return SIZE[rank][dim - 1]


@operation
def vector(b, slot, dim):
    """Return the vector at `slot` of the neighbours `b`."""
    return tuple(b[slot + k] for k in range(_size("vector", dim)))


@operation
def symmetric(b, slot, dim):
    """Return the symmetric tensor at `slot` of the neighbours `b`."""
    return tuple(b[slot + k] for k in range(_size("symmetric", dim)))


@operation
def gradient(b, slot, dim):
    """Return the gradient at `slot` of the neighbours `b`."""
    return tuple(b[slot + k] for k in range(_size("gradient", dim)))


@operation
def symmetric_gradient(b, slot, dim):
    """Return the gradient of a symmetric tensor at `slot` of the neighbours `b`."""
    return tuple(b[slot + k] for k in range(_size("symmetric_gradient", dim)))


@operation
def own_vector(rows, i, slot, dim):
    """Return the vector at `slot` of row `i`."""
    return tuple(rows[i, slot + k] for k in range(_size("vector", dim)))


@operation
def own_symmetric(rows, i, slot, dim):
    """Return the symmetric tensor at `slot` of row `i`."""
    return tuple(rows[i, slot + k] for k in range(_size("symmetric", dim)))


@operation
def own_gradient(rows, i, slot, dim):
    """Return the gradient at `slot` of row `i`."""
    return tuple(rows[i, slot + k] for k in range(_size("gradient", dim)))


@operation
def own_symmetric_gradient(rows, i, slot, dim):
    """Return the gradient of a symmetric tensor at `slot` of row `i`."""
    return tuple(rows[i, slot + k] for k in range(_size("symmetric_gradient", dim)))


@operation
def own_full_symmetric(rows, i, slot, dim):
    """Return the six components of the tensor at `slot` of row `i`, stored as `hvisph.core.fields` says."""
    return tuple(rows[i, slot + k] if k < _STORED[dim] else 0.0 for k in range(6))


@operation
def put(rows, i, slot, value):
    """Write a vector or tensor to `slot` of row `i`."""
    for k, part in enumerate(value):
        rows[i, slot + k] = part


@operation
def put_full_symmetric(rows, i, slot, s, dim):
    """Write of six components those that the state stores."""
    for k in range(_STORED[dim]):
        rows[i, slot + k] = s[k]


@operation
def no_vector(dim):
    """Return the vector 0."""
    return (0.0,) * _size("vector", dim)


@operation
def no_symmetric(dim):
    """Return the symmetric tensor 0."""
    return (0.0,) * _size("symmetric", dim)


@operation
def no_gradient(dim):
    """Return the gradient 0."""
    return (0.0,) * _size("gradient", dim)


@operation
def no_symmetric_gradient(dim):
    """Return the gradient 0 of a symmetric tensor."""
    return (0.0,) * _size("symmetric_gradient", dim)


@operation
def spread(a):
    """Return lanes that all hold the components of `a`; of floats in Python, themselves."""
    return tuple(p.spread() if hasattr(p, "spread") else p for p in a)


@operation
def totals(a):
    """Return the sum over all lanes of each component."""
    return tuple(p.total() if hasattr(p, "total") else p for p in a)


# Algebra


@operation
def plus(a, b):
    """Return a + b."""
    return tuple(p + q for p, q in zip(a, b, strict=True))


@operation
def minus(a, b):
    """Return a - b."""
    return tuple(p - q for p, q in zip(a, b, strict=True))


@operation
def times(f, a):
    """Return f a, of a number f."""
    return tuple(f * p for p in a)


@operation
def dot(a, b):
    """Return the sum of the products of components: a . b of vectors, A : B of gradients."""
    return _sum(p * q for p, q in zip(a, b, strict=True))


@operation
def double_dot(a, b):
    """Return A : B of symmetric tensors, the sum of the products of all components of both matrices."""
    products = [p * q for p, q in zip(a, b, strict=True)]
    on, off = products[: _DIAGONAL[len(a)]], products[_DIAGONAL[len(a)] :]
    return _sum(on) + 2.0 * _sum(off) if off else _sum(on)


@operation
def outer(a, b):
    """Return a (x) b, row by row."""
    return tuple(p * q for p in a for q in b)


@operation
def symmetric_outer(a, b):
    """Return the components of a (x) b that a symmetric tensor keeps: all of it where b is along a."""
    places = _PLACES[len(a) * (len(a) + 1) // 2]
    found = {places[i][j]: a[i] * b[j] for i in range(len(a)) for j in range(i, len(a))}
    return tuple(found[k] for k in range(len(found)))


@operation
def on(s, v):
    """Return s . v of a symmetric tensor and a vector."""
    return tuple(_sum(s[place] * q for place, q in zip(row, v, strict=True)) for row in _PLACES[len(s)])


@operation
def to_dimensions(f, l):
    """Return f^d, with the dimensions of the gradient `l`."""
    d = len(_TRACE[len(l)])
    return f if d == 1 else f * f if d == 2 else f * f * f


@operation
def on_rows(t, v):
    """Return each row of a gradient, of a vector or of a symmetric tensor, times v: t . v."""
    d = len(v)
    return tuple(_sum(t[d * k + j] * v[j] for j in range(d)) for k in range(len(t) // d))


@operation
def plus_identity(s, f):
    """Return s + f 1 of a symmetric tensor."""
    return tuple(p + f if k < _DIAGONAL[len(s)] else p for k, p in enumerate(s))


@operation
def divergence(l):
    """Return the trace of a gradient."""
    return _sum(l[k] for k in _TRACE[len(l)])


@operation
def matrix(s):
    """Return a symmetric tensor as a gradient stands: row by row."""
    return tuple(s[place] for row in _PLACES[len(s)] for place in row)


@operation
def identity(l):
    """Return 1 with as many components as the gradient `l`."""
    return tuple(1.0 if k in _TRACE[len(l)] else 0.0 for k in range(len(l)))


@operation
def transposed(l):
    """Return the transpose of a gradient."""
    d = len(_TRACE[len(l)])
    return tuple(l[d * j + i] for i in range(d) for j in range(d))


@operation
def product(a, b):
    """Return a . b of gradients, or of the rows of a gradient `a` of a symmetric tensor."""
    d = len(_TRACE[len(b)])
    return tuple(_sum(a[d * i + k] * b[d * k + j] for k in range(d)) for i in range(len(a) // d) for j in range(d))


@operation
def adjugate(l):
    """Return the inverse of a gradient times its determinant."""
    if len(l) == 1:
        return (1.0,)
    if len(l) == 4:
        return l[3], -l[1], -l[2], l[0]
    xx, xy, xz, yx, yy, yz, zx, zy, zz = l
    return (yy * zz - yz * zy, xz * zy - xy * zz, xy * yz - xz * yy,
            yz * zx - yx * zz, xx * zz - xz * zx, xz * yx - xx * yz,
            yx * zy - yy * zx, xy * zx - xx * zy, xx * yy - xy * yx)  # fmt: skip


@operation
def determinant(l):
    """Return the determinant of a gradient."""
    d = len(_TRACE[len(l)])
    return _sum(l[k] * adjugate(l)[d * k] for k in range(d))


@operation
def mean_diagonal(l):
    """Return the mean of the diagonal of a gradient."""
    return _sum(l[k] for k in _TRACE[len(l)]) * (1.0 / len(_TRACE[len(l)]))


# Full tensors


@operation
def full_gradient(l):
    """Return nine components of a gradient, zeros out of the plane."""
    d = {1: 1, 4: 2, 9: 3}[len(l)]
    return tuple(l[d * i + j] if max(i, j) < d else 0.0 for i in range(3) for j in range(3))


@operation
def with_zz(l, zz):
    """Return a full gradient with another last component."""
    return (*l[:8], zz)


@operation
def in_plane(s, dim):
    """Return the components in the plane of a full symmetric tensor."""
    return tuple(s[k] for k in _IN_PLANE[dim])


@operation
def from_plane(s):
    """Return six components of a symmetric tensor in the plane, zeros out of it."""
    places = _IN_PLANE[len(_PLACES[len(s)])]
    return tuple(s[places.index(k)] if k in places else 0.0 for k in range(6))


@operation
def stretching(l):
    """Return the symmetric part of a full gradient, its six components."""
    xx, xy, xz, yx, yy, yz, zx, zy, zz = l
    return xx, yy, zz, 0.5 * (xy + yx), 0.5 * (xz + zx), 0.5 * (yz + zy)


@operation
def curl(l):
    """Return the curl of the vector with the full gradient `l`: twice the axial vector of its spin."""
    _, xy, xz, yx, _, yz, zx, zy, _ = l
    return zy - yz, xz - zx, yx - xy


@operation
def rotation(a):
    """Return Cayley's rotation (1 - W)^-1 (1 + W), row by row, of the axial vector a of W, tan(angle/2) long."""
    x, y, z = a
    square = x * x + y * y + z * z
    scale = 2.0 / (1.0 + square)
    diagonal = 1.0 - scale * square
    return (diagonal + scale * x * x, scale * (x * y - z), scale * (x * z + y),
            scale * (x * y + z), diagonal + scale * y * y, scale * (y * z - x),
            scale * (x * z - y), scale * (y * z + x), diagonal + scale * z * z)  # fmt: skip


@operation
def turned(s, r):
    """Return r . s . r^T of a full symmetric tensor and a rotation."""
    t = product(r, matrix(s))
    kept = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    return tuple(_sum(t[3 * i + k] * r[3 * j + k] for k in range(3)) for i, j in kept)


@operation
def turned_in_plane(s, z):
    """Return `turned` for the rotation of the axial vector (0, 0, z)."""
    xx, yy, zz, xy, xz, yz = s
    scale = 1.0 / (1.0 + z * z)
    cosine, sine = (1.0 - z * z) * scale, 2.0 * z * scale
    cc, ss, cs = cosine * cosine, sine * sine, cosine * sine
    return (cc * xx + ss * yy - 2.0 * cs * xy, ss * xx + cc * yy + 2.0 * cs * xy, zz,
            cs * (xx - yy) + (cc - ss) * xy, cosine * xz - sine * yz, sine * xz + cosine * yz)  # fmt: skip
