"""Vectors and tensors of compiled loops: tuples of floats, or of lanes, as long as the dimensions ask.

| rank | components in 1, 2 and 3 dimensions |
| --- | --- |
| vector | x, y, z: 1, 2, 3 |
| axial | of what turns, along the normal of its plane: none / z / x y z: 0, 1, 3 |
| symmetric | xx / xx yy xy / xx yy zz xy xz yz: 1, 3, 6 |
| gradient | row by row, xy = du_x/dy: 1, 4, 9 |
| symmetric_gradient | a vector for each component of a symmetric tensor: 1, 6, 18 |

What is solid in all directions whatever the dimensions, the stress update, takes six components and nine:
`compiler.tensors3d`.

Every operation is written once, in plain Python over its components, and `compiler.component_functions` hands that
very text to
the compiler, unrolled: called from Python it is its own plain twin. Sizes are known from lengths and from the tables
below, so that a further set of components (an in-plane tensor with a hoop component) is a line in them.
"""

from __future__ import annotations

from typing import Any

from .component_functions import operation

# How many components each rank has in 1, 2 and 3 dimensions.
SIZE = {"vector": (1, 2, 3), "axial": (0, 1, 3), "symmetric": (1, 3, 6), "gradient": (1, 4, 9),
        "symmetric_gradient": (1, 6, 18)}  # fmt: skip
# By the length of a symmetric tensor: where its matrix finds its components, and how many diagonal ones come first.
PLACES = {1: ((0,),), 3: ((0, 2), (2, 1)), 6: ((0, 3, 4), (3, 1, 5), (4, 5, 2))}
_DIAGONAL = {1: 1, 3: 2, 6: 3}
# By the length of a gradient: its diagonal; by that of a vector or a gradient: the dimensions.
_TRACE = {1: (0,), 4: (0, 3), 9: (0, 4, 8)}
_DIMENSIONS = {1: 1, 2: 2, 3: 3, 4: 2, 9: 3}


def total_of(terms):
    """Return the sum of terms, from the left."""
    first, *others = terms
    for term in others:
        first = first + term
    return first


# Rows and lanes


def _reader(rank: str) -> Any:
    """Return the operation that reads a tensor of this rank at `slot` of the neighbours `b`."""

    def read(b, slot, dim):
        return tuple(b[slot + k] for k in range(SIZE[rank][dim - 1]))

    return operation(read)


def _own_reader(rank: str) -> Any:
    """Return the operation that reads a tensor of this rank at `slot` of row `i`."""

    def read(rows, i, slot, dim):
        return tuple(rows[i, slot + k] for k in range(SIZE[rank][dim - 1]))

    return operation(read)


def _nothing(rank: str) -> Any:
    """Return the operation that gives the tensor 0 of this rank."""

    def zero(dim):
        return (0.0,) * SIZE[rank][dim - 1]

    return operation(zero)


vector, axial, symmetric, gradient, symmetric_gradient = (_reader(rank) for rank in SIZE)
own_vector, own_axial, own_symmetric, own_gradient, own_symmetric_gradient = (_own_reader(rank) for rank in SIZE)
no_vector, no_axial, no_symmetric, no_gradient, no_symmetric_gradient = (_nothing(rank) for rank in SIZE)


@operation
def put(rows, i, slot, value):
    """Write a vector or tensor to `slot` of row `i`."""
    for k, part in enumerate(value):
        rows[i, slot + k] = part


@operation
def own_columns(rows, i, slot, stride, dim):
    """Return the gradient whose columns stand in row `i` from `slot` on, each `stride` behind the one before."""
    return tuple(rows[i, slot + stride * k + j] for j in range(dim) for k in range(dim))


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
    return total_of(p * q for p, q in zip(a, b, strict=True))


@operation
def double_dot(a, b):
    """Return A : B of symmetric tensors, the sum of the products of all components of both matrices."""
    products = [p * q for p, q in zip(a, b, strict=True)]
    on, off = products[: _DIAGONAL[len(a)]], products[_DIAGONAL[len(a)] :]
    return total_of(on) + 2.0 * total_of(off) if off else total_of(on)


@operation
def outer(a, b):
    """Return a (x) b, row by row."""
    return tuple(p * q for p in a for q in b)


@operation
def symmetric_outer(a, b):
    """Return the components of a (x) b that a symmetric tensor keeps: all of it where b is along a."""
    places = PLACES[len(a) * (len(a) + 1) // 2]
    parts = {places[i][j]: a[i] * b[j] for i in range(len(a)) for j in range(i, len(a))}
    return tuple(parts[k] for k in range(len(parts)))


@operation
def on(s, v):
    """Return s . v of a symmetric tensor and a vector."""
    return tuple(total_of(s[place] * q for place, q in zip(row, v, strict=True)) for row in PLACES[len(s)])


@operation
def to_dimensions(f, l):
    """Return f^d, with the dimensions of the vector or gradient `l`."""
    d = _DIMENSIONS[len(l)]
    return f if d == 1 else f * f if d == 2 else f * f * f


@operation
def radial(v):
    """Return the component of a vector, or the normal one of a symmetric tensor, along the radius, which is y."""
    return v[min(1, len(v) - 1)]


@operation
def scaled_apart(v, along, radial):
    """Return a vector with its component along the radius, y, times `radial`, all others times `along`."""
    return tuple(p * (radial if k == 1 else along) for k, p in enumerate(v))


@operation
def plus_radial(v, f):
    """Return a vector with `f` added to its component along the radius, y."""
    return tuple(p + f if k == 1 else p for k, p in enumerate(v))


@operation
def plus_last(l, f):
    """Return a gradient with `f` added to its last component, in the plane of rings the rate of the radius."""
    return (*l[:-1], l[-1] + f)


@operation
def on_rows(t, v):
    """Return each row of a gradient, of a vector or of a symmetric tensor, times v: t . v."""
    d = len(v)
    return tuple(total_of(t[d * k + j] * v[j] for j in range(d)) for k in range(len(t) // d))


@operation
def plus_identity(s, f):
    """Return s + f 1 of a symmetric tensor."""
    return tuple(p + f if k < _DIAGONAL[len(s)] else p for k, p in enumerate(s))


@operation
def divergence(l):
    """Return the trace of a gradient."""
    return total_of(l[k] for k in _TRACE[len(l)])


@operation
def matrix(s):
    """Return a symmetric tensor as a gradient stands: row by row."""
    return tuple(s[place] for row in PLACES[len(s)] for place in row)


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
    return tuple(total_of(a[d * i + k] * b[d * k + j] for k in range(d)) for i in range(len(a) // d) for j in range(d))


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
    return total_of(l[k] * adjugate(l)[d * k] for k in range(d))


@operation
def mean_diagonal(l):
    """Return the mean of the diagonal of a gradient."""
    return total_of(l[k] for k in _TRACE[len(l)]) * (1.0 / len(_TRACE[len(l)]))


# Beside a line


@operation
def beside(v, along, e):
    """Return what of the vector `v`, `along` of which is along the unit vector `e`, lies beside `e`.

    In the plane that is one number: the component along `e` turned by a right angle.
    """
    if len(v) == 2:
        return (e[0] * v[1] - e[1] * v[0],)
    return tuple(p - along * q for p, q in zip(v, e, strict=True))


@operation
def facing_aside(v, e):
    """Return of the vector `v` what its products with what lies beside `e` ask for: in space all of it."""
    return (e[0] * v[1] - e[1] * v[0],) if len(v) == 2 else v


@operation
def aside(t, e):
    """Return as a vector what lies beside the unit vector `e`, see `beside`."""
    return (-t[0] * e[1], t[0] * e[0]) if len(e) == 2 else t


# What turns


@operation
def torque(x, f):
    """Return x x f of two vectors, an axial vector."""
    if len(x) == 2:
        return (x[0] * f[1] - x[1] * f[0],)
    return x[1] * f[2] - x[2] * f[1], x[2] * f[0] - x[0] * f[2], x[0] * f[1] - x[1] * f[0]


@operation
def about(w, x):
    """Return w x x of an axial vector and a vector."""
    if len(x) == 2:
        return -w[0] * x[1], w[0] * x[0]
    return w[1] * x[2] - w[2] * x[1], w[2] * x[0] - w[0] * x[2], w[0] * x[1] - w[1] * x[0]


@operation
def turning(w):
    """Return the gradient of w x x, of an axial vector w."""
    if len(w) == 1:
        return 0.0, -w[0], w[0], 0.0
    return 0.0, -w[2], w[1], w[2], 0.0, -w[0], -w[1], w[0], 0.0


@operation
def whirl(l):
    """Return the curl of the vector with the gradient `l`, an axial vector."""
    if len(l) == 4:
        return (l[2] - l[1],)
    return l[7] - l[5], l[2] - l[6], l[3] - l[1]


@operation
def inertia(s):
    """Return tr(s) - s of a symmetric tensor, row by row, as it acts on axial vectors: in the plane its trace."""
    if len(s) == 3:
        return (s[0] + s[1],)
    return s[1] + s[2], -s[3], -s[4], -s[3], s[0] + s[2], -s[5], -s[4], -s[5], s[0] + s[1]
