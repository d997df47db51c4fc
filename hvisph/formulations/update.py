"""The pass over single particles: complete a step, predict the next stage, update the stress, pack.

Between two evaluations of the pair forces every particle is visited once. With the rates of the
last evaluation its state is carried to the end of the step; then the stage of the
next evaluation is predicted, `materials.response` gives the stress there, and what the neighbours
need is packed into the particle's row. See `integrators.scheme` for the scheme and its energy.
"""

from __future__ import annotations

import numpy as np

from hvisph.core.jit import compiled, prange
from hvisph.sph.viscosity import balsara_share, relaxed_share

CHUNK = 256
# Which share of the viscosity a particle takes: all of it, or by a published switch.
WHOLE, BALSARA, MORRIS_MONAGHAN = 0, 1, 2
SWITCHES = {"none": WHOLE, "balsara": BALSARA, "morris_monaghan": MORRIS_MONAGHAN}
# Columns of the sums that the completed states give: see `Budget`.
KINETIC, INTERNAL, MOMENTUM, SUPPORT, FASTEST, LONGEST = 0, 1, 2, 5, 8, 9
SUMS = 10


@compiled
def grown(rate):
    """Return exp(rate) to second order, by a fraction that is positive for every step that a criterion allows."""
    return (1.0 + 0.5 * rate) / (1.0 - 0.5 * rate)


def update(state, tags, place, rates, sorted_rows, table, models, coefficients, step, stage, complete,
           h_low, h_high, rows, lengths, signals, pressures, sums):  # fmt: skip
    """Complete the step of length `step` (if `complete`) and pack the stage `stage` ahead: the template.

    Bound names: DIM, PREVIOUS (1 for schemes that use the rates of the step before), VARIABLE_H,
    DENSITY_RATE (1 where the rates hold one of ln(rho)), DRIFT (share of the acceleration in the stage's
    position), PLANE_STRESS, SWITCH (share of the viscosity), columns of the state (S_...), slots of the row
    (U, SHARE), functions `respond`, `thinning`, `longitudinal_speed`, `shear_speed` and `pack`.
    """
    count = np.uint64(state.shape[0])
    for chunk in prange((count + np.uint64(CHUNK - 1)) // np.uint64(CHUNK)):
        first = np.uint64(chunk) * np.uint64(CHUNK)
        kinetic = internal = fastest = longest = 0.0
        p_x = p_y = p_z = f_x = f_y = f_z = 0.0
        for s in range(first, min(first + np.uint64(CHUNK), count)):
            k = np.uint64(place[s])
            m = np.uint64(tags[s, 2])
            fixed = tags[s, 3] & np.uint32(1)
            x = state[s, 0]
            y = state[s, 1] if DIM > 1 else 0.0
            z = state[s, 2] if DIM > 2 else 0.0
            u = state[s, S_VELOCITY]
            v = state[s, S_VELOCITY + 1] if DIM > 1 else 0.0
            w = state[s, S_VELOCITY + 2] if DIM > 2 else 0.0
            mass = state[s, S_MASS]
            rho = state[s, S_DENSITY]
            e = state[s, S_INTERNAL_ENERGY]
            h = state[s, S_SMOOTHING_LENGTH]
            s_xx = state[s, S_DEVIATOR]
            s_yy = state[s, S_DEVIATOR + 1]
            s_zz = state[s, S_DEVIATOR + 2]
            s_xy = state[s, S_DEVIATOR + 3] if DIM > 1 else 0.0
            s_xz = state[s, S_DEVIATOR + 4] if DIM > 2 else 0.0
            s_yz = state[s, S_DEVIATOR + 5] if DIM > 2 else 0.0
            plastic = state[s, S_PLASTIC_STRAIN]
            damage = state[s, S_DAMAGE]
            a_x = rates[k, 0]
            a_y = rates[k, 1] if DIM > 1 else 0.0
            a_z = rates[k, 2] if DIM > 2 else 0.0
            power = rates[k, DIM]
            l_xy = l_xz = l_yx = l_yy = l_yz = l_zx = l_zy = l_zz = 0.0
            l_xx = rates[k, DIM + 2]
            if DIM == 2:
                l_xy, l_yx, l_yy = rates[k, DIM + 3], rates[k, DIM + 4], rates[k, DIM + 5]
            if DIM == 3:
                l_xy, l_xz, l_yx, l_yy = rates[k, 6], rates[k, 7], rates[k, 8], rates[k, 9]
                l_yz, l_zx, l_zy, l_zz = rates[k, 10], rates[k, 11], rates[k, 12], rates[k, 13]
            dissipated = rates[k, DIM + 2 + DIM * DIM] if DENSITY_RATE else 0.0
            if fixed:
                f_x += mass * a_x
                f_y += mass * a_y
                f_z += mass * a_z
                a_x = a_y = a_z = 0.0
            if complete:
                # Velocity of the evaluation, with which `power` and the gradient were found.
                e_x = sorted_rows[k, U]
                e_y = sorted_rows[k, U + 1] if DIM > 1 else 0.0
                e_z = sorted_rows[k, U + 2] if DIM > 2 else 0.0
                n_x, n_y, n_z, heat = a_x, a_y, a_z, power
                g_xx, g_xy, g_xz, g_yx, g_yy, g_yz, g_zx, g_zy, g_zz = (
                    l_xx, l_xy, l_xz, l_yx, l_yy, l_yz, l_zx, l_zy, l_zz)  # fmt: skip
                if PREVIOUS:
                    q_x = state[s, S_PREVIOUS_ACCELERATION]
                    q_y = state[s, S_PREVIOUS_ACCELERATION + 1] if DIM > 1 else 0.0
                    q_z = state[s, S_PREVIOUS_ACCELERATION + 2] if DIM > 2 else 0.0
                    n_x, n_y, n_z = 0.5 * (a_x + q_x), 0.5 * (a_y + q_y), 0.5 * (a_z + q_z)
                    heat = 0.5 * (power + state[s, S_PREVIOUS_POWER])
                    G = S_PREVIOUS_GRADIENT
                    g_xx = 0.5 * (l_xx + state[s, G])
                    if DIM == 2:
                        g_xy = 0.5 * (l_xy + state[s, G + 1])
                        g_yx = 0.5 * (l_yx + state[s, G + 2])
                        g_yy = 0.5 * (l_yy + state[s, G + 3])
                    if DIM == 3:
                        g_xy = 0.5 * (l_xy + state[s, G + 1])
                        g_xz = 0.5 * (l_xz + state[s, G + 2])
                        g_yx = 0.5 * (l_yx + state[s, G + 3])
                        g_yy = 0.5 * (l_yy + state[s, G + 4])
                        g_yz = 0.5 * (l_yz + state[s, G + 5])
                        g_zx = 0.5 * (l_zx + state[s, G + 6])
                        g_zy = 0.5 * (l_zy + state[s, G + 7])
                        g_zz = 0.5 * (l_zz + state[s, G + 8])
                swelling = g_xx + g_yy + g_zz - dissipated
                if PREVIOUS and DENSITY_RATE:
                    swelling += 0.5 * (dissipated - state[s, S_PREVIOUS_DENSITY_RATE])
                # Mean velocity of the step; the work of the forces at it is what the energy receives.
                m_x = u + 0.5 * step * n_x
                m_y = v + 0.5 * step * n_y
                m_z = w + 0.5 * step * n_z
                if PREVIOUS:
                    V = S_PREVIOUS_VELOCITY
                    missing = 0.5 * (a_x * (m_x - e_x) + q_x * (m_x - state[s, V]))
                    if DIM > 1:
                        missing += 0.5 * (a_y * (m_y - e_y) + q_y * (m_y - state[s, V + 1]))
                    if DIM > 2:
                        missing += 0.5 * (a_z * (m_z - e_z) + q_z * (m_z - state[s, V + 2]))
                else:
                    missing = a_x * (m_x - e_x) + a_y * (m_y - e_y) + a_z * (m_z - e_z)
                e += step * (heat - missing)
                x += step * m_x
                y += step * m_y
                z += step * m_z
                u += step * n_x
                v += step * n_y
                w += step * n_z
                if PLANE_STRESS:
                    g_zz = thinning(table, models, m, step, rho, swelling, e, s_xx, s_yy, s_zz, s_xy, plastic,
                                    damage, g_xx, g_xy, g_yx, g_yy)  # fmt: skip
                    state[s, S_THICKNESS] *= grown(step * g_zz)
                half = 0.5 * step * swelling
                rho *= grown(-step * (swelling + g_zz)) if PLANE_STRESS else grown(-step * swelling)
                if VARIABLE_H:
                    h = min(max(h * (1.0 + half / DIM) / (1.0 - half / DIM), h_low), h_high)
                s_xx, s_yy, s_zz, s_xy, s_xz, s_yz, plastic, damage, p, c = respond(
                    table, models, m, step, rho, e, s_xx, s_yy, s_zz, s_xy, s_xz, s_yz, plastic, damage,
                    g_xx, g_xy, g_xz, g_yx, g_yy, g_yz, g_zx, g_zy, g_zz)  # fmt: skip
                state[s, 0] = x
                state[s, S_VELOCITY] = u
                if DIM > 1:
                    state[s, 1] = y
                    state[s, S_VELOCITY + 1] = v
                    state[s, S_DEVIATOR + 3] = s_xy
                if DIM > 2:
                    state[s, 2] = z
                    state[s, S_VELOCITY + 2] = w
                    state[s, S_DEVIATOR + 4] = s_xz
                    state[s, S_DEVIATOR + 5] = s_yz
                state[s, S_DENSITY] = rho
                state[s, S_INTERNAL_ENERGY] = e
                state[s, S_SMOOTHING_LENGTH] = h
                state[s, S_DEVIATOR] = s_xx
                state[s, S_DEVIATOR + 1] = s_yy
                state[s, S_DEVIATOR + 2] = s_zz
                state[s, S_PLASTIC_STRAIN] = plastic
                state[s, S_DAMAGE] = damage
                if SWITCH == MORRIS_MONAGHAN:
                    state[s, S_VISCOSITY_SHARE] = relaxed_share(
                        state[s, S_VISCOSITY_SHARE], g_xx + g_yy + g_zz, c, h, step, coefficients[5], coefficients[6]
                    )
                if PREVIOUS:
                    V, A, G = S_PREVIOUS_VELOCITY, S_PREVIOUS_ACCELERATION, S_PREVIOUS_GRADIENT
                    state[s, V] = e_x
                    state[s, A] = a_x
                    if DIM > 1:
                        state[s, V + 1] = e_y
                        state[s, A + 1] = a_y
                    if DIM > 2:
                        state[s, V + 2] = e_z
                        state[s, A + 2] = a_z
                    state[s, S_PREVIOUS_POWER] = power
                    if DENSITY_RATE:
                        state[s, S_PREVIOUS_DENSITY_RATE] = dissipated
                    for f in range(np.uint64(DIM * DIM)):
                        state[s, np.uint64(G) + f] = rates[k, np.uint64(DIM + 2) + f]
            speed2 = u * u + v * v + w * w
            kinetic += 0.5 * mass * speed2
            internal += mass * e
            p_x += mass * u
            p_y += mass * v
            p_z += mass * w
            fastest = max(fastest, speed2)
            # The stage: where the rates are evaluated next.
            x += stage * (u + DRIFT * stage * a_x)
            y += stage * (v + DRIFT * stage * a_y)
            z += stage * (w + DRIFT * stage * a_z)
            u += stage * a_x
            v += stage * a_y
            w += stage * a_z
            e += stage * power
            thickness = 1.0
            if PLANE_STRESS:
                l_zz = thinning(table, models, m, stage, rho, l_xx + l_yy - dissipated, e, s_xx, s_yy, s_zz, s_xy,
                                plastic, damage, l_xx, l_xy, l_yx, l_yy)  # fmt: skip
                thickness = state[s, S_THICKNESS] * grown(stage * l_zz)
            half = (
                0.5 * stage * (l_xx + l_yy - dissipated)
                if PLANE_STRESS
                else 0.5 * stage * (l_xx + l_yy + l_zz - dissipated)
            )
            rho *= grown(-stage * (l_xx + l_yy + l_zz - dissipated))
            if VARIABLE_H:
                h = min(max(h * (1.0 + half / DIM) / (1.0 - half / DIM), h_low), h_high)
            longest = max(longest, h)
            s_xx, s_yy, s_zz, s_xy, s_xz, s_yz, plastic, damage, p, c = respond(
                table, models, m, stage, rho, e, s_xx, s_yy, s_zz, s_xy, s_xz, s_yz, plastic, damage,
                l_xx, l_xy, l_xz, l_yx, l_yy, l_yz, l_zx, l_zy, l_zz)  # fmt: skip
            c_l = longitudinal_speed(c, rho, table, m)
            rows[s, 0] = x
            if DIM > 1:
                rows[s, 1] = y
            if DIM > 2:
                rows[s, 2] = z
            c_t = shear_speed(rho, table, m)
            pressures[s] = p
            if PLANE_STRESS:  # a membrane: its forces and its density are those of its thickness
                rho, p = rho * thickness, p * thickness
                s_xx, s_yy, s_zz, s_xy = s_xx * thickness, s_yy * thickness, s_zz * thickness, s_xy * thickness
            signals[s] = pack(rows, s, coefficients, u, v, w, mass, rho, e, h, p, c, c_l, c_t,
                              s_xx, s_yy, s_zz, s_xy, s_xz, s_yz)  # fmt: skip
            if SWITCH:
                share = balsara_share(l_xx, l_xy, l_xz, l_yx, l_yy, l_yz, l_zx, l_zy, l_zz, c, h)
                if SWITCH == MORRIS_MONAGHAN:
                    share = relaxed_share(state[s, S_VISCOSITY_SHARE], l_xx + l_yy + l_zz, c, h, stage,
                                          coefficients[5], coefficients[6])  # fmt: skip
                rows[s, SHARE] = share
                # a small share lets no step grow: the shock that raises it may be a step away
                signals[s] += 1.2 * coefficients[0] * max(share - 1.0, 0.0) * c
            lengths[s] = h
        i = np.uint64(chunk)
        sums[i, KINETIC] = kinetic
        sums[i, INTERNAL] = internal
        sums[i, MOMENTUM] = p_x
        sums[i, MOMENTUM + 1] = p_y
        sums[i, MOMENTUM + 2] = p_z
        sums[i, SUPPORT] = f_x
        sums[i, SUPPORT + 1] = f_y
        sums[i, SUPPORT + 2] = f_z
        sums[i, FASTEST] = fastest
        sums[i, LONGEST] = longest
