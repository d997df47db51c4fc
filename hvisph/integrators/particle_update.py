"""Particle update: complete a step, predict the next stage, update the stress, pack the row.

Each particle is visited once between two evaluations of the pair forces. The rates of the last evaluation advance its
state to the end of the step. Then the stage of the next evaluation is predicted, `materials.stress_update` computes the
stress there, and the data for the neighbours are packed into the particle's row. See `integrators.scheme` for the
scheme and its energy.

Particles of a chunk that have one material, and are all clamped or all free, are advanced LANES at a time. The source
is that of a single particle: arrays represent rows, numbers represent lanes (`compiler.vector.memory_access`,
`compiler.if_conversion`). Each lane has the bits of a single particle; the grouping does not matter.
"""

from math import pi

import numpy as np

from hvisph.compiler.exact_sum import add_lane_vectors, add_lanes, add_term, sum_lanes
from hvisph.compiler.tensors import (
    add,
    divergence,
    dot,
    multiply,
    no_axial,
    no_symmetric,
    no_vector,
    put,
    row_axial,
    row_gradient,
    row_vector,
)
from hvisph.compiler.tensors3d import extend_vector
from hvisph.compiler.vector.api import LANES, broadcast_strict, extract_lane, first_lanes, gather
from hvisph.compiler.vector.rows import NONE, fetch_row, list_equal_keys
from hvisph.sph.terms.viscosity import shear_share

from .particle_steps import MORRIS_MONAGHAN, Limits, Packed, State, hoop_signal, ring_radius
from .prescribed_motion import GROUP_SHIFT, LAYER_GROUP, RIGID_GROUP
from .sums import COUNTED, HEATING, INTERNAL, KINETIC, LENGTH, MOMENTUM, PLASTIC, SIZE, SLIPPING, SPEED2, SUPPORT
from .time_step import VISCOUS_SIGNAL

CHUNK = 256
# Axisymmetric particles in shear flow have at least the share 1 - AT_AXIS r/h of the viscosity.
AT_AXIS = 0.5


def advance_lanes(particles, mask, group, materials, coefficients, gravity, times_ahead, h_limits, rows, limits,
                  totals, maxima, rounders):  # fmt: skip
    """Advance LANES particles of one material, all clamped or all free.

    `mask` are the valid lanes; others repeat the last of these. `group` are material and clamp. `totals` (2, COUNTED,
    LANES) receives the integer sums, `maxima` the largest speed squared and smoothing length and the sum of energy
    magnitudes; returns `maxima`. Other arguments as of `update`.
    """
    state, tags, rates = particles
    m, clamp = group
    table, models = materials
    dt, stage, complete = times_ahead
    h_low, h_high = h_limits[m, 0], h_limits[m, 1]
    lengths, signals, pressures = limits
    of_energy, of_momentum, of_force, of_power = rounders
    s = np.uint64(0)  # arrays represent the rows of all lanes: the index has no effect
    plastic_work = dissipated = 0.0
    mass, y, rate = state[s, S_MASS], load_state(state, s), load_rates(rates, s)
    acting, free = rate, 0.0 if clamp else 1.0
    if clamp:
        a_clamp = rate.a
        if PREVIOUS:
            a_clamp = multiply(0.5, add(a_clamp, row_vector(state, s, S_PREVIOUS_ACCELERATION, DIM)))
        add_lane_vectors(totals, SUPPORT, mask, extend_vector(multiply(mass, a_clamp)), of_force)
    a = no_vector(DIM) if clamp else rate.a
    pull = no_vector(DIM)
    if GRAVITY:  # at the positions of the evaluation; retired particles have no mass
        pull = multiply(free if mass > 0.0 else 0.0, gravity_at(row_vector(rows, s, 0, DIM), gravity))
        a = add(a, pull)
    thickness = state[s, S_THICKNESS] if PLANE_STRESS else 1.0
    ring = ring_radius(y.x, y.h) if AXISYMMETRIC else 0.0
    rho_min = isolated_density(mass, ring, y.h, thickness) if ISOLATED_DENSITY else 0.0
    if complete:
        u, y_start = row_vector(rows, s, U, DIM), y
        y, l, swelling, hoop = move(state, s, y, acting, free, pull, u, dt)
        y, p, c, l, growth = strain(y, dt, l, swelling, hoop, rho_min, table, models, m, h_low, h_high)
        store(state, s, y)
        plastic_work, dissipated = dissipation(y_start, y, l, pressures[s], dt)
        plastic_work, dissipated = mass * plastic_work, mass * dissipated
        if PLANE_STRESS:
            state[s, S_THICKNESS] *= growth
        if SWITCH == MORRIS_MONAGHAN:
            state[s, S_VISCOSITY_FACTOR] = viscous_share(state[s, S_VISCOSITY_FACTOR], l, c, y.h, dt, coefficients)
        if PREVIOUS:
            store_previous(state, s, u, acting)
        if DENSITY_CORRECTION:
            bound = 2.0 * max(y.rho - rho_min, 0.0) / (y.rho + rho_min)  # 0 for an isolated particle
            correction = state[s, S_DENSITY_CORRECTION] + dt * rates[s, R_CORRECTION]
            state[s, S_DENSITY_CORRECTION] = min(max(correction, -bound), bound)
        if ANGULAR_MOMENTUM:
            residual = multiply(dt, row_axial(rates, s, R_SPIN, DIM))
            put(state, s, S_TORQUE_RESIDUAL, add(row_axial(state, s, S_TORQUE_RESIDUAL, DIM), residual))
    speed2 = dot(y.u, y.u)
    kinetic, internal = 0.5 * mass * speed2, mass * y.e
    add_lanes(totals, KINETIC, mask, kinetic, of_energy)
    add_lanes(totals, INTERNAL, mask, internal, of_energy)
    add_lane_vectors(totals, MOMENTUM, mask, extend_vector(multiply(mass, y.u)), of_momentum)
    add_lanes(totals, PLASTIC, mask, plastic_work, of_energy)
    add_lanes(totals, HEATING, mask, dissipated, of_energy)
    if SLIPS:
        add_lanes(totals, SLIPPING, mask, mass * rates[s, R_SLIP], of_power)
    # The stage: where the rates are evaluated next.
    x = add(y.x, multiply(stage, add(y.u, multiply(DRIFT * stage, a))))
    y_stage = State(x, add(y.u, multiply(stage, a)), y.rho, y.e + stage * rate.power, y.h, y.s,
                  y.plastic_strain, y.damage, y.history, y.axes)  # fmt: skip
    swelling = divergence(rate.l) - rate.density
    y_stage, p, c, l, growth = strain(
        y_stage, stage, rate.l, swelling, rate.hoop, rho_min, table, models, m, h_low, h_high)  # fmt: skip
    pressures[s], lengths[s] = p, y_stage.h
    shear = shear_modulus(table, models, m, y_stage.rho, y_stage.e, p)
    c_l, c_t = longitudinal_speed(c, y_stage.rho, shear), shear_speed(y_stage.rho, shear)
    waves = no_symmetric(3)
    if ANISOTROPIC:
        c_t = shear_speed(y_stage.rho, transverse_modulus(table, models, m, shear))
        waves = squared_speeds(table, models, m, y_stage.rho, c, shear, y_stage.axes)
    # In plane stress a membrane: its forces and its density are those of its thickness.
    thickness = state[s, S_THICKNESS] * growth if PLANE_STRESS else 1.0
    # Axisymmetric particles have the mass of their section.
    ring = ring_radius(y_stage.x, y_stage.h) if AXISYMMETRIC else 0.0
    m_plane = mass / (2.0 * pi * ring) if AXISYMMETRIC else mass
    per_step = AHEAD / stage if stage > 0.0 else 0.0
    spin = multiply(per_step, row_axial(state, s, S_TORQUE_RESIDUAL, DIM)) if ANGULAR_MOMENTUM else no_axial(DIM)
    density_correction = state[s, S_DENSITY_CORRECTION] + stage * rates[s, R_CORRECTION] if DENSITY_CORRECTION else 0.0
    signal = pack(rows, s, coefficients, Packed(
        y_stage.x, y_stage.u, m_plane, y_stage.rho * thickness, y_stage.e, y_stage.h, p * thickness, c, c_l, c_t,
        multiply(thickness, y_stage.s), tags[s, 1], ring, spin, density_correction, waves,
        row_gradient(rates, s, R_GRADIENT_BEFORE, DIM) if ADJOINT else no_vector(DIM),
        -2.0 * stage if y_stage.plastic_strain > y.plastic_strain else 2.0 * stage))  # fmt: skip
    if REDUCES_SHEAR_VISCOSITY:  # alpha goes with this speed of sound
        factor = shear_share(l)
        if AXISYMMETRIC:  # nothing else holds the rows at the axis
            factor = max(factor, 1.0 - AT_AXIS * ring / y_stage.h)
        rows[s, C] *= factor
    if LIMITED:
        acting = acting_damage(table, m, y_stage.damage, y_stage.history)
        tension = bearable_tension(table, models, m, y_stage.s, y_stage.damage)
        tau_max = bearable_shear(table, models, m, y_stage.rho, y_stage.e, p, y_stage.s, y_stage.plastic_strain,
                                 y_stage.plastic_strain > y.plastic_strain, acting, l)  # fmt: skip
        tension, tau_max, soft = softened_limits(table, m, tension, tau_max, y_stage.s, y_stage.damage, y_stage.history)
        signal = show_limits(rows, s, coefficients, signal, y_stage.rho, c, Limits(
            thickness * tension, thickness * tau_max,
            has_failed(table, models, m, y_stage.damage), orderly(models, m, y_stage.plastic_strain),
            1.0 if h_low < y_stage.h < h_high else 0.0, density_at_rest(table, m), soft))  # fmt: skip
    if SWITCH:
        share = state[s, S_VISCOSITY_FACTOR] if SWITCH == MORRIS_MONAGHAN else 1.0
        share = viscous_share(share, l, c, y_stage.h, stage, coefficients)
        rows[s, SHARE] = share
        # a small share does not lengthen the step: a shock may raise it in the next one
        signal += VISCOUS_SIGNAL * coefficients[0] * max(share - 1.0, 0.0) * c
    signals[s] = max(signal, c_l * hoop_signal(y_stage.h, ring)) if AXISYMMETRIC else signal
    u2_max, h_max, size = maxima
    return max(u2_max, speed2), max(h_max, y_stage.h), size + (kinetic + abs(internal) if mask else 0.0)


def update(chunk, count, state, tags, place, rates, materials, coefficients, gravity, times_ahead, h_limits, rows,
           limits, sums, rounders):  # fmt: skip
    """Complete a step and pack the stage of the next one for a chunk of particles (template).

    Bound names: DIM, PREVIOUS (1 for schemes that use the rates of the step before), VARIABLE_H,
    SPARSEST (least rho h^dim/m, 0 for none), DENSITY_RATE (1 where the rates hold one of ln(rho)),
    DRIFT (share of the acceleration in the stage's position), PLANE_STRESS, AXISYMMETRIC, SWITCH (share of the
    viscosity), SHEARS (1 where shear takes a share of it), DENSITY_CORRECTION (1 where density returns to the number
    density), ANGULAR_MOMENTUM (1 where pairs return the angular momentum that they made), AHEAD (share of the step that
    the stage is ahead), GRAVITY (kind of the field), HAS_HISTORY (1 where particles have history variables), NO_HISTORY
    (else), FRACTURES (1 where those contain a crack),
    ADJOINT (1 where the row has the velocity gradient of the evaluation before),
    ANISOTROPIC (1 where a material has directions), NO_AXES (else), columns of the state (S_...) and of the
    rates (R_...), slots of the row (U, C, SHARE), `advance_lanes` and the templates of `parts`, and functions of
    `hvisph.materials` and `pack`.

    `chunk`, `count`: see `compiler.parallel_for.chunk_loop`
    `state`, `tags`: the particles
    `place`, `rates`: row of each particle's rates, and the rates
    `materials`: table and models of the packed materials
    `coefficients`: numbers that `pack` and the switches read
    `gravity`: numbers of the field of gravity, see `integrators.gravity`; GRAVITY is its kind
    `times_ahead`: length of the step [s], how far the next stage is ahead of its end [s], whether to complete the step
    `h_limits`: least and largest smoothing length of each material [m], (materials, 2)
    `rows`: the packed rows of the evaluation, which those of the next stage replace
    `limits`: three arrays (n,) that receive smoothing length, speed of signals and pressure at the stage
    `sums`, `rounders`: `Sums.loops`: arrays that receive sums over the completed state, and what rounds these
    """
    lengths, signals, pressures = limits
    integers, extremes = sums
    first = chunk * np.uint64(CHUNK)
    end = min(first + np.uint64(CHUNK), count)
    keys, index = np.empty(CHUNK, np.uint64), np.empty(CHUNK + LANES, np.uint32)
    places = np.empty(CHUNK + LANES, np.uint32)
    totals = np.zeros((2, COUNTED, LANES), np.int64)
    maxima = (broadcast_strict(0.0), broadcast_strict(0.0), broadcast_strict(0.0))
    for s in range(first, end):  # material, and whether it is held
        keys[s - first] = np.uint64(2) * np.uint64(tags[s, 2]) + np.uint64(tags[s, 3] & np.uint32(1))
        if times_ahead[2] and RIGID_GROUP <= tags[s, 3] >> np.uint32(GROUP_SHIFT) < LAYER_GROUP:
            keys[s - first] = np.uint64(NONE)  # state and row stay as they are: others write its motion
    key = np.uint64(0)
    while key != np.uint64(NONE):
        n, next_key = list_equal_keys(keys, end - first, first, key, index)
        for k in range(n + np.uint64(LANES)):
            if n > np.uint64(0):
                places[k] = place[np.uint64(index[k])]
        for k in range(np.uint64(0), n, np.uint64(LANES)):
            for entry in range(k + np.uint64(LANES), min(k + np.uint64(2 * LANES), n)):
                s = np.uint64(index[entry])
                fetch_row(state, s, 0, state.shape[1])
                fetch_row(rows, s, 0, rows.shape[1])
                fetch_row(rates, np.uint64(places[entry]), 0, rates.shape[1])
            maxima = advance_lanes(
                (gather(state, index, k), gather(tags, index, k), gather(rates, places, k)),
                first_lanes(n - k), (key >> np.uint64(1), (key & np.uint64(1)) == np.uint64(1)),
                materials, coefficients, gravity, times_ahead, h_limits, gather(rows, index, k),
                (gather(lengths, index, k), gather(signals, index, k), gather(pressures, index, k)), totals, maxima,
                rounders)  # fmt: skip
        key = next_key
    sum_lanes(integers, chunk, totals)
    u2_max = h_max = size = 0.0
    for k in range(np.uint64(LANES)):
        u2_max, h_max = max(u2_max, extract_lane(maxima[0], k)), max(h_max, extract_lane(maxima[1], k))
        size += extract_lane(maxima[2], k)
    for s in range(first, end):
        if keys[s - first] == np.uint64(NONE):
            energy = state[s, S_MASS] * state[s, S_INTERNAL_ENERGY]
            add_term(integers, chunk, INTERNAL, energy, rounders[0])
            h_max, size = max(h_max, lengths[s]), size + abs(energy)
    extremes[chunk, SPEED2], extremes[chunk, LENGTH], extremes[chunk, SIZE] = u2_max, h_max, size
