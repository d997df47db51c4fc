"""CON: contact (Riemann) SPH of elastic-plastic solids, with optional limited reconstruction.

In each pair the acoustic Riemann problem along the line of centres e = (x_b - x_a)/r gives
a contact velocity and traction, normal with the impedance rho c_l, tangential with rho c_t:

    u* = (Z_a u_a + Z_b u_b + t_b - t_a) / (Z_a + Z_b)
    t* = (Z_b t_a + Z_a t_b + Z_a Z_b (u_b - u_a)) / (Z_a + Z_b),        t = sigma e
    F    = 2 V_a V_b |dW/dr| t*                   force on a, -F on b
    L_a += 2 V_b |dW/dr| (u* - u_a) (x) e
    m_a de_a += F . (u* - u_a)

Reconstruction moves each side's value halfway to the other by a limited slope: with d = f_b - f_a
and D = (grad f_a . e) r,  f_a += lim(d, 2 D - d)/2. Gradients are renormalised and come from a first
pass over the same neighbours (`gradients`), which writes them into the particle's own row.
The tangential part is limited as a vector, so the result does not depend on the frame.

The printed form ends there, density following tr L. With CONSISTENT

    Z_n  = rho (c_l + 1.2 max(u_an - u_bn, 0))                   a shock's speed rises with its jump
    d ln(rho_a)/dt = - 2 V_a sum |dW/dr| (u* - u_a) . e          the own volume: density keeps to the spacing
    t*_n <= what both sides bear in tension,  |t*_t| <= what both bear in shear            (`materials.traction_limits`)

and gradients are corrected at edges (`sph.terms.free_surface_correction`). With the own volume the rate is that of
the number density
sum W and of an exchange between both sides: mass, momentum and energy hold across a front. The exchange, which keeps
density even, loses half in pairs of one body that press hard, where it parts density from the number for good,

    u*  <-  u* + s ((u_a + u_b)/2 - u*)  in the density's rate,      s = min((10 t*_n / rho c^2)^2, 1/2),  t*_n < 0

and gives up its lead x = ln(rho/m) - ln(sum W) behind the front (LEADS),

    dx/dt -= q,   d ln(rho)/dt -= q min((10 p/rho c_l^2)^2, 1),   q = x c_l/(10 h) max(0, 1 - 20 mu/c_l),   p > 0

but loses all, 1 for 1/2, where h follows density (FOLLOWING). There the number is that of the kernel at the own h,
whose change divides by Omega_a = 1 + V_a h_a/d sum dW/dh. A wall that counted how the rows of a gas, or of a softer
body, close on each other would be strained by it: between bodies that number counts 2 (u* - u_a) for u_b - u_a, and sum
W in the lead 2 Z_b/(Z_a + Z_b) (u_b - u_a). Rings that a hole opens in move apart by unlike shares, and their sections
are no longer alike: where h is fixed each neighbour counts as many times as its section has the own one's area at rest,
m/(2 pi r rho_0), each over its h^2; half of what it fills is the least, or thin debris would count what closes on it as
many times over as it has thinned. Fronts conduct heat within a body, at a Prandtl number of one,

    m_a de_a += 2 V_a V_b |dW/dr| (rho_a + rho_b)/4 1.2 max(u_an - u_bn, 0) (e_b - e_a)

Tension makes a lattice of particles unstable, for disorder raises sum W. HELD keeps it where o_ab says that the
bodies have not flowed: tension leaves pairs that are closer than their volumes allow,

    t*_n -= max(t*_n, 0) o_ab min(12 max(V_a V_b / r^(2d) - 1, 0), 1)

Outside fronts lim(d, s) takes at least a share of d: what dissipates fastest is neighbours against each other, whose
slopes are none, and the less of it there is the longer a step may be,

    0.35 (1 + o_ab) max(0, 1 - 40 max(u_an - u_bn, 2 |t_bn - t_an|/(Z_a + Z_b)) (rho_a + rho_b)/(Z_a + Z_b))

What has failed (o_a = -1, for 0 here) has no slopes of its own: beside what is pressed it would give heat that it has
not, where t* (u* - u_a) of a side at rest that starts from its own state is a square.

Between different bodies (PARTED), with normal and gate of `sph.contact.contact_normal` and no reconstruction,

    G    = |dW/dr| n . e,  n  in place of  |dW/dr|,  e
    t*_n = gate min(t*_n, 0),     |t*_t| <= friction |t*_n|
    u*_a = u_a + (t* - t_a)/Z_a,  u*_b = u_b - (t* - t_b)/Z_b    each side's own, equal where t* is the full one
    D    = F . (u*_b - u*_a)/2 >= 0                              heat of slip and of the gate, to each side

and the velocity gradient takes the pair by its gate. FACES of one body that look at each other meet so, too (there).
Bodies of UNLIKE spacings meet as `sph.contact.variable_resolution` says. In all forms the energies of a pair and the
work of its force
sum to nothing. Rings of solids of revolution (REVOLVED) add what `sph.terms.axisymmetric` says; in the printed form
their velocity gradient is renormalised.

Shear tractions lie beside the line of centres and make angular momentum. With SPINS each particle counts its share,

    m_a ds_a/dt = - sum r e x F/2 - V_a (tr B - B) w_a,     B = sum of the own body V_b |dW/dr| r e (x) e

half of the pairs' torque and what its own w takes back; the sum over all particles is all that is made. In the next
step dt the own body's pairs carry (w_a + w_b) x e/2 beside t*, w_a = rho_a s_a/(2 dt): an antisymmetric stress, equal
and opposite in each pair as the rest of it. The work of w_a on u_b - u_a is a's, who made that torque: what turns as a
whole gains no heat by it. What is left at any time is one step's worth.
Where B is too poor to correct gradients by (`sph.terms.free_surface_correction.correctable`), in strings and crumbs
that have torn off, s
is dropped: they take their own turning for strain, and given back it would be strained without end.

Source: Parshikov & Medin 2002 as used by Mehra & Chaturvedi 2006; reconstruction after van Leer 1979; h that
follows density after Springel & Hernquist 2002.
"""

from __future__ import annotations

import numpy as np

from hvisph.compiler.tensors import (
    about,
    aside,
    axial,
    beside,
    divergence,
    dot,
    facing_aside,
    gradient,
    inertia,
    matrix,
    minus,
    no_axial,
    no_gradient,
    no_symmetric,
    no_vector,
    on,
    on_rows,
    outer,
    own_axial,
    own_gradient,
    own_symmetric,
    own_symmetric_gradient,
    own_vector,
    plus,
    plus_radial,
    product,
    put,
    radial,
    scaled_apart,
    spread,
    symmetric,
    symmetric_gradient,
    symmetric_outer,
    times,
    to_dimensions,
    torque,
    totals,
    vector,
)
from hvisph.compiler.vector.api import LANES, all_lanes, anywhere, larger_lanes, largest, neighbours, total
from hvisph.sph.contact.contact_normal import across
from hvisph.sph.contact.variable_resolution import along_normal, stretched
from hvisph.sph.terms.axisymmetric import brake, hoop_share, ring_weight
from hvisph.sph.terms.free_surface_correction import FRONT, at_edges, correctable
from hvisph.sph.terms.limiters import TINY
from hvisph.sph.terms.riemann_solver import at_most, counted, drawn, inverses, let_go, met, met_beside, pressed, slid
from hvisph.sph.terms.shape_matrix import sound_inverse

# Options of the law, off unless bound.
RECONSTRUCTION = CONSISTENT = HELD = FOLLOWING = PARTED = UNLIKE = ONLY_OTHER = REVOLVED = SPINS = LEADS = 0

# Slope of the shock's speed over its jump of velocity, for the impedance; metals have 1.2 to 1.5.
SHOCK_SLOPE = 1.2
# Share of a volume: a neighbour with less is the far row that fills lists, which has no say in the closing speed.
NOTHING = 1e-12
# Stands for no limit of a traction [Pa].
UNLIMITED = 1e300
# Shear impedance over the normal one of what bears no shear.
SLIPPERY = 1e-8
# Least share of their difference that both sides of a pair move to each other by, and what neither having flowed adds.
EASED, ORDERLY = 0.35, 0.35
# A pair that closes at this share of the speed of sound, or would, is in a front, and moves by its slopes alone.
CALM = 0.025


def accumulate(near, n, rows, i, constants, out):
    """Sum the rates of particle `i` over its neighbours."""
    x, u, s = own_vector(rows, i, 0, DIM), own_vector(rows, i, U, DIM), own_symmetric(rows, i, T, DIM)
    h, zn, zt, volume = rows[i, H], rows[i, ZN], rows[i, ZT], rows[i, V]
    many = 1.0 / (NOTHING * volume) if volume > 0.0 else 0.0
    if RECONSTRUCTION:
        grad_u, grad_s = own_gradient(rows, i, GU, DIM), own_symmetric_gradient(rows, i, GT, DIM)
    if PARTED:
        fills, ends = own_vector(rows, i, FILLS, DIM), own_vector(rows, i, ENDS, DIM)
    a, l, moment = spread(no_vector(DIM)), spread(no_gradient(DIM)), spread(no_symmetric(DIM))
    made, across_bodies = spread(no_axial(DIM)), spread(no_symmetric(DIM))
    if SPINS and not ONLY_OTHER:
        twist = own_axial(rows, i, TWIST, DIM)
    nowhere = power = mu = number = receding = own_number = widening = slip = fullness = all_lanes(0.0)
    inverse_ring = 1.0 / rows[i, RING] if REVOLVED else 0.0
    per_rest = 1.0 / (rows[i, REST] + TINY) if REVOLVED and LEADS else 0.0
    for k in range(np.uint64(0), n, np.uint64(LANES)):
        b = neighbours(rows, near, k, WIDTH)
        dx = minus(vector(b, 0, DIM), x)
        r = np.sqrt(dot(dx, dx))
        ih, inverse_r = inverses(0.5 * (h + b[H]), r)
        g, e = -2.0 * scale(ih) * slope(r * ih), times(inverse_r, dx)
        za, zb = zn, b[ZN]
        jump, lever = minus(vector(b, U, DIM), u), dx
        du_n = dot(jump, e)
        approach, half, weight, other, gate = -du_n, all_lanes(0.5), all_lanes(1.0), nowhere, nowhere
        meeting = False
        if PARTED:  # bodies seldom meet: most vectors of neighbours skip what is for them alone
            other = of_other(rows, i, b, dx)
            meeting = anywhere(other * b[V])
            if ONLY_OTHER:
                if not meeting:
                    continue
                g, approach = g * other, approach * other
            if meeting:
                cold = neighbours(rows, near, k, WHOLE)
                e, cosine, gate = across(e, other, fills, vector(cold, FILLS, DIM), ends, vector(cold, ENDS, DIM))
                g, half, weight = g * cosine, 0.5 - 0.5 * other, 1.0 + other * (gate - 1.0)
                du_n, lever = dot(jump, e), times(dot(dx, e), e)
                if UNLIKE:
                    ik = along_normal(rows[i, DEPTH], h, cold[DEPTH], b[H])
                    q, s_n, _ = stretched(dx, e, ik, ih)
                    facing = -2.0 * scale(ih) / (ih * ih * h * b[H]) * slope(q) * s_n * ik / (q + TINY)
                    g, weight = g + other * (facing - g), weight * (1.0 + other * (ik * h - 1.0))
        mu = larger_lanes(mu, min(b[V] * many, 1.0) * approach)
        vg = worked = b[V] * g
        if REVOLVED:
            mean, real = ring_weight(b[RING], inverse_ring)
            worked = vg * (mean * real)
        ta = on(s, e)  # own traction, its step to the neighbour's, and the jump of velocity, normal and tangential
        step = minus(on(symmetric(b, T, DIM), e), ta)
        ta_n, dt_n = dot(ta, e), dot(step, e)
        if DIM > 1:
            du_t, dt_t, ta_t = beside(jump, du_n, e), beside(step, dt_n, e), beside(ta, ta_n, e)
        # How far each side moves to the middle: shares of normal velocity and traction, and of the tangential ones.
        moves = of_n = shares_u = shares_t = (nowhere, nowhere)
        if RECONSTRUCTION:
            least = 0.0
            if CONSISTENT:
                inverse = 1.0 / (za + zb)
                jolt = max(approach, 2.0 * inverse * abs(dt_n))
                calm = max(1.0 - (1.0 / CALM) * (rows[i, RHO] + b[RHO]) * inverse * jolt, 0.0)
                least = calm * (EASED + ORDERLY * max(min(rows[i, ORDER], b[ORDER]), 0.0))
            pa, pb = on_rows(grad_u, dx), on_rows(gradient(b, GU, DIM), dx)
            qa, qb = on(on_rows(grad_s, dx), e), on(on_rows(symmetric_gradient(b, GT, DIM), dx), e)
            moves, of_n = drawn(du_n * du_n, (du_n * dot(pa, e), du_n * dot(pb, e)),
                                dt_n * dt_n, (dt_n * dot(qa, e), dt_n * dot(qb, e)), share, least)  # fmt: skip
            if DIM > 1:
                of_u = (dot(facing_aside(pa, e), du_t), dot(facing_aside(pb, e), du_t))
                of_t = (dot(facing_aside(qa, e), dt_t), dot(facing_aside(qb, e), dt_t))
                shares_u, shares_t = drawn(dot(du_t, du_t), of_u, dot(dt_t, dt_t), of_t, share, least)
        # The acoustic Riemann problem, with velocities less the own one.
        apart = du_n - half * du_n * (moves[0] + moves[1])
        if CONSISTENT:
            closing = -SHOCK_SLOPE * min(apart, 0.0)
            za, zb = za + rows[i, RHO] * closing, zb + b[RHO] * closing
        by_n, by_t = inverses(za + zb, zt + b[ZT] + TINY)
        us_n, t_n = met(by_n, za, zb, du_n, ta_n, dt_n, moves, of_n, half)
        if CONSISTENT:
            t_n = min(t_n, min(rows[i, BEAR], b[BEAR]))
            if HELD:
                t_n = let_go(t_n, volume * b[V], dx, inverse_r, min(rows[i, ORDER], b[ORDER]))
        if DIM > 1:
            us_t, t_t = met_beside(by_t, zt, b[ZT], du_t, ta_t, dt_t, shares_u, shares_t, half)
            if CONSISTENT:
                most = min(rows[i, SHEAR], b[SHEAR])
                t_t = (max(min(t_t[0], most), -most),) if DIM == 2 else at_most(most, t_t)
        if meeting:
            t_n, us_n, parting = pressed(t_n, us_n, du_n, ta_n, dt_n, za, zb, other, gate)
            power += worked * (t_n * parting)
            if DIM > 1:
                most = max(UNLIMITED * (1.0 - other), -constants[1] * t_n)
                t_t, us_t, heat = slid(t_t, us_t, du_t, ta_t, dt_t, (zt, zn), (b[ZT], b[ZN]), most, other)
                power, slip = power + worked * heat, slip + worked * heat
            if SPINS:
                across_bodies = plus(across_bodies, symmetric_outer(lever, times(other * weight * vg, e)))
        us, ts = times(us_n, e), times(t_n, e)
        if DIM > 1:
            us, ts = plus(us, aside(us_t, e)), plus(ts, aside(t_t, e))
        if SPINS:
            made = plus(made, times(vg, torque(dx, ts)))
        power += worked * dot(ts, us)
        if SPINS and not ONLY_OTHER:
            turned = times(half, e)
            taken = about(twist, turned)
            power += vg * dot(taken, jump)
            ts = plus(ts, plus(taken, about(axial(b, TWIST, DIM), turned)))
        if CONSISTENT:
            power += worked * (1.0 - other) * (0.25 * (rows[i, RHO] + b[RHO])) * closing * (b[HEAT] - rows[i, HEAT])
        if REVOLVED:
            fullness += (0.5 * weight) * vg * radial(e) * radial(dx)
            power -= vg * mean * (1.0 - real) * (0.5 * radial(ts)) * (2.0 * radial(u) + radial(jump))
            braked = (1.0 - other) * brake(e, apart, zt, b[ZT], mean, real)
            power += (0.5 * vg) * braked * radial(jump)
            ts = plus_radial(scaled_apart(ts, mean * real, mean), braked)
        a = plus(a, times(vg, ts))
        of_gradient = times(weight * vg, e)
        l = plus(l, outer(us, of_gradient))
        if CONSISTENT or REVOLVED:
            moment = plus(moment, symmetric_outer(lever, of_gradient))
        if CONSISTENT:
            space = to_dimensions(1.0 + other * (b[H] / h - 1.0), dx) if UNLIKE else 1.0
            if REVOLVED and LEADS:
                space *= b[REST] * per_rest
            evening = counted(us_n, du_n, t_n, by_n, rows[i, RHO] + b[RHO], 1.0 if FOLLOWING else 0.5)
            number += weight * g * space * (us_n - (1.0 - other) * evening)
            receding += weight * g * space * du_n * (0.5 + other * (zb * by_n - 0.5))
            if FOLLOWING:
                q, away = r / h, weight * (du_n + other * (2.0 * us_n - du_n))
                number -= 0.5 * g * away
                own_number -= scale(1.0 / h) * slope(q) * away
                widening += weight * scale(1.0 / h) * (DIM * shape(q) + q * slope(q))
    conclude(rows, i, out, totals(a), totals(l), times(0.5, totals(moment)), total(power), largest(mu),
             (total(number), total(receding), total(own_number), total(widening)),
             (totals(made), times(0.5, totals(across_bodies))), total(slip), total(fullness))  # fmt: skip


def conclude(rows, i, out, force, gradient_u, moment, work, closing, numbers, turning, slip, full):
    """Write the rates of particle `i`, from what its pairs sum to: a part of `accumulate`."""
    h, volume, inverse_density = rows[i, H], rows[i, V], rows[i, V] / rows[i, M]
    if CONSISTENT:
        number, receding, own_number, widening = numbers
        rate = volume * number
        if FOLLOWING:
            widened = widening + scale(1.0 / h) * DIM * shape(0.0)
            rate = (rate + volume * own_number) / (1.0 - rows[i, GROWS] * volume * h / DIM * widened)
        calm = max(1.0 - closing * rows[i, RHO] / (FRONT * rows[i, ZN]), 0.0)
        leaves = calm * rows[i, LEAVES] if LEADS else 0.0
        if LEADS:
            out[i, R_LEAD] = rows[i, COUNTS] * receding - rate - calm * rows[i, FADES]
        gradient_u, rate = at_edges(gradient_u, rate, matrix(moment), calm, rows[i, BEAR])
        out[i, R_DENSITY] = divergence(gradient_u) - (rate + leaves)
    if REVOLVED:
        if not (CONSISTENT or ONLY_OTHER):
            gradient_u = product(gradient_u, sound_inverse(matrix(moment))[0])
        own, inverse_ring, radial_u = 0.0 if ONLY_OTHER else 1.0, 1.0 / rows[i, RING], rows[i, U + 1]
        taken = hoop_share(full) * inverse_ring
        hoop = (own - full) * radial(own_symmetric(rows, i, T, DIM)) - own * rows[i, HOOP]
        hoop = hoop * (inverse_ring if ONLY_OTHER else taken)
        force, work = plus_radial(force, hoop), work - hoop * radial_u
        out[i, R_HOOP] = radial_u * taken
    write_rates(out, i, times(inverse_density, force), inverse_density * work, closing, gradient_u)
    if SPINS:
        made, across_bodies = turning
        spin = times(-0.5, made)
        if not ONLY_OTHER:
            w = own_axial(rows, i, TWIST, DIM)
            given = on_rows(inertia(minus(moment, across_bodies)), w)
            spin = minus(spin, given) if correctable(matrix(moment)) else times(-2.0, w)
        put(out, i, R_SPIN, times(inverse_density, spin))
    if PARTED:
        out[i, R_SLIP] = inverse_density * slip
