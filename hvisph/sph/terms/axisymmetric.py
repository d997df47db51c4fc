"""Axisymmetric terms of pairs and particles in the half-plane (x, r).

A particle is a whole ring of mass m. In the plane it has the mass M = m / (2 pi r) and the area A = M / rho, with which
the laws of the plane hold, and images over the axis, of which s = -1 (s = 1 of all others). A pair's force takes both
radii in the mean,

    F_ab = 2 pi M_a M_b (r_a + s r_b)/2 [force of the plane]        a_a = sum_b w [..],     w = (1 + s r_b/r_a)/2

and an image over the axis gives its radial part alone: axial forces are conserved over all rings, radial ones need not
be over the axis. Its work is that of the two real rings, half to either side: F_r (u_ra - u_rb). Then

    kappa_a = - sum_b A_b (r_a - s r_b) dW/dr                        1 within a body, about 1/2 at a face
    a_a,r  += [(1 - kappa_a) sigma_rr - sigma_tt] / (rho_a r_a)
    de_a   -= [(1 - kappa_a) sigma_rr - sigma_tt] u_r / (rho_a r_a)
    L_tt    = u_r/r,     d ln(rho)/dt = - (L_rr + L_xx + L_tt),     d ln(h)/dt = (L_rr + L_xx)/2

A uniform pressure is static at the axis, as its pair sum gives kappa p/(rho r); total energy and axial momentum are
kept to round-off. Only in the plane is the velocity gradient a sum, without w.

What dissipates presses over the axis as across a mirror, with 1 - w = (1 + r_b/r_a)/2, against the closing of the two
sections, u_ra + u_rb, of which either side has half the heat: viscosity, and where Riemann problems are solved a
dashpot of the shear impedances, which gases have none of. With w it would drive rings into the axis, the first row by
energy that its own stress has not lost.

In the mass form of density chi_a (`schemes.standard.law`) is its sum in the plane, with M.

At the axis L_rr = L_tt; there each takes of the difference what brings both to their mean, whole at r = 0 and none from
r = h on, which leaves the rate of density as it is.

A ring alone has nothing to lean on: the pressure of a fluid does no work on its hoop, as kappa says, and it would be
squeezed without end at the axis. Its hoop's rate and force are taken as far as it has neighbours, in whole from kappa =
1/4, that of an edge.

Compare: the area-weighted form of Owen's Spheral, which conserves nothing; contact SPH of Rublev & Parshikov 2025.
"""

from __future__ import annotations

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.compiler.tensors import add_radial, multiply, radial_part, scale_radial

from .limiters import TINY

EDGES = 4.0  # 1 over the fullness of an edge


@inline
def mirror_weight(ring, inverse_ring):
    """Return w, and 1 for a ring or 0 for an image over the axis.

    Parameters
    ----------
    ring
        Radius of the neighbour, below zero of an image over the axis [m].
    inverse_ring
        1 over the own radius [1/m].
    """
    return 0.5 + (0.5 * inverse_ring) * ring, max(np.copysign(1.0, ring), 0.0)


@inline
def axisymmetric_jump(du, own, its, real):
    """Return the difference `du` of two velocities; of an image over the axis the radial one of its ring.

    `own` and `its` are both radial velocities, that of the image its own.
    """
    return add_radial(scale_radial(du, real, 0.0), own - (2.0 * real - 1.0) * its)


@inline
def axisymmetric_pair(force, dissipating, du, own, its, weight, real):
    """Return force and difference of velocities of a pair, and over the axis what its dissipation closes by, doubled.

    Parameters
    ----------
    force, dissipating, du
        Force of the plane, the part of it that dissipates, and difference of velocities.
    own, its
        Radial velocities.
    weight, real
        See `ring_weight`.
    """
    apart = multiply(weight, axisymmetric_jump(du, own, its, real))
    mirrored = (1.0 - real) * (1.0 - weight)
    force = scale_radial(force, weight * real, weight)
    force = add_radial(force, (mirrored - (1.0 - real) * weight) * radial_part(dissipating))
    return force, apart, mirrored * radial_part(du) - (1.0 - real) * radial_part(apart)


@inline
def axis_dashpot(e, apart, zt_a, zt_b, weight, real):
    """Return the radial traction [Pa] by which shear impedances brake what closes, at `apart` [m/s], over the axis."""
    return (1.0 - real) * (1.0 - weight) * radial_part(e) * min(apart, 0.0) * (zt_a * zt_b / (zt_a + zt_b + TINY))


@inline
def axisymmetric_traction(t, area, e, u, jump, left, zt_a, zt_b, other, weight, real):
    """Return the traction of a pair in the half-plane, the power of an image over the axis, and that of its dashpot.

    Parameters
    ----------
    t, area
        Traction of the plane [Pa]; interaction area of the pair over the own volume.
    e, u, jump, left
        Line of centres; own velocity, its jump, and the normal jump that reconstruction leaves [m/s].
    zt_a, zt_b, other
        Shear impedances; 1 for a pair of different bodies, else 0.
    weight, real
        See `mirror_weight`.
    """
    image_power = area * weight * (1.0 - real) * (0.5 * radial_part(t)) * (2.0 * radial_part(u) + radial_part(jump))
    dashpot = (1.0 - other) * axis_dashpot(e, left, zt_a, zt_b, weight, real)
    traction = add_radial(scale_radial(t, weight * real, weight), dashpot)
    return traction, image_power, (0.5 * area) * dashpot * radial_part(jump)


@inline
def axis_regularization(radial_rate, hoop_rate, ring, h):
    """Return what the rate of the radius [1/s] gains, and that of the hoop loses, near the axis."""
    return 0.5 * max(1.0 - ring / h, 0.0) * (hoop_rate - radial_rate)


@inline
def hoop_share(fullness):
    """Return which share of its hoop's rate and force a ring takes: none of a ring alone.

    Parameters
    ----------
    fullness
        kappa: 1 within a body, 1/2 at a face, 1/4 at an edge.
    """
    return min(max(EDGES * fullness, 0.0), 1.0)
