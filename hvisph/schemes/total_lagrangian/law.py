"""Total Lagrangian pair forces over reference neighbours, and the particle row for them.

    f_ab  = V0_a V0_b (P_a g_ab - P_b g_ba) = V0_a ((Q_a + Q_b) s (X_a - X_b) + (q_a - q_b) w)
    e_a   : own stress power V0_a P_a : Fdot_a, and half of the work of viscosity and hourglass control

with V0_b g_ab = A_a s (X_a - X_b) + B_a w (s, w: slope and shape of the pair, see
`sph.neighbours.reference_neighbours`), and Q = P A, q = P B from `schemes.total_lagrangian.deformation_gradient`. Pairs
of an Eulerian and a Total Lagrangian particle have the weight 1/2, the other half being their spatial force; pairs of
two Eulerian particles have none. Each particle writes its own row only.

Viscosity: Monaghan's with the plain kernel gradient at current positions (dissipative for every pair),
or the printed form of Young 2021 eqs. 2 and 9 in reference gradients. Hourglass control after
Ganzenmueller 2015: f_ab = - alpha V0_a V0_b W0 / (2 R^2) (E_a delta_a + E_b delta_b) x_ab / r with
delta_a = (F_a X_ab - x_ab) . x_ab / r, in his sign convention x_ab = x_b - x_a.

Axisymmetric particles (AXISYMMETRIC) have the weights of `sph.terms.axisymmetric`: at reference radii for sums over
reference gradients, at present radii for the viscosity, which acts across the axis as across a mirror. The power of a
particle's own stress is summed pair by pair, as its force is; energy is conserved to round-off.
"""

import numpy as np

from hvisph.compiler.tensors import (
    add,
    broadcast,
    dot,
    dot_rows,
    gradient,
    lane_sums,
    multiply,
    no_vector,
    put,
    radial_part,
    row_gradient,
    row_vector,
    scale_radial,
    subtract,
    vector,
)
from hvisph.compiler.vector.api import LANES, broadcast_lanes, elementwise_max, lane_max, lane_sum, neighbours
from hvisph.compiler.vector.rows import fetch_rows
from hvisph.sph.neighbours.particle_layout import RowLayout, select_fields
from hvisph.sph.terms.axisymmetric import axisymmetric_jump, mirror_weight
from hvisph.sph.terms.viscosity import SOFTENING, approach, monaghan

AHEAD = 96  # rows of neighbours are prefetched so many entries before they are needed


def row_layout(
    dim: int, mixed: bool, printed_viscosity: bool, hourglass: bool, axisymmetric: bool = False
) -> tuple[RowLayout, int]:
    """Return the row of a particle and how many of its slots `accumulate` reads of neighbours.

    X0 is the reference position, which only hourglass control reads of neighbours, KIND 1 for Total Lagrangian and 0
    for Eulerian, Q and QW the stress with the corrections; N, NW and IJ belong to the printed viscosity, EM, a modulus,
    and EF = EM F to hourglass control, RING and RING0, the radius now and in the reference, to rings. Those after them
    are the particle's own.
    """
    pair_fields = select_fields(
        ("x", "vector"), ("u", "vector"), hourglass and ("x0", "vector"), ("m", "scalar"), ("rho", "scalar"),
        ("c", "scalar"), ("q", "gradient"), mixed and ("qw", "vector"),
        printed_viscosity and ("n", "gradient"), printed_viscosity and ("nw", "vector"),
        printed_viscosity and ("ij", "scalar"), hourglass and ("ef", "gradient"), hourglass and ("em", "scalar"),
        axisymmetric and ("ring", "radius"), axisymmetric and ("ring0", "radius"), ("kind", "scalar"),
    )  # fmt: skip
    rest = select_fields(("h", "scalar"), ("s", "symmetric"), ("e", "scalar"), not hourglass and ("x0", "vector"))
    return RowLayout(dim, (*pair_fields, *rest)), RowLayout(dim, pair_fields).used_width


def accumulate(i, rows, active, group, volume, lists, sums, viscosity, hourglass, ih, rates):
    """Sum forces and powers over the neighbours of particle `i`, if active[i] equals `group` (template).

    Parameters: those of `deform` and of `sph.neighbours.reference_neighbours` (`sums`: first and zeroth), alpha and
    beta of the viscosity, the hourglass coefficient, 1/h [1/m]. `rates` receives acceleration, power and largest |mu|.
    The particle's own stress is summed pair by pair (BY_PAIRS) beside Eulerian neighbours (COUPLED) and in
    axisymmetric cases; otherwise as a whole, with the power of `deform`.
    """
    starts, indices, codes, kernels = lists
    first_sums, zeroth_sums = sums
    alpha, beta = viscosity
    if active[i] != group:
        return
    x, u = row_vector(rows, i, 0, DIM), row_vector(rows, i, U, DIM)
    kind, rho, c, h = rows[i, KIND], rows[i, RHO], rows[i, C], 1.0 / ih
    q = row_gradient(rows, i, Q, DIM)
    if MIXED:
        qw = row_vector(rows, i, QW, DIM)
    if PRINTED:
        n, nw, ij = row_gradient(rows, i, N, DIM), row_vector(rows, i, NW, DIM), rows[i, IJ]
    if HOURGLASS:
        x0 = row_vector(rows, i, X0, DIM)
        ef, em = row_gradient(rows, i, EF, DIM), rows[i, EM]
    inverse_rho0 = volume[i] / rows[i, M]  # all of the reference density of its neighbours: they are of one body
    if AXISYMMETRIC:
        inverse_rho0 *= rows[i, RING0] / rows[i, RING]
        inverse_ring, inverse_ring0 = 1.0 / rows[i, RING], 1.0 / rows[i, RING0]
    factor = scale(ih)
    a, power, mu_max = broadcast(no_vector(DIM)), broadcast_lanes(0.0), broadcast_lanes(0.0)
    for k in range(np.uint64(starts[i]), np.uint64(starts[i + np.uint64(1)]), np.uint64(LANES)):
        if DIM > 2:  # flat bodies find them in a cache
            fetch_rows(rows, indices, k + np.uint64(AHEAD), WIDTH if COUPLED else WIDTH - 1)
        b = neighbours(rows, indices, k, WIDTH)
        dx, du = subtract(x, vector(b, 0, DIM)), subtract(u, vector(b, U, DIM))
        r2, ur = dot(dx, dx), dot(du, dx)
        kernel = neighbours(kernels, codes, k, WEIGHTS)
        g = vector(kernel, 0, DIM)
        term_b = dot_rows(gradient(b, Q, DIM), g)
        if MIXED or HOURGLASS or PRINTED:
            w = kernel[DIM]
        if MIXED:
            term_b = subtract(term_b, multiply(w, vector(b, QW, DIM)))
        # What belongs to the pair, with half of its work for each side.
        r = np.sqrt(r2)
        soft = r2 + SOFTENING * h * h
        densities = rho + b[RHO]
        inverse = 1.0 / (r * soft * densities)
        mu = approach(h, ur, inverse * r * densities)
        mu_max = elementwise_max(mu_max, -mu)
        pi = monaghan(mu, alpha, beta, c + b[C], inverse * r * soft)
        if PRINTED:
            n_sum = add(multiply(b[IJ], n), multiply(ij, gradient(b, N, DIM)))
            nw_sum = subtract(multiply(b[IJ], nw), multiply(ij, vector(b, NW, DIM)))
            pair = multiply(-0.5 * pi / (inverse_rho0 * inverse_rho0), add(dot_rows(n_sum, g), multiply(w, nw_sum)))
        else:
            gradient_r = factor * slope(r * ih) * (inverse * soft * densities)
            pair = multiply(-pi * b[M] * gradient_r / inverse_rho0, dx)
        jump = du
        if AXISYMMETRIC:
            weight, real = mirror_weight(b[RING0], inverse_ring0)
            term_b = multiply(weight, term_b)
            # image over the axis: the radial work of the two real particles
            jump = axisymmetric_jump(du, radial_part(u), b[U + 1], real)
            if PRINTED:
                pair = multiply(weight, pair)
            else:  # of the viscosity that of a mirror
                ring_weight = mirror_weight(b[RING], inverse_ring)[0]
                pair = multiply(ring_weight + (1.0 - real) * (1.0 - 2.0 * ring_weight), pair)
                closing = (1.0 - real) * (radial_part(du) - radial_part(jump))
                image_power = 0.5 * closing * radial_part(pair)
        if HOURGLASS:
            # Errors of the distances that F_a and F_b predict, along the pair, times E_a and E_b. Each sum over
            # the sides comes first; the remainder is then rounded equally on both sides.
            dx0 = subtract(x0, vector(b, X0, DIM))
            prediction = dot_rows(add(ef, gradient(b, EF, DIM)), dx0)
            error = dot(subtract(prediction, multiply(em + b[EM], dx)), dx)
            # the far row has an infinite distance and w = 0
            strength = 0.5 * hourglass * w * error / (dot(dx0, dx0) * r2)
            if AXISYMMETRIC:
                strength = strength * weight
            pair = add(pair, multiply(strength, dx))
        if BY_PAIRS:
            share = 0.5 * (kind + b[KIND]) * inverse_rho0 if COUPLED else broadcast_lanes(inverse_rho0)
            term_a = dot_rows(q, g)
            if MIXED:
                term_a = add(term_a, multiply(w, qw))
            if AXISYMMETRIC:
                term_a = multiply(weight, term_a)
            force = add(add(term_a, term_b), pair)
            if AXISYMMETRIC:
                force = scale_radial(force, real, 1.0)
            a = add(a, multiply(share, force))
            power += share * dot(jump, add(term_a, multiply(0.5, pair)))
            if AXISYMMETRIC and not PRINTED:
                power += share * image_power
        else:
            a = add(a, add(term_b, pair))
            power += dot(du, pair)
    if AXISYMMETRIC:
        put(rates, i, R_ACCELERATION, add(row_vector(rates, i, R_ACCELERATION, DIM), lane_sums(a)))
        rates[i, R_POWER] -= lane_sum(power)
    elif BY_PAIRS:
        put(rates, i, R_ACCELERATION, lane_sums(a))
        rates[i, R_POWER] = -lane_sum(power)
    else:
        total = add(lane_sums(a), dot_rows(q, row_vector(first_sums, i, 0, DIM)))
        if MIXED:
            total = add(total, multiply(zeroth_sums[i], qw))
        put(rates, i, R_ACCELERATION, multiply(inverse_rho0, total))
        rates[i, R_POWER] -= 0.5 * inverse_rho0 * lane_sum(power)
    rates[i, R_APPROACH] = lane_max(mu_max)
