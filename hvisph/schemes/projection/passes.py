"""Particle loops of SPH-projection, pass by pass (Farahani 2009, eqs. 20-32).

Each template is a pass over all particles. It takes the sum of its pair law from `rows`, which
neighbours read, and writes the row of the next pass into `following`: row i is written by i alone.
Bound names: DIM, the pair law, columns of the state (S_...) and of the rates (R_...), slots of the rows that are
written. `near` is what the pair laws read: the neighbours' numbers, first and last place of each particle's, and
the kernels of the pairs.
"""

from __future__ import annotations

import numpy as np

from hvisph.compiler.exact_sum import add_term, add_vector
from hvisph.compiler.logarithmic_growth import growth_factor
from hvisph.compiler.tensors import add, divergence, dot, multiply, no_vector, own_gradient, own_vector, put, subtract
from hvisph.compiler.tensors3d import full_gradient, own_full_symmetric, plane_components, put_full_symmetric
from hvisph.integrators.sums import KINETIC, LENGTH, MOMENTUM, SIZE, SPEED2, SUPPORT

CHUNK = 256


def stress(i, state, tags, near, rows, following, rates, materials, dt):
    """Pass 1: velocity gradient, and the deviator at the end of the step."""
    listed, first, last, kernels = near
    table, models = materials
    l = velocity_gradient(listed, first[i], last[i], rows, i, kernels)
    rho = state[i, S_DENSITY]
    # The pressure that comes with the deviator is the equation of state's: it has no part here.
    s, plastic, _, _, _ = respond(
        table, models, np.uint64(tags[i, 2]), dt, rho, state[i, S_INTERNAL_ENERGY],
        own_full_symmetric(state, i, S_DEVIATOR, DIM), state[i, S_PLASTIC_STRAIN], state[i, S_DAMAGE],
        full_gradient(l))  # fmt: skip
    put_full_symmetric(state, i, S_DEVIATOR, s, DIM)
    state[i, S_PLASTIC_STRAIN] = plastic
    put(following, i, 0, own_vector(rows, i, 0, DIM))
    following[i, M] = state[i, S_MASS]
    put(following, i, T, multiply(1.0 / (rho * rho), plane_components(s, DIM)))
    put(rates, i, R_GRADIENT, l)


def velocity(i, state, tags, near, rows, following, rates, dt, body_force):
    """Pass 2: stress divergence, and the intermediate velocity from it and the body force."""
    listed, first, last, kernels = near
    a = add(stress_divergence(listed, first[i], last[i], rows, i, kernels), body_force)
    put(rates, i, R_ACCELERATION, a)
    # A clamped particle feels its forces, which the budget counts, and stays.
    moves = 0.0 if tags[i, 3] & np.uint32(1) else dt
    put(following, i, 0, own_vector(rows, i, 0, DIM))
    put(following, i, U, add(own_vector(state, i, S_VELOCITY, DIM), multiply(moves, a)))
    following[i, V] = state[i, S_MASS] / state[i, S_DENSITY]
    following[i, RHO], following[i, P] = state[i, S_DENSITY], state[i, S_PRESSURE]


def pressure(i, state, near, rows, following, dt, eta2, fullness, min_support, original):
    """Pass 3: the pressure that restores the density, from the previous pressures."""
    listed, first, last, kernels = near
    loss, diagonal, others = poisson(listed, first[i], last[i], rows, i, kernels, eta2)
    rho, h, p = state[i, S_DENSITY], state[i, S_SMOOTHING_LENGTH], 0.0
    if diagonal < 0.0 and not -diagonal * rho * h * h * fullness < min_support:
        p = (others - loss / dt) / diagonal
    state[i, S_PRESSURE] = p
    w = state[i, S_MASS] if original else state[i, S_MASS] / rho
    put(following, i, 0, own_vector(rows, i, 0, DIM))
    following[i, W] = w
    following[i, WP] = w * p / (rho * rho) if original else w * p


def acceleration(i, state, near, rows, rates, original):
    """Pass 4: pressure gradient and total acceleration."""
    listed, first, last, kernels = near
    inverse, p = 1.0 / state[i, S_DENSITY], state[i, S_PRESSURE]
    push = pressure_gradient(listed, first[i], last[i], rows, i, kernels, p * inverse * inverse if original else p)
    push = multiply(1.0 if original else inverse, push)
    put(rates, i, R_ACCELERATION, subtract(own_vector(rates, i, R_ACCELERATION, DIM), push))


def carry(
    chunk, count, state, tags, rates, rows, lengths, dt, complete, variable, h_limits, body_force, sums, rounders
):
    """Complete the step (if `complete`) and pack the rows of the next one, for a chunk of particles."""
    h_low, h_high = h_limits
    wholes, extremes = sums
    of_energy, of_momentum, of_force, _ = rounders
    start = chunk * np.uint64(CHUNK)
    fastest = longest = size = 0.0
    wholes[chunk] = 0
    for i in range(start, min(start + np.uint64(CHUNK), count)):
        x, u = own_vector(state, i, S_POSITION, DIM), own_vector(state, i, S_VELOCITY, DIM)
        h, mass = state[i, S_SMOOTHING_LENGTH], state[i, S_MASS]
        a = own_vector(rates, i, R_ACCELERATION, DIM)
        # What particles do not keep: the forces on clamped ones and, negative, the body force on others.
        missing = multiply(-mass, body_force)
        if tags[i, 3] & np.uint32(1):
            missing = add(missing, multiply(mass, a))
            a = no_vector(DIM)
        if complete:
            x = add(x, multiply(dt, add(u, multiply(0.5 * dt, a))))
            u = add(u, multiply(dt, a))
            put(state, i, S_POSITION, x)
            put(state, i, S_VELOCITY, u)
            if variable:
                expansion = divergence(own_gradient(rates, i, R_GRADIENT, DIM))
                h = min(max(h * growth_factor(dt * expansion / DIM), h_low), h_high)
                state[i, S_SMOOTHING_LENGTH] = h
        speed2 = dot(u, u)
        kinetic = 0.5 * mass * speed2
        add_term(wholes, chunk, KINETIC, kinetic, of_energy)
        size += kinetic
        add_vector(wholes, chunk, MOMENTUM, multiply(mass, u), of_momentum)
        add_vector(wholes, chunk, SUPPORT, missing, of_force)
        fastest, longest = max(fastest, speed2), max(longest, h)
        put(rows, i, 0, x)
        put(rows, i, U, u)
        rows[i, H] = h
        rows[i, V] = mass / state[i, S_DENSITY]
        lengths[i] = h
    extremes[chunk, SPEED2], extremes[chunk, LENGTH], extremes[chunk, SIZE] = fastest, longest, size
