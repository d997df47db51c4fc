"""Neighbour sums of SPH-projection (Farahani 2009), one a pass.

    velocity_gradient    L_a = - sum_b V_b u_ab (x) grad W_ab                                 and f_ab, kept
    stress_divergence    T_a =   sum_b m_b (S_a/rho_a^2 + S_b/rho_b^2) . grad W_ab            eq. 21
    poisson              D_a =   sum_b V_b u~_ab . grad W_ab                                  eq. 25
                         A_a =   sum_b m_b c_ab,   Q_a = sum_b m_b c_ab P_b                   eqs. 28-30
                         c_ab = 8 x_ab . grad W_ab / ((rho_a + rho_b)^2 (r^2 + eta^2))
    pressure_gradient    G_a =   sum_b (w_b P_b + w_b P_a) grad W_ab / rho_a                  see below

grad W_ab = f_ab x_ab, and all four passes use the kernels at the start of the step: f is found once.

The last one has two forms. The conjugate of the divergence, w = V, is (P_a + P_b)/(rho_a rho_b); eq. 31
has P_a/rho_a^2 + P_b/rho_b^2, which is the same for equal densities only. What a particle shows
(`w`, `wp`) and its own factor make the one or the other of the same loop.
"""

from __future__ import annotations

import numpy as np

from hvisph.compiler.tensors import (
    add,
    broadcast,
    dot,
    lane_sums,
    multiply,
    no_gradient,
    no_vector,
    outer,
    own_symmetric,
    own_vector,
    subtract,
    symmetric,
    symmetric_dot,
    vector,
)
from hvisph.compiler.vector.api import LANES, broadcast_lanes, lane_sum, load_lanes, neighbours, put_lanes
from hvisph.sph.neighbours.particle_layout import RowLayout


def layouts(dim: int) -> list[RowLayout]:
    """Return the row layouts of the sums: T is S/rho^2 for the stress divergence, w and w P for the gradient."""
    return [RowLayout(dim, fields) for fields in (
        (("x", "vector"), ("u", "vector"), ("h", "scalar"), ("v", "scalar")),
        (("x", "vector"), ("m", "scalar"), ("t", "symmetric")),
        (("x", "vector"), ("u", "vector"), ("v", "scalar"), ("rho", "scalar"), ("p", "scalar")),
        (("x", "vector"), ("w", "scalar"), ("wp", "scalar")),
    )]  # fmt: skip


def velocity_gradient(near, first, last, rows, i, kernels):
    """Return L [1/s], and store f of each pair in `kernels`."""
    x, u, h = own_vector(rows, i, 0, DIM), own_vector(rows, i, U, DIM), rows[i, H]
    l = broadcast(no_gradient(DIM))
    for k in range(first, last, np.uint64(LANES)):
        b = neighbours(rows, near, k, WIDTH)
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


def stress_divergence(near, first, last, rows, i, kernels):
    """Return the acceleration by the deviators [m/s^2]."""
    x, t = own_vector(rows, i, 0, DIM), own_symmetric(rows, i, T, DIM)
    a = broadcast(no_vector(DIM))
    for k in range(first, last, np.uint64(LANES)):
        b = neighbours(rows, near, k, WIDTH)
        g = multiply(b[M] * load_lanes(kernels, k), subtract(x, vector(b, 0, DIM)))
        a = add(a, symmetric_dot(add(t, symmetric(b, T, DIM)), g))
    return lane_sums(a)


def poisson(near, first, last, rows, i, kernels, eta2):
    """Return D [1/s], the relative rate of density loss, A [m/kg] and Q [1/s^2]."""
    x, u, rho = own_vector(rows, i, 0, DIM), own_vector(rows, i, U, DIM), rows[i, RHO]
    loss = diagonal = others = broadcast_lanes(0.0)
    for k in range(first, last, np.uint64(LANES)):
        b = neighbours(rows, near, k, WIDTH)
        dx = subtract(x, vector(b, 0, DIM))
        r2 = dot(dx, dx)
        f = b[V] * load_lanes(kernels, k)
        loss += f * dot(subtract(u, vector(b, U, DIM)), dx)
        densities = rho + b[RHO]
        c = f * r2 * b[RHO] / (densities * densities * (r2 + eta2))
        diagonal += c
        others += c * b[P]
    return lane_sum(loss), 8.0 * lane_sum(diagonal), 8.0 * lane_sum(others)


def pressure_gradient(near, first, last, rows, i, kernels, own):
    """Return sum_b (w_b P_b + w_b `own`) grad W_ab."""
    x, a = own_vector(rows, i, 0, DIM), broadcast(no_vector(DIM))
    for k in range(first, last, np.uint64(LANES)):
        b = neighbours(rows, near, k, WIDTH)
        f = (b[WP] + own * b[W]) * load_lanes(kernels, k)
        a = add(a, multiply(f, subtract(x, vector(b, 0, DIM))))
    return lane_sums(a)
