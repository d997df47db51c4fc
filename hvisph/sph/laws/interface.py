"""Where bodies meet: the normal of the interface between two of them, and whether they touch.

    N_a = sum over other bodies V_b |dW/dr| e          points to where they lie
    O_a = - sum over the own body V_b |dW/dr| e        points out of it
    n   = (N_a - N_b) / |N_a - N_b|                    from a to b
    phi = |N_a - N_b| / (O_a - O_b) . n                1 where the bodies touch; 0.93, 0.81, 0.55, 0.2 where they are
                                                       1.1, 1.25, 1.5, 2 spacings apart

Both are antisymmetric in the pair, so that its force is. A smeared gap carries nothing: the gate opens with phi from
0.93 to 0.94, a gap of 0.1 spacings. Faces of unlike lattices touch with phi from 0.92 to 1.05, and all their pairs are
to carry; while a gate opens it is a dashpot, so that it opens at once. Where the line of centres is no way across the
interface, the bodies being mixed up, it is the normal.

Faces of one body (FACES) are told by what each particle remembers of the evaluation before, m = O over that of the
outermost layer under a flat face: a and b lie across from one another where m_a . e, - m_b . e or both together are
above 0.5. Such pairs count as of other bodies, so that O goes on without them, and faces that have met are faces still.
"""

from __future__ import annotations

import numpy as np

from hvisph.core.jit import compiled
from hvisph.core.tensors import dot, minus, own_vector, plus, times, vector

from .limiters import TINY

# Share of the free part of the kernel sum that the other body fills: none, and all of the traction.
OPEN, SHUT = 0.93, 0.94
# Below this cosine between line of centres and normal the bodies are mixed up.
MIXED_UP = 0.1
# Option of `of_other`, off unless bound: faces of one body that look at each other.
FACES = 0
# Least cosine of what lies in front of a face.
LOOKS = 0.5


def of_other(rows, i, b, dx):
    """Return 1 of the lanes `b` that row `i` meets, those of other bodies and of faces across from its own, else 0.

    A template: bound are DIM, BODY, FACES and, with that, FACE. `dx` is x_b - x_a.
    """
    other = min(abs(rows[i, BODY] - b[BODY]), 1.0)
    if FACES:
        other = max(other, looking(own_vector(rows, i, FACE, DIM), vector(b, FACE, DIM), dx))
    return other


@compiled
def across(e, other, fills_a, fills_b, ends_a, ends_b):
    """Return the pair's normal, the cosine that scales its kernel slope, and its gate.

    Parameters
    ----------
    e
        Line of centres, from a to b.
    other
        1 for a pair of different bodies, else 0: its normal is `e` then.
    fills_a, fills_b, ends_a, ends_b
        N and O of both.
    """
    fills = minus(fills_a, fills_b)
    size = np.sqrt(dot(fills, fills)) + TINY
    n = times(1.0 / size, fills)
    gate = (size / (max(dot(minus(ends_a, ends_b), n), 0.0) + TINY) - OPEN) * (1.0 / (SHUT - OPEN))
    cosine = dot(n, e)
    turned = other * max(np.copysign(1.0, cosine - MIXED_UP), 0.0)
    return plus(e, times(turned, minus(n, e))), 1.0 + turned * (cosine - 1.0), min(max(gate, 0.0), 1.0)


@compiled
def looking(face_a, face_b, dx):
    """Return 1 where one of two particles of a body lies in front of the other's face, else 0.

    Parameters
    ----------
    face_a, face_b
        Normals of the faces that they lie under, 1 long in the outermost layer under a flat face.
    dx
        x_b - x_a.
    """
    of_a, of_b = dot(face_a, dx), -dot(face_b, dx)
    most = max(max(of_a, of_b), of_a + of_b)
    return max(np.copysign(1.0, most - LOOKS * np.sqrt(dot(dx, dx))), 0.0)
