"""Acoustic Riemann problem of a pair of particles, with reconstructed states.

Along the line of centres e, with the impedances Z of both sides (normal: rho c_l, tangential: rho c_t),

    u* = (Z_a u_a + Z_b u_b + t_b - t_a) / (Z_a + Z_b)
    t* = (Z_b t_a + Z_a t_b + Z_a Z_b (u_b - u_a)) / (Z_a + Z_b),        t = sigma e

The normal impedance grows with the jump of velocity that reconstruction leaves, as the speed of a shock does:

    Z_n = rho (c_l + 1.2 max(u_an - u_bn, 0))

Beyond an open edge nothing comes back if the traction of the outgoing wave takes the place of Z (u_b - u_a): that of a
plane wave along the normal N of the edge has the stress

    sigma = Z_n u_N [1 - 2 w^2 (1 - N (x) N)] + Z_t (u_T (x) N + N (x) u_T),        w = Z_t/Z_n

of the jump u = u_N N + u_T. `outgoing_jump` is the jump that has this traction sigma e in the Riemann problem above.

Source: Parshikov & Medin 2002; the slope of the shock speed after Dukowicz 1985. Verification: `hugoniot`, `plate`.
"""

from __future__ import annotations

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.compiler.tensors import add, dot, multiply, subtract
from hvisph.compiler.vector.api import any_positive

from .limiters import TINY

# Slope of the shock speed over the jump of velocity; metals have 1.2 to 1.5.
SHOCK_SLOPE = 1.2
# Closing speed over sound speed in a neighbourhood from which on a compression is a shock front; one pair of it closes
# at half of that.
FRONT = 0.05
# Shear impedance over the normal one of a material without shear strength.
SHEAR_IMPEDANCE_MIN = 1e-8


@inline
def reciprocals(a, b):
    """Return 1/a and 1/b with a single division."""
    inverse = 1.0 / (a * b)
    return b * inverse, a * inverse


@inline
def shock_stiffening(jump):
    """Return the increase of the wave speed [m/s] for a normal velocity `jump` [m/s], negative in compression."""
    return -SHOCK_SLOPE * min(jump, 0.0)


@inline
def riemann_normal(inverse, za, zb, du, t_a, dt, shares_u, shares_t, half):
    """Return contact velocity relative to the own one, and traction, of the normal Riemann problem.

    `inverse`, `za`, `zb`: 1 over the sum of both impedances; impedances [kg/(m^2 s)]
    `du`, `t_a`, `dt`: jump of velocity to the neighbour [m/s]; own traction and jump of traction [Pa]
    `shares_u`, `shares_t`, `half`: shares of half of the jumps by which reconstruction moves both states
      (`sph.terms.reconstruction`); 1/2, or 0 of pairs without reconstruction
    """
    half_u, half_t = half * du, half * dt
    rest_u, rest_t = du - (shares_u[0] + shares_u[1]) * half_u, dt - (shares_t[0] + shares_t[1]) * half_t
    change = inverse * (zb * rest_u + rest_t)
    return shares_u[0] * half_u + change, t_a + shares_t[0] * half_t + za * change


@inline
def riemann_tangential(inverse, za, zb, du, t_a, dt, shares_u, shares_t, half):
    """Return the same of the tangential Riemann problem, as vectors."""
    half_u, half_t = multiply(half, du), multiply(half, dt)
    rest_u = subtract(du, multiply(shares_u[0] + shares_u[1], half_u))
    rest_t = subtract(dt, multiply(shares_t[0] + shares_t[1], half_t))
    change = multiply(inverse, add(multiply(zb, rest_u), rest_t))
    traction = add(t_a, add(multiply(shares_t[0], half_t), multiply(za, change)))
    return add(multiply(shares_u[0], half_u), change), traction


@inline
def outgoing_jump(jump, e, outward, ratio):
    """Return the jump of velocity [m/s] whose Riemann problem along e has the traction of an outgoing plane wave.

    `outward`: normal of the edge from the own side on. `ratio`: shear impedance over the normal one.
    """
    outward_jump, cosine = dot(jump, outward), dot(e, outward)
    tangential = subtract(jump, multiply(outward_jump, outward))
    skew = dot(tangential, e)
    normal = outward_jump * (1.0 - 2.0 * ratio * ratio * (1.0 - cosine * cosine)) + 2.0 * ratio * cosine * skew
    shear = add(multiply(cosine, tangential), multiply(2.0 * ratio * cosine * outward_jump + skew, outward))
    return add(shear, multiply(normal - dot(shear, e), e))


@inline
def clip_norm(limit, t):
    """Return the vector `t`, shortened to the length `limit` where it is longer."""
    t2 = dot(t, t)
    if any_positive(t2 - limit * limit):
        t = multiply(min(limit / (np.sqrt(t2) + TINY), 1.0), t)
    return t


@inline
def clip_shear(limit, t):
    """Return the tangential traction `t`, one number in the plane or a vector in space, limited to `limit` [Pa]."""
    if len(t) == 1:
        return (max(min(t[0], limit), -limit),)
    return clip_norm(limit, t)
