"""Standard SPH of solids with corrected kernels: Shepard's, the gradient's, or both (mixed).

    L_a     = - sum_b V_b u_ab (x) g_ab
    rho_a a_a = sum_b V_b (sigma_a g_ab - sigma_b g_ba) + rho_a rho_b V_b (-Pi_ab I + f^n (R_a + R_b)) g*_ab
    rho_a de_a = sigma_a : L_a - (the last term's work) / 2,            g*_ab = (g_ab - g_ba) / 2

with g_ab = A_a grad_a W_ab + W_ab B_a the corrected gradient, whose A and B the pass before this one wrote
into each row (`sph.laws.corrections`). Forces remain equal and opposite pair by pair, because each side's
correction goes with its own stress; and own stress power with half of the pair work to each is exactly
minus the power of the forces. Where A = I and B = 0 this is the standard form with
(sigma_a + sigma_b)/(rho_a rho_b). Beside Total Lagrangian particles pairs have shares (`sph.laws.coupling`).

Safeguard. A pair takes the plain gradient on both sides where a component of either corrected gradient is more than
C_f times the plain one or less than 1/C_f of it; that refuses changed signs too. Components along which
the two stand side by side are not tested: the plain gradient has none there. Fall-backs are counted.

Source: Young 2021 eqs. 1, 14 and section 3.2.
"""

from __future__ import annotations

import numpy as np

from hvisph.core.jit import compiled
from hvisph.core.lanes import LANES, all_lanes, larger_lanes, largest, total
from hvisph.core.simd import neighbours
from hvisph.sph.laws.corrections import HUGE
from hvisph.sph.viscosity import SOFTENING, approach, monaghan

# A component of x_ab below this share of the distance is not tested: the plain gradient has next to none.
LEVEL = 1e-3


def coefficients(factor: float) -> np.ndarray:
    """Return what `accumulate` reads of C_f: itself and the share LEVEL; with no limit nothing is tested."""
    return np.array([factor, LEVEL]) if np.isfinite(factor) else np.array([1.0, np.inf])


@compiled
def is_not_negative(x):
    """Return 1 where x >= 0, 0 elsewhere."""
    return min(max(x * HUGE + 1.0, 0.0), 1.0)


@compiled
def margin(own, others, plain, factor, distance, level):
    """Return a number below 0 where a ratio to `plain` is above factor or below 1/factor, not so elsewhere.

    It is large where the component is not tested: where the `distance` along it, x_a - x_b, is below `level`.
    """
    square = plain * plain
    low = min(own * plain, others * plain)
    high = max(own * plain, others * plain)
    return min(factor * square - high, factor * low - square) + max((level - abs(distance)) * HUGE, 0.0)


def accumulate(near, n, rows, i, constants, out):
    """Sum the rates of particle `i` over its block of neighbours; count its plain gradients in its row."""
    alpha = constants[0]
    beta = constants[1]
    inverse_w0 = constants[2]
    factor = constants[FACTOR]
    share = constants[FACTOR + 1]
    x = rows[i, 0]
    y = rows[i, 1] if DIM > 1 else 0.0
    z = rows[i, 2] if DIM > 2 else 0.0
    u = rows[i, U]
    v = rows[i, U + 1] if DIM > 1 else 0.0
    w = rows[i, U + 2] if DIM > 2 else 0.0
    h = rows[i, H]
    rho = rows[i, RHO]
    c = rows[i, C]
    a_xx = rows[i, A]
    b_x = rows[i, B]
    a_xy = a_xz = a_yx = a_yy = a_yz = a_zx = a_zy = a_zz = b_y = b_z = 0.0
    if DIM == 2:
        a_xy, a_yx, a_yy = rows[i, A + 1], rows[i, A + 2], rows[i, A + 3]
        b_y = rows[i, B + 1]
    if DIM == 3:
        a_xy, a_xz = rows[i, A + 1], rows[i, A + 2]
        a_yx, a_yy, a_yz = rows[i, A + 3], rows[i, A + 4], rows[i, A + 5]
        a_zx, a_zy, a_zz = rows[i, A + 6], rows[i, A + 7], rows[i, A + 8]
        b_y, b_z = rows[i, B + 1], rows[i, B + 2]
    if ARTIFICIAL_STRESS:
        r_xx = rows[i, R]
        r_yy = rows[i, R + 1] if DIM > 1 else 0.0
        r_xy = rows[i, R + DIM] if DIM > 1 else 0.0
        r_zz = rows[i, R + 2] if DIM > 2 else 0.0
        r_xz = rows[i, R + 4] if DIM > 2 else 0.0
        r_yz = rows[i, R + 5] if DIM > 2 else 0.0
    none = all_lanes(0.0)
    l_xx = l_xy = l_xz = l_yx = l_yy = l_yz = l_zx = l_zy = l_zz = none
    w_xx = w_xy = w_xz = w_yy = w_yz = w_zz = none
    s_x = s_y = s_z = f_x = f_y = f_z = power = mu_max = plain = none
    for k in range(np.uint64(0), n, np.uint64(LANES)):
        b = neighbours(rows, near, k, WIDTH)
        dx = x - b[0]
        r2 = dx * dx
        du = u - b[U]
        ur = du * dx
        if DIM > 1:
            dy = y - b[1]
            dv = v - b[U + 1]
            r2 += dy * dy
            ur += dv * dy
        else:
            dy = dv = 0.0
        if DIM > 2:
            dz = z - b[2]
            dw = w - b[U + 2]
            r2 += dz * dz
            ur += dw * dz
        else:
            dz = dw = 0.0
        hm = 0.5 * (h + b[H])
        r = np.sqrt(r2)
        # One division for five: 1/r, 1/(r^2 + 0.01 h^2), 1/(rho_a + rho_b), 1/rho_b and 1/h.
        rho_b = b[RHO]
        soft = r2 + SOFTENING * hm * hm
        densities = rho + rho_b
        lengths = r * soft
        products = densities * rho_b
        lengths_h = lengths * hm
        inverse = 1.0 / (lengths_h * products)
        inverse_lengths_h = inverse * products
        inverse_products = inverse * lengths_h
        inverse_lengths = inverse_lengths_h * hm
        ih = inverse_lengths_h * lengths
        q = r * ih
        mu = approach(hm, ur, inverse_lengths * r)
        if COUPLED:
            force_share, gradient_share, stress_share = shares(rows, i, b, dx, dy, dz, constants[constants.size - 1])
        mu_max = larger_lanes(mu_max, -mu * force_share if COUPLED else -mu)
        pi = monaghan(mu, alpha, beta, c + b[C], inverse_products * rho_b)
        m = b[M]
        volume = m * (inverse_products * densities)
        norm = scale(ih)
        f = norm * slope(q) * (inverse_lengths * soft)
        kernel = norm * hm * shape(q)
        # p plain; g corrected by a; o, for b, corrected by b and turned round.
        p_x = f * dx
        p_y = f * dy if DIM > 1 else 0.0
        p_z = f * dz if DIM > 2 else 0.0
        if DIM == 1:
            g_x = a_xx * p_x + b_x * kernel
            o_x = b[A] * p_x - b[B] * kernel
            g_y = g_z = o_y = o_z = 0.0
        if DIM == 2:
            g_x = a_xx * p_x + a_xy * p_y + b_x * kernel
            g_y = a_yx * p_x + a_yy * p_y + b_y * kernel
            o_x = b[A] * p_x + b[A + 1] * p_y - b[B] * kernel
            o_y = b[A + 2] * p_x + b[A + 3] * p_y - b[B + 1] * kernel
            g_z = o_z = 0.0
        if DIM == 3:
            g_x = a_xx * p_x + a_xy * p_y + a_xz * p_z + b_x * kernel
            g_y = a_yx * p_x + a_yy * p_y + a_yz * p_z + b_y * kernel
            g_z = a_zx * p_x + a_zy * p_y + a_zz * p_z + b_z * kernel
            o_x = b[A] * p_x + b[A + 1] * p_y + b[A + 2] * p_z - b[B] * kernel
            o_y = b[A + 3] * p_x + b[A + 4] * p_y + b[A + 5] * p_z - b[B + 1] * kernel
            o_z = b[A + 6] * p_x + b[A + 7] * p_y + b[A + 8] * p_z - b[B + 2] * kernel
        level = share * r
        room = margin(g_x, o_x, p_x, factor, dx, level)
        if DIM > 1:
            room = min(room, margin(g_y, o_y, p_y, factor, dy, level))
        if DIM > 2:
            room = min(room, margin(g_z, o_z, p_z, factor, dz, level))
        kept = is_not_negative(room)
        left = 1.0 - kept
        plain += left
        g_x = kept * g_x + left * p_x
        o_x = kept * o_x + left * p_x
        if DIM > 1:
            g_y = kept * g_y + left * p_y
            o_y = kept * o_y + left * p_y
        if DIM > 2:
            g_z = kept * g_z + left * p_z
            o_z = kept * o_z + left * p_z
        mean_x = 0.5 * (g_x + o_x)
        mean_y = 0.5 * (g_y + o_y)
        mean_z = 0.5 * (g_z + o_z)
        if ARTIFICIAL_STRESS:
            fw = shape(q) * inverse_w0
            fn = fw
            for _ in range(EXPONENT - 1):
                fn = fn * fw
            if COUPLED:
                fn = fn * stress_share
            t_xx = fn * (r_xx + b[R]) - pi
            t_yy = fn * (r_yy + b[R + 1]) - pi if DIM > 1 else 0.0
            t_xy = fn * (r_xy + b[R + DIM]) if DIM > 1 else 0.0
            t_zz = fn * (r_zz + b[R + 2]) - pi if DIM > 2 else 0.0
            t_xz = fn * (r_xz + b[R + 4]) if DIM > 2 else 0.0
            t_yz = fn * (r_yz + b[R + 5]) if DIM > 2 else 0.0
            pair_x = t_xx * mean_x + t_xy * mean_y + t_xz * mean_z
            pair_y = t_xy * mean_x + t_yy * mean_y + t_yz * mean_z
            pair_z = t_xz * mean_x + t_yz * mean_y + t_zz * mean_z
        else:
            pair_x = -pi * mean_x
            pair_y = -pi * mean_y
            pair_z = -pi * mean_z
        # b's stress over rho_a: T = sigma/rho^2, V_b sigma_b = m_b rho_b T_b
        if COUPLED:
            m = m * force_share
        weight = m * rho_b
        b_xx = b[T]
        b_yy = b[T + 1] if DIM > 1 else 0.0
        b_xy = b[T + DIM] if DIM > 1 else 0.0
        b_zz = b[T + 2] if DIM > 2 else 0.0
        b_xz = b[T + 4] if DIM > 2 else 0.0
        b_yz = b[T + 5] if DIM > 2 else 0.0
        pair_x *= m * rho
        f_x += weight * (b_xx * o_x + b_xy * o_y + b_xz * o_z) + pair_x
        power += du * pair_x
        if COUPLED:
            # what acts has other shares than what is differentiated
            acts = volume * force_share
            s_x += acts * g_x
            if DIM > 1:
                s_y += acts * g_y
            if DIM > 2:
                s_z += acts * g_z
            w_xx -= acts * du * g_x
            if DIM > 1:
                w_xy -= acts * (du * g_y + dv * g_x)
                w_yy -= acts * dv * g_y
            if DIM > 2:
                w_xz -= acts * (du * g_z + dw * g_x)
                w_yz -= acts * (dv * g_z + dw * g_y)
                w_zz -= acts * dw * g_z
            volume = volume * gradient_share
        vg_x = volume * g_x
        if not COUPLED:
            s_x += vg_x
        l_xx -= du * vg_x
        if DIM > 1:
            pair_y *= m * rho
            f_y += weight * (b_xy * o_x + b_yy * o_y + b_yz * o_z) + pair_y
            power += dv * pair_y
            vg_y = volume * g_y
            if not COUPLED:
                s_y += vg_y
            l_xy -= du * vg_y
            l_yx -= dv * vg_x
            l_yy -= dv * vg_y
        if DIM > 2:
            pair_z *= m * rho
            f_z += weight * (b_xz * o_x + b_yz * o_y + b_zz * o_z) + pair_z
            power += dw * pair_z
            vg_z = volume * g_z
            if not COUPLED:
                s_z += vg_z
            l_xz -= du * vg_z
            l_yz -= dv * vg_z
            l_zx -= dw * vg_x
            l_zy -= dw * vg_y
            l_zz -= dw * vg_z
    # The own stress is the same for all pairs: it acts on the sum of their gradients.
    inverse_rho = 1.0 / rho
    t_xx = rows[i, T] * rho
    t_yy = rows[i, T + 1] * rho if DIM > 1 else 0.0
    t_xy = rows[i, T + DIM] * rho if DIM > 1 else 0.0
    t_zz = rows[i, T + 2] * rho if DIM > 2 else 0.0
    t_xz = rows[i, T + 4] * rho if DIM > 2 else 0.0
    t_yz = rows[i, T + 5] * rho if DIM > 2 else 0.0
    x, y, z = total(s_x), total(s_y), total(s_z)
    l_xx, l_xy, l_xz = total(l_xx), total(l_xy), total(l_xz)
    l_yx, l_yy, l_yz = total(l_yx), total(l_yy), total(l_yz)
    l_zx, l_zy, l_zz = total(l_zx), total(l_zy), total(l_zz)
    if COUPLED:
        own = t_xx * total(w_xx) + t_yy * total(w_yy) + t_zz * total(w_zz)
        own += t_xy * total(w_xy) + t_xz * total(w_xz) + t_yz * total(w_yz)
    else:
        own = t_xx * l_xx + t_yy * l_yy + t_zz * l_zz
        own += t_xy * (l_xy + l_yx) + t_xz * (l_xz + l_zx) + t_yz * (l_yz + l_zy)
    write_rates(out, i, t_xx * x + t_xy * y + t_xz * z + total(f_x) * inverse_rho,
                t_xy * x + t_yy * y + t_yz * z + total(f_y) * inverse_rho,
                t_xz * x + t_yz * y + t_zz * z + total(f_z) * inverse_rho,
                own - 0.5 * total(power) * inverse_rho, largest(mu_max),
                l_xx, l_xy, l_xz, l_yx, l_yy, l_yz, l_zx, l_zy, l_zz)  # fmt: skip
    if rows[i, FALLBACKS] == 0.0:
        rows[i, FALLBACKS] = total(plain)
