"""Neighbour sums of SPH-projection (Farahani 2009), one a pass, and the particle loops of the passes.

    velocity_gradient    L_a = - sum_b V_b u_ab (x) grad W_ab                                 and f_ab, kept
    stress_divergence    T_a =   sum_b m_b (S_a/rho_a^2 + S_b/rho_b^2) . grad W_ab            eq. 21
    poisson              D_a =   sum_b V_b u~_ab . grad W_ab                                  eq. 25
                         A_a =   sum_b m_b c_ab,   Q_a = sum_b m_b c_ab P_b                   eqs. 28-30
                         c_ab = 8 x_ab . grad W_ab / ((rho_a + rho_b)^2 (r^2 + eta^2))
    pressure_gradient    G_a =   sum_b (w_b P_b + w_b P_a) grad W_ab / rho_a                  see below

grad W_ab = f_ab x_ab, and all four passes use the kernels at the start of the step: f is found once.

The last sum has two forms. The conjugate of the divergence, w = V, has (P_a + P_b)/(rho_a rho_b); eq. 31 has
P_a/rho_a^2 + P_b/rho_b^2, which is equal for equal densities only. One loop computes both, from `w` and `wp` of the
rows and the factor of the particle.
"""

import numpy as np

from hvisph.compiler.exact_sum import add_term, add_vector
from hvisph.compiler.tensors import (
    add,
    broadcast,
    divergence,
    dot,
    lane_sums,
    multiply,
    no_gradient,
    no_vector,
    outer,
    put,
    row_gradient,
    row_symmetric,
    row_vector,
    subtract,
    symmetric,
    symmetric_dot,
    vector,
)
from hvisph.compiler.tensors3d import (
    full_gradient,
    growth_factor,
    plane_components,
    put_full_symmetric,
    row_full_symmetric,
)
from hvisph.compiler.vector.api import LANES, broadcast_lanes, lane_sum, load_lanes, neighbours, put_lanes
from hvisph.integrators.sums import KINETIC, LENGTH, MOMENTUM, SIZE, SPEED2, SUPPORT
from hvisph.sph.neighbours.particle_layout import RowLayout

CHUNK = 256


def layouts(dim: int) -> list[RowLayout]:
    """Return the row layouts of the sums: T is S/rho^2 for the stress divergence, w and w P for the gradient."""
    return [
        RowLayout(dim, fields)
        for fields in (
            (("x", "vector"), ("u", "vector"), ("h", "scalar"), ("v", "scalar")),
            (("x", "vector"), ("m", "scalar"), ("t", "symmetric")),
            (("x", "vector"), ("u", "vector"), ("v", "scalar"), ("rho", "scalar"), ("p", "scalar")),
            (("x", "vector"), ("w", "scalar"), ("wp", "scalar")),
        )
    ]


def velocity_gradient(indices, first, last, rows, i, kernels):
    """Return L [1/s], and store f of each pair in `kernels`."""
    x, u, h = row_vector(rows, i, 0, DIM), row_vector(rows, i, U, DIM), rows[i, H]
    l = broadcast(no_gradient(DIM))
    for k in range(first, last, np.uint64(LANES)):
        b = neighbours(rows, indices, k, WIDTH)
        dx = subtract(x, vector(b, 0, DIM))
        hm = 0.5 * (h + b[H])
        r = np.sqrt(dot(dx, dx))
        # One division for 1/h and 1/r.
        inverse = 1.0 / (hm * r)
        ih = r * inverse
        f = scale(ih) * slope(r * ih) * (hm * inverse)
        put_lanes(kernels, k, f)
        l = subtract(l, outer(multiply(f * b[V], subtract(u, vector(b, U, DIM))), dx))
    return lane_sums(l)


def stress_divergence(indices, first, last, rows, i, kernels):
    """Return the acceleration by the deviators [m/s^2]."""
    x, t = row_vector(rows, i, 0, DIM), row_symmetric(rows, i, T, DIM)
    a = broadcast(no_vector(DIM))
    for k in range(first, last, np.uint64(LANES)):
        b = neighbours(rows, indices, k, WIDTH)
        g = multiply(b[M] * load_lanes(kernels, k), subtract(x, vector(b, 0, DIM)))
        a = add(a, symmetric_dot(add(t, symmetric(b, T, DIM)), g))
    return lane_sums(a)


def poisson(indices, first, last, rows, i, kernels, eta2):
    """Return D [1/s], the relative rate of density loss, A [m/kg] and Q [1/s^2]."""
    x, u, rho = row_vector(rows, i, 0, DIM), row_vector(rows, i, U, DIM), rows[i, RHO]
    loss = diagonal = weighted_p = broadcast_lanes(0.0)
    for k in range(first, last, np.uint64(LANES)):
        b = neighbours(rows, indices, k, WIDTH)
        dx = subtract(x, vector(b, 0, DIM))
        r2 = dot(dx, dx)
        f = b[V] * load_lanes(kernels, k)
        loss += f * dot(subtract(u, vector(b, U, DIM)), dx)
        densities = rho + b[RHO]
        c = f * r2 * b[RHO] / (densities * densities * (r2 + eta2))
        diagonal += c
        weighted_p += c * b[P]
    return lane_sum(loss), 8.0 * lane_sum(diagonal), 8.0 * lane_sum(weighted_p)


def pressure_gradient(indices, first, last, rows, i, kernels, p_a):
    """Return sum_b (w_b P_b + w_b `p_a`) grad W_ab."""
    x, a = row_vector(rows, i, 0, DIM), broadcast(no_vector(DIM))
    for k in range(first, last, np.uint64(LANES)):
        b = neighbours(rows, indices, k, WIDTH)
        f = (b[WP] + p_a * b[W]) * load_lanes(kernels, k)
        a = add(a, multiply(f, subtract(x, vector(b, 0, DIM))))
    return lane_sums(a)


# Particle loops, pass by pass (eqs. 20-32). Each template is a pass over all particles. It takes the sum of its pair
# law from `rows`, which neighbours read, and writes the row of the next pass into `next_rows`: row i is written by i
# alone. Bound names: DIM, the pair law, columns of the state (S_...) and of the rates (R_...), slots of the rows that
# are written. `lists` is what the pair laws read: the neighbours' numbers, first and last place of each particle's, and
# the kernels of the pairs.


def stress(i, state, tags, lists, rows, next_rows, rates, materials, dt):
    """Pass 1: velocity gradient, and the deviator at the end of the step."""
    indices, first, last, kernels = lists
    table, models = materials
    l = velocity_gradient(indices, first[i], last[i], rows, i, kernels)
    rho = state[i, S_DENSITY]
    # The pressure that comes with the deviator is the equation of state's: it has no part here.
    s, plastic, _, _, _ = respond(
        table,
        models,
        np.uint64(tags[i, 2]),
        dt,
        rho,
        state[i, S_INTERNAL_ENERGY],
        row_full_symmetric(state, i, S_DEVIATOR, DIM),
        state[i, S_PLASTIC_STRAIN],
        state[i, S_DAMAGE],
        full_gradient(l),
    )
    put_full_symmetric(state, i, S_DEVIATOR, s, DIM)
    state[i, S_PLASTIC_STRAIN] = plastic
    put(next_rows, i, 0, row_vector(rows, i, 0, DIM))
    next_rows[i, M] = state[i, S_MASS]
    put(next_rows, i, T, multiply(1.0 / (rho * rho), plane_components(s, DIM)))
    put(rates, i, R_GRADIENT, l)


def velocity(i, state, tags, lists, rows, next_rows, rates, dt, body_force):
    """Pass 2: stress divergence, and the intermediate velocity from it and the body force."""
    indices, first, last, kernels = lists
    a = add(stress_divergence(indices, first[i], last[i], rows, i, kernels), body_force)
    put(rates, i, R_ACCELERATION, a)
    # A clamped particle feels its forces, which the budget counts, and stays.
    step = 0.0 if tags[i, 3] & np.uint32(1) else dt
    put(next_rows, i, 0, row_vector(rows, i, 0, DIM))
    put(next_rows, i, U, add(row_vector(state, i, S_VELOCITY, DIM), multiply(step, a)))
    next_rows[i, V] = state[i, S_MASS] / state[i, S_DENSITY]
    next_rows[i, RHO], next_rows[i, P] = state[i, S_DENSITY], state[i, S_PRESSURE]


def pressure(i, state, lists, rows, next_rows, dt, eta2, fullness, min_support, original):
    """Pass 3: the pressure that restores the density, from the previous pressures."""
    indices, first, last, kernels = lists
    loss, diagonal, weighted_p = poisson(indices, first[i], last[i], rows, i, kernels, eta2)
    rho, h, p = state[i, S_DENSITY], state[i, S_SMOOTHING_LENGTH], 0.0
    if diagonal < 0.0 and not -diagonal * rho * h * h * fullness < min_support:
        p = (weighted_p - loss / dt) / diagonal
    state[i, S_PRESSURE] = p
    w = state[i, S_MASS] if original else state[i, S_MASS] / rho
    put(next_rows, i, 0, row_vector(rows, i, 0, DIM))
    next_rows[i, W] = w
    next_rows[i, WP] = w * p / (rho * rho) if original else w * p


def acceleration(i, state, lists, rows, rates, original):
    """Pass 4: pressure gradient and total acceleration."""
    indices, first, last, kernels = lists
    inverse, p = 1.0 / state[i, S_DENSITY], state[i, S_PRESSURE]
    push = pressure_gradient(indices, first[i], last[i], rows, i, kernels, p * inverse * inverse if original else p)
    push = multiply(1.0 if original else inverse, push)
    put(rates, i, R_ACCELERATION, subtract(row_vector(rates, i, R_ACCELERATION, DIM), push))


def advance(
    chunk, count, state, tags, rates, rows, lengths, dt, complete, variable, h_limits, body_force, sums, rounders
):
    """Complete the step (if `complete`) and pack the rows of the next one, for a chunk of particles."""
    h_low, h_high = h_limits
    integers, extremes = sums
    of_energy, of_momentum, of_force, _ = rounders
    start = chunk * np.uint64(CHUNK)
    u2_max = h_max = size = 0.0
    integers[chunk] = 0
    for i in range(start, min(start + np.uint64(CHUNK), count)):
        x, u = row_vector(state, i, S_POSITION, DIM), row_vector(state, i, S_VELOCITY, DIM)
        h, mass = state[i, S_SMOOTHING_LENGTH], state[i, S_MASS]
        a = row_vector(rates, i, R_ACCELERATION, DIM)
        # For the budget: the forces on clamped particles and, negative, the body force on others.
        support = multiply(-mass, body_force)
        if tags[i, 3] & np.uint32(1):
            support = add(support, multiply(mass, a))
            a = no_vector(DIM)
        if complete:
            x = add(x, multiply(dt, add(u, multiply(0.5 * dt, a))))
            u = add(u, multiply(dt, a))
            put(state, i, S_POSITION, x)
            put(state, i, S_VELOCITY, u)
            if variable:
                expansion = divergence(row_gradient(rates, i, R_GRADIENT, DIM))
                h = min(max(h * growth_factor(dt * expansion / DIM), h_low), h_high)
                state[i, S_SMOOTHING_LENGTH] = h
        speed2 = dot(u, u)
        kinetic = 0.5 * mass * speed2
        add_term(integers, chunk, KINETIC, kinetic, of_energy)
        size += kinetic
        add_vector(integers, chunk, MOMENTUM, multiply(mass, u), of_momentum)
        add_vector(integers, chunk, SUPPORT, support, of_force)
        u2_max, h_max = max(u2_max, speed2), max(h_max, h)
        put(rows, i, 0, x)
        put(rows, i, U, u)
        rows[i, H] = h
        rows[i, V] = mass / state[i, S_DENSITY]
        lengths[i] = h
    extremes[chunk, SPEED2], extremes[chunk, LENGTH], extremes[chunk, SIZE] = u2_max, h_max, size
