"""CON: contact (Riemann) SPH of elastic-plastic solids, with optional limited reconstruction.

In each pair the acoustic Riemann problem along the line of centres e = (x_b - x_a)/r gives
a contact velocity and traction, normal with the impedance rho c_l, tangential with rho c_t:

    u* = (Z_a u_a + Z_b u_b + t_b - t_a) / (Z_a + Z_b)
    t* = (Z_b t_a + Z_a t_b + Z_a Z_b (u_b - u_a)) / (Z_a + Z_b),        t = sigma e
    F    = 2 V_a V_b |dW/dr| t*                   force on a, -F on b
    L_a += 2 V_b |dW/dr| (u* - u_a) (x) e
    m_a de_a += F . (u* - u_a)

Reconstruction moves each side's value halfway to the other by a limited slope: with d = f_b - f_a
and D = (grad f_a . e) r,  f_a += lim(d, 2 D - d)/2. Gradients are renormalised and come from a first
pass over the same neighbours (`gradients`), which writes them into the particle's own row.
The tangential part is limited as a vector, so the result does not depend on the frame.

Source: Parshikov & Medin 2002 as used by Mehra & Chaturvedi 2006; reconstruction after van Leer 1979.
"""

from __future__ import annotations

import numpy as np

from hvisph.core.jit import compiled
from hvisph.core.lanes import LANES, all_lanes, total
from hvisph.core.simd import neighbours
from hvisph.sph.rows import RowLayout

# Keeps a pair without any shear impedance from dividing zero by zero.
TINY = 1e-30

# A neighbourhood whose shape matrix has less than this share of a round one's determinant keeps the
# plain gradient: a particle with one or two neighbours, or a string of them.
SINGULAR = 0.05


def row_layout(dim: int, reconstruct: bool) -> RowLayout:
    """Return what a particle shows its neighbours; T is the stress, GU, GT are the gradients of U, T."""
    fields = [("x", "vector"), ("u", "vector"), ("h", "scalar"), ("v", "scalar"), ("zn", "scalar"),
              ("zt", "scalar"), ("t", "symmetric")]  # fmt: skip
    if reconstruct:
        fields += [("gu", "gradient"), ("gt", "symmetric_gradient")]
    fields.append(("m", "scalar"))  # the pairs never read it
    return RowLayout(dim, tuple(fields))


@compiled
def minmod(a, b):
    """Return the smaller in size of `a` and `b`, 0 where their signs differ."""
    return 0.5 * (np.copysign(1.0, a) + np.copysign(1.0, b)) * min(abs(a), abs(b))


@compiled
def van_leer(a, b):
    """Return the harmonic mean of `a` and `b`, 0 where their signs differ."""
    product = max(a * b, 0.0)
    return 2.0 * product * (a + b) / ((a + b) * (a + b) + TINY)


@compiled
def minmod_share(a, b):
    """Return minmod(a, b) / a for a >= 0, 0 for a = 0."""
    return max(min(a, b), 0.0) / (a + TINY)


@compiled
def van_leer_share(a, b):
    """Return van_leer(a, b) / a for a >= 0, 0 for a = 0."""
    b = max(b, 0.0)
    return 2.0 * b / (a + b + TINY)


LIMITERS = {"minmod": (minmod, minmod_share), "van_leer": (van_leer, van_leer_share)}


def gradients(near, n, rows, i, constants, out):
    """Write the renormalised gradients of velocity and stress into row `i`."""
    x = rows[i, 0]
    y = rows[i, 1] if DIM > 1 else 0.0
    z = rows[i, 2] if DIM > 2 else 0.0
    h = rows[i, H]
    none = all_lanes(0.0)
    m_xx = m_yy = m_zz = m_xy = m_xz = m_yz = none
    u_xx = u_xy = u_xz = u_yx = u_yy = u_yz = u_zx = u_zy = u_zz = none
    xx_x = xx_y = xx_z = yy_x = yy_y = yy_z = zz_x = zz_y = zz_z = none
    xy_x = xy_y = xy_z = xz_x = xz_y = xz_z = yz_x = yz_y = yz_z = none
    u = rows[i, U]
    s_xx = rows[i, T]
    if DIM > 1:
        v = rows[i, U + 1]
        s_yy = rows[i, T + 1]
        s_xy = rows[i, T + DIM]
    if DIM > 2:
        w = rows[i, U + 2]
        s_zz = rows[i, T + 2]
        s_xz = rows[i, T + 4]
        s_yz = rows[i, T + 5]
    for k in range(np.uint64(0), n, np.uint64(LANES)):
        b = neighbours(rows, near, k, WIDTH)
        dx = b[0] - x
        dy = b[1] - y if DIM > 1 else 0.0
        dz = b[2] - z if DIM > 2 else 0.0
        r = np.sqrt(dx * dx + dy * dy + dz * dz)
        ih = 2.0 / (h + b[H])
        f = -b[V] * scale(ih) * slope(r * ih) / r
        g_x = f * dx
        g_y = f * dy if DIM > 1 else 0.0
        g_z = f * dz if DIM > 2 else 0.0
        m_xx += dx * g_x
        d = b[U] - u
        u_xx += d * g_x
        e = b[T] - s_xx
        xx_x += e * g_x
        if DIM > 1:
            m_yy += dy * g_y
            m_xy += dx * g_y
            u_xy += d * g_y
            d = b[U + 1] - v
            u_yx += d * g_x
            u_yy += d * g_y
            xx_y += e * g_y
            e = b[T + 1] - s_yy
            yy_x += e * g_x
            yy_y += e * g_y
            e = b[T + DIM] - s_xy
            xy_x += e * g_x
            xy_y += e * g_y
        if DIM > 2:
            m_zz += dz * g_z
            m_xz += dx * g_z
            m_yz += dy * g_z
            u_yz += d * g_z
            u_xz += (b[U] - u) * g_z
            d = b[U + 2] - w
            u_zx += d * g_x
            u_zy += d * g_y
            u_zz += d * g_z
            xy_z += e * g_z
            xx_z += (b[T] - s_xx) * g_z
            yy_z += (b[T + 1] - s_yy) * g_z
            e = b[T + 2] - s_zz
            zz_x += e * g_x
            zz_y += e * g_y
            zz_z += e * g_z
            e = b[T + 4] - s_xz
            xz_x += e * g_x
            xz_y += e * g_y
            xz_z += e * g_z
            e = b[T + 5] - s_yz
            yz_x += e * g_x
            yz_y += e * g_y
            yz_z += e * g_z
    b_xx, b_yy, b_zz = total(m_xx), total(m_yy), total(m_zz)
    b_xy, b_xz, b_yz = total(m_xy), total(m_xz), total(m_yz)
    if DIM == 1:
        k_xx = 1.0 / b_xx if b_xx > SINGULAR else 1.0
        out[i, GU] = total(u_xx) * k_xx
        out[i, GT] = total(xx_x) * k_xx
    elif DIM == 2:
        determinant = b_xx * b_yy - b_xy * b_xy
        k_xx, k_yy, k_xy = 1.0, 1.0, 0.0
        if determinant > SINGULAR * 0.25 * (b_xx + b_yy) ** 2 and b_xx + b_yy > SINGULAR:
            k_xx, k_yy, k_xy = b_yy / determinant, b_xx / determinant, -b_xy / determinant
        out[i, GU] = total(u_xx) * k_xx + total(u_xy) * k_xy
        out[i, GU + 1] = total(u_xx) * k_xy + total(u_xy) * k_yy
        out[i, GU + 2] = total(u_yx) * k_xx + total(u_yy) * k_xy
        out[i, GU + 3] = total(u_yx) * k_xy + total(u_yy) * k_yy
        out[i, GT] = total(xx_x) * k_xx + total(xx_y) * k_xy
        out[i, GT + 1] = total(xx_x) * k_xy + total(xx_y) * k_yy
        out[i, GT + 2] = total(yy_x) * k_xx + total(yy_y) * k_xy
        out[i, GT + 3] = total(yy_x) * k_xy + total(yy_y) * k_yy
        out[i, GT + 4] = total(xy_x) * k_xx + total(xy_y) * k_xy
        out[i, GT + 5] = total(xy_x) * k_xy + total(xy_y) * k_yy
    else:
        c_xx = b_yy * b_zz - b_yz * b_yz
        c_xy = b_xz * b_yz - b_xy * b_zz
        c_xz = b_xy * b_yz - b_xz * b_yy
        determinant = b_xx * c_xx + b_xy * c_xy + b_xz * c_xz
        trace = (b_xx + b_yy + b_zz) / 3.0
        k_xx, k_yy, k_zz, k_xy, k_xz, k_yz = 1.0, 1.0, 1.0, 0.0, 0.0, 0.0
        if determinant > SINGULAR * trace**3 and trace > SINGULAR:
            k = 1.0 / determinant
            k_xx, k_xy, k_xz = c_xx * k, c_xy * k, c_xz * k
            k_yy = (b_xx * b_zz - b_xz * b_xz) * k
            k_yz = (b_xy * b_xz - b_xx * b_yz) * k
            k_zz = (b_xx * b_yy - b_xy * b_xy) * k
        sums = (
            (u_xx, u_xy, u_xz), (u_yx, u_yy, u_yz), (u_zx, u_zy, u_zz),
            (xx_x, xx_y, xx_z), (yy_x, yy_y, yy_z), (zz_x, zz_y, zz_z),
            (xy_x, xy_y, xy_z), (xz_x, xz_y, xz_z), (yz_x, yz_y, yz_z),
        )  # fmt: skip
        for f in range(9):
            a, b, c = total(sums[f][0]), total(sums[f][1]), total(sums[f][2])
            out[i, GU + 3 * f] = a * k_xx + b * k_xy + c * k_xz
            out[i, GU + 3 * f + 1] = a * k_xy + b * k_yy + c * k_yz
            out[i, GU + 3 * f + 2] = a * k_xz + b * k_yz + c * k_zz


def accumulate(near, n, rows, i, constants, out):
    """Sum the rates of particle `i` over its neighbours."""
    x = rows[i, 0]
    u = rows[i, U]
    h = rows[i, H]
    zn = rows[i, ZN]
    zt = rows[i, ZT]
    s_xx = rows[i, T]
    if DIM > 1:
        y = rows[i, 1]
        v = rows[i, U + 1]
        s_yy = rows[i, T + 1]
        s_xy = rows[i, T + DIM]
    else:
        y = v = s_yy = s_xy = 0.0
    if DIM > 2:
        z = rows[i, 2]
        w = rows[i, U + 2]
        s_zz = rows[i, T + 2]
        s_xz = rows[i, T + 4]
        s_yz = rows[i, T + 5]
    else:
        z = w = s_zz = s_xz = s_yz = 0.0
    if RECONSTRUCTION:
        gu_xx = rows[i, GU]
        gt_xx_x = rows[i, GT]
        if DIM == 2:
            gu_xy, gu_yx, gu_yy = rows[i, GU + 1], rows[i, GU + 2], rows[i, GU + 3]
            gt_xx_y, gt_yy_x, gt_yy_y = rows[i, GT + 1], rows[i, GT + 2], rows[i, GT + 3]
            gt_xy_x, gt_xy_y = rows[i, GT + 4], rows[i, GT + 5]
    none = all_lanes(0.0)
    l_xx = l_xy = l_xz = l_yx = l_yy = l_yz = l_zx = l_zy = l_zz = none
    a_x = a_y = a_z = power = none
    for k in range(np.uint64(0), n, np.uint64(LANES)):
        b = neighbours(rows, near, k, WIDTH)
        dx = b[0] - x
        dy = b[1] - y if DIM > 1 else 0.0
        dz = b[2] - z if DIM > 2 else 0.0
        r2 = dx * dx + dy * dy + dz * dz
        r = np.sqrt(r2)
        ih = 2.0 / (h + b[H])
        ir = 1.0 / r
        g = -2.0 * b[V] * scale(ih) * slope(r * ih)
        e_x = dx * ir
        e_y = dy * ir if DIM > 1 else 0.0
        e_z = dz * ir if DIM > 2 else 0.0
        # Tractions on e and velocities of both sides, then their parts along e.
        b_u = b[U]
        b_v = b[U + 1] if DIM > 1 else 0.0
        b_w = b[U + 2] if DIM > 2 else 0.0
        if DIM == 1:
            ta_x, ta_y, ta_z = s_xx * e_x, 0.0, 0.0
            tb_x, tb_y, tb_z = b[T] * e_x, 0.0, 0.0
        elif DIM == 2:
            ta_x, ta_y, ta_z = s_xx * e_x + s_xy * e_y, s_xy * e_x + s_yy * e_y, 0.0
            b_xy = b[T + DIM]
            tb_x, tb_y, tb_z = b[T] * e_x + b_xy * e_y, b_xy * e_x + b[T + 1] * e_y, 0.0
        else:
            ta_x = s_xx * e_x + s_xy * e_y + s_xz * e_z
            ta_y = s_xy * e_x + s_yy * e_y + s_yz * e_z
            ta_z = s_xz * e_x + s_yz * e_y + s_zz * e_z
            b_xy, b_xz, b_yz = b[T + DIM], b[T + 4], b[T + 5]
            tb_x = b[T] * e_x + b_xy * e_y + b_xz * e_z
            tb_y = b_xy * e_x + b[T + 1] * e_y + b_yz * e_z
            tb_z = b_xz * e_x + b_yz * e_y + b[T + 2] * e_z
        ua_n = u * e_x + v * e_y + w * e_z
        ub_n = b_u * e_x + b_v * e_y + b_w * e_z
        ta_n = ta_x * e_x + ta_y * e_y + ta_z * e_z
        tb_n = tb_x * e_x + tb_y * e_y + tb_z * e_z
        if DIM == 2:
            ua_t, ub_t = v * e_x - u * e_y, b_v * e_x - b_u * e_y
            ta_t, tb_t = ta_y * e_x - ta_x * e_y, tb_y * e_x - tb_x * e_y
        if DIM == 3:
            ua_x, ua_y, ua_z = u - ua_n * e_x, v - ua_n * e_y, w - ua_n * e_z
            ub_x, ub_y, ub_z = b_u - ub_n * e_x, b_v - ub_n * e_y, b_w - ub_n * e_z
            ta_x, ta_y, ta_z = ta_x - ta_n * e_x, ta_y - ta_n * e_y, ta_z - ta_n * e_z
            tb_x, tb_y, tb_z = tb_x - tb_n * e_x, tb_y - tb_n * e_y, tb_z - tb_n * e_z
        if RECONSTRUCTION:
            if DIM == 1:
                du_a, du_b = gu_xx * r, b[GU] * r
                d = ub_n - ua_n
                ua_n, ub_n = ua_n + 0.5 * limit(d, 2.0 * du_a - d), ub_n - 0.5 * limit(d, 2.0 * du_b - d)
                d = tb_n - ta_n
                dt_a, dt_b = gt_xx_x * dx, b[GT] * dx
                ta_n, tb_n = ta_n + 0.5 * limit(d, 2.0 * dt_a - d), tb_n - 0.5 * limit(d, 2.0 * dt_b - d)
            if DIM == 2:
                p, q = gu_xx * dx + gu_xy * dy, gu_yx * dx + gu_yy * dy
                da_n, da_t = p * e_x + q * e_y, q * e_x - p * e_y
                p = b[GU] * dx + b[GU + 1] * dy
                q = b[GU + 2] * dx + b[GU + 3] * dy
                db_n, db_t = p * e_x + q * e_y, q * e_x - p * e_y
                d = ub_n - ua_n
                ua_n += 0.5 * limit(d, 2.0 * da_n - d)
                ub_n -= 0.5 * limit(d, 2.0 * db_n - d)
                d = ub_t - ua_t
                ua_t += 0.5 * limit(d, 2.0 * da_t - d)
                ub_t -= 0.5 * limit(d, 2.0 * db_t - d)
                m_xx, m_yy = gt_xx_x * dx + gt_xx_y * dy, gt_yy_x * dx + gt_yy_y * dy
                m_xy = gt_xy_x * dx + gt_xy_y * dy
                p, q = m_xx * e_x + m_xy * e_y, m_xy * e_x + m_yy * e_y
                da_n, da_t = p * e_x + q * e_y, q * e_x - p * e_y
                m_xx = b[GT] * dx + b[GT + 1] * dy
                m_yy = b[GT + 2] * dx + b[GT + 3] * dy
                m_xy = b[GT + 4] * dx + b[GT + 5] * dy
                p, q = m_xx * e_x + m_xy * e_y, m_xy * e_x + m_yy * e_y
                db_n, db_t = p * e_x + q * e_y, q * e_x - p * e_y
                d = tb_n - ta_n
                ta_n += 0.5 * limit(d, 2.0 * da_n - d)
                tb_n -= 0.5 * limit(d, 2.0 * db_n - d)
                d = tb_t - ta_t
                ta_t += 0.5 * limit(d, 2.0 * da_t - d)
                tb_t -= 0.5 * limit(d, 2.0 * db_t - d)
            if DIM == 3:
                pa_x = rows[i, GU] * dx + rows[i, GU + 1] * dy + rows[i, GU + 2] * dz
                pa_y = rows[i, GU + 3] * dx + rows[i, GU + 4] * dy + rows[i, GU + 5] * dz
                pa_z = rows[i, GU + 6] * dx + rows[i, GU + 7] * dy + rows[i, GU + 8] * dz
                pb_x = b[GU] * dx + b[GU + 1] * dy + b[GU + 2] * dz
                pb_y = b[GU + 3] * dx + b[GU + 4] * dy + b[GU + 5] * dz
                pb_z = b[GU + 6] * dx + b[GU + 7] * dy + b[GU + 8] * dz
                qa_x, qa_y, qa_z = _traction_slope(rows[i, GT], rows[i, GT + 1], rows[i, GT + 2],
                    rows[i, GT + 3], rows[i, GT + 4], rows[i, GT + 5], rows[i, GT + 6], rows[i, GT + 7],
                    rows[i, GT + 8], rows[i, GT + 9], rows[i, GT + 10], rows[i, GT + 11], rows[i, GT + 12],
                    rows[i, GT + 13], rows[i, GT + 14], rows[i, GT + 15], rows[i, GT + 16], rows[i, GT + 17],
                    dx, dy, dz, e_x, e_y, e_z)  # fmt: skip
                qb_x, qb_y, qb_z = _traction_slope(b[GT], b[GT + 1], b[GT + 2],
                    b[GT + 3], b[GT + 4], b[GT + 5], b[GT + 6], b[GT + 7],
                    b[GT + 8], b[GT + 9], b[GT + 10], b[GT + 11], b[GT + 12],
                    b[GT + 13], b[GT + 14], b[GT + 15], b[GT + 16], b[GT + 17],
                    dx, dy, dz, e_x, e_y, e_z)  # fmt: skip
                d = ub_n - ua_n
                pa_n = pa_x * e_x + pa_y * e_y + pa_z * e_z
                pb_n = pb_x * e_x + pb_y * e_y + pb_z * e_z
                ua_n += 0.5 * limit(d, 2.0 * pa_n - d)
                ub_n -= 0.5 * limit(d, 2.0 * pb_n - d)
                d = tb_n - ta_n
                qa_n = qa_x * e_x + qa_y * e_y + qa_z * e_z
                qb_n = qb_x * e_x + qb_y * e_y + qb_z * e_z
                ta_n += 0.5 * limit(d, 2.0 * qa_n - d)
                tb_n -= 0.5 * limit(d, 2.0 * qb_n - d)
                d_x, d_y, d_z = ub_x - ua_x, ub_y - ua_y, ub_z - ua_z
                d2 = d_x * d_x + d_y * d_y + d_z * d_z
                fa = 0.5 * share(d2, 2.0 * (pa_x * d_x + pa_y * d_y + pa_z * d_z) - d2)
                fb = 0.5 * share(d2, 2.0 * (pb_x * d_x + pb_y * d_y + pb_z * d_z) - d2)
                ua_x, ua_y, ua_z = ua_x + fa * d_x, ua_y + fa * d_y, ua_z + fa * d_z
                ub_x, ub_y, ub_z = ub_x - fb * d_x, ub_y - fb * d_y, ub_z - fb * d_z
                d_x, d_y, d_z = tb_x - ta_x, tb_y - ta_y, tb_z - ta_z
                d2 = d_x * d_x + d_y * d_y + d_z * d_z
                fa = 0.5 * share(d2, 2.0 * (qa_x * d_x + qa_y * d_y + qa_z * d_z) - d2)
                fb = 0.5 * share(d2, 2.0 * (qb_x * d_x + qb_y * d_y + qb_z * d_z) - d2)
                ta_x, ta_y, ta_z = ta_x + fa * d_x, ta_y + fa * d_y, ta_z + fa * d_z
                tb_x, tb_y, tb_z = tb_x - fb * d_x, tb_y - fb * d_y, tb_z - fb * d_z
        # The acoustic Riemann problem, normal and tangential.
        zb = b[ZN]
        inverse = 1.0 / (zn + zb)
        star_u = (zn * ua_n + zb * ub_n + tb_n - ta_n) * inverse
        star_t = (zb * ta_n + zn * tb_n + zn * zb * (ub_n - ua_n)) * inverse
        us_x = star_u * e_x - u
        us_y = star_u * e_y - v
        us_z = star_u * e_z - w
        ts_x = star_t * e_x
        ts_y = star_t * e_y
        ts_z = star_t * e_z
        if DIM > 1:
            zb = b[ZT]
            inverse = 1.0 / (zt + zb + TINY)
        if DIM == 2:
            star_u = (zt * ua_t + zb * ub_t + tb_t - ta_t) * inverse
            star_t = (zb * ta_t + zt * tb_t + zt * zb * (ub_t - ua_t)) * inverse
            us_x -= star_u * e_y
            us_y += star_u * e_x
            ts_x -= star_t * e_y
            ts_y += star_t * e_x
        if DIM == 3:
            us_x += (zt * ua_x + zb * ub_x + tb_x - ta_x) * inverse
            us_y += (zt * ua_y + zb * ub_y + tb_y - ta_y) * inverse
            us_z += (zt * ua_z + zb * ub_z + tb_z - ta_z) * inverse
            ts_x += (zb * ta_x + zt * tb_x + zt * zb * (ub_x - ua_x)) * inverse
            ts_y += (zb * ta_y + zt * tb_y + zt * zb * (ub_y - ua_y)) * inverse
            ts_z += (zb * ta_z + zt * tb_z + zt * zb * (ub_z - ua_z)) * inverse
        a_x += g * ts_x
        power += g * (ts_x * us_x + ts_y * us_y + ts_z * us_z)
        ge_x = g * e_x
        l_xx += us_x * ge_x
        if DIM > 1:
            a_y += g * ts_y
            ge_y = g * e_y
            l_xy += us_x * ge_y
            l_yx += us_y * ge_x
            l_yy += us_y * ge_y
        if DIM > 2:
            a_z += g * ts_z
            ge_z = g * e_z
            l_xz += us_x * ge_z
            l_yz += us_y * ge_z
            l_zx += us_z * ge_x
            l_zy += us_z * ge_y
            l_zz += us_z * ge_z
    weight = rows[i, V] / rows[i, M]
    write_rates(out, i, weight * total(a_x), weight * total(a_y), weight * total(a_z),
                weight * total(power), 0.0,
                total(l_xx), total(l_xy), total(l_xz), total(l_yx), total(l_yy), total(l_yz),
                total(l_zx), total(l_zy), total(l_zz))  # fmt: skip


@compiled
def _traction_slope(xx_x, xx_y, xx_z, yy_x, yy_y, yy_z, zz_x, zz_y, zz_z, xy_x, xy_y, xy_z,
                    xz_x, xz_y, xz_z, yz_x, yz_y, yz_z, dx, dy, dz, e_x, e_y, e_z):  # fmt: skip
    """Return ((grad sigma) . d) . e from the gradients of the six stress components."""
    m_xx = xx_x * dx + xx_y * dy + xx_z * dz
    m_yy = yy_x * dx + yy_y * dy + yy_z * dz
    m_zz = zz_x * dx + zz_y * dy + zz_z * dz
    m_xy = xy_x * dx + xy_y * dy + xy_z * dz
    m_xz = xz_x * dx + xz_y * dy + xz_z * dz
    m_yz = yz_x * dx + yz_y * dy + yz_z * dz
    return (m_xx * e_x + m_xy * e_y + m_xz * e_z, m_xy * e_x + m_yy * e_y + m_yz * e_z,
            m_xz * e_x + m_yz * e_y + m_zz * e_z)  # fmt: skip
