"""Deformation gradient and stress of Total Lagrangian particles from reference neighbours.

    F_a = 1 + sum_b [(x_b - x_a) - (X_b - X_a)] (x) V0_b g_ab,   J = chi det F,   L = Fdot F^-1,   rho = rho0 / J
    P = J sigma F^-T,      Q = P A,  q = P B        (A, B: the corrections, see `sph.neighbours.reference_neighbours`)

Eulerian particles with Total Lagrangian neighbours have F, too, and contribute their sigma to P (Young 2021 eq. 13);
density and velocity gradient are those of their own law. Each particle writes its own row only.

chi is 1 until neighbours leave a list. The shorter list defines another F: chi is multiplied by the ratio of both
determinants, so that volume, density and pressure are continuous (P, power and strain follow F).

Axisymmetric particles (AXISYMMETRIC, `sph.terms.axisymmetric`) have F_tt = r/r0 in addition, and

    J = chi det F F_tt,   P_tt = J sigma_tt / F_tt,   a_r += [F0_rr P_rR - P_tt] / (rho0 r0),   de -= its power

where F0_rr is 1 - kappa of the reference kernel; volumes are section areas.

With REDUCES_SHEAR_VISCOSITY the factor of alpha is that of `sph.terms.viscosity`.
In strong compression waves cross a particle sooner: the signal speed is multiplied by C |F^-1| where that exceeds 1, C
being the Courant number and |F^-1|^2 = F^-1 : F^-1 - (d - 1), the inverse square of the smallest stretch if the others
are 1. With SECANT hourglass control has the secant modulus E/(1 + E eps_p/Y) (1 - D), Y the initial yield stress.
"""

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.compiler.tensors import (
    add,
    add_identity,
    adjugate,
    determinant,
    divergence,
    dot,
    dot_rows,
    double_dot,
    identity,
    matrix,
    multiply,
    no_vector,
    outer,
    product,
    put,
    row_columns,
    row_gradient,
    row_symmetric,
    row_vector,
    subtract,
    transpose,
)
from hvisph.compiler.tensors3d import full_gradient, growth_factor, replace_zz, symmetric_part
from hvisph.compiler.vector.api import LANES, fetch, gather, load_row_lanes, put_row_lanes
from hvisph.compiler.vector.rows import NONE, fetch_row, list_equal_keys
from hvisph.sph.terms.viscosity import shear_share

CHUNK = 256


@inline
def equivalent_strain(f, hoop):
    """Return sqrt(2/3 E':E') of the Green-Lagrange strain; `hoop` is the stretch out of the plane."""
    grad = full_gradient(multiply(0.5, subtract(product(transpose(f), f), identity(f))))
    e = symmetric_part(replace_zz(grad, grad[8] + 0.5 * (hoop * hoop - 1.0)))
    e = add_identity(e, (-1.0 / 3.0) * (e[0] + e[1] + e[2]))
    return np.sqrt((2.0 / 3.0) * double_dot(e, e))


@inline
def secant_modulus(modulus, inverse_yield, plastic_strain, damage):
    """Return the secant modulus [Pa], stress over strain, of Young's modulus E after plastic flow and damage."""
    return modulus / (1.0 + modulus * inverse_yield * plastic_strain) * (1.0 - min(damage, 1.0))


def move(i, rows, motions):
    """Write displacement from the reference and velocity of row `i` into `motions` (template).

    Both lie side by side for the passes over neighbours, and are exactly zero at rest.
    """
    put(motions, i, 0, subtract(row_vector(rows, i, 0, DIM), row_vector(rows, i, X0, DIM)))
    put(motions, i, DIM, row_vector(rows, i, U, DIM))


def collect(motions, i, lists, sums, k):
    """Write the neighbour sums of particle `i` that `load_deformation` reads into row `k` of `sums` (template).

    Displacement and velocity of a neighbour are lanes of one vector.
    """
    starts, indices, codes, kernels = lists
    motion = load_row_lanes(motions, np.uint64(i), MOTIONS)
    slope_sum, shape_sum = multiply(0.0, outer(no_vector(DIM), motion)), multiply(0.0, motion)
    for entry in range(np.uint64(starts[i]), np.uint64(starts[i + np.uint64(1)])):
        code = np.uint64(codes[entry])
        difference = subtract(load_row_lanes(motions, np.uint64(indices[entry]), MOTIONS), motion)
        slope_sum = add(slope_sum, outer(row_vector(kernels, code, 0, DIM), difference))
        shape_sum = add(shape_sum, multiply(kernels[code, DIM], difference))
    put_row_lanes(sums, np.uint64(k), slope_sum + shape_sum)


def load_deformation(sums, k, i, corrections):
    """Return the deformation gradient of particle `i`, and its rate, from row `k` of what `collect` wrote."""
    a_t, shift = transpose(row_gradient(corrections[0], i, 0, DIM)), row_vector(corrections[1], i, 0, DIM)
    f = product(row_columns(sums, k, 0, STRIDE, DIM), a_t)
    rate = product(row_columns(sums, k, DIM, STRIDE, DIM), a_t)
    f = add(f, outer(row_vector(sums, k, SHAPED, DIM), shift))
    return add(f, identity(f)), add(rate, outer(row_vector(sums, k, RATE_SHAPED, DIM), shift))


def show(rows, i, stress, f, j, inverse, corrections):
    """Write what neighbours read of the first Piola-Kirchhoff `stress`, F and J into row `i` (template)."""
    a, b = row_gradient(corrections[0], i, 0, DIM), row_vector(corrections[1], i, 0, DIM)
    put(rows, i, Q, product(stress, a))
    if MIXED:
        put(rows, i, QW, dot_rows(stress, b))
    if PRINTED:
        inverse_t = transpose(inverse)
        put(rows, i, N, product(inverse_t, a))
        put(rows, i, NW, dot_rows(inverse_t, b))
        rows[i, IJ] = 1.0 / j
    if HOURGLASS:
        put(rows, i, EF, multiply(rows[i, EM], f))


def deform_lanes(rows, particles, group, sums, corrections, materials, numbers, results, rates):
    """Deform LANES particles of one material, all Total Lagrangian or all Eulerian (template).

    `group`: their material, and whether they are Total Lagrangian
    `sums`: their neighbour sums by `collect`
    Others as of `deform`, restricted to these particles; `particles` without tags.
    """
    m, tied = group
    state, volume, loads, swellings, f_start = particles
    table, models, moduli = materials
    stage, signal_alpha, courant = numbers
    jacobians, strains, latest, pressures, signals = results
    i = np.uint64(0)  # arrays represent the rows of all lanes: the index has no effect
    f, rate = load_deformation(sums, i, i, corrections)
    det_f = determinant(f)
    section = swellings[i] * det_f
    stretch = rows[i, RING] / rows[i, RING0] if AXISYMMETRIC else 1.0
    j = section * stretch
    inverse = multiply(1.0 / det_f, adjugate(f))
    strain = equivalent_strain(f, stretch)
    jacobians[i], strains[i] = j, strain
    if RENEWS:
        latest[i] = strain
    if SECANT:
        rows[i, EM] = secant_modulus(moduli[m, 0], moduli[m, 1], state[i, S_PLASTIC_STRAIN], state[i, S_DAMAGE])
        if FRACTURES and state[i, S_ONSET_TENSION] > 0.0:  # pairs with a modulus would bridge a crack
            rows[i, EM] = 0.0
    if tied:
        if RENEWS:
            hoop_start = f_start[i, DIM * DIM] if AXISYMMETRIC else 1.0
            strains[i] = equivalent_strain(product(f, row_gradient(f_start, i, 0, DIM)), stretch * hoop_start)
        l = product(rate, inverse)
        put(rates, i, R_GRADIENT, l)
        grad, swelling = full_gradient(l), divergence(l)
        if AXISYMMETRIC:
            hoop = rows[i, U + 1] / rows[i, RING]
            rates[i, R_HOOP] = hoop
            grad, swelling = replace_zz(grad, hoop), swelling + hoop
        # mass over volume, both of the section if axisymmetric
        rho = rows[i, M] / (volume[i] * section)
        history = state[i, S_HISTORY_VARIABLE] if HAS_HISTORY else 1.0
        p, c = state_with_history(table, models, m, rho, rows[i, E], state[i, S_DAMAGE], history)
        if FRACTURES:
            p = softened_pressure(p, state[i, S_DAMAGE], state[i, S_ONSET_TENSION])
        shear = shear_modulus(table, models, m, rho, rows[i, E], p)
        factor = courant * np.sqrt(max(dot(inverse, inverse) - (DIM - 1.0), 0.0))
        signals[i] = (longitudinal_speed(c, rho, shear) + signal_alpha * c) * max(factor, 1.0)
        pressures[i] = p
        rows[i, RHO] = rho
        rows[i, C] = shear_share(grad) * c if REDUCES_SHEAR_VISCOSITY else c
        state[i, S_DENSITY] = rho * growth_factor(stage * swelling)
    pressure = pressures[i] + loads[i]
    sigma = add_identity(row_symmetric(rows, i, S, DIM), -pressure)
    stress = multiply(j, product(matrix(sigma), transpose(inverse)))
    show(rows, i, stress, f, j, inverse, corrections)
    if AXISYMMETRIC:
        if tied:
            hoop_stress = section * (-rows[i, S] - rows[i, S + 1] - pressure)
            share = corrections[2][i, DIM * DIM - 1]  # 1 - kappa
            hoop_force = (share * stress[DIM * DIM - 1] - hoop_stress) * volume[i] / (rows[i, M] * rows[i, RING])
            rates[i, R_ACCELERATION + 1] = hoop_force
            rates[i, R_POWER] = -hoop_force * rows[i, U + 1]
    else:
        rates[i, R_POWER] = dot(stress, rate) * volume[i] / rows[i, M]


def deform(
    chunk, count, rows, motions, active, eulerian, particles, lists, corrections, materials, numbers, results, rates
):
    """Compute the deformation of the `active` particles of a chunk (template).

    Bound names: DIM, MIXED, PRINTED, HOURGLASS, SECANT, RENEWS, AXISYMMETRIC, MOTIONS, slots of the row, columns of the
    rates (R_...), S_DENSITY, S_PLASTIC_STRAIN, S_DAMAGE, the templates above, and functions of `hvisph.materials`.

    `chunk`, `count`: see `compiler.parallel_for.chunk_loop`
    `rows`: packed rows (n + images + 1, width): positions and velocities of the stage; Q, and of Total Lagrangian
      particles density and sound speed, are written
    `motions`: what `move` made of them
    `active`: (n,) uint8: not 0 where F is needed, 2 where Total Lagrangian and Eulerian particles meet
    `eulerian`: (n,) uint8: 0 of Total Lagrangian particles
    `particles`: state, whose density is set to one from which continuity over a step ends on rho0/J; tags; reference
      volumes; pressures added to the particles' own [Pa] (n,); chi (n,); and, for references that are renewed, the
      deformation gradients of the reference itself (n, dim^2), and behind them, if axisymmetric, its hoop stretch
    `lists`: of the reference neighbours: starts, indices, codes, kernels
    `corrections`: theirs, a row a particle: A, B, F0
    `materials`: table, models, and a row of E [Pa] and 1/Y [1/Pa] for each material
    `numbers`: time of the stage after the state [s], 1.2 alpha of the viscosity, and the Courant number: a body at rest
      is stable up to nearly 1, so that its spacings may shrink to this share before they limit the step
    `results`: arrays (n,) that receive J, equivalent strain since the start and since the reference, and of Total
      Lagrangian particles pressure [Pa] and signal speed [m/s]
    `rates`: (n, width of rates): receives the velocity gradient of Total Lagrangian particles, and of those that meet
      no Eulerian ones the power of their own stress; if axisymmetric, the hoop force and its power
    """
    state, tags, volume, loads, swellings, f_start = particles
    a, b, start = corrections
    jacobians, strains, latest, pressures, signals = results
    first = chunk * np.uint64(CHUNK)
    end = min(first + np.uint64(CHUNK), count)
    keys, index = np.empty(CHUNK, np.uint64), np.empty(CHUNK + LANES, np.uint32)
    sums, lane_index = np.empty((LANES, SUMS)), np.empty(LANES, np.uint32)
    for i in range(first, end):
        number = np.uint64(2) * np.uint64(tags[i, 2]) + np.uint64(eulerian[i] == 0)
        keys[i - first] = number if active[i] != 0 else np.uint64(NONE)
    key = np.uint64(0)
    while key != np.uint64(NONE):
        n, next_key = list_equal_keys(keys, end - first, first, key, index)
        for k in range(np.uint64(0), n, np.uint64(LANES)):
            for lane in range(np.uint64(LANES)):
                lane_index[lane] = min(lane, n - k - np.uint64(1))
                if k + lane < n:
                    number = np.uint64(index[k + lane])
                    fetch_row(rows, number, 0, ROW)
                    fetch_row(rates, number, 0, rates.shape[1])
                    fetch_row(a, number, 0, DIM * DIM)
                    fetch_row(b, number, 0, DIM)
                    fetch(state, number, np.uint64(S_DENSITY))
                    collect(motions, number, lists, sums, lane)
            deform_lanes(
                gather(rows, index, k),
                (gather(state, index, k), gather(volume, index, k), gather(loads, index, k),
                 gather(swellings, index, k), gather(f_start, index, k)),
                (key >> np.uint64(1), (key & np.uint64(1)) == np.uint64(1)), gather(sums, lane_index, np.uint64(0)),
                (gather(a, index, k), gather(b, index, k), gather(start, index, k)), materials, numbers,
                (gather(jacobians, index, k), gather(strains, index, k), gather(latest, index, k),
                 gather(pressures, index, k), gather(signals, index, k)), gather(rates, index, k))  # fmt: skip
        key = next_key


def map_particles(k, indices, motions, lists, corrections, maps):
    """Write F of the particle chosen[k] by its present list into row `k` of `maps` (template)."""
    i, sums = np.uint64(indices[k]), np.empty((1, SUMS))
    collect(motions, i, lists, sums, np.uint64(0))
    put(maps, k, 0, load_deformation(sums, np.uint64(0), i, corrections)[0])
