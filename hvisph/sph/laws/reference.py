"""Total Lagrangian pair forces over reference neighbours, and the row that a particle shows for them.

    f_ab  = V0_a V0_b (P_a g_ab - P_b g_ba) = V0_a ((Q_a + Q_b) s (X_a - X_b) + (q_a - q_b) w)
    e_a   : own stress power V0_a P_a : Fdot_a, and half of the work of viscosity and hourglass control

with V0_b g_ab = A_a s (X_a - X_b) + B_a w (s, w: slope and shape of the pair, see `sph.reference`), and
Q = P A, q = P B from `sph.laws.deformation`. Pairs of an Eulerian and a Total Lagrangian particle count half
here, pairs of two Eulerian ones not at all: the other half is their spatial force. Row i is written by i alone.

Viscosity: Monaghan's with the plain kernel gradient at current positions (dissipative for every pair),
or the printed form of Young 2021 eqs. 2 and 9 in reference gradients. Hourglass control after
Ganzenmueller 2015: f_ab = - alpha V0_a V0_b W0 / (2 R^2) (E_a delta_a + E_b delta_b) x_ab / r with
delta_a = (F_a X_ab - x_ab) . x_ab / r, in his sign convention x_ab = x_b - x_a.
"""

from __future__ import annotations

import numpy as np

from hvisph.core.blocks import eight_at
from hvisph.core.jit import prange
from hvisph.core.lanes import LANES, all_lanes, larger_lanes, largest, total
from hvisph.core.simd import neighbours
from hvisph.sph.rows import RowLayout

CHUNK = 256


def row_layout(dim: int, mixed: bool, printed_viscosity: bool, hourglass: bool) -> tuple[RowLayout, int]:
    """Return the row of a particle and how many of its slots `accumulate` reads of neighbours.

    X0 is the reference position, KIND 1 for Total Lagrangian and 0 for Eulerian, Q and QW the
    stress with the corrections; N, NW and IJ belong to the printed viscosity, FG and EM to hourglass
    control. Those after them are the particle's own.
    """
    fields = [("x", "vector"), ("u", "vector"), ("x0", "vector"), ("kind", "scalar"), ("m", "scalar"),
              ("rho", "scalar"), ("c", "scalar"), ("q", "gradient")]  # fmt: skip
    if mixed:
        fields.append(("qw", "vector"))
    if printed_viscosity:
        fields += [("n", "gradient"), ("nw", "vector"), ("ij", "scalar")]
    if hourglass:
        fields += [("fg", "gradient"), ("em", "scalar")]
    read = RowLayout(dim, tuple(fields)).used
    fields += [("h", "scalar"), ("s", "symmetric"), ("e", "scalar"), ("damage", "scalar")]
    return RowLayout(dim, tuple(fields)), read


def accumulate(
    rows,
    active,
    which,
    starts,
    near,
    slopes,
    shapes,
    volume,
    first_sums,
    zeroth_sums,
    alpha,
    beta,
    hourglass,
    ih,
    rates,
):
    """Sum the forces and powers of the particles that are `active` as `which` says: the template.

    Parameters are those of `deform` and of `sph.reference`, and alpha, beta of the viscosity, the hourglass
    coefficient and 1/h [1/m]. `rates` receives acceleration, power and largest |mu|. Without Eulerian
    neighbours (COUPLED 0) the particle's own stress comes in as a whole, and its power is known from `deform`.
    """
    count = np.uint64(active.shape[0])
    for chunk in prange((count + np.uint64(CHUNK - 1)) // np.uint64(CHUNK)):
        one = np.uint64(1)
        first = np.uint64(chunk) * np.uint64(CHUNK)
        for i in range(first, min(first + np.uint64(CHUNK), count)):
            if active[i] != which:
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
            kind, rho, c = rows[i, KIND], rows[i, RHO], rows[i, C]
            # All of the reference density of its neighbours: they are of one body.
            inverse_rho0 = volume[i] / rows[i, M]
            factor = scale(ih)
            a_x = a_y = a_z = power = mu_max = all_lanes(0.0)
            for k in range(np.uint64(starts[i]), np.uint64(starts[i + one]), np.uint64(LANES)):
                b = neighbours(rows, near, k, WIDTH)
                s = eight_at(slopes, k)
                dx, du = x - b[0], u - b[U]
                r2, ur = dx * dx, du * dx
                g_x = s * (x0 - b[X0])
                if DIM > 1:
                    dy, dv = y - b[1], v - b[U + 1]
                    r2 += dy * dy
                    ur += dv * dy
                    g_y = s * (y0 - b[X0 + 1])
                if DIM > 2:
                    dz, dw = z - b[2], w - b[U + 2]
                    r2 += dz * dz
                    ur += dw * dz
                    g_z = s * (z0 - b[X0 + 2])
                if COUPLED:
                    share = 0.5 * (kind + b[KIND]) * inverse_rho0
                t_x = b[Q] * g_x
                if DIM == 2:
                    t_x += b[Q + 1] * g_y
                    t_y = b[Q + 2] * g_x + b[Q + 3] * g_y
                if DIM == 3:
                    t_x += b[Q + 1] * g_y + b[Q + 2] * g_z
                    t_y = b[Q + 3] * g_x + b[Q + 4] * g_y + b[Q + 5] * g_z
                    t_z = b[Q + 6] * g_x + b[Q + 7] * g_y + b[Q + 8] * g_z
                if MIXED or HOURGLASS or PRINTED:
                    g = eight_at(shapes, k)
                if MIXED:
                    t_x -= b[QW] * g
                    if DIM > 1:
                        t_y -= b[QW + 1] * g
                    if DIM > 2:
                        t_z -= b[QW + 2] * g
                if COUPLED:
                    o_x = rows[i, Q] * g_x
                    if DIM == 2:
                        o_x += rows[i, Q + 1] * g_y
                        o_y = rows[i, Q + 2] * g_x + rows[i, Q + 3] * g_y
                    if DIM == 3:
                        o_x += rows[i, Q + 1] * g_y + rows[i, Q + 2] * g_z
                        o_y = rows[i, Q + 3] * g_x + rows[i, Q + 4] * g_y + rows[i, Q + 5] * g_z
                        o_z = rows[i, Q + 6] * g_x + rows[i, Q + 7] * g_y + rows[i, Q + 8] * g_z
                    if MIXED:
                        o_x += rows[i, QW] * g
                        if DIM > 1:
                            o_y += rows[i, QW + 1] * g
                        if DIM > 2:
                            o_z += rows[i, QW + 2] * g
                # What belongs to the pair: p, with half of its work for each side.
                r = np.sqrt(r2)
                soft = r2 + 0.01 / (ih * ih)
                densities = rho + b[RHO]
                inverse = 1.0 / (r * soft * densities)
                mu = min(ur * (inverse * r * densities) / ih, 0.0)
                mu_max = larger_lanes(mu_max, -mu)
                pi = mu * (2.0 * beta * mu - alpha * (c + b[C])) * (inverse * r * soft)
                if PRINTED:
                    half = 0.5 * pi / (inverse_rho0 * inverse_rho0)
                    p_x = -half * ((rows[i, N] * b[IJ] + rows[i, IJ] * b[N]) * g_x
                                   + (rows[i, NW] * b[IJ] - rows[i, IJ] * b[NW]) * g)  # fmt: skip
                    if DIM == 2:
                        p_x -= half * (rows[i, N + 1] * b[IJ] + rows[i, IJ] * b[N + 1]) * g_y
                        p_y = -half * ((rows[i, N + 2] * b[IJ] + rows[i, IJ] * b[N + 2]) * g_x
                                       + (rows[i, N + 3] * b[IJ] + rows[i, IJ] * b[N + 3]) * g_y
                                       + (rows[i, NW + 1] * b[IJ] - rows[i, IJ] * b[NW + 1]) * g)  # fmt: skip
                    if DIM == 3:
                        p_x -= half * ((rows[i, N + 1] * b[IJ] + rows[i, IJ] * b[N + 1]) * g_y
                                       + (rows[i, N + 2] * b[IJ] + rows[i, IJ] * b[N + 2]) * g_z)  # fmt: skip
                        p_y = -half * ((rows[i, N + 3] * b[IJ] + rows[i, IJ] * b[N + 3]) * g_x
                                       + (rows[i, N + 4] * b[IJ] + rows[i, IJ] * b[N + 4]) * g_y
                                       + (rows[i, N + 5] * b[IJ] + rows[i, IJ] * b[N + 5]) * g_z
                                       + (rows[i, NW + 1] * b[IJ] - rows[i, IJ] * b[NW + 1]) * g)  # fmt: skip
                        p_z = -half * ((rows[i, N + 6] * b[IJ] + rows[i, IJ] * b[N + 6]) * g_x
                                       + (rows[i, N + 7] * b[IJ] + rows[i, IJ] * b[N + 7]) * g_y
                                       + (rows[i, N + 8] * b[IJ] + rows[i, IJ] * b[N + 8]) * g_z
                                       + (rows[i, NW + 2] * b[IJ] - rows[i, IJ] * b[NW + 2]) * g)  # fmt: skip
                else:
                    f = -pi * b[M] * factor * slope(r * ih) * (inverse * soft * densities) / inverse_rho0
                    p_x = f * dx
                    if DIM > 1:
                        p_y = f * dy
                    if DIM > 2:
                        p_z = f * dz
                if HOURGLASS:
                    # Errors of the distances that F_a and F_b predict, along the pair; X_ab = X_a - X_b.
                    if DIM == 1:
                        e_x = x0 - b[X0]
                        reference2 = e_x * e_x
                        own = rows[i, FG] * e_x * dx
                        other = b[FG] * e_x * dx
                    if DIM == 2:
                        e_x, e_y = x0 - b[X0], y0 - b[X0 + 1]
                        reference2 = e_x * e_x + e_y * e_y
                        own = ((rows[i, FG] * e_x + rows[i, FG + 1] * e_y) * dx
                               + (rows[i, FG + 2] * e_x + rows[i, FG + 3] * e_y) * dy)  # fmt: skip
                        other = (b[FG] * e_x + b[FG + 1] * e_y) * dx + (b[FG + 2] * e_x + b[FG + 3] * e_y) * dy
                    if DIM == 3:
                        e_x, e_y, e_z = x0 - b[X0], y0 - b[X0 + 1], z0 - b[X0 + 2]
                        reference2 = e_x * e_x + e_y * e_y + e_z * e_z
                        own = ((rows[i, FG] * e_x + rows[i, FG + 1] * e_y + rows[i, FG + 2] * e_z) * dx
                               + (rows[i, FG + 3] * e_x + rows[i, FG + 4] * e_y + rows[i, FG + 5] * e_z) * dy
                               + (rows[i, FG + 6] * e_x + rows[i, FG + 7] * e_y
                                  + rows[i, FG + 8] * e_z) * dz)  # fmt: skip
                        other = ((b[FG] * e_x + b[FG + 1] * e_y + b[FG + 2] * e_z) * dx
                                 + (b[FG + 3] * e_x + b[FG + 4] * e_y + b[FG + 5] * e_z) * dy
                                 + (b[FG + 6] * e_x + b[FG + 7] * e_y + b[FG + 8] * e_z) * dz)  # fmt: skip
                    error = rows[i, EM] * (own - r2) + b[EM] * (other - r2)
                    # the far row's infinite distance meets a zero in g
                    f = 0.5 * hourglass * g * error / (reference2 * r2)
                    p_x += f * dx
                    if DIM > 1:
                        p_y += f * dy
                    if DIM > 2:
                        p_z += f * dz
                if COUPLED:
                    a_x += share * (o_x + t_x + p_x)
                    power += share * du * (o_x + 0.5 * p_x)
                    if DIM > 1:
                        a_y += share * (o_y + t_y + p_y)
                        power += share * dv * (o_y + 0.5 * p_y)
                    if DIM > 2:
                        a_z += share * (o_z + t_z + p_z)
                        power += share * dw * (o_z + 0.5 * p_z)
                else:
                    a_x += t_x + p_x
                    power += du * p_x
                    if DIM > 1:
                        a_y += t_y + p_y
                        power += dv * p_y
                    if DIM > 2:
                        a_z += t_z + p_z
                        power += dw * p_z
            if COUPLED:
                rates[i, 0] = total(a_x)
                if DIM > 1:
                    rates[i, 1] = total(a_y)
                if DIM > 2:
                    rates[i, 2] = total(a_z)
                rates[i, DIM] = -total(power)
            else:
                s_x = total(a_x) + rows[i, Q] * first_sums[i, 0]
                if DIM == 2:
                    s_x += rows[i, Q + 1] * first_sums[i, 1]
                    s_y = total(a_y) + rows[i, Q + 2] * first_sums[i, 0] + rows[i, Q + 3] * first_sums[i, 1]
                if DIM == 3:
                    d_x, d_y, d_z = first_sums[i, 0], first_sums[i, 1], first_sums[i, np.uint64(2)]
                    s_x += rows[i, Q + 1] * d_y + rows[i, Q + 2] * d_z
                    s_y = total(a_y) + rows[i, Q + 3] * d_x + rows[i, Q + 4] * d_y + rows[i, Q + 5] * d_z
                    s_z = total(a_z) + rows[i, Q + 6] * d_x + rows[i, Q + 7] * d_y + rows[i, Q + 8] * d_z
                if MIXED:
                    s_x += rows[i, QW] * zeroth_sums[i]
                    if DIM > 1:
                        s_y += rows[i, QW + 1] * zeroth_sums[i]
                    if DIM > 2:
                        s_z += rows[i, QW + 2] * zeroth_sums[i]
                rates[i, 0] = inverse_rho0 * s_x
                if DIM > 1:
                    rates[i, 1] = inverse_rho0 * s_y
                if DIM > 2:
                    rates[i, 2] = inverse_rho0 * s_z
                rates[i, DIM] -= 0.5 * inverse_rho0 * total(power)
            rates[i, DIM + 1] = largest(mu_max)
