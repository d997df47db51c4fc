"""Corrections of the kernel and its gradient: Shepard, gradient, or both (mixed).

    s_a     = sum_b V_b W_ab, the particle itself included               (Shepard's sum)
    G~_ab   = grad_a (W_ab / s_a) = grad_a W_ab / s_a - W_ab (sum_b V_b grad_a W_ab) / s_a^2
    K_a     = [sum_b V_b G~_ab (x) (x_b - x_a)]^-1
    g_ab    = K_a G~_ab = A_a grad_a W_ab + W_ab B_a

`shepard` has K = I, `gradient` has s = 1. With g_ab the gradient of a linear field is exact (`gradient`,
`mixed`), at free surfaces too. A particle with fewer than two neighbours, or with a matrix near singular, has
A = I, B = 0. With a contact algorithm between bodies, only the own body counts.

Source: Young 2021 eqs. 3-5.
"""

from __future__ import annotations

import numpy as np

from hvisph.compiler.tensors import (
    add,
    broadcast,
    dot,
    dot_rows,
    identity,
    lane_sums,
    matrix,
    multiply,
    no_gradient,
    no_symmetric,
    no_vector,
    outer,
    put,
    row_vector,
    subtract,
    symmetric_outer,
    vector,
)
from hvisph.compiler.vector.api import LANES, broadcast_lanes, lane_sum, neighbours
from hvisph.sph.neighbours.particle_layout import RowLayout

from .shape_matrix import sound_inverse

# Turns a positive number into one that is at least 1, and leaves 0.
HUGE = 1e300
COUPLED = 0  # off unless bound: pairs beside Total Lagrangian particles


def row_layout(standard: RowLayout) -> RowLayout:
    """Return the `standard` law's row with A, B; the last slot, which no pair reads, takes the fall-backs."""
    return RowLayout(standard.dim, (*pair_layout(standard).fields, ("fallbacks", "scalar")))


def pair_layout(standard: RowLayout) -> RowLayout:
    """Return what `accumulate` reads of a neighbour: the `standard` law's row with A and B."""
    return RowLayout(standard.dim, (*standard.fields, ("a", "gradient"), ("b", "vector")))


def corrections(indices, n, rows, i, constants, out):
    """Write A and B into row `i`, and the number of its neighbours where it falls back as a whole, else 0."""
    x, h = row_vector(rows, i, 0, DIM), rows[i, H]
    count = s = broadcast_lanes(0.0)
    slope_sum = first_sum = broadcast(no_vector(DIM))
    moment = broadcast(no_symmetric(DIM))
    for k in range(np.uint64(0), n, np.uint64(LANES)):
        b = neighbours(rows, indices, k, WIDTH)
        dx = subtract(vector(b, 0, DIM), x)
        r = np.sqrt(dot(dx, dx))
        hm = 0.5 * (h + b[H])
        density_length = r * b[RHO]
        inverse = 1.0 / (hm * density_length)  # one division for 1/h and 1/(r rho_b)
        ih = inverse * density_length
        norm = scale(ih) * b[M] * (inverse * hm)
        mask = min(b[M] * HUGE, 1.0)
        if COUPLED:
            _, share, _ = shares(rows, i, b, multiply(-1.0, dx), constants[constants.size - 1])
            norm = norm * share
            mask = mask * share
        g = multiply(-norm * slope(r * ih), dx)  # V_b times the gradient of W
        count += mask
        if SHEPARD:
            w = norm * r * hm * shape(r * ih)
            s += w
            slope_sum = add(slope_sum, g)
            first_sum = add(first_sum, multiply(w, dx))
        if GRADIENT:
            moment = add(moment, symmetric_outer(dx, g))
    inverse_s, shift = 1.0, no_vector(DIM)
    if SHEPARD:
        inverse_s = 1.0 / (lane_sum(s) + rows[i, M] / rows[i, RHO] * scale(1.0 / h) * h * shape(0.0))
        shift = multiply(-inverse_s * inverse_s, lane_sums(slope_sum))
    regular = lane_sum(count) > 1.5
    a = identity(no_gradient(DIM))
    if GRADIENT:
        shape_matrix = add(multiply(inverse_s, matrix(lane_sums(moment))), outer(shift, lane_sums(first_sum)))
        a, is_regular = sound_inverse(shape_matrix)
        shift = dot_rows(a, shift)
        regular = regular and is_regular
    a = multiply(inverse_s, a)
    if not regular:
        a, shift = identity(a), no_vector(DIM)
    put(out, i, A, a)
    put(out, i, B, shift)
    out[i, FALLBACKS] = 0.0 if regular else lane_sum(count)
