"""Vectors and tensors of compiled loops: tuples of floats or of lanes, whose length depends on the dimensions.

| rank | components in 1, 2 and 3 dimensions |
| --- | --- |
| vector | x, y, z: 1, 2, 3 |
| axial | rotation about the normal of its plane: none / z / x y z: 0, 1, 3 |
| symmetric | xx / xx yy xy / xx yy zz xy xz yz: 1, 3, 6 |
| gradient | row by row, xy = du_x/dy: 1, 4, 9 |
| symmetric_gradient | a vector for each component of a symmetric tensor: 1, 6, 18 |

The stress update has three dimensions in every case, with six and nine components: `compiler.tensors3d`.

Every operation is written once, in plain Python over its components. `compiler.lazy_import` compiles the same
function, unrolled. Sizes follow from lengths and from the tables below, so that a further set of components (an
in-plane tensor with a hoop component) is one line in them.
"""

from __future__ import annotations

from .lazy_import import PythonFunction, operation

# Number of components of each rank in 1, 2 and 3 dimensions.
SIZE = {
    "vector": (1, 2, 3),
    "axial": (0, 1, 3),
    "symmetric": (1, 3, 6),
    "gradient": (1, 4, 9),
    "symmetric_gradient": (1, 6, 18),
}
# By the length of a symmetric tensor: the indices of the components of its matrix, and the number of diagonal ones.
PLACES = {1: ((0,),), 3: ((0, 2), (2, 1)), 6: ((0, 3, 4), (3, 1, 5), (4, 5, 2))}
_DIAGONAL = {1: 1, 3: 2, 6: 3}
# By the length of a gradient: its diagonal; by that of a vector or a gradient: the dimensions.
_TRACE = {1: (0,), 4: (0, 3), 9: (0, 4, 8)}
_DIMENSIONS = {1: 1, 2: 2, 3: 3, 4: 2, 9: 3}


def sum_terms(terms):
    """Return the sum of terms, from the left."""
    first, *rest = terms
    for term in rest:
        first = first + term
    return first


# Rows and lanes


def _reader(rank: str) -> PythonFunction:
    """Return the operation that reads a tensor of this rank at `slot` of the neighbours `b`."""

    def read(b, slot, dim):
        return tuple(b[slot + k] for k in range(SIZE[rank][dim - 1]))

    return operation(read)


def _row_reader(rank: str) -> PythonFunction:
    """Return the operation that reads a tensor of this rank at `slot` of row `i`."""

    def read(rows, i, slot, dim):
        return tuple(rows[i, slot + k] for k in range(SIZE[rank][dim - 1]))

    return operation(read)


def _nothing(rank: str) -> PythonFunction:
    """Return the operation that returns the zero tensor of this rank."""

    def zero(dim):
        return (0.0,) * SIZE[rank][dim - 1]

    return operation(zero)


vector, axial, symmetric, gradient, symmetric_gradient = (_reader(rank) for rank in SIZE)
row_vector, row_axial, row_symmetric, row_gradient, row_symmetric_gradient = (_row_reader(rank) for rank in SIZE)
no_vector, no_axial, no_symmetric, no_gradient, no_symmetric_gradient = (_nothing(rank) for rank in SIZE)


@operation
def exact_vector(b, slot, rest, dim):
    """Return a vector at `slot` of the neighbours `b`, and what rounding has taken of it, at `rest` unless 0."""
    return tuple(b[slot + k] for k in range(dim)) + tuple(b[rest + k] for k in range(dim if rest else 0))


@operation
def row_exact_vector(rows, i, slot, rest, dim):
    """Return the same of row `i`."""
    return tuple(rows[i, slot + k] for k in range(dim)) + tuple(rows[i, rest + k] for k in range(dim if rest else 0))


@operation
def exact_difference(a, b, dim):
    """Return a - b of two vectors; of `exact_vector` in single precision it is rounded after subtraction."""
    if len(a) == dim:
        return tuple(p - q for p, q in zip(a, b, strict=True))
    return tuple(a[k].subtract_exactly(b[k], a[dim + k], b[dim + k]) for k in range(dim))


@operation
def column_vector(columns, i, dim):
    """Return the first `dim` numbers of column `i`."""
    return tuple(columns[k, i] for k in range(dim))


@operation
def put(rows, i, slot, value):
    """Write a vector or tensor to `slot` of row `i`."""
    for k, part in enumerate(value):
        rows[i, slot + k] = part


@operation
def row_columns(rows, i, slot, stride, dim):
    """Return the gradient whose columns are stored in row `i` from `slot` on, at intervals of `stride`."""
    return tuple(rows[i, slot + stride * k + j] for j in range(dim) for k in range(dim))


@operation
def broadcast(a):
    """Return the components of `a` as lanes; in plain Python `a` itself."""
    return tuple(p.spread() if hasattr(p, "spread") else p for p in a)


@operation
def broadcast_singles(a):
    """Return the components of `a` as lanes of single precision."""
    return tuple(p.spread_singles() if hasattr(p, "spread_singles") else p for p in a)


@operation
def lane_sums(a):
    """Return the sum over all lanes of each component."""
    return tuple(p.total() if hasattr(p, "total") else p for p in a)


# Algebra


@operation
def add(a, b):
    """Return a + b."""
    return tuple(p + q for p, q in zip(a, b, strict=True))


@operation
def subtract(a, b):
    """Return a - b."""
    return tuple(p - q for p, q in zip(a, b, strict=True))


@operation
def multiply(f, a):
    """Return f a, of a number f."""
    return tuple(f * p for p in a)


@operation
def dot(a, b):
    """Return the sum of the products of components: a . b of vectors, A : B of gradients."""
    return sum_terms(p * q for p, q in zip(a, b, strict=True))


@operation
def double_dot(a, b):
    """Return A : B of symmetric tensors, the sum of the products of all components of both matrices."""
    products = [p * q for p, q in zip(a, b, strict=True)]
    diagonal, off_diagonal = products[: _DIAGONAL[len(a)]], products[_DIAGONAL[len(a)] :]
    return sum_terms(diagonal) + 2.0 * sum_terms(off_diagonal) if off_diagonal else sum_terms(diagonal)


@operation
def outer(a, b):
    """Return a (x) b, row by row."""
    return tuple(p * q for p in a for q in b)


@operation
def symmetric_outer(a, b):
    """Return the components of a (x) b that a symmetric tensor stores: all of them if b is parallel to a."""
    places = PLACES[len(a) * (len(a) + 1) // 2]
    components = {places[i][j]: a[i] * b[j] for i in range(len(a)) for j in range(i, len(a))}
    return tuple(components[k] for k in range(len(components)))


@operation
def symmetric_dot(s, v):
    """Return s . v of a symmetric tensor and a vector."""
    return tuple(sum_terms(s[place] * q for place, q in zip(row, v, strict=True)) for row in PLACES[len(s)])


@operation
def power_of_dimension(f, l):
    """Return f^d, where d is the number of dimensions of the vector or gradient `l`."""
    d = _DIMENSIONS[len(l)]
    return f if d == 1 else f * f if d == 2 else f * f * f


@operation
def radial_part(v):
    """Return the component of a vector, or the normal one of a symmetric tensor, along the radius, which is y."""
    return v[min(1, len(v) - 1)]


@operation
def scale_radial(v, along, across):
    """Return a vector with its component along the radius, y, times `across`, all others times `along`."""
    return tuple(p * (across if k == 1 else along) for k, p in enumerate(v))


@operation
def add_radial(v, f):
    """Return a vector with `f` added to its component along the radius, y."""
    return tuple(p + f if k == 1 else p for k, p in enumerate(v))


@operation
def add_last(l, f):
    """Return a gradient with `f` added to its last component, in the meridian plane that of the radius."""
    return (*l[:-1], l[-1] + f)


@operation
def dot_rows(t, v):
    """Return each row of a gradient, of a vector or of a symmetric tensor, times v: t . v."""
    d = len(v)
    return tuple(sum_terms(t[d * k + j] * v[j] for j in range(d)) for k in range(len(t) // d))


@operation
def add_identity(s, f):
    """Return s + f 1 of a symmetric tensor."""
    return tuple(p + f if k < _DIAGONAL[len(s)] else p for k, p in enumerate(s))


@operation
def divergence(l):
    """Return the trace of a gradient."""
    return sum_terms(l[k] for k in _TRACE[len(l)])


@operation
def matrix(s):
    """Return the matrix of a symmetric tensor, row by row."""
    return tuple(s[place] for row in PLACES[len(s)] for place in row)


@operation
def symmetric_components(l):
    """Return the components of a symmetric tensor that is given row by row."""
    d = len(_TRACE[len(l)])
    places = {k: d * i + j for i, row in enumerate(PLACES[d * (d + 1) // 2]) for j, k in enumerate(row)}
    return tuple(l[places[k]] for k in range(len(places)))


@operation
def identity(l):
    """Return 1 with as many components as the gradient `l`."""
    return tuple(1.0 if k in _TRACE[len(l)] else 0.0 for k in range(len(l)))


@operation
def transpose(l):
    """Return the transpose of a gradient."""
    d = len(_TRACE[len(l)])
    return tuple(l[d * j + i] for i in range(d) for j in range(d))


@operation
def product(a, b):
    """Return a . b of gradients, or of the rows of a gradient `a` of a symmetric tensor."""
    d = len(_TRACE[len(b)])
    return tuple(sum_terms(a[d * i + k] * b[d * k + j] for k in range(d)) for i in range(len(a) // d) for j in range(d))


@operation
def adjugate(l):
    """Return the inverse of a gradient times its determinant."""
    if len(l) == 1:
        return (1.0,)
    if len(l) == 4:
        return l[3], -l[1], -l[2], l[0]
    xx, xy, xz, yx, yy, yz, zx, zy, zz = l
    return (
        yy * zz - yz * zy,
        xz * zy - xy * zz,
        xy * yz - xz * yy,
        yz * zx - yx * zz,
        xx * zz - xz * zx,
        xz * yx - xx * yz,
        yx * zy - yy * zx,
        xy * zx - xx * zy,
        xx * yy - xy * yx,
    )


@operation
def determinant(l):
    """Return the determinant of a gradient."""
    d = len(_TRACE[len(l)])
    return sum_terms(l[k] * adjugate(l)[d * k] for k in range(d))


@operation
def mean_diagonal(l):
    """Return the mean of the diagonal of a gradient."""
    return sum_terms(l[k] for k in _TRACE[len(l)]) * (1.0 / len(_TRACE[len(l)]))


# Components normal to a line


@operation
def tangential_part(v, along, e):
    """Return the part of the vector `v` normal to the unit vector `e`; its component parallel to `e` is `along`.

    In two dimensions that is one number: the component parallel to `e` rotated by a right angle.
    """
    if len(v) == 2:
        return (e[0] * v[1] - e[1] * v[0],)
    return tuple(p - along * q for p, q in zip(v, e, strict=True))


@operation
def tangential_components(v, e):
    """Return the components of `v` for products with a `tangential_part`: in three dimensions all of them."""
    return (e[0] * v[1] - e[1] * v[0],) if len(v) == 2 else v


@operation
def tangential_vector(t, e):
    """Return the vector of a `tangential_part` `t` with respect to `e`."""
    return (-t[0] * e[1], t[0] * e[0]) if len(e) == 2 else t


# Rotation


@operation
def torque(x, f):
    """Return x x f of two vectors, an axial vector."""
    if len(x) == 2:
        return (x[0] * f[1] - x[1] * f[0],)
    return x[1] * f[2] - x[2] * f[1], x[2] * f[0] - x[0] * f[2], x[0] * f[1] - x[1] * f[0]


@operation
def axial_cross(w, x):
    """Return w x x of an axial vector and a vector."""
    if len(x) == 2:
        return -w[0] * x[1], w[0] * x[0]
    return w[1] * x[2] - w[2] * x[1], w[2] * x[0] - w[0] * x[2], w[0] * x[1] - w[1] * x[0]


@operation
def spin_gradient(w):
    """Return the gradient of w x x, of an axial vector w."""
    if len(w) == 1:
        return 0.0, -w[0], w[0], 0.0
    return 0.0, -w[2], w[1], w[2], 0.0, -w[0], -w[1], w[0], 0.0


@operation
def axial_curl(l):
    """Return the curl of the vector with the gradient `l`, an axial vector."""
    if len(l) == 4:
        return (l[2] - l[1],)
    return l[7] - l[5], l[2] - l[6], l[3] - l[1]


@operation
def inertia(s):
    """Return tr(s) - s of a symmetric tensor, row by row, for axial vectors: in two dimensions its trace."""
    if len(s) == 3:
        return (s[0] + s[1],)
    return s[1] + s[2], -s[3], -s[4], -s[3], s[0] + s[2], -s[5], -s[4], -s[5], s[0] + s[1]
