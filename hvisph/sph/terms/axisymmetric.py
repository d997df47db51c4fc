"""Axisymmetric terms of pairs and particles in the half-plane (x, r).

A particle is a torus of mass m and radius r. In the plane it has the mass M = m / (2 pi r) and the section area A = M /
rho, for which the plane laws hold. Particles near the axis have images on its other side, with s = -1 (otherwise s =
1). The force of a pair contains the mean of both radii,

    F_ab = 2 pi M_a M_b (r_a + s r_b)/2 [plane force]               a_a = sum_b w [..],     w = (1 + s r_b/r_a)/2

and an image exerts its radial part only: the axial momentum of all particles is conserved. The work of an image is that
of the two real particles, half to either side: F_r (u_ra - u_rb). With the fullness kappa,

    kappa_a = - sum_b A_b (r_a - s r_b) dW/dr                        1 within a body, about 1/2 at a face
    a_a,r  += [(1 - kappa_a) sigma_rr - sigma_tt] / (rho_a r_a)
    de_a   -= [(1 - kappa_a) sigma_rr - sigma_tt] u_r / (rho_a r_a)
    L_tt    = u_r/r,     d ln(rho)/dt = - (L_rr + L_xx + L_tt),     d ln(h)/dt = (L_rr + L_xx)/2

a uniform pressure is in equilibrium at the axis, where the pair sum is kappa p/(rho r). Total energy and axial momentum
are conserved to round-off. The velocity gradient in the plane has no weights w.

Dissipative terms act across the axis as across a mirror, with 1 - w = (1 + r_b/r_a)/2, on the closing speed of both
sections, u_ra + u_rb; each side receives half of the heat. They are the viscosity or, with Riemann problems, a dashpot
of the shear impedance (none for gases). With the weight w they would drive particles into the axis.

In the mass form of density, chi_a (`schemes.standard.law`) is its plane sum, with M.

At the axis L_rr = L_tt: both rates are replaced by their mean at r = 0, and by less up to r = h; their sum, the rate of
density, is unchanged.

An isolated particle exerts no hoop stress: its fluid pressure does no work on the hoop, and the axis would compress it
without bound. Hoop rate and hoop force grow linearly with the fullness up to kappa = 1/4, that of an edge.

Compare: the area-weighted form of Owen's Spheral, without conservation; contact SPH of Rublev & Parshikov 2025.
"""

from __future__ import annotations

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.compiler.tensors import add_radial, multiply, radial_part, scale_radial

from .limiters import TINY

HOOP_ONSET = 4.0  # inverse of the fullness of an edge


@inline
def mirror_weight(ring, inverse_ring):
    """Return w, and 1 for a particle or 0 for an image over the axis.

    `ring`: radius of the neighbour, below zero of an image over the axis [m]
    `inverse_ring`: 1 over the own radius [1/m]
    """
    return 0.5 + (0.5 * inverse_ring) * ring, max(np.copysign(1.0, ring), 0.0)


@inline
def axisymmetric_jump(du, u_a, u_b, real):
    """Return the velocity difference `du`; for an image over the axis, with the radial velocity of its particle.

    `u_a` and `u_b` are both radial velocities, that of the image its own.
    """
    return add_radial(scale_radial(du, real, 0.0), u_a - (2.0 * real - 1.0) * u_b)


@inline
def axisymmetric_pair(force, dissipating, du, u_a, u_b, weight, real):
    """Return force and difference of velocities of a pair, and over the axis what its dissipation closes by, doubled.

    `force`, `dissipating`, `du`: force of the plane, the part of it that dissipates, and difference of velocities
    `u_a`, `u_b`: radial velocities
    `weight`, `real`: see `mirror_weight`
    """
    jump = multiply(weight, axisymmetric_jump(du, u_a, u_b, real))
    share = (1.0 - real) * (1.0 - weight)
    force = scale_radial(force, weight * real, weight)
    force = add_radial(force, (share - (1.0 - real) * weight) * radial_part(dissipating))
    return force, jump, share * radial_part(du) - (1.0 - real) * radial_part(jump)


@inline
def axis_dashpot(e, jump, zt_a, zt_b, weight, real):
    """Return the radial traction [Pa] of the dashpot of both shear impedances for a `jump` [m/s] across the axis."""
    return (1.0 - real) * (1.0 - weight) * radial_part(e) * min(jump, 0.0) * (zt_a * zt_b / (zt_a + zt_b + TINY))


@inline
def axisymmetric_traction(t, area, e, u, jump, rest, zt_a, zt_b, other, weight, real):
    """Return the traction of a pair in the half-plane, the power of an image over the axis, and that of its dashpot.

    `t`, `area`: traction of the plane [Pa]; interaction area of the pair over the own volume
    `e`, `u`, `jump`, `rest`: line of centres; own velocity, its jump, and the normal jump that reconstruction leaves
      [m/s]
    `zt_a`, `zt_b`, `other`: shear impedances; 1 for a pair of different bodies, else 0
    `weight`, `real`: see `mirror_weight`
    """
    image_power = area * weight * (1.0 - real) * (0.5 * radial_part(t)) * (2.0 * radial_part(u) + radial_part(jump))
    dashpot = (1.0 - other) * axis_dashpot(e, rest, zt_a, zt_b, weight, real)
    traction = add_radial(scale_radial(t, weight * real, weight), dashpot)
    return traction, image_power, (0.5 * area) * dashpot * radial_part(jump)


@inline
def axis_regularization(radial_rate, hoop_rate, ring, h):
    """Return the rate [1/s] that is added to the radial strain rate and subtracted from the hoop strain rate."""
    return 0.5 * max(1.0 - ring / h, 0.0) * (hoop_rate - radial_rate)


@inline
def hoop_share(fullness):
    """Return the share of hoop strain and force for `fullness` kappa: 1 inside, 1/2 at a face; 0 when alone."""
    return min(max(HOOP_ONSET * fullness, 0.0), 1.0)
