"""Monaghan's artificial viscosity between approaching particles.

    mu_ab = min(h_ab u_ab . x_ab / (|x_ab|^2 + 0.01 h_ab^2), 0)
    Pi_ab = (-alpha c_ab mu_ab + beta mu_ab^2) / rho_ab

with the means c_ab = (c_a + c_b)/2 and rho_ab = (rho_a + rho_b)/2. Both functions take floats or vectors; reciprocals
are arguments, because the pair laws compute all of them with one division.

Two switches give each particle a factor s_a of it, and a pair the mean of both factors:

    BAL  s = |div u| / (|div u| + |curl u| + 1e-4 c/h)                                 Balsara 1995
    MON  ds/dt = -(s - s_min)/tau + max(-div u, 0),   tau = h / (C1 c)      Morris & Monaghan 1997

The factor of MON multiplies both coefficients of SAV1, so that its beta is twice its alpha; it is integrated exactly
over a step in which all else is constant.

In plastic flow the linear viscosity would carry as much shear as the metal; in axisymmetric cases only in the plane, as
pairs have no hoop strain rate. With REDUCES_SHEAR_VISCOSITY the factor of alpha is

    max(0.1, |tr L| / (|tr L| + 0.2 D')),     D' = sqrt(2/3 dev D : dev D)             0.88 in a plane shock

Source: Monaghan 1992; Young 2021 eqs. 6-7; Farahani 2009.
"""

from __future__ import annotations

from math import exp, sqrt

from hvisph.compiler.jit import inline
from hvisph.compiler.tensors import add_identity, divergence, dot, double_dot
from hvisph.compiler.tensors3d import curl, symmetric_part

SOFTENING = 0.01  # share of h^2 in the denominator of mu


@inline
def approach(h, ur, inverse):
    """Return mu [m/s]: `ur` = u_ab . x_ab [m^2/s], `inverse` = 1 / (|x_ab|^2 + 0.01 h^2) [1/m^2]."""
    return min(h * ur * inverse, 0.0)


@inline
def monaghan(mu, alpha, beta, c, inverse_density):
    """Return Pi [m^5/(kg s^2)] from the sums `c` = c_a + c_b and `inverse_density` = 1 / (rho_a + rho_b)."""
    return mu * (2.0 * beta * mu - alpha * c) * inverse_density


@inline
def shear_share(l):
    """Return the share of the linear viscosity that a particle with the full velocity gradient `l` [1/s] takes."""
    d = symmetric_part(l)
    swelling = d[0] + d[1] + d[2]
    d = add_identity(d, (-1.0 / 3.0) * swelling)
    volume = abs(swelling) + 1e-30  # at rest all of it
    return max(volume / (volume + 0.2 * sqrt((2.0 / 3.0) * double_dot(d, d))), 0.1)


@inline
def balsara_share(l, c, h):
    """Return BAL's share from the full velocity gradient [1/s], sound speed [m/s] and smoothing length [m]."""
    compression = abs(divergence(l))
    rotation = curl(l)
    return compression / (compression + sqrt(dot(rotation, rotation)) + 1e-4 * c / h)


@inline
def relaxed_share(share, divergence, c, h, dt, minimum, c1):
    """Return MON's share after `dt` [s] at a velocity divergence [1/s]."""
    decay = c1 * c / h
    equilibrium = minimum + max(-divergence, 0.0) / decay
    return equilibrium + (share - equilibrium) * exp(-decay * dt)
