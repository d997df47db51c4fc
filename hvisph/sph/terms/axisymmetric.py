"""Axisymmetric terms of pairs and particles in the half-plane (x, r).

A particle is a torus of mass m. In the half-plane it has the mass M = m / (2 pi r) and the area A = M / rho, with which
the laws of the plane hold, and an image beyond the axis. With s = -1 for an image and 1 otherwise, the force of a pair
takes the mean of both radii,

    F_ab = 2 pi M_a M_b (r_a + s r_b)/2 [force of the plane]        a_a = sum_b w [..],     w = (1 + s r_b/r_a)/2

An image exerts the radial part alone, so that axial momentum is conserved; radial forces are balanced by the hoop. Its
work is that of the two real particles, half to either side: F_r (u_ra - u_rb). Then

    kappa_a = - sum_b A_b (r_a - s r_b) dW/dr                        1 within a body, about 1/2 at a face
    a_a,r  += [(1 - kappa_a) sigma_rr - sigma_tt] / (rho_a r_a)
    de_a   -= [(1 - kappa_a) sigma_rr - sigma_tt] u_r / (rho_a r_a)
    L_tt    = u_r/r,     d ln(rho)/dt = - (L_rr + L_xx + L_tt),     d ln(h)/dt = (L_rr + L_xx)/2

A uniform pressure is static at the axis, because its pair sum gives kappa p/(rho r). Total energy and axial momentum
are exact. The velocity gradient is the sum of the plane, without w.

Dissipation across the axis acts as across a mirror: it has the weight 1 - w = (1 + r_b/r_a)/2 and acts on the closing
speed u_ra + u_rb of the two sections; either side has half of the heat. It is the viscosity, or a dashpot of the shear
impedances in Riemann schemes (none in gases). With w it would accelerate the first row towards the axis, by energy that
its own stress has not lost.

In the mass form of density chi_a (`schemes.standard.law`) is its sum in the plane, with M.

At the axis L_rr = L_tt. Within r = h both are shifted towards their mean, fully at r = 0; the rate of density is
unchanged.

An isolated particle has no pair force that balances its hoop and would be squeezed without end at the axis. Rate and
force of the hoop are multiplied by min(4 kappa, 1): in full from kappa = 1/4, the value at an edge.

Compare: the area-weighted form of Owen's Spheral, which conserves nothing; contact SPH of Rublev & Parshikov 2025.
"""

from __future__ import annotations

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.compiler.tensors import add_radial, multiply, radial_part, scale_radial

from .limiters import TINY

EDGES = 4.0  # 1 over kappa at an edge


@inline
def mirror_weight(ring, inverse_ring):
    """Return w, and 1 for a real particle or 0 for an image.

    Parameters
    ----------
    ring
        Radius of the neighbour, negative for an image [m].
    inverse_ring
        1 over the own radius [1/m].
    """
    return 0.5 + (0.5 * inverse_ring) * ring, max(np.copysign(1.0, ring), 0.0)


@inline
def axisymmetric_jump(du, own, its, real):
    """Return the difference `du` of two velocities; for an image the radial one of the real particle.

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
    """Return the share of rate and force of the hoop that acts: none for an isolated particle.

    Parameters
    ----------
    fullness
        kappa: 1 within a body, 1/2 at a face, 1/4 at an edge.
    """
    return min(max(EDGES * fullness, 0.0), 1.0)
