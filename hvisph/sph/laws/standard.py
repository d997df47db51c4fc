"""Standard SPH of solids: symmetric stress sum, Monaghan viscosity (whole or by shares), Gray's artificial stress.

    L_a  = - sum_b m_b/rho_b u_ab (x) grad_a W_ab
    a_a  =   sum_b m_b (sigma_a/rho_a^2 + sigma_b/rho_b^2 - Pi_ab I + f^n (R_a + R_b)) . grad_a W_ab
    de_a = - sum_b m_b u_ab . (sigma_a/rho_a^2 - Pi_ab/2 + f^n (R_a + R_b)/2) . grad_a W_ab

Each particle receives its own stress power and half of the work of what belongs to the
pair, so the sum of m_a de_a is exactly minus the power of the pair forces. In the product form
both denominators are rho_a rho_b (Zisis 2013 eq. 13; Young 2021 eq. 1).

The rate of density is that of the volume, -rho tr L, or in the mass form sum_b m_b u_ab . grad_a W_ab,
written as what it adds to the rate of ln(rho):

    chi_a = sum_b (m_b/rho_a - m_b/rho_b) u_ab . grad_a W_ab

Density dissipation (Zisis 2013 eqs. 22-24), as a rate of ln(rho), and its energy:

    chi_a += 1/rho_a sum_b q_ab,     q_ab = alpha_rho m_b/rho_b (p_a - p_b)/c_ab dW/dr,
    de_a += 1/(2 rho_a) sum_b q_ab (p_a/rho_a + p_b/rho_b)

Density holds elastic energy, p/rho^2 for each unit of it. Of what the two sides of a pair give and
take of that, V_a V_b q_ab p_a/rho_a and -V_a V_b q_ab p_b/rho_b, the sum is lost to the elastic
store, and half of it becomes heat on either side. What remains is an exchange at the mean of
p/rho, equal and opposite, so that the total energy is kept pair by pair, and between alike
materials both sides gain entropy. A barotropic material takes no notice of its heat.
"""

from __future__ import annotations

import numpy as np

from hvisph.core.lanes import LANES, all_lanes, larger_lanes, largest, total
from hvisph.core.simd import neighbours
from hvisph.sph.rows import RowLayout
from hvisph.sph.viscosity import SOFTENING, approach, monaghan

# Options of the law, off unless bound: the product form, the mass form, density dissipation, shares of the
# viscosity, and the exponent n of f.
PRODUCT = MASS_FORM = DISSIPATION = SWITCHED = 0
EXPONENT = 4


def row_layout(dim: int, artificial_stress: bool, more: tuple[tuple[str, str], ...] = ()) -> RowLayout:
    """Return what a particle shows its neighbours; T is sigma/rho^2, R the artificial stress."""
    fields = [("x", "vector"), ("u", "vector"), ("h", "scalar"), ("m", "scalar"), ("rho", "scalar"),
              ("c", "scalar"), ("t", "symmetric")]  # fmt: skip
    if artificial_stress:
        fields.append(("r", "symmetric"))
    return RowLayout(dim, (*fields, *more))


def accumulate(near, n, rows, i, constants, out):
    """Sum the rates of particle `i` over its neighbours."""
    alpha = constants[0]
    beta = constants[1]
    inverse_w0 = constants[2]
    x = rows[i, 0]
    y = rows[i, 1] if DIM > 1 else 0.0
    z = rows[i, 2] if DIM > 2 else 0.0
    u = rows[i, U]
    v = rows[i, U + 1] if DIM > 1 else 0.0
    w = rows[i, U + 2] if DIM > 2 else 0.0
    h = rows[i, H]
    rho = rows[i, RHO]
    c = rows[i, C]
    t_xx = rows[i, T]
    t_yy = rows[i, T + 1] if DIM > 1 else 0.0
    t_xy = rows[i, T + DIM] if DIM > 1 else 0.0
    t_zz = rows[i, T + 2] if DIM > 2 else 0.0
    t_xz = rows[i, T + 4] if DIM > 2 else 0.0
    t_yz = rows[i, T + 5] if DIM > 2 else 0.0
    if ARTIFICIAL_STRESS:
        r_xx = rows[i, R]
        r_yy = rows[i, R + 1] if DIM > 1 else 0.0
        r_xy = rows[i, R + DIM] if DIM > 1 else 0.0
        r_zz = rows[i, R + 2] if DIM > 2 else 0.0
        r_xz = rows[i, R + 4] if DIM > 2 else 0.0
        r_yz = rows[i, R + 5] if DIM > 2 else 0.0
    inverse_rho = 1.0 / rho
    none = all_lanes(0.0)
    if SWITCHED:
        half_share = 0.5 * rows[i, SHARE]
    if DISSIPATION:
        p = rows[i, P]
        twice_alpha = 2.0 * constants[4]  # for c_a + c_b in place of their mean
    density_rate = none
    l_xx = l_xy = l_xz = l_yx = l_yy = l_yz = l_zx = l_zy = l_zz = none
    a_x = a_y = a_z = power = mu_max = none
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
        ih = 1.0 / hm
        r = np.sqrt(r2)
        q = r * ih
        m = b[M]
        if COUPLED:
            force_share, gradient_share, stress_share = shares(rows, i, b, dx, dy, dz, constants[constants.size - 1])
        # One division for four: 1/r, 1/(r^2 + 0.01 h^2), 1/(rho_a + rho_b) and 1/rho_b.
        rho_b = b[RHO]
        soft = r2 + SOFTENING * hm * hm
        densities = rho + rho_b
        lengths = r * soft
        products = densities * rho_b
        inverse = 1.0 / (lengths * products)
        inverse_lengths = inverse * products
        inverse_products = inverse * lengths
        f = scale(ih) * slope(q) * (inverse_lengths * soft)
        mu = approach(hm, ur, inverse_lengths * r)
        pi = monaghan(mu, alpha, beta, c + b[C], inverse_products * rho_b)
        if SWITCHED:
            share = half_share + 0.5 * b[SHARE]
            pi = pi * share
            mu = mu * share
        mu_max = larger_lanes(mu_max, -mu * force_share if COUPLED else -mu)
        g_x = f * dx
        g_y = f * dy if DIM > 1 else 0.0
        g_z = f * dz if DIM > 2 else 0.0
        # own stress
        own_x = t_xx * g_x + t_xy * g_y + t_xz * g_z
        own_y = t_xy * g_x + t_yy * g_y + t_yz * g_z
        own_z = t_xz * g_x + t_yz * g_y + t_zz * g_z
        if PRODUCT:
            ratio = rho * (inverse_products * densities)
            own_x = own_x * ratio
            own_y = own_y * ratio
            own_z = own_z * ratio
        b_xx = b[T]
        b_yy = b[T + 1] if DIM > 1 else 0.0
        b_xy = b[T + DIM] if DIM > 1 else 0.0
        b_zz = b[T + 2] if DIM > 2 else 0.0
        b_xz = b[T + 4] if DIM > 2 else 0.0
        b_yz = b[T + 5] if DIM > 2 else 0.0
        if ARTIFICIAL_STRESS:
            fw = shape(q) * inverse_w0
            fn = fw
            for _ in range(EXPONENT - 1):
                fn = fn * fw
            if COUPLED:
                fn = fn * stress_share
            s_xx = fn * (r_xx + b[R]) - pi
            s_yy = fn * (r_yy + b[R + 1]) - pi if DIM > 1 else 0.0
            s_xy = fn * (r_xy + b[R + DIM]) if DIM > 1 else 0.0
            s_zz = fn * (r_zz + b[R + 2]) - pi if DIM > 2 else 0.0
            s_xz = fn * (r_xz + b[R + 4]) if DIM > 2 else 0.0
            s_yz = fn * (r_yz + b[R + 5]) if DIM > 2 else 0.0
            pair_x = s_xx * g_x + s_xy * g_y + s_xz * g_z
            pair_y = s_xy * g_x + s_yy * g_y + s_yz * g_z
            pair_z = s_xz * g_x + s_yz * g_y + s_zz * g_z
        else:
            pair_x = -pi * g_x
            pair_y = -pi * g_y
            pair_z = -pi * g_z
        vf = m * (inverse_products * densities)
        if COUPLED:
            vf = vf * gradient_share
            m = m * force_share
        if MASS_FORM:
            density_rate += (m - rho * vf) * (f * ur)
        if DISSIPATION:
            p_b = b[P]
            flow = twice_alpha * vf * (p - p_b) * (f * r) / (c + b[C])
            density_rate += flow
            power -= 0.5 * inverse_rho * flow * (p * inverse_rho + p_b * (inverse_products * densities))
        of_b_x = b_xx * g_x + b_xy * g_y + b_xz * g_z
        of_b_y = b_xy * g_x + b_yy * g_y + b_yz * g_z
        of_b_z = b_xz * g_x + b_yz * g_y + b_zz * g_z
        if PRODUCT:
            ratio = rho_b * inverse_rho
            of_b_x = of_b_x * ratio
            of_b_y = of_b_y * ratio
            of_b_z = of_b_z * ratio
        a_x += m * (own_x + pair_x + of_b_x)
        power += m * du * (own_x + 0.5 * pair_x)
        l_xx -= vf * du * g_x
        if DIM > 1:
            a_y += m * (own_y + pair_y + of_b_y)
            power += m * dv * (own_y + 0.5 * pair_y)
            l_xy -= vf * du * g_y
            l_yx -= vf * dv * g_x
            l_yy -= vf * dv * g_y
        if DIM > 2:
            a_z += m * (own_z + pair_z + of_b_z)
            power += m * dw * (own_z + 0.5 * pair_z)
            l_xz -= vf * du * g_z
            l_yz -= vf * dv * g_z
            l_zx -= vf * dw * g_x
            l_zy -= vf * dw * g_y
            l_zz -= vf * dw * g_z
    write_rates(out, i, total(a_x), total(a_y), total(a_z), -total(power), largest(mu_max),
                total(l_xx), total(l_xy), total(l_xz), total(l_yx), total(l_yy), total(l_yz),
                total(l_zx), total(l_zy), total(l_zz))  # fmt: skip
    if MASS_FORM or DISSIPATION:
        out[i, DIM + 2 + DIM * DIM] = inverse_rho * total(density_rate)
