"""Sums of SPH-projection over a particle's neighbours (Farahani 2009), one a pass.

    velocity_gradient    L_a = - sum_b V_b u_ab (x) grad W_ab                                 and f_ab, kept
    stress_divergence    T_a =   sum_b m_b (S_a/rho_a^2 + S_b/rho_b^2) . grad W_ab            eq. 21
    poisson              D_a =   sum_b V_b u~_ab . grad W_ab                                  eq. 25
                         A_a =   sum_b m_b c_ab,   Q_a = sum_b m_b c_ab P_b                   eqs. 28-30
                         c_ab = 8 x_ab . grad W_ab / ((rho_a + rho_b)^2 (r^2 + eta^2))
    pressure_gradient    G_a =   sum_b (w_b P_b + w_b P_a) grad W_ab / rho_a                  see below

grad W_ab = f_ab x_ab, and all four passes use the kernels at the start of the step: f is found once.

The last one has two forms. The conjugate of the divergence, w = V, is (P_a + P_b)/(rho_a rho_b); eq. 31
as printed has P_a/rho_a^2 + P_b/rho_b^2, which is the same for equal densities only. What a particle shows
(`w`, `wp`) and its own factor make the one or the other of the same loop.
"""

from __future__ import annotations

import numpy as np

from hvisph.core.blocks import eight_at, put_eight
from hvisph.core.lanes import LANES, all_lanes, total
from hvisph.core.simd import neighbours
from hvisph.sph.rows import RowLayout


def motion_layout(dim: int) -> RowLayout:
    """Return what the velocity gradient reads: position, velocity, smoothing length, volume."""
    return RowLayout(dim, (("x", "vector"), ("u", "vector"), ("h", "scalar"), ("v", "scalar")))


def stress_layout(dim: int) -> RowLayout:
    """Return what the stress divergence reads: position, mass, S/rho^2."""
    return RowLayout(dim, (("x", "vector"), ("m", "scalar"), ("t", "symmetric")))


def poisson_layout(dim: int) -> RowLayout:
    """Return what the density and Poisson sums read: position, velocity, volume, density, old pressure."""
    return RowLayout(dim, (("x", "vector"), ("u", "vector"), ("v", "scalar"), ("rho", "scalar"), ("p", "scalar")))


def pressure_layout(dim: int) -> RowLayout:
    """Return what the pressure gradient reads: position, weight, weight times pressure."""
    return RowLayout(dim, (("x", "vector"), ("w", "scalar"), ("wp", "scalar")))


def velocity_gradient(near, first, last, rows, i, kernels):
    """Return the nine components of L [1/s], and keep f of each pair in `kernels`."""
    x = rows[i, 0]
    y = rows[i, 1] if DIM > 1 else 0.0
    z = rows[i, 2] if DIM > 2 else 0.0
    u = rows[i, U]
    v = rows[i, U + 1] if DIM > 1 else 0.0
    w = rows[i, U + 2] if DIM > 2 else 0.0
    h = rows[i, H]
    l_xx = l_xy = l_xz = l_yx = l_yy = l_yz = l_zx = l_zy = l_zz = all_lanes(0.0)
    for k in range(first, last, np.uint64(LANES)):
        b = neighbours(rows, near, k, WIDTH)
        dx = x - b[0]
        dy = y - b[1] if DIM > 1 else 0.0
        dz = z - b[2] if DIM > 2 else 0.0
        r2 = dx * dx
        if DIM > 1:
            r2 += dy * dy
        if DIM > 2:
            r2 += dz * dz
        hm = 0.5 * (h + b[H])
        r = np.sqrt(r2)
        # One division for 1/h and 1/r.
        inverse = 1.0 / (hm * r)
        ih = r * inverse
        f = scale(ih) * slope(r * ih) * (hm * inverse)
        put_eight(kernels, k, f)
        f *= b[V]
        du = f * (u - b[U])
        l_xx -= du * dx
        if DIM > 1:
            dv = f * (v - b[U + 1])
            l_xy -= du * dy
            l_yx -= dv * dx
            l_yy -= dv * dy
        if DIM > 2:
            dw = f * (w - b[U + 2])
            l_xz -= du * dz
            l_yz -= dv * dz
            l_zx -= dw * dx
            l_zy -= dw * dy
            l_zz -= dw * dz
    return (total(l_xx), total(l_xy), total(l_xz), total(l_yx), total(l_yy), total(l_yz),
            total(l_zx), total(l_zy), total(l_zz))  # fmt: skip


def stress_divergence(near, first, last, rows, i, kernels):
    """Return the acceleration by the deviators [m/s^2], three components."""
    x = rows[i, 0]
    y = rows[i, 1] if DIM > 1 else 0.0
    z = rows[i, 2] if DIM > 2 else 0.0
    t_xx = rows[i, T]
    t_yy = rows[i, T + 1] if DIM > 1 else 0.0
    t_xy = rows[i, T + DIM] if DIM > 1 else 0.0
    t_zz = rows[i, T + 2] if DIM > 2 else 0.0
    t_xz = rows[i, T + 4] if DIM > 2 else 0.0
    t_yz = rows[i, T + 5] if DIM > 2 else 0.0
    a_x = a_y = a_z = all_lanes(0.0)
    for k in range(first, last, np.uint64(LANES)):
        b = neighbours(rows, near, k, WIDTH)
        f = b[M] * eight_at(kernels, k)
        g_x = f * (x - b[0])
        s_xx = t_xx + b[T]
        if DIM == 1:
            a_x += s_xx * g_x
        if DIM > 1:
            g_y = f * (y - b[1])
            s_yy = t_yy + b[T + 1]
            s_xy = t_xy + b[T + DIM]
            if DIM == 2:
                a_x += s_xx * g_x + s_xy * g_y
                a_y += s_xy * g_x + s_yy * g_y
        if DIM > 2:
            g_z = f * (z - b[2])
            s_zz = t_zz + b[T + 2]
            s_xz = t_xz + b[T + 4]
            s_yz = t_yz + b[T + 5]
            a_x += s_xx * g_x + s_xy * g_y + s_xz * g_z
            a_y += s_xy * g_x + s_yy * g_y + s_yz * g_z
            a_z += s_xz * g_x + s_yz * g_y + s_zz * g_z
    return total(a_x), total(a_y), total(a_z)


def poisson(near, first, last, rows, i, kernels, eta2):
    """Return D [1/s], the rate at which density is lost over density, A [m/kg] and Q [1/s^2]."""
    x = rows[i, 0]
    y = rows[i, 1] if DIM > 1 else 0.0
    z = rows[i, 2] if DIM > 2 else 0.0
    u = rows[i, U]
    v = rows[i, U + 1] if DIM > 1 else 0.0
    w = rows[i, U + 2] if DIM > 2 else 0.0
    rho = rows[i, RHO]
    divergence = diagonal = others = all_lanes(0.0)
    for k in range(first, last, np.uint64(LANES)):
        b = neighbours(rows, near, k, WIDTH)
        dx = x - b[0]
        r2 = dx * dx
        ux = (u - b[U]) * dx
        if DIM > 1:
            dy = y - b[1]
            r2 += dy * dy
            ux += (v - b[U + 1]) * dy
        if DIM > 2:
            dz = z - b[2]
            r2 += dz * dz
            ux += (w - b[U + 2]) * dz
        f = b[V] * eight_at(kernels, k)
        divergence += f * ux
        densities = rho + b[RHO]
        c = f * r2 * b[RHO] / (densities * densities * (r2 + eta2))
        diagonal += c
        others += c * b[P]
    return total(divergence), 8.0 * total(diagonal), 8.0 * total(others)


def pressure_gradient(near, first, last, rows, i, kernels, own):
    """Return sum_b (w_b P_b + w_b `own`) grad W_ab, three components."""
    x = rows[i, 0]
    y = rows[i, 1] if DIM > 1 else 0.0
    z = rows[i, 2] if DIM > 2 else 0.0
    a_x = a_y = a_z = all_lanes(0.0)
    for k in range(first, last, np.uint64(LANES)):
        b = neighbours(rows, near, k, WIDTH)
        f = (b[WP] + own * b[W]) * eight_at(kernels, k)
        a_x += f * (x - b[0])
        if DIM > 1:
            a_y += f * (y - b[1])
        if DIM > 2:
            a_z += f * (z - b[2])
    return total(a_x), total(a_y), total(a_z)
