"""Full tensors, solid whatever the dimensions: six components of a symmetric one, nine of a gradient.

The stress update takes these; `from_plane`, `full_gradient` and `in_plane` lead from the vectors and tensors of
`compiler.tensors` and back. Symmetric ones stand as xx yy zz xy xz yz.
"""

from __future__ import annotations

from .component_functions import operation
from .tensors import PLACES, matrix, product, total_of

# By dimensions: the components of a full symmetric tensor that lie in the plane, and those that the state stores.
_IN_PLANE = {1: (0,), 2: (0, 1, 3), 3: (0, 1, 2, 3, 4, 5)}
_STORED = {1: 3, 2: 4, 3: 6}


@operation
def own_full_symmetric(rows, i, slot, dim):
    """Return the six components of the tensor at `slot` of row `i`, stored as `hvisph.core.fields` says."""
    return tuple(rows[i, slot + k] if k < _STORED[dim] else 0.0 for k in range(6))


@operation
def put_full_symmetric(rows, i, slot, s, dim):
    """Write of six components those that the state stores."""
    for k in range(_STORED[dim]):
        rows[i, slot + k] = s[k]


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
def in_space(v):
    """Return the three components of a vector in the plane."""
    return (*v, *(0.0,) * (3 - len(v)))


@operation
def from_plane(s):
    """Return six components of a symmetric tensor in the plane, zeros out of it."""
    places = _IN_PLANE[len(PLACES[len(s)])]
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
    return tuple(total_of(t[3 * i + k] * r[3 * j + k] for k in range(3)) for i, j in kept)


@operation
def turned_in_plane(s, z):
    """Return `turned` for the rotation of the axial vector (0, 0, z)."""
    xx, yy, zz, xy, xz, yz = s
    scale = 1.0 / (1.0 + z * z)
    cosine, sine = (1.0 - z * z) * scale, 2.0 * z * scale
    cc, ss, cs = cosine * cosine, sine * sine, cosine * sine
    return (cc * xx + ss * yy - 2.0 * cs * xy, ss * xx + cc * yy + 2.0 * cs * xy, zz,
            cs * (xx - yy) + (cc - ss) * xy, cosine * xz - sine * yz, sine * xz + cosine * yz)  # fmt: skip
