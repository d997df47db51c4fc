"""The pass over single particles: complete a step, predict the next stage, update the stress, pack.

Between two evaluations of the pair forces every particle is visited once. With the rates of the
last evaluation its state is carried to the end of the step; then the stage of the
next evaluation is predicted, `materials.response` gives the stress there, and what the neighbours
need is packed into the particle's row. See `integrators.scheme` for the scheme and its energy.

Particles of a chunk that share a material, and are all held or all free, are carried LANES at once. The text is that of
a single one: arrays stand for many of their rows, numbers are lanes (`core.many`, `core.branches`), each of which
rounds as a single number does. So the bits do not depend on which particles are carried together.
"""

from __future__ import annotations

from math import pi, sqrt

import numpy as np

from hvisph.core.exact import add_lanes, add_lanes_of, sum_lanes
from hvisph.core.growth import grown
from hvisph.core.jit import compiled, prange
from hvisph.core.lanes import LANES, all_strict
from hvisph.core.many import many
from hvisph.core.masks import first_lanes, lane
from hvisph.core.tensors import (
    divergence,
    dot,
    double_dot,
    full_gradient,
    in_space,
    minus,
    no_vector,
    own_full_symmetric,
    own_gradient,
    own_vector,
    plus,
    put,
    put_full_symmetric,
    radial,
    stretching,
    times,
    with_zz,
)
from hvisph.sph.viscosity import balsara_share, relaxed_share, shear_share

from .particle import Limits, Rates, Shown, State
from .sums import COUNTED, HEATING, INTERNAL, KINETIC, LENGTH, MOMENTUM, PLASTIC, SIZE, SLIPPING, SPEED2, SUPPORT

CHUNK = 256
# More than any key of `listed`.
NONE = 2**62
# The smallest radius of a ring, over h: below it a ring is taken for one of this radius.
ON_AXIS = 0.07
# Rings in shear flow have all of the viscosity at the axis, none beyond the reduced share from h over this on.
AT_AXIS = 0.5
# Which share of the viscosity a particle takes: all of it, or by a published switch.
WHOLE, BALSARA, MORRIS_MONAGHAN = 0, 1, 2
SWITCHES = {"none": WHOLE, "balsara": BALSARA, "morris_monaghan": MORRIS_MONAGHAN}


def loaded(state, i):
    """Return particle `i` of the state."""
    return State(own_vector(state, i, S_POSITION, DIM), own_vector(state, i, S_VELOCITY, DIM), state[i, S_DENSITY],
                 state[i, S_INTERNAL_ENERGY], state[i, S_SMOOTHING_LENGTH],
                 own_full_symmetric(state, i, S_DEVIATOR, DIM), state[i, S_PLASTIC_STRAIN], state[i, S_DAMAGE],
                 (state[i, S_MEMORY], state[i, S_FLAW_STRAIN], state[i, S_FLAW_EXPONENT], state[i, S_FLAWS],
                  state[i, S_STRAIN_RATE])
                 if REMEMBERS else NOTHING)  # fmt: skip


def store(state, i, now):
    """Write particle `i` into the state."""
    put(state, i, S_POSITION, now.x)
    put(state, i, S_VELOCITY, now.u)
    state[i, S_DENSITY] = now.rho
    state[i, S_INTERNAL_ENERGY] = now.e
    state[i, S_SMOOTHING_LENGTH] = now.h
    put_full_symmetric(state, i, S_DEVIATOR, now.s, DIM)
    state[i, S_PLASTIC_STRAIN] = now.plastic_strain
    state[i, S_DAMAGE] = now.damage
    if REMEMBERS:
        state[i, S_MEMORY], state[i, S_FLAW_STRAIN] = now.memory[0], now.memory[1]
        state[i, S_STRAIN_RATE] = now.memory[4]


def measured(rates, k):
    """Return row `k` of the rates."""
    return Rates(own_vector(rates, k, R_ACCELERATION, DIM), rates[k, R_POWER], own_gradient(rates, k, R_GRADIENT, DIM),
                 rates[k, R_DENSITY] if DENSITY_RATE else 0.0, rates[k, R_HOOP] if REVOLVED else 0.0)  # fmt: skip


def remember(state, i, u, rate):
    """Keep the rates of an evaluation, and the velocity `u` that it was made with, for the step after."""
    put(state, i, S_PREVIOUS_VELOCITY, u)
    put(state, i, S_PREVIOUS_ACCELERATION, rate.a)
    state[i, S_PREVIOUS_POWER] = rate.power
    put(state, i, S_PREVIOUS_GRADIENT, rate.l)
    if DENSITY_RATE:
        state[i, S_PREVIOUS_DENSITY_RATE] = rate.density
    if REVOLVED:
        state[i, S_PREVIOUS_HOOP_RATE] = rate.hoop


def moved(state, i, now, rate, free, u, dt):
    """Carry position, velocity and energy over a step: return them in a state, and gradient, swelling, hoop's rate.

    `u` is the velocity of the evaluation, with which power and gradient were found. The step's rates are those of
    the evaluation or, with PREVIOUS, the means of them and of the one before. `free` is 0 of a particle that is held.
    """
    a, power, l, density, hoop = rate.a, rate.power, rate.l, rate.density, rate.hoop
    if PREVIOUS:
        before = own_vector(state, i, S_PREVIOUS_ACCELERATION, DIM)
        a = times(0.5, plus(a, before))
        power = 0.5 * (power + state[i, S_PREVIOUS_POWER])
        l = times(0.5, plus(l, own_gradient(state, i, S_PREVIOUS_GRADIENT, DIM)))
        if DENSITY_RATE:
            density = 0.5 * (density + state[i, S_PREVIOUS_DENSITY_RATE])
        if REVOLVED:
            hoop = 0.5 * (hoop + state[i, S_PREVIOUS_HOOP_RATE])
    a = times(free, a)
    # Mean velocity of the step; the work of the forces at it is what the energy receives.
    mean = plus(now.u, times(0.5 * dt, a))
    missing = dot(rate.a, minus(mean, u))
    if PREVIOUS:
        missing = 0.5 * (missing + dot(before, minus(mean, own_vector(state, i, S_PREVIOUS_VELOCITY, DIM))))
    after = State(plus(now.x, times(dt, mean)), plus(now.u, times(dt, a)), now.rho,
                  now.e + dt * (power - missing), now.h, now.s, now.plastic_strain, now.damage,
                  now.memory)  # fmt: skip
    return after, l, divergence(l) - density, hoop


def sparsest(mass, ring, h, thickness):
    """Return the least density [kg/m^3] that particles of `mass`, rings of a radius, can have: of one alone, m W(0)."""
    least = SPARSEST * mass / thickness
    for _ in range(DIM):
        least /= h
    return least / (2.0 * pi * ring) if REVOLVED else least


def strained(now, dt, l, swelling, hoop, least, table, models, m, h_low, h_high):
    """Strain a particle over `dt` at the velocity gradient `l` in the plane and its rate of volume `swelling` there.

    A ring's circumference grows at the rate `hoop`; its smoothing length follows its area. Density stays above `least`.
    Returns the state, pressure, bulk sound speed, full velocity gradient, and growth of the thickness.
    """
    full, thicker, rho = full_gradient(l), 1.0, now.rho
    if PLANE_STRESS:
        zz = thinning(table, models, m, dt, rho, swelling, now.e, now.s, now.plastic_strain, now.damage, full)
        full, thicker = with_zz(full, zz), grown(dt * zz)
        rho *= grown(-dt * (swelling + zz))
    elif REVOLVED:
        full = with_zz(full, hoop)
        rho *= grown(-dt * (swelling + hoop))
    else:
        rho *= grown(-dt * swelling)
    if SPARSEST:
        rho = max(rho, least)
    h = min(max(now.h * grown(dt * swelling / DIM), h_low), h_high) if VARIABLE_H else now.h
    s, plastic_strain, damage, p, c, memory = recall(
        table, models, m, dt, rho, now.e, now.s, now.plastic_strain, now.damage, now.memory, full)  # fmt: skip
    kept = memory if REMEMBERS else NOTHING
    return State(now.x, now.u, rho, now.e, h, s, plastic_strain, damage, kept), p, c, full, thicker


def works(before, now, l, p, dt):
    """Return what a step did to a particle, per mass [J/kg]: plastic work, and what was dissipated beside it.

    The energy that its own pressure `p` and deviator did not do, at its strain, came from viscosity, from the fluxes
    of Riemann problems or from friction. `l` is the full velocity gradient, `p` the pressure of the evaluation.
    """
    volume = 2.0 / (before.rho + now.rho)
    strain = now.plastic_strain - before.plastic_strain
    plastic = volume * strain * sqrt(1.5 * double_dot(now.s, now.s)) if strain > 0.0 else 0.0
    pressed = p * (1.0 / before.rho - 1.0 / now.rho)
    sheared = volume * dt * double_dot(times(0.5, plus(before.s, now.s)), stretching(l))
    return plastic, now.e - before.e - pressed - sheared


@compiled
def ring_radius(x, h):
    """Return the radius of the ring at `x` [m], at the axis that of a tenth of a spacing or so."""
    return max(abs(radial(x)), ON_AXIS * h)


def viscous_share(share, l, c, h, dt, coefficients):
    """Return the share of the viscosity that a particle takes, from its full velocity gradient."""
    if SWITCH == MORRIS_MONAGHAN:
        return relaxed_share(share, divergence(l), c, h, dt, coefficients[5], coefficients[6])
    return balsara_share(l, c, h)


@compiled
def listed(tags, first, end, key, found):
    """List the particles from `first` to `end` whose material and flag of being held make up `key`.

    Returns how many, and the least key above, or NONE. Behind them the list repeats its last for LANES.
    """
    n, above = np.uint64(0), np.uint64(NONE)
    for s in range(first, end):
        own = np.uint64(2) * np.uint64(tags[s, 2]) + np.uint64(tags[s, 3] & np.uint32(1))
        if own == key:
            found[n] = s
            n += np.uint64(1)
        elif own > key:
            above = min(above, own)
    for k in range(np.uint64(LANES)):
        if n > np.uint64(0):
            found[n + k] = found[n - np.uint64(1)]
    return n, above


def carried(particles, here, alike, materials, coefficients, times_ahead, h_limits, rows, limits, counted, most,
            rounders):  # fmt: skip
    """Carry LANES particles on, of one material and all held or all free.

    Parameters
    ----------
    particles
        Their rows of the state, of tags, of rates and of the evaluation's packed rows.
    here
        The lanes that count: others repeat the last of these.
    alike
        Their material and whether they are held.
    materials, coefficients, times_ahead, h_limits, rows, limits
        See `update`; rows and limits of these particles.
    counted
        Whole numbers of each lane and finer ones (2, COUNTED, LANES), which their sums are added to.
    most
        Largest speed squared, largest smoothing length and sum of the sizes of energies so far, a lane each.
    rounders
        What rounds energies, momenta, forces and powers.

    Returns
    -------
    tuple
        `most` with these particles.
    """
    state, tags, rates, sorted_rows = particles
    m, held = alike
    table, models = materials
    dt, stage, complete = times_ahead
    h_low, h_high = h_limits
    lengths, signals, pressures = limits
    of_energy, of_momentum, of_force, of_power = rounders
    s = np.uint64(0)  # arrays stand for all of the particles: any row will do
    flowed = dissipated = 0.0
    mass, now, rate = state[s, S_MASS], loaded(state, s), measured(rates, s)
    acting, free = rate, 0.0 if held else 1.0
    if held:
        resting = rate.a
        if PREVIOUS:
            resting = times(0.5, plus(resting, own_vector(state, s, S_PREVIOUS_ACCELERATION, DIM)))
        add_lanes_of(counted, SUPPORT, here, in_space(times(mass, resting)), of_force)
    a = no_vector(DIM) if held else rate.a
    thickness = state[s, S_THICKNESS] if PLANE_STRESS else 1.0
    ring = ring_radius(now.x, now.h) if REVOLVED else 0.0
    least = sparsest(mass, ring, now.h, thickness) if SPARSEST else 0.0
    if complete:
        u, before = own_vector(sorted_rows, s, U, DIM), now
        now, l, swelling, hoop = moved(state, s, now, acting, free, u, dt)
        now, p, c, l, thicker = strained(now, dt, l, swelling, hoop, least, table, models, m, h_low, h_high)
        store(state, s, now)
        flowed, dissipated = works(before, now, l, pressures[s], dt)
        flowed, dissipated = mass * flowed, mass * dissipated
        if PLANE_STRESS:
            state[s, S_THICKNESS] *= thicker
        if SWITCH == MORRIS_MONAGHAN:
            state[s, S_VISCOSITY_SHARE] = viscous_share(state[s, S_VISCOSITY_SHARE], l, c, now.h, dt, coefficients)
        if PREVIOUS:
            remember(state, s, u, acting)
    speed2 = dot(now.u, now.u)
    kinetic, internal = 0.5 * mass * speed2, mass * now.e
    add_lanes(counted, KINETIC, here, kinetic, of_energy)
    add_lanes(counted, INTERNAL, here, internal, of_energy)
    add_lanes_of(counted, MOMENTUM, here, in_space(times(mass, now.u)), of_momentum)
    add_lanes(counted, PLASTIC, here, flowed, of_energy)
    add_lanes(counted, HEATING, here, dissipated, of_energy)
    if SLIPS:
        add_lanes(counted, SLIPPING, here, mass * rates[s, R_SLIP], of_power)
    # The stage: where the rates are evaluated next.
    x = plus(now.x, times(stage, plus(now.u, times(DRIFT * stage, a))))
    ahead = State(x, plus(now.u, times(stage, a)), now.rho, now.e + stage * rate.power, now.h, now.s,
                  now.plastic_strain, now.damage, now.memory)  # fmt: skip
    swelling = divergence(rate.l) - rate.density
    ahead, p, c, l, thicker = strained(
        ahead, stage, rate.l, swelling, rate.hoop, least, table, models, m, h_low, h_high)  # fmt: skip
    pressures[s], lengths[s] = p, ahead.h
    shear = shear_modulus(table, models, m, ahead.rho, ahead.e, p)
    c_l, c_t = longitudinal_speed(c, ahead.rho, shear), shear_speed(ahead.rho, shear)
    # In plane stress a membrane: its forces and its density are those of its thickness.
    thickness = state[s, S_THICKNESS] * thicker if PLANE_STRESS else 1.0
    # In the plane of a ring the mass of its section.
    ring = ring_radius(ahead.x, ahead.h) if REVOLVED else 0.0
    planar = mass / (2.0 * pi * ring) if REVOLVED else mass
    signal = pack(rows, s, coefficients, Shown(
        ahead.x, ahead.u, planar, ahead.rho * thickness, ahead.e, ahead.h, p * thickness, c, c_l, c_t,
        times(thickness, ahead.s), tags[s, 1], ring))  # fmt: skip
    if SHEARS:  # alpha goes with this speed of sound
        left = shear_share(l)
        if REVOLVED:  # nothing else holds the rows at the axis
            left = max(left, 1.0 - AT_AXIS * ring / ahead.h)
        rows[s, C] *= left
    if LIMITED:
        signal = show_limits(rows, s, coefficients, signal, ahead.rho, c, Limits(
            thickness * bearable_tension(table, models, m, ahead.s, ahead.damage),
            thickness * bearable_shear(
                table, models, m, ahead.rho, ahead.e, p, ahead.plastic_strain, ahead.damage, l),
            failed(table, models, m, ahead.damage), orderly(models, m, ahead.plastic_strain),
            1.0 if h_low < ahead.h < h_high else 0.0))  # fmt: skip
    if SWITCH:
        share = state[s, S_VISCOSITY_SHARE] if SWITCH == MORRIS_MONAGHAN else 1.0
        share = viscous_share(share, l, c, ahead.h, stage, coefficients)
        rows[s, SHARE] = share
        # a small share lets no step grow: the shock that raises it may be a step away
        signal += 1.2 * coefficients[0] * max(share - 1.0, 0.0) * c
    signals[s] = signal
    fastest, longest, size = most
    return max(fastest, speed2), max(longest, ahead.h), size + (kinetic + abs(internal) if here else 0.0)


def update(state, tags, place, rates, sorted_rows, materials, coefficients, times_ahead, h_limits, rows, limits,
           sums):  # fmt: skip
    """Complete a step and pack the stage of the next one: the template.

    Bound names: DIM, PREVIOUS (1 for schemes that use the rates of the step before), VARIABLE_H,
    SPARSEST (least rho h^dim/m, 0 for none), DENSITY_RATE (1 where the rates hold one of ln(rho)),
    DRIFT (share of the acceleration in the stage's
    position), PLANE_STRESS, REVOLVED, SWITCH (share of the viscosity), SHEARS (1 where
    shear takes a share of it), REMEMBERS (1 where
    particles have a memory), NOTHING (else), columns of the state (S_...) and of the rates (R_...),
    slots of the row (U, C, SHARE), the templates above, and functions of `hvisph.materials` and `pack`.

    Parameters
    ----------
    state, tags
        The particles.
    place, rates, sorted_rows
        Row of each particle's rates, the rates, and the packed rows of their evaluation.
    materials
        Table and models of the packed materials.
    coefficients
        Numbers that `pack` and the switches read.
    times_ahead
        Length of the step [s], how far the next stage is ahead of its end [s], whether to complete the step.
    h_limits
        Least and largest smoothing length [m].
    rows
        Receives the packed rows of the stage.
    limits
        Three arrays (n,) that receive smoothing length, speed of signals and pressure at the stage.
    sums
        `Sums.loops`: receive sums over the completed state, chunk by chunk.
    """
    count = np.uint64(state.shape[0])
    table, models = materials
    dt, stage, complete = times_ahead
    h_low, h_high = h_limits
    lengths, signals, pressures = limits
    wholes, extremes, (of_energy, of_momentum, of_force, of_power) = sums
    for chunk in prange((count + np.uint64(CHUNK - 1)) // np.uint64(CHUNK)):
        first = np.uint64(chunk) * np.uint64(CHUNK)
        end = min(first + np.uint64(CHUNK), count)
        near = np.empty(CHUNK + LANES, np.uint32)
        placed = np.empty(CHUNK + LANES, np.uint32)
        counted = np.zeros((2, COUNTED, LANES), np.int64)
        most = (all_strict(0.0), all_strict(0.0), all_strict(0.0))
        key = np.uint64(0)
        while key != np.uint64(NONE):
            n, above = listed(tags, first, end, key, near)
            for k in range(n + np.uint64(LANES)):
                if n > np.uint64(0):
                    placed[k] = place[np.uint64(near[k])]
            for k in range(np.uint64(0), n, np.uint64(LANES)):
                most = carried(
                    (many(state, near, k), many(tags, near, k), many(rates, placed, k), many(sorted_rows, placed, k)),
                    first_lanes(n - k), (key >> np.uint64(1), (key & np.uint64(1)) == np.uint64(1)),
                    (table, models), coefficients, (dt, stage, complete), (h_low, h_high), many(rows, near, k),
                    (many(lengths, near, k), many(signals, near, k), many(pressures, near, k)), counted, most,
                    (of_energy, of_momentum, of_force, of_power))  # fmt: skip
            key = above
        i = np.uint64(chunk)
        sum_lanes(wholes, i, counted)
        fastest = longest = size = 0.0
        for k in range(np.uint64(LANES)):
            fastest, longest = max(fastest, lane(most[0], k)), max(longest, lane(most[1], k))
            size += lane(most[2], k)
        extremes[i, SPEED2], extremes[i, LENGTH], extremes[i, SIZE] = fastest, longest, size


PARTS = (loaded, store, measured, remember, moved, sparsest, strained, works, viscous_share)

