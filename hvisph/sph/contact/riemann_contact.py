"""Riemann contact of bodies: compression along the normal, Coulomb friction along the interface.

With the normal n and the gap factor of `sph.contact.contact_normal`, without reconstruction,

    t*_n = gap_factor min(t*_n, 0),     |t*_t| <= friction |t*_n|
    u*_a = u_a + (t* - t_a)/Z_a,  u*_b = u_b - (t* - t_b)/Z_b   one a side, equal where t* is not limited
    D    = F . (u*_b - u*_a)/2 >= 0                              heat of slip and of the gap, on each side

Where h follows density, the gap factor is 1 if both sides bear a hundredth of the traction: faces across a gap bear
nothing, and the volumes of a crushed first row would show a gap.

Verification: `friction`, `separation`, `bars`, `porous`.
"""

from __future__ import annotations

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.compiler.tensors import add, dot, multiply, subtract, vector
from hvisph.compiler.vector.api import neighbours
from hvisph.sph.terms.limiters import TINY
from hvisph.sph.terms.riemann_solver import SHEAR_IMPEDANCE_MIN, clip_norm

from .contact_normal import contact_frame
from .variable_resolution import normal_inverse_length, stretched_distance

# Share of the contact traction that both sides bear where there is no gap.
PRESSED = 0.01
# Stands for no limit of a traction [Pa].
UNLIMITED = 1e300
# Option of `contact_geometry`, off unless bound: bodies of unequal spacings.
VARIABLE_RESOLUTION = 0


def contact_geometry(rows, i, k, indices, b, dx, ih, e, g, other, n_other, n_surface):
    """Return normal, kernel slope, weight in the velocity gradient without gap, and gap factor of pairs in contact.

    A template: bound are DIM, WHOLE, the slots of the row, `scale` and `slope`. `other` is 1 for a pair of
    different bodies, else 0: nothing changes for it then.
    """
    row = neighbours(rows, indices, k, WHOLE)
    e, cosine, gap_factor = contact_frame(
        e, other, n_other, vector(row, N_OTHER, DIM), n_surface, vector(row, N_SURFACE, DIM)
    )
    g, weight = g * cosine, 1.0
    if VARIABLE_RESOLUTION:
        g_plain = -scale(ih) * slope(np.sqrt(dot(dx, dx)) * ih)
        ik = normal_inverse_length(rows[i, DEPTH], rows[i, H], row[DEPTH], b[H])
        q, s_n, _ = stretched_distance(dx, e, ik, ih)
        g_ab = -2.0 * scale(ih) / (ih * ih * rows[i, H] * b[H]) * slope(q) * s_n * ik / (q + TINY)
        g_ab *= g_plain / (g_plain + TINY)  # lists hold more where h varies: the pair must be in both
        g, weight = g + other * (g_ab - g), 1.0 + other * (ik * rows[i, H] - 1.0)
    return e, g, weight, gap_factor


@inline
def pressed_gap_factor(gap_factor, t, t_a, step, other):
    """Return the gap factor, 1 where both sides bear at least `PRESSED` of the normal traction `t` [Pa].

    `t_a`, `step`: own normal traction and its difference to the neighbour's [Pa]
    """
    push, minimum = max(-t, 0.0), max(-max(t_a, t_a + step), 0.0)
    return max(gap_factor, other * min((1.0 / PRESSED) * minimum, push) / (push + TINY))


@inline
def shear_compliance(zt, zn):
    """Return 1/Z_t; of a material without shear strength 1/Z_n, for its quotient would be rounding alone."""
    return zt / (zt * zt + SHEAR_IMPEDANCE_MIN * zn * zn + TINY)


@inline
def compressive_contact(t, us, d, t_a, step, za, zb, other, gap_factor):
    """Return normal traction, contact velocity, and half the difference of both sides' contact velocities.

    `t`, `us`: traction [Pa], and contact velocity relative to the own one [m/s], of a bonded pair
    `d`, `t_a`, `step`: jump of velocity [m/s]; own traction and jump of traction [Pa]
    `za`, `zb`: impedances
    `other`, `gap_factor`: 1 for a pair of different bodies, else 0; gap factor of the contact
    """
    t += other * (gap_factor * min(t, 0.0) - t)
    u_a, u_b = (t - t_a) / za, d - (t - t_a - step) / (zb + TINY)
    return t, us + other * (u_a - us), (0.5 * other) * (u_b - u_a)


@inline
def coulomb_slip(t, us, d, t_a, step, side_a, side_b, friction, t_n, other):
    """Return tangential traction and contact velocity, and the heat of slip over the weight of the pair.

    Vectors as in `compressive_contact`; `side_a` and `side_b` are the shear and normal impedances of each side,
    `friction` is Coulomb's coefficient, `t_n` the normal traction.
    """
    t = clip_norm(max(UNLIMITED * (1.0 - other), -friction * t_n), t)
    change = subtract(t, t_a)
    u_a = multiply(shear_compliance(*side_a), change)
    u_b = subtract(d, multiply(shear_compliance(*side_b), subtract(change, step)))
    return t, add(us, multiply(other, subtract(u_a, us))), (0.5 * other) * dot(t, subtract(u_b, u_a))
