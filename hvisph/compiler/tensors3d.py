"""Three-dimensional tensors for any number of dimensions: symmetric with six components, gradients with nine.

The stress update takes these; `extend_symmetric`, `full_gradient` and `plane_components` convert from and to the
vectors and tensors of `compiler.tensors`. Symmetric ones are stored as xx yy zz xy xz yz.
"""

from __future__ import annotations

from hvisph.compiler.jit import inline
from hvisph.compiler.lazy_import import operation
from hvisph.compiler.tensors import PLACES, matrix, product, sum_terms

# By dimensions: the components of a full symmetric tensor that lie in the plane, and those that the state stores.
_IN_PLANE = {1: (0,), 2: (0, 1, 3), 3: (0, 1, 2, 3, 4, 5)}
_STORED = {1: 3, 2: 4, 3: 6}


@operation
def row_full_symmetric(rows, i, slot, dim):
    """Return the six components of the tensor at `slot` of row `i`, stored as `hvisph.core.fields` says."""
    return tuple(rows[i, slot + k] if k < _STORED[dim] else 0.0 for k in range(6))


@operation
def put_full_symmetric(rows, i, slot, s, dim):
    """Write those of six components that the state stores."""
    for k in range(_STORED[dim]):
        rows[i, slot + k] = s[k]


@operation
def full_gradient(l):
    """Return nine components of a gradient, zeros out of the plane."""
    d = {1: 1, 4: 2, 9: 3}[len(l)]
    return tuple(l[d * i + j] if max(i, j) < d else 0.0 for i in range(3) for j in range(3))


@operation
def replace_zz(l, zz):
    """Return a full gradient with its last component replaced by `zz`."""
    return (*l[:8], zz)


@operation
def plane_components(s, dim):
    """Return the components in the plane of a full symmetric tensor."""
    return tuple(s[k] for k in _IN_PLANE[dim])


@operation
def extend_vector(v):
    """Return the three components of a vector in the plane."""
    return (*v, *(0.0,) * (3 - len(v)))


@operation
def extend_symmetric(s):
    """Return six components of a symmetric tensor in the plane, zeros out of it."""
    places = _IN_PLANE[len(PLACES[len(s)])]
    return tuple(s[places.index(k)] if k in places else 0.0 for k in range(6))


@operation
def symmetric_part(l):
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
    return (
        diagonal + scale * x * x,
        scale * (x * y - z),
        scale * (x * z + y),
        scale * (x * y + z),
        diagonal + scale * y * y,
        scale * (y * z - x),
        scale * (x * z - y),
        scale * (y * z + x),
        diagonal + scale * z * z,
    )


@operation
def rotate(s, r):
    """Return r . s . r^T of a full symmetric tensor and a rotation."""
    t = product(r, matrix(s))
    indices = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    return tuple(sum_terms(t[3 * i + k] * r[3 * j + k] for k in range(3)) for i, j in indices)


@operation
def quaternion_product(a, b):
    """Return the quaternion of the rotation `a` after the rotation `b`; components are w, x, y, z."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


@operation
def quaternion_rotation(q):
    """Return the rotation of a quaternion, row by row; its columns are the turned axes. A length near 1 is enough."""
    w, x, y, z = q
    scale = 2.0 / (w * w + x * x + y * y + z * z)
    return (
        1.0 - scale * (y * y + z * z),
        scale * (x * y - w * z),
        scale * (x * z + w * y),
        scale * (x * y + w * z),
        1.0 - scale * (x * x + z * z),
        scale * (y * z - w * x),
        scale * (x * z - w * y),
        scale * (y * z + w * x),
        1.0 - scale * (x * x + y * y),
    )


@operation
def rotate_in_plane(s, z):
    """Return `rotate` for the rotation with the axial vector (0, 0, z)."""
    xx, yy, zz, xy, xz, yz = s
    scale = 1.0 / (1.0 + z * z)
    cosine, sine = (1.0 - z * z) * scale, 2.0 * z * scale
    cc, ss, cs = cosine * cosine, sine * sine, cosine * sine
    return (
        cc * xx + ss * yy - 2.0 * cs * xy,
        ss * xx + cc * yy + 2.0 * cs * xy,
        zz,
        cs * (xx - yy) + (cc - ss) * xy,
        cosine * xz - sine * yz,
        sine * xz + cosine * yz,
    )


@inline
def growth_factor(rate):
    """Return exp(rate) to second order, by a fraction that is positive for every admissible step."""
    return (1.0 + 0.5 * rate) / (1.0 - 0.5 * rate)
