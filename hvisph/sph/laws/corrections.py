"""Corrections of the kernel and its gradient: Shepard's, the gradient's, or both (mixed).

    s_a     = sum_b V_b W_ab, the particle itself included               (Shepard's sum)
    G~_ab   = grad_a (W_ab / s_a) = grad_a W_ab / s_a - W_ab (sum_b V_b grad_a W_ab) / s_a^2
    K_a     = [sum_b V_b G~_ab (x) (x_b - x_a)]^-1
    g_ab    = K_a G~_ab = A_a grad_a W_ab + W_ab B_a

`shepard` has K = I, `gradient` has s = 1. With g_ab the gradient of a linear field is exact (`gradient`,
`mixed`), at free surfaces too. A particle with fewer than two neighbours, or with a matrix near singular, has
A = I, B = 0. Where a contact algorithm parts bodies, only the own one counts.

Source: Young 2021 eqs. 3-5.
"""

from __future__ import annotations

import numpy as np

from hvisph.core.lanes import LANES, all_lanes, total
from hvisph.core.simd import neighbours
from hvisph.sph.rows import RowLayout

# A neighbourhood whose matrix has less than this share of a round one's determinant keeps the plain gradient.
SINGULAR = 0.05

HUGE = 1e300


def row_layout(standard: RowLayout) -> RowLayout:
    """Return the `standard` law's row with A, B; the last slot, which no pair reads, takes the fall-backs."""
    return RowLayout(standard.dim, (*pair_layout(standard).fields, ("fallbacks", "scalar")))


def pair_layout(standard: RowLayout) -> RowLayout:
    """Return what `accumulate` reads of a neighbour: the `standard` law's row with A and B."""
    return RowLayout(standard.dim, (*standard.fields, ("a", "gradient"), ("b", "vector")))


def corrections(near, n, rows, i, constants, out):
    """Write A and B into row `i`, and the number of its neighbours where it falls back as a whole, else 0."""
    x = rows[i, 0]
    y = rows[i, 1] if DIM > 1 else 0.0
    z = rows[i, 2] if DIM > 2 else 0.0
    h = rows[i, H]
    none = all_lanes(0.0)
    count = s = none
    g_x = g_y = g_z = q_x = q_y = q_z = none
    m_xx = m_yy = m_zz = m_xy = m_xz = m_yz = none
    for k in range(np.uint64(0), n, np.uint64(LANES)):
        b = neighbours(rows, near, k, WIDTH)
        dx = b[0] - x
        dy = b[1] - y if DIM > 1 else 0.0
        dz = b[2] - z if DIM > 2 else 0.0
        r = np.sqrt(dx * dx + dy * dy + dz * dz)
        hm = 0.5 * (h + b[H])
        density_length = r * b[RHO]
        inverse = 1.0 / (hm * density_length)  # one division for 1/h and 1/(r rho_b)
        ih = inverse * density_length
        norm = scale(ih) * b[M] * (inverse * hm)
        present = min(b[M] * HUGE, 1.0)
        if COUPLED:
            _, same, _ = shares(rows, i, b, -dx, -dy, -dz, constants[constants.size - 1])
            norm = norm * same
            present = present * same
        f = norm * slope(r * ih)  # V_b (dW/dr) / r, times -d the gradient
        count += present
        fx = f * dx
        fy = f * dy if DIM > 1 else 0.0
        fz = f * dz if DIM > 2 else 0.0
        if SHEPARD:
            w = norm * r * hm * shape(r * ih)
            s += w
            g_x -= fx
            q_x += w * dx
            if DIM > 1:
                g_y -= fy
                q_y += w * dy
            if DIM > 2:
                g_z -= fz
                q_z += w * dz
        if GRADIENT:
            m_xx -= fx * dx
            if DIM > 1:
                m_xy -= fx * dy
                m_yy -= fy * dy
            if DIM > 2:
                m_xz -= fx * dz
                m_yz -= fy * dz
                m_zz -= fz * dz
    inverse_s = 1.0
    b_x = b_y = b_z = 0.0
    if SHEPARD:
        inverse_s = 1.0 / (total(s) + rows[i, M] / rows[i, RHO] * scale(1.0 / h) * h * shape(0.0))
        b_x = -total(g_x) * inverse_s * inverse_s
        b_y = -total(g_y) * inverse_s * inverse_s
        b_z = -total(g_z) * inverse_s * inverse_s
    a_xx = a_yy = a_zz = inverse_s
    a_xy = a_xz = a_yx = a_yz = a_zx = a_zy = 0.0
    good = total(count) > 1.5
    if GRADIENT:
        c_xx = inverse_s * total(m_xx) + b_x * total(q_x)
        c_xy = inverse_s * total(m_xy) + b_x * total(q_y)
        c_xz = inverse_s * total(m_xz) + b_x * total(q_z)
        c_yx = inverse_s * total(m_xy) + b_y * total(q_x)
        c_yy = inverse_s * total(m_yy) + b_y * total(q_y) if DIM > 1 else 1.0
        c_yz = inverse_s * total(m_yz) + b_y * total(q_z)
        c_zx = inverse_s * total(m_xz) + b_z * total(q_x)
        c_zy = inverse_s * total(m_yz) + b_z * total(q_y)
        c_zz = inverse_s * total(m_zz) + b_z * total(q_z) if DIM > 2 else 1.0
        k_xx = c_yy * c_zz - c_yz * c_zy
        k_yx = c_yz * c_zx - c_yx * c_zz
        k_zx = c_yx * c_zy - c_yy * c_zx
        determinant = c_xx * k_xx + c_xy * k_yx + c_xz * k_zx
        mean = (c_xx + (c_yy if DIM > 1 else 0.0) + (c_zz if DIM > 2 else 0.0)) / DIM
        good = good and mean > SINGULAR and determinant > SINGULAR * mean**DIM
        d = 1.0 / determinant
        k_xx, k_yx, k_zx = d * k_xx, d * k_yx, d * k_zx
        k_xy = d * (c_xz * c_zy - c_xy * c_zz)
        k_yy = d * (c_xx * c_zz - c_xz * c_zx)
        k_zy = d * (c_xy * c_zx - c_xx * c_zy)
        k_xz = d * (c_xy * c_yz - c_xz * c_yy)
        k_yz = d * (c_xz * c_yx - c_xx * c_yz)
        k_zz = d * (c_xx * c_yy - c_xy * c_yx)
        a_xx, a_xy, a_xz = inverse_s * k_xx, inverse_s * k_xy, inverse_s * k_xz
        a_yx, a_yy, a_yz = inverse_s * k_yx, inverse_s * k_yy, inverse_s * k_yz
        a_zx, a_zy, a_zz = inverse_s * k_zx, inverse_s * k_zy, inverse_s * k_zz
        b_x, b_y, b_z = (k_xx * b_x + k_xy * b_y + k_xz * b_z, k_yx * b_x + k_yy * b_y + k_yz * b_z,
                         k_zx * b_x + k_zy * b_y + k_zz * b_z)  # fmt: skip
    if not good:
        a_xx = a_yy = a_zz = 1.0
        a_xy = a_xz = a_yx = a_yz = a_zx = a_zy = b_x = b_y = b_z = 0.0
    out[i, A] = a_xx
    out[i, B] = b_x
    out[i, FALLBACKS] = 0.0 if good else total(count)
    if DIM == 2:
        out[i, A + 1], out[i, A + 2], out[i, A + 3] = a_xy, a_yx, a_yy
        out[i, B + 1] = b_y
    if DIM == 3:
        out[i, A + 1], out[i, A + 2] = a_xy, a_xz
        out[i, A + 3], out[i, A + 4], out[i, A + 5] = a_yx, a_yy, a_yz
        out[i, A + 6], out[i, A + 7], out[i, A + 8] = a_zx, a_zy, a_zz
        out[i, B + 1], out[i, B + 2] = b_y, b_z
