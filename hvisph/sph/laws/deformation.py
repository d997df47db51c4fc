"""Deformation gradients and stress of Total Lagrangian particles, from their reference neighbours.

    F_a = F0_a + sum_b (x_b - x_a) (x) V0_b g_ab,   J = chi det F,   L = Fdot F^-1,   rho = rho0 / J
    P = J sigma F^-T,      Q = P A,  q = P B        (A, B: the corrections, see `sph.reference`)

Eulerian particles with Total Lagrangian neighbours have F, too, and carry their own sigma to P (Young 2021
eq. 13); density and velocity gradient are their own. Row i is written by i alone.

chi is 1 until neighbours leave a list. What is left is fitted by another linear map: chi takes the ratio of both
determinants, so that volume, density and pressure go on without a jump (P, power and strain follow F as it is).

Rings of solids of revolution (REVOLVED, `sph.laws.rings`) have F_tt = r/r0 beside F, and are held round the axis:

    J = chi det F F_tt,   P_tt = J sigma_tt / F_tt,   a_r += [F0_rr P_rR - P_tt] / (rho0 r0),   de -= the power of it

where F0_rr is 1 - kappa of the reference kernel; their volumes are areas of the section.

With SHEARS a particle takes of alpha only the share that `sph.viscosity` says.
What is squeezed to less than a third of its spacing is crossed sooner: the speed of signals takes 0.3 |F^-1| where that
is above 1, with |F^-1|^2 = F^-1 : F^-1 - (d - 1), the inverse square of the least stretch where the others are 1.
Hourglass control follows the secant modulus with SECANT: E/(1 + E eps_p/Y) (1 - D), Y the first yield stress.
"""

from __future__ import annotations

import numpy as np

from hvisph.core.blocks import lanes_at
from hvisph.core.growth import grown
from hvisph.core.jit import compiled, prange
from hvisph.core.lanes import LANES
from hvisph.core.simd import neighbours
from hvisph.core.tensors import (
    adjugate,
    determinant,
    divergence,
    dot,
    double_dot,
    full_gradient,
    identity,
    matrix,
    minus,
    no_gradient,
    no_vector,
    on_rows,
    outer,
    own_gradient,
    own_symmetric,
    own_vector,
    plus,
    plus_identity,
    product,
    put,
    spread,
    stretching,
    times,
    totals,
    transposed,
    vector,
    with_zz,
)
from hvisph.sph.viscosity import shear_share

CHUNK = 256
# A step of a body at rest has so much in reserve: spacings may shrink to it before they set the step.
RESERVE = 0.3


@compiled
def equivalent_strain(f, hoop):
    """Return the equivalent of the deviatoric Green-Lagrange strain, sqrt(2/3 E':E'), of a deformation gradient.

    `hoop` is the stretch out of the plane, 1 of all but rings.
    """
    full = full_gradient(times(0.5, minus(product(transposed(f), f), identity(f))))
    e = stretching(with_zz(full, full[8] + 0.5 * (hoop * hoop - 1.0)))
    e = plus_identity(e, (-1.0 / 3.0) * (e[0] + e[1] + e[2]))
    return np.sqrt((2.0 / 3.0) * double_dot(e, e))


@compiled
def secant_modulus(modulus, inverse_yield, plastic_strain, damage):
    """Return the stiffness [Pa] that is left of Young's modulus E after plastic flow: sigma over strain."""
    return modulus / (1.0 + modulus * inverse_yield * plastic_strain) * (1.0 - min(damage, 1.0))


def gradients(rows, i, lists, corrections):
    """Return the deformation gradient of particle `i` and its rate: a template."""
    starts, near, slopes, shapes = lists
    a, b, start = corrections
    x, u, x0 = own_vector(rows, i, 0, DIM), own_vector(rows, i, U, DIM), own_vector(rows, i, X0, DIM)
    m = n = spread(no_gradient(DIM))
    of_shape = rate_of_shape = spread(no_vector(DIM))
    for k in range(np.uint64(starts[i]), np.uint64(starts[i + np.uint64(1)]), np.uint64(LANES)):
        other = neighbours(rows, near, k, PLACES)
        dx, du = minus(vector(other, 0, DIM), x), minus(vector(other, U, DIM), u)
        g = times(lanes_at(slopes, k), minus(x0, vector(other, X0, DIM)))
        m, n = plus(m, outer(dx, g)), plus(n, outer(du, g))
        if MIXED:
            w = lanes_at(shapes, k)
            of_shape, rate_of_shape = plus(of_shape, times(w, dx)), plus(rate_of_shape, times(w, du))
    turned, shift = transposed(own_gradient(a, i, 0, DIM)), own_vector(b, i, 0, DIM)
    f = plus(own_gradient(start, i, 0, DIM), product(totals(m), turned))
    rate = product(totals(n), turned)
    return plus(f, outer(totals(of_shape), shift)), plus(rate, outer(totals(rate_of_shape), shift))


def show(rows, i, stress, f, j, inverse, corrections):
    """Write what neighbours read of the first Piola-Kirchhoff `stress`, F and J into row `i`: a template."""
    a, b = own_gradient(corrections[0], i, 0, DIM), own_vector(corrections[1], i, 0, DIM)
    put(rows, i, Q, product(stress, a))
    if MIXED:
        put(rows, i, QW, on_rows(stress, b))
    if PRINTED:
        turned = transposed(inverse)
        put(rows, i, N, product(turned, a))
        put(rows, i, NW, on_rows(turned, b))
        rows[i, IJ] = 1.0 / j
    if HOURGLASS:
        put(rows, i, EF, times(rows[i, EM], f))


def deform(rows, active, particles, lists, corrections, materials, stage, signal_alpha, results, rates):
    """Compute the deformation of all particles that are `active`: the template.

    Bound names: DIM, MIXED, PRINTED, HOURGLASS, SECANT, SHEARS, RENEWS, REVOLVED, PLACES, slots of the row, columns of
    the rates (R_...), S_DENSITY, S_PLASTIC_STRAIN, the templates above, and functions of `hvisph.materials`.

    Parameters
    ----------
    rows
        Packed rows (n + images + 1, width): positions and velocities of the stage; Q, and of Total
        Lagrangian particles density and sound speed, are written.
    active
        (n,) uint8: not 0 where F is needed, 2 where Total Lagrangian and Eulerian particles meet.
    particles
        State, whose density is set to one from which continuity over a step ends on rho0/J; tags; reference
        volumes; pressures added to the particles' own [Pa] (n,); chi (n,); and, for references that are renewed, the
        deformation gradients of the reference itself (n, dim^2), and behind them of rings its hoop stretch.
    lists
        Of the reference neighbours: starts, near, slopes, shapes.
    corrections
        Theirs, a row a particle: A, B, F0.
    materials
        Table, models, and a row of E [Pa] and 1/Y [1/Pa] for each material.
    stage
        How far the stage is ahead of the state [s].
    signal_alpha
        1.2 alpha of the viscosity.
    results
        Arrays (n,) that receive J, equivalent strain since the start and since the reference, and of Total
        Lagrangian particles pressure [Pa] and signal speed [m/s].
    rates
        (n, width of rates): receives the velocity gradient of Total Lagrangian particles, and of those that
        meet no Eulerian ones the power of their own stress; of rings what holds them round the axis, and its power.
    """
    count = np.uint64(active.shape[0])
    state, tags, volume, loads, swellings, before = particles
    table, models, moduli = materials
    jacobians, strains, latest, pressures, signals = results
    for chunk in prange((count + np.uint64(CHUNK - 1)) // np.uint64(CHUNK)):
        first = np.uint64(chunk) * np.uint64(CHUNK)
        for i in range(first, min(first + np.uint64(CHUNK), count)):
            if active[i] == 0:
                continue
            f, rate = gradients(rows, i, lists, corrections)
            of_list = determinant(f)
            section = swellings[i] * of_list
            stretch = rows[i, RING] / rows[i, RING0] if REVOLVED else 1.0
            j = section * stretch
            inverse = times(1.0 / of_list, adjugate(f))
            jacobians[i], strains[i] = j, equivalent_strain(f, stretch)
            if RENEWS:
                latest[i] = strains[i]
            if SECANT:
                own = moduli[tags[i, 2]]
                rows[i, EM] = secant_modulus(own[0], own[1], state[i, S_PLASTIC_STRAIN], rows[i, DAMAGE])
            if rows[i, KIND] == 1.0:
                if RENEWS:
                    before_it = before[i, DIM * DIM] if REVOLVED else 1.0
                    strains[i] = equivalent_strain(product(f, own_gradient(before, i, 0, DIM)), stretch * before_it)
                l = product(rate, inverse)
                put(rates, i, R_GRADIENT, l)
                full, swelling = full_gradient(l), divergence(l)
                if REVOLVED:
                    hoop = rows[i, U + 1] / rows[i, RING]
                    rates[i, R_HOOP] = hoop
                    full, swelling = with_zz(full, hoop), swelling + hoop
                # mass over volume; of rings both are those of the section
                m, rho = np.uint64(tags[i, 2]), rows[i, M] / (volume[i] * section)
                first = state[i, S_MEMORY] if REMEMBERS else 1.0
                p, c = remembered_state(table, models, m, rho, rows[i, E], rows[i, DAMAGE], first)
                shear = shear_modulus(table, models, m, rho, rows[i, E], p)
                shrunk = RESERVE * np.sqrt(max(dot(inverse, inverse) - (DIM - 1.0), 0.0))
                signals[i] = (longitudinal_speed(c, rho, shear) + signal_alpha * c) * max(shrunk, 1.0)
                pressures[i] = p
                rows[i, RHO], rows[i, C] = rho, shear_share(full) * c if SHEARS else c
                state[i, S_DENSITY] = rho * grown(stage * swelling)
            sigma = plus_identity(own_symmetric(rows, i, S, DIM), -(pressures[i] + loads[i]))
            stress = times(j, product(matrix(sigma), transposed(inverse)))
            show(rows, i, stress, f, j, inverse, corrections)
            if REVOLVED:
                if rows[i, KIND] == 1.0:
                    around = section * (-rows[i, S] - rows[i, S + 1] - (pressures[i] + loads[i]))
                    left = corrections[2][i, DIM * DIM - 1]  # 1 - kappa
                    held = (left * stress[DIM * DIM - 1] - around) * volume[i] / (rows[i, M] * rows[i, RING])
                    rates[i, R_ACCELERATION + 1] = held
                    rates[i, R_POWER] = -held * rows[i, U + 1]
            else:
                rates[i, R_POWER] = dot(stress, rate) * volume[i] / rows[i, M]


def map_particles(chosen, rows, lists, corrections, maps):
    """Compute F of the particles `chosen` as their lists are now into the rows of `maps`: a template."""
    count = np.uint64(chosen.shape[0])
    for chunk in prange((count + np.uint64(CHUNK - 1)) // np.uint64(CHUNK)):
        first = np.uint64(chunk) * np.uint64(CHUNK)
        for k in range(first, min(first + np.uint64(CHUNK), count)):
            f, _ = gradients(rows, np.uint64(chosen[k]), lists, corrections)
            put(maps, k, 0, f)


PARTS = (gradients, show)
