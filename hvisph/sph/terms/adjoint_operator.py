"""Corrected operator of velocity gradient and force, and stress extrapolated without amplification.

    B_a = sum_b V_b |dW/dr| r e (x) e,          K_a = 1 + o_a (B_a^-1 - 1)
    L_a = sum_b 2 V_b |dW/dr| u_ab (x) K_a e,   u_ab = (u_b - u_a)/2
    t_a = sigma_a K_a e,                        t* = (t_a + t_b)/2 + P e
    m_a de_a/dt = sum_b 2 V_a V_b |dW/dr| [t* . u_ab + (t_a - t_b) . u_ab/2]

L and the force are adjoint: the power of a particle is sigma_a : L_a and half of the pair's dissipation. K B = 1 makes
L of a rigid rotation antisymmetric, so that no pair force creates angular momentum. B includes the part of bodies in
contact along the normal n, (n . B n) n (x) n times the gap factor, without which the first rows would be stiffer than
those behind them. o_a is the order of the lattice, 0 where B is not correctable.

The stress of the stage is extrapolated over theta dt with the rates of the evaluation before. For an oscillation this
is the second-order Adams-Bashforth method, which amplifies by 1 + (w dt)^4/4 a step. With C the elastic moduli,

    sigma_a <- sigma_a + 2 theta dt o_a C : (grad u - grad u of the evaluation before)

is neutral up to w dt = 1; during plastic flow C has its bulk part alone.

Source: Bonet & Lok 1999 (adjoint of the corrected gradient); the extrapolation is this code's own. Verification:
`elastic_ring`, `cantilever`, `rebound`, `spinning_disc`.
"""

from __future__ import annotations

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.compiler.tensors import (
    add,
    add_identity,
    adjugate,
    determinant,
    divergence,
    dot,
    identity,
    matrix,
    multiply,
    subtract,
    symmetric_components,
    symmetric_dot,
    symmetric_outer,
    transpose,
)
from hvisph.sph.contact.contact_normal import contact_gap_factor

from .free_surface_correction import correctable
from .limiters import TINY


@inline
def closed_moment(moment, contact_moment, f, o):
    """Return B with the part of bodies in contact along their normal.

    `moment`, `contact_moment`: B of the own body and of the others, symmetric
    `f`, `o`: sums of V |dW/dr| e over the other bodies, and the same of the own body with the opposite sign
      [1/m]
    """
    size = np.sqrt(dot(f, f)) + TINY
    n = multiply(1.0 / size, f)
    normal = contact_gap_factor(size, dot(o, n)) * dot(n, symmetric_dot(contact_moment, n))
    return add(moment, symmetric_outer(n, multiply(normal, n)))


@inline
def corrected_operator(moment, order):
    """Return K, symmetric, and the share with which it holds: the order, or 0 where B is not correctable."""
    rows = matrix(moment)
    share = max(order, 0.0) if correctable(rows) else 0.0
    size = determinant(rows) if share > 0.0 else 1.0
    unit = identity(rows)
    return symmetric_components(add(unit, multiply(share, subtract(multiply(1.0 / size, adjugate(rows)), unit)))), share


@inline
def adjoint_tractions(s, stress_b, operator, operator_b, e):
    """Return the difference t_a - t_b of the tractions of both sides, their mean, and the mean of both K e."""
    ea, eb = symmetric_dot(operator, e), symmetric_dot(operator_b, e)
    t_a, t_b = symmetric_dot(s, ea), symmetric_dot(stress_b, eb)
    return subtract(t_a, t_b), multiply(0.5, add(t_a, t_b)), multiply(0.5, add(ea, eb))


@inline
def extrapolated_stress(stress, change, time, zn, zt, volume, mass):
    """Return the stress [Pa] of the stage.

    `stress`: that of the rates of the evaluation before [Pa]
    `change`: change of the velocity gradient since that evaluation [1/s]
    `time`: twice the time of the stage [s], negative during plastic flow
    `zn`, `zt`, `volume`, `mass`: impedances [kg/(m^2 s)]; volume and mass
    """
    compliance = abs(time) * volume / mass
    longitudinal, shear = zn * zn * compliance, zt * zt * compliance
    if time < 0.0:
        longitudinal, shear = longitudinal - (4.0 / 3.0) * shear, 0.0
    strain = symmetric_components(add(change, transpose(change)))
    return add(stress, add_identity(multiply(shear, strain), (longitudinal - 2.0 * shear) * divergence(change)))
