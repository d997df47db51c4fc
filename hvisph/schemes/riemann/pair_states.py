"""Stages of a pair in Riemann SPH: impedances, reconstruction, Riemann problems, limits, contact, rates of density.

The functions are templates of the loop `schemes.riemann.law.accumulate`, bound to its options, dimension and slots.
A pair of values is a normal and a tangential part (`compiler.tensors.tangential_part`); in 1D the latter is 0.
"""

from __future__ import annotations

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.compiler.tensors import (
    add,
    axial,
    axial_cross,
    dot,
    dot_rows,
    gradient,
    multiply,
    power_of_dimension,
    row_axial,
    row_symmetric,
    subtract,
    symmetric,
    symmetric_dot,
    symmetric_gradient,
    tangential_components,
    vector,
)
from hvisph.sph.contact.contact_normal import is_rigid
from hvisph.sph.contact.riemann_contact import compressive_contact, coulomb_slip
from hvisph.sph.terms.crack import softened_bound, unbroken_share
from hvisph.sph.terms.density_correction import EXCHANGE_CUTOFF_MAX, exchange_correction
from hvisph.sph.terms.limiters import TINY
from hvisph.sph.terms.reconstruction import limited_shares
from hvisph.sph.terms.riemann_solver import clip_shear, reciprocals, riemann_normal, riemann_tangential
from hvisph.sph.terms.tension_stabilization import tension_relief

# Options, off unless bound.
TENSION_STABILIZED = GRAD_H = AXISYMMETRIC = DENSITY_CORRECTION = VARIABLE_RESOLUTION = ANISOTROPIC = FRACTURES = 0
TURNS = EDGES = 0
# Slot of what rounding takes of the position, in single precision; least shear impedance over the normal one at which
# the jump of the tangential traction counts then.
X_REST, SHEARING = 0, 1e-4


def rigid_motion(rows, i, b, dx, rigid_a, g, jump):
    """Return kernel slope, velocity jump at the other side's place, rigidity of the neighbour, and share of heat."""
    rigid_b = is_rigid(b[BODY])
    g, heat_share = g * (1.0 - rigid_a * rigid_b), 1.0 + rigid_b - rigid_a
    if TURNS:
        turn = add(row_axial(rows, i, TURN_RATE, DIM), axial(b, TURN_RATE, DIM))
        jump = subtract(jump, axial_cross(turn, dx))
    return g, jump, rigid_b, heat_share


@inline
def layer_share(normal):
    """Return 1 for a particle beyond an open edge, whose outward normal is `normal`, and 0 for the zero vector."""
    return min(2.0 * dot(normal, normal), 1.0)


def impedances(rows, i, b, e, inverse_filler, layer_a, layer_b):
    """Return the impedances of both sides, normal (along e) and shear; an ambient layer has those of its partner."""
    za, zb, zta, ztb = rows[i, ZN], b[ZN], rows[i, ZT], b[ZT]
    if ANISOTROPIC:
        za = np.sqrt(dot(symmetric_dot(row_symmetric(rows, i, Z_SQUARED, DIM), e), e))
        zb = np.sqrt(dot(symmetric_dot(symmetric(b, Z_SQUARED, DIM), e), e))
    if EDGES:
        real = min(b[V] * inverse_filler, 1.0) * layer_a
        za, zb = za + real * (zb - za), zb + layer_b * (za - zb)
        zta, ztb = zta + real * (ztb - zta), ztb + layer_b * (zta - ztb)
    return za, zb, zta, ztb


def reconstructed_shares(b, dx, e, velocity, stress, grad_u, grad_s, floor):
    """Return the shares of half of the jumps `velocity` and `stress` by which both states move to the middle.

    Each is a pair of shares, of the own side and of the neighbour: of normal velocity and traction, of tangential
    velocity and traction (`sph.terms.reconstruction`).
    """
    du_n, du_t = velocity
    dt_n, dt_t = stress
    pa, pb = dot_rows(grad_u, dx), dot_rows(gradient(b, GU, DIM), dx)
    qa = symmetric_dot(dot_rows(grad_s, dx), e)
    qb = symmetric_dot(dot_rows(symmetric_gradient(b, GT, DIM), dx), e)
    slopes_u, slopes_t = (du_n * dot(pa, e), du_n * dot(pb, e)), (dt_n * dot(qa, e), dt_n * dot(qb, e))
    normal = limited_shares(du_n * du_n, slopes_u, dt_n * dt_n, slopes_t, share, floor)
    if DIM == 1:
        return normal, normal
    slopes_u = (dot(tangential_components(pa, e), du_t), dot(tangential_components(pb, e), du_t))
    slopes_t = (dot(tangential_components(qa, e), dt_t), dot(tangential_components(qb, e), dt_t))
    return normal, limited_shares(dot(du_t, du_t), slopes_u, dot(dt_t, dt_t), slopes_t, share, floor)


def riemann_states(za, zb, zt_a, zt_b, velocity, t_a, stress, shares, half):
    """Solve the Riemann problems of a pair.

    Returns the contact velocity relative to the own one and the traction, each normal and tangential, and 1 over the
    sum of the normal impedances. `velocity`, `t_a`, `stress`: jump of velocity, own traction, jump of traction.
    """
    inverse_n, inverse_t = reciprocals(za + zb, zt_a + zt_b + TINY)
    jump = stress[1]
    if X_REST and DIM > 1:  # without shear strength it is zero, and rounding over the impedance would be some 10 m/s
        shears = min((zt_a + zt_b) * inverse_n * (1.0 / SHEARING), 1.0)
        jump = multiply(shears * shears, jump)
    us_n, t_n = riemann_normal(inverse_n, za, zb, velocity[0], t_a[0], stress[0], shares[0][0], shares[0][1], half)
    if DIM == 1:
        return (us_n, 0.0), (t_n, 0.0), inverse_n
    us_t, t_t = riemann_tangential(inverse_t, zt_a, zt_b, velocity[1], t_a[1], jump, shares[1][0], shares[1][1], half)
    return (us_n, us_t), (t_n, t_t), inverse_n


def elastic_states(contact, traction, velocity, mean, pressure, elastic):
    """Return contact velocity and traction of the adjoint variant where the lattice is elastic, by its share `elastic`.

    `mean`: mean traction by the corrected operator, normal and tangential; `pressure`: the pair's dissipative traction.
    """
    us_n, t_n = contact[0], traction[0]
    us_n += elastic * (0.5 * velocity[0] - us_n)
    t_n += elastic * (mean[0] + pressure - t_n)
    if DIM == 1:
        return (us_n, contact[1]), (t_n, traction[1])
    us_t = add(contact[1], multiply(elastic, subtract(multiply(0.5, velocity[1]), contact[1])))
    return (us_n, us_t), (t_n, add(traction[1], multiply(elastic, subtract(mean[1], traction[1]))))


def strength_limits(rows, i, b, dx, inverse_r, traction, factor):
    """Return the traction within the limits of both sides, with the tension of close pairs relieved.

    `factor`: that of the limits, 1 except in the adjoint variant.
    """
    t_n, t_t = traction
    t_n = min(t_n, factor * min(rows[i, TENSION_LIMIT], b[TENSION_LIMIT]))
    if TENSION_STABILIZED:
        order = min(rows[i, LATTICE_ORDER], b[LATTICE_ORDER])
        t_n = tension_relief(t_n, rows[i, V] * b[V], dx, inverse_r, order)
    if DIM == 1:
        return t_n, t_t
    return t_n, clip_shear(factor * min(rows[i, SHEAR_LIMIT], b[SHEAR_LIMIT]), t_t)


def crack_limits(rows, i, b, e, crack, traction, t_a, stress, other):
    """Return the traction that softened sides and a crack between them transmit (`sph.terms.crack`)."""
    t_n, t_t = traction
    transmitted = 1.0 - (1.0 - other) * (1.0 - unbroken_share(crack, vector(b, CRACK, DIM), e))
    t_n = min(t_n, min(softened_bound(t_a, rows[i, SOFT]), softened_bound(t_a + stress, b[SOFT])))
    t_n = min(t_n, transmitted * t_n)
    return t_n, multiply(transmitted, t_t) if DIM > 1 else t_t


def contact_states(rows, i, b, contact, traction, velocity, t_a, stress, impedances, friction, other, gap_factor):
    """Return contact velocity and traction of bodies in contact, and the heats of the gap and of slip.

    Heats are per interaction area (`sph.contact.riemann_contact`); pairs of one body keep their state.
    """
    za, zb = impedances
    t_n, us_n, separation = compressive_contact(
        traction[0], contact[0], velocity[0], t_a[0], stress[0], za, zb, other, gap_factor
    )
    if DIM == 1:
        return (us_n, contact[1]), (t_n, traction[1]), t_n * separation, 0.0 * other
    t_t, us_t, heat = coulomb_slip(
        traction[1], contact[1], velocity[1], t_a[1], stress[1], (rows[i, ZT], rows[i, ZN]), (b[ZT], b[ZN]),
        friction, t_n, other,
    )  # fmt: skip
    return (us_n, us_t), (t_n, t_t), t_n * separation, heat


def section_ratio(rows, i, b, dx, other, inverse_rest):
    """Return the weight of a neighbour in the number density by spacings and section areas at rest.

    Where h follows density, neighbours of other bodies are weighted by volume, as in the work of a contact: otherwise
    gas of a thousandth of a wall's volume would strain the wall without work.
    """
    ratio = power_of_dimension(1.0 + other * (b[H] / rows[i, H] - 1.0), dx) if VARIABLE_RESOLUTION else 1.0
    if GRAD_H:
        ratio = 1.0 + other * (b[V] / (rows[i, V] + TINY) - 1.0)
    if AXISYMMETRIC and DENSITY_CORRECTION:
        ratio *= b[REST_AREA] * inverse_rest
    return ratio


def density_velocities(rows, i, b, us_n, du_n, t_n, zb, inverse_n, other):
    """Return the velocities [m/s] that the rates of density and of the number density count."""
    limit, compression = (1.0, 0.5 * (rows[i, COMPRESSION] + b[COMPRESSION])) if GRAD_H else (EXCHANGE_CUTOFF_MAX, 0.0)
    correction = exchange_correction(us_n, du_n, t_n, inverse_n, rows[i, RHO] + b[RHO], compression, limit)
    return us_n - (1.0 - other) * correction, du_n * (0.5 + other * (zb * inverse_n - 0.5))
