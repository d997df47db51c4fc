"""Pair law of Riemann SPH for elastic-plastic solids, CON.

Each pair solves the acoustic Riemann problem along its line of centres e = (x_b - x_a)/r, which yields a contact
velocity u* and a traction t* (`sph.terms.riemann_solver`), from states that a limited reconstruction moves to the
middle of the pair (`sph.terms.reconstruction`):

    F    = 2 V_a V_b |dW/dr| t*                   force on a, -F on b
    L_a += 2 V_b |dW/dr| (u* - u_a) (x) e
    m_a de_a/dt += F . (u* - u_a)

The original variant ends there, with density from tr L. The corrected variant (CORRECTED_VARIANT) has in addition

- density from the own volume, d ln(rho_a)/dt = - 2 V_a sum |dW/dr| (u* - u_a) . e, the rate of the number density and
  of an exchange between both sides, with its correction (`sph.terms.density_correction`); where h follows density, the
  number density is that of the kernel at the own h (`sph.terms.grad_h`);
- an impedance that grows in a front, and tractions limited by the strength of both sides (`materials.traction_limits`);
- a velocity gradient corrected at free surfaces (`sph.terms.free_surface_correction`);
- conduction in fronts (`sph.terms.conduction`), relief of tension in disordered pairs
  (`sph.terms.tension_stabilization`), and conserved angular momentum (`sph.terms.angular_momentum`).

The adjoint variant (ADJOINT) has the corrected operator of the velocity gradient in force and power, too, and no jump
of stress in u*, as far as the lattice is in order (`sph.terms.adjoint_operator`).

Different bodies slide and separate with SEPARATING (`sph.contact.contact_normal`, `sph.contact.riemann_contact`, and
`sph.contact.variable_resolution` for unequal spacings). With RIGID some are rigid (`integrators.rigid_body`): they have
no pairs among themselves, all heat of a contact is that of the other side, and, with TURNS, their velocity is that at
the place of the other side, where their force acts, too. Between bodies the number density counts 2 (u* - u_a) for
u_b - u_a, so that a gas or a softer body does not strain a wall. Axisymmetric particles add the terms of
`sph.terms.axisymmetric`; with the density correction each neighbour is weighted by the ratio of the section areas at
rest, m/(2 pi r rho_0), each over its h^2, limited to half of the present one. In the original variant their velocity
gradient is renormalised. The energies of a pair and the work of its force add up to zero in all variants.

Source: Parshikov & Medin 2002 as used by Mehra & Chaturvedi 2006; reconstruction after van Leer 1979; h that
follows density after Springel & Hernquist 2002. The page `docs/theory/default-scheme.md` has all equations in order.
"""

from __future__ import annotations

import numpy as np

from hvisph.compiler.tensors import (
    add,
    add_radial,
    axial,
    broadcast,
    divergence,
    dot,
    exact_difference,
    exact_vector,
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
    row_symmetric_gradient,
    row_vector,
    subtract,
    symmetric,
    symmetric_dot,
    symmetric_outer,
    tangential_part,
    tangential_vector,
    torque,
    vector,
)
from hvisph.compiler.vector.api import (
    LANES,
    any_positive,
    broadcast_lanes,
    elementwise_max,
    lane_max,
    lane_sum,
    neighbours,
)
from hvisph.sph.contact.contact_normal import is_other_body, is_rigid
from hvisph.sph.contact.riemann_contact import contact_geometry, pressed_gap_factor
from hvisph.sph.terms.adjoint_operator import adjoint_tractions
from hvisph.sph.terms.angular_momentum import spin_tractions, torque_residual
from hvisph.sph.terms.axisymmetric import axisymmetric_traction, hoop_share, mirror_weight
from hvisph.sph.terms.conduction import conducted_power
from hvisph.sph.terms.free_surface_correction import free_surface_correction
from hvisph.sph.terms.grad_h import grad_h_rate, grad_h_sums
from hvisph.sph.terms.limiters import TINY
from hvisph.sph.terms.reconstruction import limiter_floor
from hvisph.sph.terms.riemann_solver import FRONT, outgoing_jump, reciprocals, shock_stiffening
from hvisph.sph.terms.shape_matrix import sound_inverse

from .pair_states import (
    contact_states,
    crack_limits,
    density_velocities,
    elastic_states,
    impedances,
    layer_share,
    reconstructed_shares,
    riemann_states,
    rigid_motion,
    section_ratio,
    strength_limits,
)

# Options of the law, off unless bound.
RECONSTRUCTION = CORRECTED_VARIANT = GRAD_H = SEPARATING = CONTACT_ONLY = 0
AXISYMMETRIC = ANGULAR_MOMENTUM = DENSITY_CORRECTION = FRACTURES = ADJOINT = 0
RIGID = TURNS = EDGES = 0
# Slots of what rounding takes of position and velocity, in single precision.
X_REST = U_REST = 0

# Share of a volume below which a neighbour is the distant row that fills lists and has no closing speed.
FILLER_VOLUME = 1e-12


def accumulate(indices, n, rows, i, constants, out):
    """Sum the rates of particle `i` over its neighbours."""
    x, u = row_exact_vector(rows, i, 0, X_REST, DIM), row_exact_vector(rows, i, U, U_REST, DIM)
    s, h, zt, volume = row_symmetric(rows, i, T, DIM), rows[i, H], rows[i, ZT], rows[i, V]
    inverse_filler = 1.0 / (FILLER_VOLUME * volume) if volume > 0.0 else 0.0
    if RECONSTRUCTION:
        grad_u, grad_s = row_gradient(rows, i, GU, DIM), row_symmetric_gradient(rows, i, GT, DIM)
    if ADJOINT:  # stress extrapolated to the stage
        s, operator = row_symmetric(rows, i, STAGE_T, DIM), row_symmetric(rows, i, OPERATOR, DIM)
    if SEPARATING:
        n_other, n_surface = row_vector(rows, i, N_OTHER, DIM), row_vector(rows, i, N_SURFACE, DIM)
    if FRACTURES:
        crack = row_vector(rows, i, CRACK, DIM)
    rigid_a = is_rigid(rows[i, BODY]) if RIGID else 0.0
    layer_a = 0.0
    if EDGES:
        edge_a = row_vector(rows, i, AMBIENT, DIM)
        layer_a = layer_share(edge_a)
    force, l, moment = broadcast(no_vector(DIM)), broadcast(no_gradient(DIM)), broadcast(no_symmetric(DIM))
    pair_torque, contact_moment = broadcast(no_axial(DIM)), broadcast(no_symmetric(DIM))
    if ANGULAR_MOMENTUM and not CONTACT_ONLY:
        spin = row_axial(rows, i, SPIN_STRESS, DIM)
    zero = power = closing = number = number_rate = slip = fullness = broadcast_lanes(0.0)
    own_number = kernel_sum = slope_sum = broadcast_lanes(0.0)
    inverse_radius = 1.0 / rows[i, RING] if AXISYMMETRIC else 0.0
    inverse_rest = 1.0 / (rows[i, REST_AREA] + TINY) if AXISYMMETRIC and DENSITY_CORRECTION else 0.0
    for k in range(np.uint64(0), n, np.uint64(LANES)):
        # Geometry: line of centres e, or normal of a contact; g = 2 |dW/dr|.
        b = neighbours(rows, indices, k, WIDTH)
        dx = exact_difference(exact_vector(b, 0, X_REST, DIM), x, DIM)
        r = np.sqrt(dot(dx, dx))
        ih, inverse_r = reciprocals(0.5 * (h + b[H]), r)
        g, e = -2.0 * scale(ih) * slope(r * ih), multiply(inverse_r, dx)
        layer_b = 0.0
        if EDGES:
            edge_b = vector(b, AMBIENT, DIM)
            layer_b = layer_share(edge_b)
        za, zb, zta, ztb = impedances(rows, i, b, e, inverse_filler, layer_a, layer_b)
        jump, lever = exact_difference(exact_vector(b, U, U_REST, DIM), u, DIM), dx
        rigid_b, heat_share = 0.0, 1.0
        if RIGID:
            g, jump, rigid_b, heat_share = rigid_motion(rows, i, b, dx, rigid_a, g, jump)
        du_n = dot(jump, e)
        approach, half, weight, other, gap_factor = -du_n, broadcast_lanes(0.5), broadcast_lanes(1.0), zero, zero
        in_contact = False
        if SEPARATING:  # most vectors of neighbours hold one body alone and skip the contact
            other = is_other_body(rows, i, b, dx)
            in_contact = any_positive(other * b[V])
            if CONTACT_ONLY:
                if not in_contact:
                    continue
                g, approach = g * other, approach * other
            if in_contact:
                e, g, weight, gap_factor = contact_geometry(
                    rows, i, k, indices, b, dx, ih, e, g, other, n_other, n_surface
                )
                half, du_n, lever = 0.5 - 0.5 * other, dot(jump, e), multiply(dot(dx, e), e)
        if EDGES:  # and no slopes
            matter = 1.0 - max(layer_a, layer_b)
            half = half * matter
        closing = elementwise_max(closing, min(b[V] * inverse_filler, 1.0) * approach)
        area = energy_area = b[V] * g
        if AXISYMMETRIC:
            mean, real = mirror_weight(b[RING], inverse_radius)
            energy_area = area * (mean * real)

        if EDGES:
            outgoing = outgoing_jump(jump, e, subtract(edge_b, edge_a), zta / za)
            excess = multiply(1.0 - matter, subtract(outgoing, jump))
            du_n += dot(excess, e)

        # Own traction, its jump and the jump of velocity, normal and tangential.
        ta = symmetric_dot(s, e)
        stress_b = symmetric(b, STAGE_T if ADJOINT else T, DIM)
        step = subtract(symmetric_dot(stress_b, e), ta)
        ta_n, dt_n = dot(ta, e), dot(step, e)
        du_t = dt_t = ta_t = 0.0
        if DIM > 1:
            full_jump = add(jump, excess) if EDGES else jump
            du_t, dt_t = tangential_part(full_jump, du_n, e), tangential_part(step, dt_n, e)
            ta_t = tangential_part(ta, ta_n, e)
        velocity, own_traction, stress = (du_n, du_t), (ta_n, ta_t), (dt_n, dt_t)
        elastic = factor = gain = 1.0
        if ADJOINT:
            elastic = (1.0 - other) * min(rows[i, ELASTIC], b[ELASTIC])
            stress_difference, mean_traction, mean_e = adjoint_tractions(
                s, stress_b, operator, symmetric(b, OPERATOR, DIM), e
            )
            factor = dot(mean_e, e)
            gain = 1.0 + other * (factor - 1.0)
            energy_area = gain * energy_area
            power += (0.25 * elastic) * energy_area * dot(stress_difference, jump)

        # Riemann problems of the reconstructed states, with velocities relative to the own one.
        no_shares = (zero, zero), (zero, zero)
        shares = no_shares, no_shares
        if RECONSTRUCTION:
            floor = 0.0
            if CORRECTED_VARIANT:
                order = zero if ADJOINT else min(rows[i, LATTICE_ORDER], b[LATTICE_ORDER])
                floor = limiter_floor(approach, dt_n, za, zb, rows[i, RHO] + b[RHO], order)
                floor = (1.0 - elastic) * floor if ADJOINT else floor
            shares = reconstructed_shares(b, dx, e, velocity, stress, grad_u, grad_s, floor)
        remainder = du_n - half * du_n * (shares[0][0][0] + shares[0][0][1])
        if CORRECTED_VARIANT:
            stiffening = shock_stiffening(remainder)
            za, zb = za + rows[i, RHO] * stiffening, zb + b[RHO] * stiffening
        contact, traction, inverse_n = riemann_states(za, zb, zta, ztb, velocity, own_traction, stress, shares, half)
        if ADJOINT:
            mean_n = dot(mean_traction, e)
            mean_t = tangential_part(mean_traction, mean_n, e) if DIM > 1 else 0.0
            contact, traction = elastic_states(
                contact, traction, velocity, (mean_n, mean_t), za * zb * inverse_n * remainder, elastic
            )

        # Limits of the materials, and contact.
        if CORRECTED_VARIANT:
            traction = strength_limits(rows, i, b, dx, inverse_r, traction, factor)
        if FRACTURES:
            traction = crack_limits(rows, i, b, e, crack, traction, ta_n, dt_n, other)
        if in_contact:
            if GRAD_H:
                gap_factor = pressed_gap_factor(gap_factor, traction[0], ta_n, dt_n, other)
            weight = weight * (1.0 + other * (gap_factor - 1.0))
            contact, traction, gap_heat, slip_heat = contact_states(
                rows, i, b, contact, traction, velocity, own_traction, stress, (za, zb), constants[1], other, gap_factor
            )
            friction_heat = heat_share * energy_area * slip_heat
            power += (heat_share * energy_area) * gap_heat
            power, slip = power + friction_heat, slip + friction_heat
            if ANGULAR_MOMENTUM:
                contact_moment = add(contact_moment, symmetric_outer(lever, multiply(other * weight * area, e)))
        us_n, t_n = contact[0], traction[0]
        us, ts = multiply(us_n, e), multiply(t_n, e)
        if DIM > 1:
            us, ts = add(us, tangential_vector(contact[1], e)), add(ts, tangential_vector(traction[1], e))

        if EDGES:  # relative to the layer, without the excess of the jump
            us = subtract(us, multiply(layer_a, excess))

        # Force and power.
        if ANGULAR_MOMENTUM or TURNS:  # a rigid body takes all of it, at the place of the other side
            share = 1.0 - rigid_b - (3.0 - rigid_b) * rigid_a if TURNS else 1.0
            pair_torque = add(pair_torque, multiply(share * area, torque(dx, multiply(gain, ts) if ADJOINT else ts)))
        power += energy_area * dot(ts, us)
        if ADJOINT:
            ts = multiply(gain, ts)
        if ANGULAR_MOMENTUM and not CONTACT_ONLY:
            spin_a, spin_b = spin_tractions(spin, axial(b, SPIN_STRESS, DIM), multiply(half, e))
            power += area * dot(spin_a, jump)
            ts = add(ts, add(spin_a, spin_b))
        if CORRECTED_VARIANT:
            heat_area = energy_area * ((1.0 - other) * matter if EDGES else 1.0 - other)
            power += conducted_power(heat_area, rows[i, RHO] + b[RHO], stiffening, b[ENERGY] - rows[i, ENERGY])
        if AXISYMMETRIC:
            radial = radial_part(e) + (elastic * radial_part(subtract(mean_e, e)) if ADJOINT else 0.0)
            fullness += (0.5 * weight) * area * radial * radial_part(dx)
            ts, image_power, dashpot_power = axisymmetric_traction(
                ts, area, e, u, jump, remainder, zt, b[ZT], other, mean, real
            )
            power -= heat_share * image_power
            power += dashpot_power
        force = add(force, multiply(area, ts))

        # Velocity gradient, moment matrix and rates of density.
        gradient_area = multiply(weight * area, e)
        l = add(l, outer(us, gradient_area))
        if CORRECTED_VARIANT or AXISYMMETRIC:
            moment = add(moment, symmetric_outer(lever, gradient_area))
        if CORRECTED_VARIANT:
            ratio = section_ratio(rows, i, b, dx, other, inverse_rest)
            u_exchange, mean_u = density_velocities(rows, i, b, us_n, du_n, t_n, zb, inverse_n, other)
            number += weight * g * ratio * u_exchange
            number_rate += weight * g * ratio * mean_u
            if GRAD_H:
                h_term, own_kernel, kernel, slopes = grad_h_sums(h, r, weight * ratio, du_n, other)
                number -= 0.5 * g * h_term
                own_number -= own_kernel
                kernel_sum, slope_sum = kernel_sum + kernel, slope_sum + slopes
    conclude(rows, i, out, lane_sums(force), lane_sums(l), multiply(0.5, lane_sums(moment)), lane_sum(power),
             lane_max(closing), (lane_sum(number), lane_sum(number_rate), lane_sum(own_number), lane_sum(kernel_sum),
             lane_sum(slope_sum)),
             (lane_sums(pair_torque), multiply(0.5, lane_sums(contact_moment))), lane_sum(slip),
             lane_sum(fullness))  # fmt: skip


def conclude(rows, i, out, force, gradient_u, moment, work, closing, numbers, torques, slip, fullness):
    """Write the rates of particle `i` from the sums over its pairs: a part of `accumulate`."""
    volume, inverse_density = rows[i, V], rows[i, V] / rows[i, M]
    if CORRECTED_VARIANT:
        number, number_rate, own_number, kernel_sum, slope_sum = numbers
        rate = volume * number
        if GRAD_H:
            rate = grad_h_rate(rows[i, H], volume, rate, own_number, kernel_sum, slope_sum, rows[i, FOLLOWING_SHARE])
        smooth = max(1.0 - closing * rows[i, RHO] / (FRONT * rows[i, ZN]), 0.0)
        relaxation = smooth * rows[i, DENSITY_RELAXATION] if DENSITY_CORRECTION else 0.0
        if DENSITY_CORRECTION:
            decay = smooth * rows[i, CORRECTION_DECAY]
            out[i, R_CORRECTION] = rows[i, INV_NUMBER_DENSITY] * number_rate - rate - decay
        l_plain = gradient_u
        gradient_u, rate = free_surface_correction(gradient_u, rate, matrix(moment), smooth, rows[i, TENSION_LIMIT])
        if ADJOINT:
            share, operator = rows[i, ELASTIC], matrix(row_symmetric(rows, i, OPERATOR, DIM))
            gradient_u = add(product(l_plain, operator), multiply(1.0 - share, subtract(gradient_u, l_plain)))
            rate, relaxation = rate + share * (divergence(gradient_u) - rate), (1.0 - share) * relaxation
            put(out, i, R_GRADIENT_BEFORE, row_gradient(rows, i, GU, DIM))
        out[i, R_DENSITY] = divergence(gradient_u) - (rate + relaxation)
    if AXISYMMETRIC:
        if not (CORRECTED_VARIANT or CONTACT_ONLY):
            gradient_u = product(gradient_u, sound_inverse(matrix(moment))[0])
        weight, inverse_radius, radial_u = 0.0 if CONTACT_ONLY else 1.0, 1.0 / rows[i, RING], rows[i, U + 1]
        hoop_rate = hoop_share(fullness) * inverse_radius
        hoop = (weight - fullness) * radial_part(row_symmetric(rows, i, T, DIM)) - weight * rows[i, HOOP]
        hoop = hoop * (inverse_radius if CONTACT_ONLY else hoop_rate)
        force, work = add_radial(force, hoop), work - hoop * radial_u
        out[i, R_HOOP] = radial_u * hoop_rate
    write_rates(out, i, multiply(inverse_density, force), inverse_density * work, closing, gradient_u)
    if ANGULAR_MOMENTUM or TURNS:
        pair_torque, contact_moment = torques
        residual = multiply(-0.5, pair_torque)
        if ANGULAR_MOMENTUM and not CONTACT_ONLY:
            spin, order = row_axial(rows, i, SPIN_STRESS, DIM), rows[i, LATTICE_ORDER] if CORRECTED_VARIANT else 0.0
            deficit = torque_residual(residual, moment, contact_moment, spin, order)
            rigid_a = is_rigid(rows[i, BODY]) if TURNS else 0.0
            residual = add(multiply(rigid_a, residual), multiply(1.0 - rigid_a, deficit)) if TURNS else deficit
        put(out, i, R_SPIN, multiply(inverse_density, residual))
    elif ADJOINT:  # its slots lie before those of the gradient
        put(out, i, R_SPIN, no_axial(DIM))
    if SEPARATING:
        out[i, R_SLIP] = inverse_density * slip


# Templates that the law calls, bound to the same names.
PARTS = (
    *(grad_h_sums, grad_h_rate, conclude, is_other_body, contact_geometry, rigid_motion, impedances),
    *(reconstructed_shares, riemann_states, elastic_states, strength_limits, crack_limits, contact_states),
    *(section_ratio, density_velocities),
)
