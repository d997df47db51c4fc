"""The loops of SPH-projection: what a particle does with its sums, pass by pass (Farahani 2009, eqs. 20-32).

Each template is a pass over all particles. It takes the sum of its pair law from `rows`, which
neighbours read, and writes the row of the next pass into `following`: row i is written by i alone.
Bound names: DIM, the pair law, columns of the state (S_...), slots of the rows that are written.
"""

from __future__ import annotations

import numpy as np

from hvisph.core.jit import prange

from .update import FASTEST, KINETIC, MOMENTUM, SUPPORT

CHUNK = 256


def stress(state, tags, near, first, last, kernels, rows, following, rates, table, models, step):
    """Pass 1: velocity gradient, and the deviator at the end of the step."""
    count = np.uint64(state.shape[0])
    for chunk in prange((count + np.uint64(CHUNK - 1)) // np.uint64(CHUNK)):
        start = np.uint64(chunk) * np.uint64(CHUNK)
        for s in range(start, min(start + np.uint64(CHUNK), count)):
            l_xx, l_xy, l_xz, l_yx, l_yy, l_yz, l_zx, l_zy, l_zz = velocity_gradient(
                near, first[s], last[s], rows, s, kernels
            )
            rho = state[s, S_DENSITY]
            # The pressure that comes with the deviator is the equation of state's: it has no part here.
            s_xx, s_yy, s_zz, s_xy, s_xz, s_yz, plastic, _, _, _ = respond(
                table, models, np.uint64(tags[s, 2]), step, rho, state[s, S_INTERNAL_ENERGY],
                state[s, S_DEVIATOR], state[s, S_DEVIATOR + 1], state[s, S_DEVIATOR + 2],
                state[s, S_DEVIATOR + 3] if DIM > 1 else 0.0,
                state[s, S_DEVIATOR + 4] if DIM > 2 else 0.0,
                state[s, S_DEVIATOR + 5] if DIM > 2 else 0.0,
                state[s, S_PLASTIC_STRAIN], state[s, S_DAMAGE],
                l_xx, l_xy, l_xz, l_yx, l_yy, l_yz, l_zx, l_zy, l_zz)  # fmt: skip
            state[s, S_DEVIATOR] = s_xx
            state[s, S_DEVIATOR + 1] = s_yy
            state[s, S_DEVIATOR + 2] = s_zz
            state[s, S_PLASTIC_STRAIN] = plastic
            inverse2 = 1.0 / (rho * rho)
            following[s, 0] = rows[s, 0]
            following[s, M] = state[s, S_MASS]
            following[s, T] = s_xx * inverse2
            rates[s, DIM + 2] = l_xx
            if DIM > 1:
                state[s, S_DEVIATOR + 3] = s_xy
                following[s, 1] = rows[s, 1]
                following[s, T + 1] = s_yy * inverse2
                following[s, T + DIM] = s_xy * inverse2
                rates[s, DIM + 3] = l_xy
            if DIM == 2:
                rates[s, 6] = l_yx
                rates[s, 7] = l_yy
            if DIM == 3:
                state[s, S_DEVIATOR + 4] = s_xz
                state[s, S_DEVIATOR + 5] = s_yz
                following[s, 2] = rows[s, 2]
                following[s, T + 2] = s_zz * inverse2
                following[s, T + 4] = s_xz * inverse2
                following[s, T + 5] = s_yz * inverse2
                rates[s, 7] = l_xz
                rates[s, 8] = l_yx
                rates[s, 9] = l_yy
                rates[s, 10] = l_yz
                rates[s, 11] = l_zx
                rates[s, 12] = l_zy
                rates[s, 13] = l_zz


def velocity(state, tags, near, first, last, kernels, rows, following, rates, step, g_x, g_y, g_z):
    """Pass 2: stress divergence, and the velocity that it and the body force alone lead to."""
    count = np.uint64(state.shape[0])
    for chunk in prange((count + np.uint64(CHUNK - 1)) // np.uint64(CHUNK)):
        start = np.uint64(chunk) * np.uint64(CHUNK)
        for s in range(start, min(start + np.uint64(CHUNK), count)):
            a_x, a_y, a_z = stress_divergence(near, first[s], last[s], rows, s, kernels)
            rates[s, 0] = a_x + g_x
            # A clamped particle feels its forces, which the budget counts, and stays.
            moves = 0.0 if tags[s, 3] & np.uint32(1) else step
            following[s, 0] = rows[s, 0]
            following[s, U] = state[s, S_VELOCITY] + moves * (a_x + g_x)
            if DIM > 1:
                rates[s, 1] = a_y + g_y
                following[s, 1] = rows[s, 1]
                following[s, U + 1] = state[s, S_VELOCITY + 1] + moves * (a_y + g_y)
            if DIM > 2:
                rates[s, 2] = a_z + g_z
                following[s, 2] = rows[s, 2]
                following[s, U + 2] = state[s, S_VELOCITY + 2] + moves * (a_z + g_z)
            rho = state[s, S_DENSITY]
            following[s, V] = state[s, S_MASS] / rho
            following[s, RHO] = rho
            following[s, P] = state[s, S_PRESSURE]


def pressure(state, near, first, last, kernels, rows, following, step, eta2, fullness, guard, printed):
    """Pass 3: the pressure that brings the density back, from those of the step before."""
    count = np.uint64(state.shape[0])
    for chunk in prange((count + np.uint64(CHUNK - 1)) // np.uint64(CHUNK)):
        start = np.uint64(chunk) * np.uint64(CHUNK)
        for s in range(start, min(start + np.uint64(CHUNK), count)):
            divergence, diagonal, others = poisson(near, first[s], last[s], rows, s, kernels, eta2)
            rho = state[s, S_DENSITY]
            h = state[s, S_SMOOTHING_LENGTH]
            p = 0.0
            if diagonal < 0.0 and not -diagonal * rho * h * h * fullness < guard:
                p = (others - divergence / step) / diagonal
            state[s, S_PRESSURE] = p
            if printed:
                w = state[s, S_MASS]
                wp = w * p / (rho * rho)
            else:
                w = state[s, S_MASS] / rho
                wp = w * p
            following[s, 0] = rows[s, 0]
            if DIM > 1:
                following[s, 1] = rows[s, 1]
            if DIM > 2:
                following[s, 2] = rows[s, 2]
            following[s, W] = w
            following[s, WP] = wp


def acceleration(state, near, first, last, kernels, rows, rates, printed):
    """Pass 4: pressure gradient, and with it the whole acceleration."""
    count = np.uint64(state.shape[0])
    for chunk in prange((count + np.uint64(CHUNK - 1)) // np.uint64(CHUNK)):
        start = np.uint64(chunk) * np.uint64(CHUNK)
        for s in range(start, min(start + np.uint64(CHUNK), count)):
            inverse = 1.0 / state[s, S_DENSITY]
            p = state[s, S_PRESSURE]
            own = p * inverse * inverse if printed else p
            a_x, a_y, a_z = pressure_gradient(near, first[s], last[s], rows, s, kernels, own)
            factor = 1.0 if printed else inverse
            rates[s, 0] -= factor * a_x
            if DIM > 1:
                rates[s, 1] -= factor * a_y
            if DIM > 2:
                rates[s, 2] -= factor * a_z


def carry(state, tags, rates, rows, lengths, step, complete, variable, h_low, h_high, g_x, g_y, g_z, sums):
    """Complete the step (if `complete`) and pack the rows of the next one; sums as named in `update`."""
    count = np.uint64(state.shape[0])
    for chunk in prange((count + np.uint64(CHUNK - 1)) // np.uint64(CHUNK)):
        start = np.uint64(chunk) * np.uint64(CHUNK)
        kinetic = fastest = 0.0
        p_x = p_y = p_z = f_x = f_y = f_z = 0.0
        for s in range(start, min(start + np.uint64(CHUNK), count)):
            fixed = tags[s, 3] & np.uint32(1)
            x = state[s, 0]
            y = state[s, 1] if DIM > 1 else 0.0
            z = state[s, 2] if DIM > 2 else 0.0
            u = state[s, S_VELOCITY]
            v = state[s, S_VELOCITY + 1] if DIM > 1 else 0.0
            w = state[s, S_VELOCITY + 2] if DIM > 2 else 0.0
            h = state[s, S_SMOOTHING_LENGTH]
            mass = state[s, S_MASS]
            a_x = rates[s, 0]
            a_y = rates[s, 1] if DIM > 1 else 0.0
            a_z = rates[s, 2] if DIM > 2 else 0.0
            # What particles do not keep: the forces on clamped ones and, negative, the body force on others.
            if fixed:
                f_x += mass * (a_x - g_x)
                f_y += mass * (a_y - g_y)
                f_z += mass * (a_z - g_z)
                a_x = a_y = a_z = 0.0
            else:
                f_x -= mass * g_x
                f_y -= mass * g_y
                f_z -= mass * g_z
            if complete:
                x += step * (u + 0.5 * step * a_x)
                u += step * a_x
                state[s, 0] = x
                state[s, S_VELOCITY] = u
                expansion = rates[s, DIM + 2]
                if DIM > 1:
                    y += step * (v + 0.5 * step * a_y)
                    v += step * a_y
                    state[s, 1] = y
                    state[s, S_VELOCITY + 1] = v
                    expansion += rates[s, DIM + 3 + DIM]  # yy
                if DIM > 2:
                    z += step * (w + 0.5 * step * a_z)
                    w += step * a_z
                    state[s, 2] = z
                    state[s, S_VELOCITY + 2] = w
                    expansion += rates[s, DIM + 10]  # zz
                if variable:
                    half = 0.5 * step * expansion / DIM
                    h = min(max(h * (1.0 + half) / (1.0 - half), h_low), h_high)
                    state[s, S_SMOOTHING_LENGTH] = h
            speed2 = u * u + v * v + w * w
            kinetic += 0.5 * mass * speed2
            p_x += mass * u
            p_y += mass * v
            p_z += mass * w
            fastest = max(fastest, speed2)
            rows[s, 0] = x
            rows[s, U] = u
            if DIM > 1:
                rows[s, 1] = y
                rows[s, U + 1] = v
            if DIM > 2:
                rows[s, 2] = z
                rows[s, U + 2] = w
            rows[s, H] = h
            rows[s, V] = mass / state[s, S_DENSITY]
            lengths[s] = h
        i = np.uint64(chunk)
        sums[i, KINETIC] = kinetic
        sums[i, MOMENTUM] = p_x
        sums[i, MOMENTUM + 1] = p_y
        sums[i, MOMENTUM + 2] = p_z
        sums[i, SUPPORT] = f_x
        sums[i, SUPPORT + 1] = f_y
        sums[i, SUPPORT + 2] = f_z
        sums[i, FASTEST] = fastest
