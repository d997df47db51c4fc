"""Artificial stress against the tensile instability (Gray, Monaghan & Swift 2001).

    R = -eps sigma+ / rho^2,    sigma+ = sum of sigma_i n_i (x) n_i over the tensile principal stresses

The pair law multiplies R_a + R_b by f^n with f = W_ab / W(dx), n = 4. Young 2021 eq. 1
carries half of this strength; `eps` here has Gray's meaning.
"""

from __future__ import annotations

from math import sqrt

from hvisph.compiler.jit import CompiledFunction, inline

# Sweeps of the Jacobi rotation, one more than reduce a 3x3 matrix to round-off.
_SWEEPS = 4


@inline
def _in_line(s):
    """Return the tensile part of a tensor with one component."""
    return (max(s[0], 0.0),)


@inline
def _plane(s):
    """Return the tensile part (xx, yy, xy) of a plane symmetric tensor."""
    xx, yy, xy = s
    mean = 0.5 * (xx + yy)
    half = 0.5 * (xx - yy)
    radius = sqrt(half * half + xy * xy)
    low = mean - radius
    if low >= 0.0:
        return xx, yy, xy
    high = mean + radius
    if high <= 0.0:
        return 0.0, 0.0, 0.0
    scale = high / (2.0 * radius)
    return scale * (xx - low), scale * (yy - low), scale * xy


@inline
def _rotation(p, q, pq):
    """Return cosine and sine of the rotation that makes `pq` of [[p, pq], [pq, q]] vanish."""
    if pq == 0.0:
        return 1.0, 0.0
    theta = (q - p) / (2.0 * pq)
    t = 1.0 / (abs(theta) + sqrt(theta * theta + 1.0))
    if theta < 0.0:
        t = -t
    c = 1.0 / sqrt(t * t + 1.0)
    return c, t * c


@inline
def _solid(s):
    """Return the tensile part of a symmetric 3x3 tensor (Jacobi's method)."""
    xx, yy, zz, xy, xz, yz = s
    mean = (xx + yy + zz) / 3.0
    d_xx, d_yy, d_zz = xx - mean, yy - mean, zz - mean
    squares = d_xx * d_xx + d_yy * d_yy + d_zz * d_zz + 2.0 * (xy * xy + xz * xz + yz * yz)
    reach = sqrt(2.0 / 3.0 * squares)  # no principal deviation is larger
    if mean + reach <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if mean - reach >= 0.0:
        return xx, yy, zz, xy, xz, yz
    a, b, c, d, e, f = xx, yy, zz, xy, xz, yz
    # Columns of the eigenvectors: (u, v, w).
    u_x, u_y, u_z = 1.0, 0.0, 0.0
    v_x, v_y, v_z = 0.0, 1.0, 0.0
    w_x, w_y, w_z = 0.0, 0.0, 1.0
    for _ in range(_SWEEPS):
        k, s = _rotation(a, b, d)
        a, b, d = k * k * a - 2.0 * k * s * d + s * s * b, s * s * a + 2.0 * k * s * d + k * k * b, 0.0
        e, f = k * e - s * f, s * e + k * f
        u_x, v_x = k * u_x - s * v_x, s * u_x + k * v_x
        u_y, v_y = k * u_y - s * v_y, s * u_y + k * v_y
        u_z, v_z = k * u_z - s * v_z, s * u_z + k * v_z
        k, s = _rotation(a, c, e)
        a, c, e = k * k * a - 2.0 * k * s * e + s * s * c, s * s * a + 2.0 * k * s * e + k * k * c, 0.0
        d, f = k * d - s * f, s * d + k * f
        u_x, w_x = k * u_x - s * w_x, s * u_x + k * w_x
        u_y, w_y = k * u_y - s * w_y, s * u_y + k * w_y
        u_z, w_z = k * u_z - s * w_z, s * u_z + k * w_z
        k, s = _rotation(b, c, f)
        b, c, f = k * k * b - 2.0 * k * s * f + s * s * c, s * s * b + 2.0 * k * s * f + k * k * c, 0.0
        d, e = k * d - s * e, s * d + k * e
        v_x, w_x = k * v_x - s * w_x, s * v_x + k * w_x
        v_y, w_y = k * v_y - s * w_y, s * v_y + k * w_y
        v_z, w_z = k * v_z - s * w_z, s * v_z + k * w_z
    a, b, c = max(a, 0.0), max(b, 0.0), max(c, 0.0)
    return (
        a * u_x * u_x + b * v_x * v_x + c * w_x * w_x,
        a * u_y * u_y + b * v_y * v_y + c * w_y * w_y,
        a * u_z * u_z + b * v_z * v_z + c * w_z * w_z,
        a * u_x * u_y + b * v_x * v_y + c * w_x * w_y,
        a * u_x * u_z + b * v_x * v_z + c * w_x * w_z,
        a * u_y * u_z + b * v_y * v_z + c * w_y * w_z,
    )


def tensile_part(dim: int) -> CompiledFunction:
    """Return the compiled function that takes the tensile part of a symmetric tensor in `dim` dimensions."""
    return (_in_line, _plane, _solid)[dim - 1]
