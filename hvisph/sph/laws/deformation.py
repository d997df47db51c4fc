"""Deformation gradients and stress of Total Lagrangian particles, from their reference neighbours.

    F_a = F0_a + sum_b (x_b - x_a) (x) V0_b g_ab,   J = det F,   L = Fdot F^-1,   rho = rho0 / J
    P = J sigma F^-T,      Q = P A,  q = P B        (A, B: the corrections, see `sph.reference`)

Eulerian particles with Total Lagrangian neighbours have F, too, and carry their own sigma to P (Young 2021
eq. 13); density and velocity gradient are their own. Row i is written by i alone.
"""

from __future__ import annotations

import numpy as np

from hvisph.core.blocks import eight_at
from hvisph.core.jit import prange
from hvisph.core.lanes import LANES, all_lanes, total
from hvisph.core.simd import neighbours

CHUNK = 256


def deform(rows, active, state, stage, starts, near, slopes, shapes, matrix, vector, start_gradient, volume,
           tags, table, models,
           loads, signal_alpha, jacobians, strains, pressures, signals, rates):  # fmt: skip
    """Compute the deformation of all particles that are `active`: the template.

    Parameters
    ----------
    rows
        Packed rows (n + images + 1, width): positions and velocities of the stage; Q, and of Total
        Lagrangian particles density and sound speed, are written.
    active
        (n,) uint8: not 0 where F is needed, 2 where Total Lagrangian and Eulerian particles meet.
    state, stage
        The state, whose density is set to one from which continuity over a step ends on rho0/J, and how
        far the stage is ahead of it [s].
    starts, near, slopes, shapes, matrix, vector, start_gradient, volume
        The reference neighbours.
    tags, table, models
        Materials.
    loads
        Pressure added to each particle's own [Pa] (n,).
    signal_alpha
        1.2 alpha of the viscosity.
    jacobians, strains
        (n,) receive J and the deviatoric Green-Lagrange equivalent strain.
    pressures, signals
        (n,) pressure [Pa] and signal speed [m/s]: those of Total Lagrangian particles are renewed.
    rates
        (n, width of rates): receives the velocity gradient of Total Lagrangian particles, and of those that
        meet no Eulerian ones the power of their own stress.
    """
    count = np.uint64(active.shape[0])
    for chunk in prange((count + np.uint64(CHUNK - 1)) // np.uint64(CHUNK)):
        one, two = np.uint64(1), np.uint64(2)
        first = np.uint64(chunk) * np.uint64(CHUNK)
        for i in range(first, min(first + np.uint64(CHUNK), count)):
            if active[i] == 0:
                continue
            x = rows[i, 0]
            y = rows[i, 1] if DIM > 1 else 0.0
            z = rows[i, 2] if DIM > 2 else 0.0
            u = rows[i, U]
            v = rows[i, U + 1] if DIM > 1 else 0.0
            w = rows[i, U + 2] if DIM > 2 else 0.0
            x0 = rows[i, X0]
            y0 = rows[i, X0 + 1] if DIM > 1 else 0.0
            z0 = rows[i, X0 + 2] if DIM > 2 else 0.0
            m_xx = m_xy = m_xz = m_yx = m_yy = m_yz = m_zx = m_zy = m_zz = m_x = m_y = m_z = all_lanes(0.0)
            n_xx = n_xy = n_xz = n_yx = n_yy = n_yz = n_zx = n_zy = n_zz = n_x = n_y = n_z = all_lanes(0.0)
            for k in range(np.uint64(starts[i]), np.uint64(starts[i + one]), np.uint64(LANES)):
                b = neighbours(rows, near, k, PLACES)
                s = eight_at(slopes, k)
                dx, du = b[0] - x, b[U] - u
                g_x = s * (x0 - b[X0])
                m_xx += dx * g_x
                n_xx += du * g_x
                if DIM > 1:
                    dy, dv = b[1] - y, b[U + 1] - v
                    g_y = s * (y0 - b[X0 + 1])
                    m_xy += dx * g_y
                    m_yx += dy * g_x
                    m_yy += dy * g_y
                    n_xy += du * g_y
                    n_yx += dv * g_x
                    n_yy += dv * g_y
                if DIM > 2:
                    dz, dw = b[2] - z, b[U + 2] - w
                    g_z = s * (z0 - b[X0 + 2])
                    m_xz += dx * g_z
                    m_yz += dy * g_z
                    m_zx += dz * g_x
                    m_zy += dz * g_y
                    m_zz += dz * g_z
                    n_xz += du * g_z
                    n_yz += dv * g_z
                    n_zx += dw * g_x
                    n_zy += dw * g_y
                    n_zz += dw * g_z
                if MIXED:
                    g = eight_at(shapes, k)
                    m_x += dx * g
                    n_x += du * g
                    if DIM > 1:
                        m_y += dy * g
                        n_y += dv * g
                    if DIM > 2:
                        m_z += dz * g
                        n_z += dw * g
            kind = rows[i, KIND]
            m = np.uint64(tags[i, 2])
            rho = rows[i, RHO]
            if DIM == 1:
                a_xx, b_x = matrix[i, 0, 0], vector[i, 0]
                f_xx = start_gradient[i, 0, 0] + total(m_xx) * a_xx + total(m_x) * b_x
                d_xx = total(n_xx) * a_xx + total(n_x) * b_x
                j = f_xx
                i_xx = 1.0 / f_xx
                strain_xx = 0.5 * (f_xx * f_xx - 1.0)
                strains[i] = 2.0 / 3.0 * abs(strain_xx)
                trace = d_xx * i_xx
                if kind == 1.0:
                    rates[i, 3] = trace
            if DIM == 2:
                a_xx, a_xy, b_x = matrix[i, 0, 0], matrix[i, 0, 1], vector[i, 0]
                a_yx, a_yy, b_y = matrix[i, 1, 0], matrix[i, 1, 1], vector[i, 1]
                xx, xy, yx, yy, ox, oy = (
                    total(m_xx),
                    total(m_xy),
                    total(m_yx),
                    total(m_yy),
                    total(m_x),
                    total(m_y),
                )
                f_xx = start_gradient[i, 0, 0] + xx * a_xx + xy * a_xy + ox * b_x
                f_xy = start_gradient[i, 0, 1] + xx * a_yx + xy * a_yy + ox * b_y
                f_yx = start_gradient[i, 1, 0] + yx * a_xx + yy * a_xy + oy * b_x
                f_yy = start_gradient[i, 1, 1] + yx * a_yx + yy * a_yy + oy * b_y
                xx, xy, yx, yy, ox, oy = (
                    total(n_xx),
                    total(n_xy),
                    total(n_yx),
                    total(n_yy),
                    total(n_x),
                    total(n_y),
                )
                d_xx = xx * a_xx + xy * a_xy + ox * b_x
                d_xy = xx * a_yx + xy * a_yy + ox * b_y
                d_yx = yx * a_xx + yy * a_xy + oy * b_x
                d_yy = yx * a_yx + yy * a_yy + oy * b_y
                j = f_xx * f_yy - f_xy * f_yx
                ij = 1.0 / j
                i_xx, i_xy, i_yx, i_yy = f_yy * ij, -f_xy * ij, -f_yx * ij, f_xx * ij
                strain_xx = 0.5 * (f_xx * f_xx + f_yx * f_yx - 1.0)
                strain_yy = 0.5 * (f_xy * f_xy + f_yy * f_yy - 1.0)
                strain_xy = 0.5 * (f_xx * f_xy + f_yx * f_yy)
                mean = (strain_xx + strain_yy) / 3.0
                strains[i] = np.sqrt(2.0 / 3.0 * ((strain_xx - mean) ** 2 + (strain_yy - mean) ** 2 + mean * mean
                                                  + 2.0 * strain_xy * strain_xy))  # fmt: skip
                trace = d_xx * i_xx + d_xy * i_yx + d_yx * i_xy + d_yy * i_yy
                if kind == 1.0:
                    rates[i, 4] = d_xx * i_xx + d_xy * i_yx
                    rates[i, 5] = d_xx * i_xy + d_xy * i_yy
                    rates[i, 6] = d_yx * i_xx + d_yy * i_yx
                    rates[i, 7] = d_yx * i_xy + d_yy * i_yy
            if DIM == 3:
                a_xx, a_xy, a_xz = matrix[i, 0, 0], matrix[i, 0, 1], matrix[i, 0, two]
                a_yx, a_yy, a_yz = matrix[i, 1, 0], matrix[i, 1, 1], matrix[i, 1, two]
                a_zx, a_zy, a_zz = matrix[i, two, 0], matrix[i, two, 1], matrix[i, two, two]
                b_x, b_y, b_z = vector[i, 0], vector[i, 1], vector[i, two]
                xx, xy, xz, ox = total(m_xx), total(m_xy), total(m_xz), total(m_x)
                yx, yy, yz, oy = total(m_yx), total(m_yy), total(m_yz), total(m_y)
                zx, zy, zz, oz = total(m_zx), total(m_zy), total(m_zz), total(m_z)
                f_xx = start_gradient[i, 0, 0] + xx * a_xx + xy * a_xy + xz * a_xz + ox * b_x
                f_xy = start_gradient[i, 0, 1] + xx * a_yx + xy * a_yy + xz * a_yz + ox * b_y
                f_xz = start_gradient[i, 0, two] + xx * a_zx + xy * a_zy + xz * a_zz + ox * b_z
                f_yx = start_gradient[i, 1, 0] + yx * a_xx + yy * a_xy + yz * a_xz + oy * b_x
                f_yy = start_gradient[i, 1, 1] + yx * a_yx + yy * a_yy + yz * a_yz + oy * b_y
                f_yz = start_gradient[i, 1, two] + yx * a_zx + yy * a_zy + yz * a_zz + oy * b_z
                f_zx = start_gradient[i, two, 0] + zx * a_xx + zy * a_xy + zz * a_xz + oz * b_x
                f_zy = start_gradient[i, two, 1] + zx * a_yx + zy * a_yy + zz * a_yz + oz * b_y
                f_zz = start_gradient[i, two, two] + zx * a_zx + zy * a_zy + zz * a_zz + oz * b_z
                xx, xy, xz, ox = total(n_xx), total(n_xy), total(n_xz), total(n_x)
                yx, yy, yz, oy = total(n_yx), total(n_yy), total(n_yz), total(n_y)
                zx, zy, zz, oz = total(n_zx), total(n_zy), total(n_zz), total(n_z)
                d_xx = xx * a_xx + xy * a_xy + xz * a_xz + ox * b_x
                d_xy = xx * a_yx + xy * a_yy + xz * a_yz + ox * b_y
                d_xz = xx * a_zx + xy * a_zy + xz * a_zz + ox * b_z
                d_yx = yx * a_xx + yy * a_xy + yz * a_xz + oy * b_x
                d_yy = yx * a_yx + yy * a_yy + yz * a_yz + oy * b_y
                d_yz = yx * a_zx + yy * a_zy + yz * a_zz + oy * b_z
                d_zx = zx * a_xx + zy * a_xy + zz * a_xz + oz * b_x
                d_zy = zx * a_yx + zy * a_yy + zz * a_yz + oz * b_y
                d_zz = zx * a_zx + zy * a_zy + zz * a_zz + oz * b_z
                c_xx, c_xy, c_xz = (
                    f_yy * f_zz - f_yz * f_zy,
                    f_yz * f_zx - f_yx * f_zz,
                    f_yx * f_zy - f_yy * f_zx,
                )
                c_yx, c_yy, c_yz = (
                    f_xz * f_zy - f_xy * f_zz,
                    f_xx * f_zz - f_xz * f_zx,
                    f_xy * f_zx - f_xx * f_zy,
                )
                c_zx, c_zy, c_zz = (
                    f_xy * f_yz - f_xz * f_yy,
                    f_xz * f_yx - f_xx * f_yz,
                    f_xx * f_yy - f_xy * f_yx,
                )
                j = f_xx * c_xx + f_xy * c_xy + f_xz * c_xz
                ij = 1.0 / j
                i_xx, i_xy, i_xz = c_xx * ij, c_yx * ij, c_zx * ij
                i_yx, i_yy, i_yz = c_xy * ij, c_yy * ij, c_zy * ij
                i_zx, i_zy, i_zz = c_xz * ij, c_yz * ij, c_zz * ij
                strain_xx = 0.5 * (f_xx * f_xx + f_yx * f_yx + f_zx * f_zx - 1.0)
                strain_yy = 0.5 * (f_xy * f_xy + f_yy * f_yy + f_zy * f_zy - 1.0)
                strain_zz = 0.5 * (f_xz * f_xz + f_yz * f_yz + f_zz * f_zz - 1.0)
                strain_xy = 0.5 * (f_xx * f_xy + f_yx * f_yy + f_zx * f_zy)
                strain_xz = 0.5 * (f_xx * f_xz + f_yx * f_yz + f_zx * f_zz)
                strain_yz = 0.5 * (f_xy * f_xz + f_yy * f_yz + f_zy * f_zz)
                mean = (strain_xx + strain_yy + strain_zz) / 3.0
                squares = (strain_xx - mean) ** 2 + (strain_yy - mean) ** 2 + (strain_zz - mean) ** 2
                strains[i] = np.sqrt(2.0 / 3.0 * (squares + 2.0 * (strain_xy**2 + strain_xz**2 + strain_yz**2)))
                trace = (d_xx * i_xx + d_xy * i_yx + d_xz * i_zx + d_yx * i_xy + d_yy * i_yy + d_yz * i_zy
                         + d_zx * i_xz + d_zy * i_yz + d_zz * i_zz)  # fmt: skip
                if kind == 1.0:
                    rates[i, 5] = d_xx * i_xx + d_xy * i_yx + d_xz * i_zx
                    rates[i, 6] = d_xx * i_xy + d_xy * i_yy + d_xz * i_zy
                    rates[i, 7] = d_xx * i_xz + d_xy * i_yz + d_xz * i_zz
                    rates[i, 8] = d_yx * i_xx + d_yy * i_yx + d_yz * i_zx
                    rates[i, 9] = d_yx * i_xy + d_yy * i_yy + d_yz * i_zy
                    rates[i, 10] = d_yx * i_xz + d_yy * i_yz + d_yz * i_zz
                    rates[i, 11] = d_zx * i_xx + d_zy * i_yx + d_zz * i_zx
                    rates[i, 12] = d_zx * i_xy + d_zy * i_yy + d_zz * i_zy
                    rates[i, 13] = d_zx * i_xz + d_zy * i_yz + d_zz * i_zz
            jacobians[i] = j
            p = pressures[i]
            if kind == 1.0:
                rho = rows[i, M] / (volume[i] * j)
                p, c = equilibrium_state(table, models, m, rho, rows[i, E], rows[i, DAMAGE])
                signals[i] = longitudinal_speed(c, rho, table, m) + signal_alpha * c
                pressures[i] = p
                rows[i, RHO] = rho
                rows[i, C] = c
                half = 0.5 * stage * trace
                state[i, S_DENSITY] = rho * (1.0 + half) / (1.0 - half)
            p += loads[i]
            work = 0.0
            if DIM == 1:
                t_xx = j * (rows[i, S] - p) * i_xx
                work = t_xx * d_xx
                rows[i, Q] = t_xx * a_xx
                if MIXED:
                    rows[i, QW] = t_xx * b_x
                if PRINTED:
                    rows[i, N] = i_xx * a_xx
                    rows[i, NW] = i_xx * b_x
                if HOURGLASS:
                    rows[i, FG] = f_xx
            if DIM == 2:
                s_xx, s_yy, s_xy = j * (rows[i, S] - p), j * (rows[i, S + 1] - p), j * rows[i, S + 2]
                # P_iJ = J sigma_ik (F^-1)_Jk
                t_xx, t_xy = s_xx * i_xx + s_xy * i_xy, s_xx * i_yx + s_xy * i_yy
                t_yx, t_yy = s_xy * i_xx + s_yy * i_xy, s_xy * i_yx + s_yy * i_yy
                work = t_xx * d_xx + t_xy * d_xy + t_yx * d_yx + t_yy * d_yy
                rows[i, Q] = t_xx * a_xx + t_xy * a_yx
                rows[i, Q + 1] = t_xx * a_xy + t_xy * a_yy
                rows[i, Q + 2] = t_yx * a_xx + t_yy * a_yx
                rows[i, Q + 3] = t_yx * a_xy + t_yy * a_yy
                if MIXED:
                    rows[i, QW] = t_xx * b_x + t_xy * b_y
                    rows[i, QW + 1] = t_yx * b_x + t_yy * b_y
                if PRINTED:  # (F^-T)_iJ = (F^-1)_Ji
                    rows[i, N] = i_xx * a_xx + i_yx * a_yx
                    rows[i, N + 1] = i_xx * a_xy + i_yx * a_yy
                    rows[i, N + 2] = i_xy * a_xx + i_yy * a_yx
                    rows[i, N + 3] = i_xy * a_xy + i_yy * a_yy
                    rows[i, NW] = i_xx * b_x + i_yx * b_y
                    rows[i, NW + 1] = i_xy * b_x + i_yy * b_y
                if HOURGLASS:
                    rows[i, FG], rows[i, FG + 1], rows[i, FG + 2], rows[i, FG + 3] = f_xx, f_xy, f_yx, f_yy
            if DIM == 3:
                s_xx, s_yy, s_zz = j * (rows[i, S] - p), j * (rows[i, S + 1] - p), j * (rows[i, S + 2] - p)
                s_xy, s_xz, s_yz = j * rows[i, S + 3], j * rows[i, S + 4], j * rows[i, S + 5]
                t_xx = s_xx * i_xx + s_xy * i_xy + s_xz * i_xz
                t_xy = s_xx * i_yx + s_xy * i_yy + s_xz * i_yz
                t_xz = s_xx * i_zx + s_xy * i_zy + s_xz * i_zz
                t_yx = s_xy * i_xx + s_yy * i_xy + s_yz * i_xz
                t_yy = s_xy * i_yx + s_yy * i_yy + s_yz * i_yz
                t_yz = s_xy * i_zx + s_yy * i_zy + s_yz * i_zz
                t_zx = s_xz * i_xx + s_yz * i_xy + s_zz * i_xz
                t_zy = s_xz * i_yx + s_yz * i_yy + s_zz * i_yz
                t_zz = s_xz * i_zx + s_yz * i_zy + s_zz * i_zz
                work = (t_xx * d_xx + t_xy * d_xy + t_xz * d_xz + t_yx * d_yx + t_yy * d_yy + t_yz * d_yz
                        + t_zx * d_zx + t_zy * d_zy + t_zz * d_zz)  # fmt: skip
                rows[i, Q] = t_xx * a_xx + t_xy * a_yx + t_xz * a_zx
                rows[i, Q + 1] = t_xx * a_xy + t_xy * a_yy + t_xz * a_zy
                rows[i, Q + 2] = t_xx * a_xz + t_xy * a_yz + t_xz * a_zz
                rows[i, Q + 3] = t_yx * a_xx + t_yy * a_yx + t_yz * a_zx
                rows[i, Q + 4] = t_yx * a_xy + t_yy * a_yy + t_yz * a_zy
                rows[i, Q + 5] = t_yx * a_xz + t_yy * a_yz + t_yz * a_zz
                rows[i, Q + 6] = t_zx * a_xx + t_zy * a_yx + t_zz * a_zx
                rows[i, Q + 7] = t_zx * a_xy + t_zy * a_yy + t_zz * a_zy
                rows[i, Q + 8] = t_zx * a_xz + t_zy * a_yz + t_zz * a_zz
                if MIXED:
                    rows[i, QW] = t_xx * b_x + t_xy * b_y + t_xz * b_z
                    rows[i, QW + 1] = t_yx * b_x + t_yy * b_y + t_yz * b_z
                    rows[i, QW + 2] = t_zx * b_x + t_zy * b_y + t_zz * b_z
                if PRINTED:
                    rows[i, N] = i_xx * a_xx + i_yx * a_yx + i_zx * a_zx
                    rows[i, N + 1] = i_xx * a_xy + i_yx * a_yy + i_zx * a_zy
                    rows[i, N + 2] = i_xx * a_xz + i_yx * a_yz + i_zx * a_zz
                    rows[i, N + 3] = i_xy * a_xx + i_yy * a_yx + i_zy * a_zx
                    rows[i, N + 4] = i_xy * a_xy + i_yy * a_yy + i_zy * a_zy
                    rows[i, N + 5] = i_xy * a_xz + i_yy * a_yz + i_zy * a_zz
                    rows[i, N + 6] = i_xz * a_xx + i_yz * a_yx + i_zz * a_zx
                    rows[i, N + 7] = i_xz * a_xy + i_yz * a_yy + i_zz * a_zy
                    rows[i, N + 8] = i_xz * a_xz + i_yz * a_yz + i_zz * a_zz
                    rows[i, NW] = i_xx * b_x + i_yx * b_y + i_zx * b_z
                    rows[i, NW + 1] = i_xy * b_x + i_yy * b_y + i_zy * b_z
                    rows[i, NW + 2] = i_xz * b_x + i_yz * b_y + i_zz * b_z
                if HOURGLASS:
                    rows[i, FG], rows[i, FG + 1], rows[i, FG + 2] = f_xx, f_xy, f_xz
                    rows[i, FG + 3], rows[i, FG + 4], rows[i, FG + 5] = f_yx, f_yy, f_yz
                    rows[i, FG + 6], rows[i, FG + 7], rows[i, FG + 8] = f_zx, f_zy, f_zz
            rates[i, DIM] = work * volume[i] / rows[i, M]
            if PRINTED:
                rows[i, IJ] = 1.0 / j
