"""Limited linear reconstruction of velocity and traction at the middle of a pair.

With the difference d = f_b - f_a and the slope D = (grad f_a . e) r, each side moves to the other by half of a limited
slope, lim(d, 2 D - d) (`sph.terms.limiters`). The tangential parts are limited as vectors, so that the result does not
depend on the frame of reference. Outside shock fronts the limiter returns at least a share of d,

    0.35 (1 + o_ab) max(0, 1 - 40 max(u_an - u_bn, 2 |t_bn - t_an|/(Z_a + Z_b)) (rho_a + rho_b)/(Z_a + Z_b)),

with the order o_ab of the lattice, 1 in a solid that has not yielded and 0 in one that has flowed by a strain of 0.2.
This floor removes the dissipation of grid-scale noise, whose slopes vanish.

Source: van Leer 1979; the floor is this code's own. Verification: `plate`, `cantilever`, `hugoniot`.
"""

from __future__ import annotations

from hvisph.compiler.jit import inline

from .riemann_solver import FRONT, reciprocals

# Least share of their difference by which both states move, twice that in a solid that has not yielded.
MIN_LIMITER = 0.35
# Least square of a difference, and largest ratio of slopes, in single precision.
SQUARE_MIN, RATIO_MAX = 1e-36, 1e4


@inline
def limiter_floor(approach, dt_n, za, zb, densities, order):
    """Return the least share of the limiter.

    `approach`, `dt_n`: closing speed [m/s] and jump of normal traction [Pa]
    `za`, `zb`, `densities`: impedances and the sum of both densities
    `order`: order of the lattice, the lesser of both
    """
    inverse = 1.0 / (za + zb)
    jump = max(approach, 2.0 * inverse * abs(dt_n))
    smooth = max(1.0 - (2.0 / FRONT) * densities * inverse * jump, 0.0)
    return smooth * (MIN_LIMITER + MIN_LIMITER * max(order, 0.0))


@inline
def limited_shares(u, slopes_u, t, slopes_t, limiter, floor):
    """Return the shares of half their difference by which both states move, of velocities and of tractions.

    `u`, `t`: square of the difference d
    `slopes_u`, `slopes_t`: products of d with the slopes of both sides
    `limiter`: A function of `sph.terms.limiters`
    `floor`: least share, see `limiter_floor`
    """
    n1, d1 = limiter(u, 2.0 * slopes_u[0] - u)
    n2, d2 = limiter(u, 2.0 * slopes_u[1] - u)
    n3, d3 = limiter(t, 2.0 * slopes_t[0] - t)
    n4, d4 = limiter(t, 2.0 * slopes_t[1] - t)
    inverse_u, inverse_t = reciprocals(d1 * d2, d3 * d4)
    shares_u = max(n1 * d2 * inverse_u, floor), max(n2 * d1 * inverse_u, floor)
    return shares_u, (max(n3 * d4 * inverse_t, floor), max(n4 * d3 * inverse_t, floor))


@inline
def limited_shares_of_ratios(u, slopes_u, t, slopes_t, limiter, floor):
    """Return `limited_shares` from slopes over the difference: squares of squares leave the range of float32."""
    inverse_u, inverse_t = 2.0 / (u + SQUARE_MIN), 2.0 / (t + SQUARE_MIN)
    n1, d1 = limiter(1.0, min(slopes_u[0] * inverse_u - 1.0, RATIO_MAX))
    n2, d2 = limiter(1.0, min(slopes_u[1] * inverse_u - 1.0, RATIO_MAX))
    n3, d3 = limiter(1.0, min(slopes_t[0] * inverse_t - 1.0, RATIO_MAX))
    n4, d4 = limiter(1.0, min(slopes_t[1] * inverse_t - 1.0, RATIO_MAX))
    inverse_u, inverse_t = reciprocals(d1 * d2, d3 * d4)
    shares_u = max(n1 * d2 * inverse_u, floor), max(n2 * d1 * inverse_u, floor)
    return shares_u, (max(n3 * d4 * inverse_t, floor), max(n4 * d3 * inverse_t, floor))
