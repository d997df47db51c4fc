"""Pair law of standard SPH: symmetric stress sum, Monaghan viscosity, Gray's artificial stress.

    L_a  = - sum_b m_b/rho_b u_ab (x) grad_a W_ab
    a_a  =   sum_b m_b (sigma_a/rho_a^2 + sigma_b/rho_b^2 - Pi_ab I + f^n (R_a + R_b)) . grad_a W_ab
    de_a = - sum_b m_b u_ab . (sigma_a/rho_a^2 - Pi_ab/2 + f^n (R_a + R_b)/2) . grad_a W_ab

Each particle receives its own stress power and half of the work of what belongs to the
pair, so the sum of m_a de_a is exactly minus the power of the pair forces. In the product form
both denominators are rho_a rho_b (Zisis 2013 eq. 13; Young 2021 eq. 1).

The density rate is -rho tr L, or in the mass form sum_b m_b u_ab . grad_a W_ab, whose difference in the rate of ln(rho)
is

    chi_a = sum_b (m_b/rho_a - m_b/rho_b) u_ab . grad_a W_ab

Density dissipation (Zisis 2013 eqs. 22-24), as a rate of ln(rho), and its energy:

    chi_a += 1/rho_a sum_b q_ab,     q_ab = alpha_rho m_b/rho_b (p_a - p_b)/c_ab dW/dr,
    de_a += 1/(2 rho_a) sum_b q_ab (p_a/rho_a + p_b/rho_b)

A change of density changes the elastic energy by p/rho^2 per unit. The changes of both sides, V_a V_b q_ab p_a/rho_a
and -V_a V_b q_ab p_b/rho_b, do not cancel: half of their sum becomes heat on either side. What remains is an exchange
of energy at the mean p/rho, so that each pair conserves total energy, and the entropy of both sides of one material
grows. The pressure of a barotropic material does not depend on this heat.

Corrected gradients (Young 2021 eqs. 1, 14 and section 3.2): with g_ab = A_a grad_a W_ab + W_ab B_a, whose A and B the
previous pass has written into each row (`sph.terms.kernel_correction`), the stress of a acts on g_ab, that of b on
-g_ba, and the terms of the pair on their mean; L has g_ab. Forces remain equal and opposite, as each correction
multiplies the stress of its own side. Both sides use the plain gradient where a corrected one is more than C_f times
longer, or its component along the pair less than 1/C_f of it, negative ones included. The published rule,
`correction_margin_by_component`, tests each component and depends on the frame; components in which both particles
coincide are not tested, as the plain gradient has none. Fall-backs are counted.

Angular momentum (ANGULAR_MOMENTUM): pair forces exert a torque where the principal axes of the stress differ from those
of B = sum_b V_b |dW/dr| r e (x) e. Each particle accumulates its share s_a per mass, which the antisymmetric stress
w_a x g with w_a = rho_a s_a/(2 dt) returns in the next step dt. The residual is the torque of one step. w_a does no
work of deformation: the rotation W of the neighbourhood (least squares) enters L unchanged, L + W (1 - B).

Beside Total Lagrangian particles pairs have weights (`sph.contact.coupling`). Axisymmetric particles (AXISYMMETRIC)
have the terms of `sph.terms.axisymmetric`, and their velocity gradient in the plane is renormalised.
"""

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.compiler.tensors import (
    add,
    add_identity,
    add_last,
    add_radial,
    axial,
    axial_cross,
    axial_curl,
    broadcast,
    dot,
    dot_rows,
    exact_difference,
    exact_vector,
    gradient,
    identity,
    inertia,
    lane_sums,
    matrix,
    multiply,
    no_axial,
    no_gradient,
    no_symmetric,
    no_vector,
    outer,
    product,
    put,
    radial_part,
    row_axial,
    row_exact_vector,
    row_gradient,
    row_symmetric,
    row_vector,
    spin_gradient,
    subtract,
    symmetric,
    symmetric_dot,
    symmetric_outer,
    torque,
    vector,
)
from hvisph.compiler.vector.api import LANES, broadcast_lanes, elementwise_max, lane_max, lane_sum, neighbours
from hvisph.sph.neighbours.particle_layout import RowLayout, select_fields
from hvisph.sph.terms.axisymmetric import axis_regularization, axisymmetric_pair, hoop_share, mirror_weight
from hvisph.sph.terms.kernel_correction import HUGE
from hvisph.sph.terms.shape_matrix import sound_inverse
from hvisph.sph.terms.viscosity import SOFTENING, approach, monaghan

# Options of the law, off unless bound: the product form, the mass form, density dissipation, shares of the
# viscosity, corrected gradients, pairs beside Total Lagrangian particles, axisymmetric particles, these beside Total
# Lagrangian ones, conservation of angular momentum; exponent n of f.
PRODUCT = MASS_FORM = DISSIPATION = SWITCHED = CORRECTED = COUPLED = AXISYMMETRIC = HYBRID = ANGULAR_MOMENTUM = 0
EXPONENT = 4
X_REST = U_REST = 0  # slots of what rounding takes of position and velocity, in single precision

LEVEL = 1e-3  # a component of x_ab below this share of the distance is not tested: the plain gradient has next to none


def row_layout(dim: int, artificial_stress: bool, extra: tuple[tuple[str, str], ...] = ()) -> RowLayout:
    """Return the layout of the particle data that pairs read; T is sigma/rho^2, R the artificial stress."""
    return RowLayout(dim, select_fields(("x", "vector"), ("u", "vector"), ("h", "scalar"), ("m", "scalar"), ("rho",
    "scalar"),
                                ("c", "scalar"), ("t", "symmetric"), artificial_stress and ("r", "symmetric"),
                                *extra))  # fmt: skip


def safeguard(factor: float) -> np.ndarray:
    """Return what `accumulate` reads of C_f: itself and the share LEVEL; with no limit nothing is tested."""
    return np.array([factor, LEVEL]) if np.isfinite(factor) else np.array([1.0, np.inf])


@inline
def is_not_negative(x):
    """Return 1 where x >= 0, 0 elsewhere."""
    return min(max(x * HUGE + 1.0, 0.0), 1.0)


@inline
def margin(gradient_a, gradient_b, plain, factor, distance, level):
    """Return a number below 0 where a ratio to `plain` is above factor or below 1/factor, not so elsewhere.

    It is large where the component is not tested: where the `distance` along it, x_a - x_b, is below `level`.
    """
    square = plain * plain
    low = min(gradient_a * plain, gradient_b * plain)
    high = max(gradient_a * plain, gradient_b * plain)
    return min(factor * square - high, factor * low - square) + max((level - abs(distance)) * HUGE, 0.0)


@inline
def correction_margin(gradient_a, gradient_b, plain, dx, r, factor, level):
    """Return a number below 0 where a corrected gradient is too unlike the `plain` one, in length or along the pair."""
    along_pair = margin(dot(gradient_a, dx), dot(gradient_b, dx), dot(plain, dx), factor, r, level)
    longest = factor * factor * dot(plain, plain) - max(dot(gradient_a, gradient_a), dot(gradient_b, gradient_b))
    return min(along_pair, longest + max((level - r) * HUGE, 0.0))


@inline
def correction_margin_by_component(gradient_a, gradient_b, plain, dx, r, factor, level):
    """Return the same where any component is too unlike."""
    minimum = margin(gradient_a[0], gradient_b[0], plain[0], factor, dx[0], level)
    if len(dx) > 1:
        minimum = min(minimum, margin(gradient_a[1], gradient_b[1], plain[1], factor, dx[1], level))
    if len(dx) > 2:
        minimum = min(minimum, margin(gradient_a[2], gradient_b[2], plain[2], factor, dx[2], level))
    return minimum


@inline
def turning_kept(l, moment):
    """Return the velocity gradient `l` with the rotation of the neighbourhood unchanged; B = `moment`."""
    inverse, _ = sound_inverse(inertia(moment))
    return add(l, product(spin_gradient(dot_rows(inverse, axial_curl(l))), subtract(identity(l), matrix(moment))))


def accumulate(indices, n, rows, i, constants, out):
    """Sum the rates of particle `i` over its neighbours."""
    alpha, beta, inverse_w0 = constants[0], constants[1], constants[2]
    x, u = row_exact_vector(rows, i, 0, X_REST, DIM), row_exact_vector(rows, i, U, U_REST, DIM)
    t = row_symmetric(rows, i, T, DIM)
    h, rho, c = rows[i, H], rows[i, RHO], rows[i, C]
    inverse_rho = 1.0 / rho
    if CORRECTED:
        own_matrix, own_shift = row_gradient(rows, i, A, DIM), row_vector(rows, i, B, DIM)
        factor, share_of_r = constants[FACTOR], constants[FACTOR + 1]
    if ARTIFICIAL_STRESS:
        tensile = row_symmetric(rows, i, R, DIM)
    if SWITCHED:
        half_share = 0.5 * rows[i, SHARE]
    if DISSIPATION:
        p = rows[i, P]
        twice_alpha = 2.0 * constants[4]  # for c_a + c_b in place of their mean
    inverse_ring = 1.0 / rows[i, RING] if AXISYMMETRIC else 0.0
    a, l, moment = broadcast(no_vector(DIM)), broadcast(no_gradient(DIM)), broadcast(no_symmetric(DIM))
    if ANGULAR_MOMENTUM:
        spin_sum, stress = broadcast(no_axial(DIM)), add(matrix(t), spin_gradient(row_axial(rows, i, SPIN_STRESS, DIM)))
    density_rate = power = mu_max = plain = broadcast_lanes(0.0)
    for k in range(np.uint64(0), n, np.uint64(LANES)):
        b = neighbours(rows, indices, k, WIDTH)
        dx = exact_difference(x, exact_vector(b, 0, X_REST, DIM), DIM)
        du = exact_difference(u, exact_vector(b, U, U_REST, DIM), DIM)
        r2, ur = dot(dx, dx), dot(du, dx)
        hm = 0.5 * (h + b[H])
        ih = 1.0 / hm
        r = np.sqrt(r2)
        q = r * ih
        m = b[M]
        if COUPLED:
            force_share, gradient_share, stress_share = shares(rows, i, b, dx, constants[constants.size - 1])
        # One division for four: 1/r, 1/(r^2 + 0.01 h^2), 1/(rho_a + rho_b) and 1/rho_b.
        rho_b = b[RHO]
        soft = r2 + SOFTENING * hm * hm
        densities = rho + rho_b
        lengths = r * soft
        products = densities * rho_b
        inverse = 1.0 / (lengths * products)
        inverse_lengths = inverse * products
        inverse_products = inverse * lengths
        inverse_rho_b = inverse_products * densities
        norm = scale(ih)
        f = norm * slope(q) * (inverse_lengths * soft)
        mu = approach(hm, ur, inverse_lengths * r)
        pi = monaghan(mu, alpha, beta, c + b[C], inverse_products * rho_b)
        if SWITCHED:
            share = half_share + 0.5 * b[SHARE]
            pi = pi * share
            mu = mu * share
        mu_max = elementwise_max(mu_max, -mu * force_share if COUPLED else -mu)
        # g corrected by a; o, for b, corrected by b and turned round; both plain without corrections
        g = o = mean = multiply(f, dx)
        if CORRECTED:
            kernel = norm * hm * shape(q)
            g_a = add(dot_rows(own_matrix, g), multiply(kernel, own_shift))
            g_b = subtract(dot_rows(gradient(b, A, DIM), g), multiply(kernel, vector(b, B, DIM)))
            share_c = is_not_negative(correction_margin(g_a, g_b, g, dx, r, factor, share_of_r * r))
            share_p = 1.0 - share_c
            plain += share_p
            g, o = add(multiply(share_c, g_a), multiply(share_p, g)), add(multiply(share_c, g_b), multiply(share_p, g))
            mean = multiply(0.5, add(g, o))
        term_a, term_b = symmetric_dot(t, g), symmetric_dot(symmetric(b, T, DIM), o)
        if ANGULAR_MOMENTUM:
            term_a, term_b = dot_rows(stress, g), add(term_b, axial_cross(axial(b, SPIN_STRESS, DIM), o))
        if PRODUCT:
            term_a, term_b = multiply(rho * inverse_rho_b, term_a), multiply(rho_b * inverse_rho, term_b)
        pair = multiply(-pi, mean)
        if ARTIFICIAL_STRESS:
            fw = shape(q) * inverse_w0
            fn = fw
            for _ in range(EXPONENT - 1):
                fn = fn * fw
            if COUPLED:
                fn = fn * stress_share
            pair = symmetric_dot(add_identity(multiply(fn, add(tensile, symmetric(b, R, DIM))), -pi), mean)
        vf = m * inverse_rho_b
        if COUPLED:
            vf = vf * gradient_share
            m = m * force_share
        if MASS_FORM:
            density_rate += (m - rho * vf) * (f * ur)
        if DISSIPATION:
            p_b = b[P]
            flow = twice_alpha * vf * (p - p_b) * (f * r) / (c + b[C])
            density_rate += flow
            power -= 0.5 * inverse_rho * flow * (p * inverse_rho + p_b * inverse_rho_b)
        force, jump = add(add(term_a, pair), term_b), du
        if ANGULAR_MOMENTUM:
            spin_sum = add(
                spin_sum, multiply(m, torque(dx, add(term_a, multiply(0.5, pair)) if ARTIFICIAL_STRESS else term_a))
            )
        if AXISYMMETRIC:
            weight, real = mirror_weight(b[RING], inverse_ring)
            force, jump, closing = axisymmetric_pair(force, pair, du, radial_part(u), b[U + 1], weight, real)
            power += (0.5 * m) * (closing * radial_part(pair))
        if ANGULAR_MOMENTUM or AXISYMMETRIC:
            moment = subtract(moment, symmetric_outer(multiply(vf * f, dx), dx))
        a = add(a, multiply(m, force))
        power += m * dot(jump, add(term_a, multiply(0.5, pair)))
        l = subtract(l, outer(multiply(vf, du), g))
    force, work, gradient_u = lane_sums(a), lane_sum(power), lane_sums(l)
    if AXISYMMETRIC:
        fullness = lane_sums(moment)
        gradient_u = product(gradient_u, sound_inverse(matrix(fullness))[0])
        hoop_factor = hoop_share(radial_part(fullness)) * inverse_ring
        hoop = ((1.0 - radial_part(fullness)) * radial_part(t) - rows[i, HOOP]) * rho * hoop_factor
        if HYBRID:  # Total Lagrangian particles have this from their own pass
            hoop = hoop * (1.0 - rows[i, KIND])
        force, work = add_radial(force, hoop), work + hoop * radial_part(u)
        hoop_rate = radial_part(u) * hoop_factor
        regularization = axis_regularization(gradient_u[-1], hoop_rate, rows[i, RING], h)
        gradient_u = add_last(gradient_u, regularization)
        out[i, R_HOOP] = hoop_rate - regularization
    if ANGULAR_MOMENTUM:
        gradient_u = turning_kept(gradient_u, lane_sums(moment))
        put(out, i, R_SPIN, lane_sums(spin_sum))
    write_rates(out, i, force, -work, lane_max(mu_max), gradient_u)
    if MASS_FORM or DISSIPATION:
        out[i, R_DENSITY] = inverse_rho * lane_sum(density_rate)
    if CORRECTED:
        rows[i, FALLBACKS] = max(rows[i, FALLBACKS], lane_sum(plain))  # all of them, where it falls back as a whole
