"""Contact normal between two bodies, and the gap factor of their contact force.

    N_a = sum over other bodies V_b |dW/dr| e          points towards the other body
    O_a = - sum over the own body V_b |dW/dr| e        points outwards; zero inside a body
    M_a = weighted mean of N in the neighbourhood      weights V_b (1 - (r/reach h)^2) cos^2; other bodies enter as -N_b
    F_a = N_a . M_a M_a/|M_a|^2                        projection of N on the mean direction
    n   = (F_a - F_b) / |F_a - F_b|                    normal, from a to b
    phi = |F_a - F_b| / (O_a - O_b) . n                closure: 1 for touching faces; 0.93, 0.81, 0.55, 0.2 at
                                                       distances of 1.1, 1.25, 1.5, 2 spacings

All quantities are antisymmetric in the pair, and so is the contact force. |dW/dr| weights the nearest neighbours most:
at the face of an irregular lattice the direction of N has errors of 0.1, which would transmit a drag of rho c u times
the square of the error along the face. The mean removes them. Its weight cos^2 excludes faces of another direction,
those behind a corner or on the far side of a foil.

Across a gap no traction acts: the gap factor rises linearly from 0 to 1 as phi rises from 0.93 to 0.94, a change of
distance of 0.1 spacings. Touching faces of different lattices have phi from 0.92 to 1.05. A factor between 0 and 1
dissipates, so that the range is small. Where the line of centres is nearly parallel to the interface (mixed bodies), it
replaces the normal.

Self-contact (SELF_CONTACT) recognises faces of one body by the normals of the previous evaluation, m = O over its value
in the outermost layer of a flat face: a and b face each other where m_a . e, -m_b . e or their sum exceeds 0.5. Such
pairs are treated as pairs of different bodies.
"""

from __future__ import annotations

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.compiler.tensors import (
    add,
    broadcast,
    dot,
    exact_difference,
    exact_vector,
    lane_sums,
    multiply,
    no_vector,
    put,
    row_exact_vector,
    row_vector,
    subtract,
    vector,
)
from hvisph.compiler.vector.api import LANES, neighbours
from hvisph.sph.terms.limiters import TINY

# Closure phi below which the gap is open (factor 0), and above which it is closed (factor 1).
OPEN, CLOSED = 0.93, 0.94
# Least cosine between line of centres and normal; below it the line of centres is the normal.
NORMAL_COSINE_MIN = 0.1
# Body number of rigid bodies in the rows of pairs; numbers of other bodies are not negative.
RIGID = -1.0
# Option of `is_other_body`, off unless bound: contact between faces of one body.
SELF_CONTACT = 0
# Slot of what rounding takes of the position, in single precision.
X_REST = 0
# Least cosine between the normal of a face and the direction to a particle in front of it.
FACING_COSINE = 0.5


@inline
def is_rigid(body):
    """Return 1 for the number `body` of rigid bodies, else 0."""
    return max(np.copysign(1.0, -0.5 - body), 0.0)


def is_other_body(rows, i, b, dx):
    """Return 1 for lanes `b` of other bodies or of opposite faces, else 0 (template).

    Bound names: DIM, BODY, SELF_CONTACT and, with that, N_PREVIOUS. `dx` is x_b - x_a.
    """
    other = min(abs(rows[i, BODY] - b[BODY]), 1.0)
    if SELF_CONTACT:
        other = max(other, faces_each_other(row_vector(rows, i, N_PREVIOUS, DIM), vector(b, N_PREVIOUS, DIM), dx))
    return other


def smooth_normals(indices, n, rows, i, constants, out):
    """Write F of particle `i` into its row (pass over particles near another body)."""
    x, h, raw = row_exact_vector(rows, i, 0, X_REST, DIM), rows[i, H], row_vector(rows, i, N_RAW, DIM)
    mean = broadcast(no_vector(DIM))
    for k in range(np.uint64(0), n, np.uint64(LANES)):
        b = neighbours(rows, indices, k, WIDTH)
        dx, ih = exact_difference(exact_vector(b, 0, X_REST, DIM), x, DIM), 2.0 / (h + b[H])
        n_b = multiply(1.0 - 2.0 * is_other_body(rows, i, b, dx), vector(b, N_RAW, DIM))
        alignment = max(dot(raw, n_b), 0.0)
        alignment = alignment * alignment / (dot(raw, raw) * dot(n_b, n_b) + TINY)
        weight = scale(ih) / ih * max(1.0 - dot(dx, dx) * ih * ih / REACH2, 0.0)
        mean = add(mean, multiply(b[V] * weight * alignment, n_b))
    direction = add(lane_sums(mean), multiply(rows[i, V] * scale(1.0 / h) * h, raw))
    put(out, i, N_OTHER, multiply(dot(raw, direction) / dot(direction, direction), direction))


@inline
def contact_gap_factor(f, o):
    """Return the gap factor from the sum `f` over other bodies and the free part `o` of the kernel sum."""
    return min(max((f / (max(o, 0.0) + TINY) - OPEN) * (1.0 / (CLOSED - OPEN)), 0.0), 1.0)


@inline
def contact_frame(e, other, f_a, f_b, o_a, o_b):
    """Return normal, cosine of the kernel slope and gap factor, from the centre line `e` and F and O of both sides."""
    f_ab = subtract(f_a, f_b)
    size = np.sqrt(dot(f_ab, f_ab)) + TINY
    n = multiply(1.0 / size, f_ab)
    cosine = dot(n, e)
    share = other * max(np.copysign(1.0, cosine - NORMAL_COSINE_MIN), 0.0)
    normal = add(e, multiply(share, subtract(n, e)))
    return normal, 1.0 + share * (cosine - 1.0), contact_gap_factor(size, dot(subtract(o_a, o_b), n))


@inline
def faces_each_other(face_a, face_b, dx):
    """Return 1 where a particle is in front of the other's face, by normals of length 1 in flat faces; else 0."""
    front_a, front_b = dot(face_a, dx), -dot(face_b, dx)
    largest = max(max(front_a, front_b), front_a + front_b)
    return max(np.copysign(1.0, largest - FACING_COSINE * np.sqrt(dot(dx, dx))), 0.0)
