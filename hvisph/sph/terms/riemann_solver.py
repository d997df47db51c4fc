"""What the contact law (`schemes.riemann.law`) makes of the two sides of a pair, before and after its Riemann problem.

Slopes move the sides to each other, limits of the material cut the tractions, and where bodies meet, pressing and
sliding take the place of what a welded pair would do.
"""

from __future__ import annotations

import numpy as np

from hvisph.compiler.jit import compiled
from hvisph.compiler.tensors import dot, minus, plus, times, to_dimensions
from hvisph.compiler.vector.api import anywhere

from .limiters import TINY

# How soon tension leaves pairs closer than their volumes allow.
HOLDING = 12.0
# Root of the share of its exchange that a pair loses, over p/(2 rho c^2): half of it at 0.07 rho c^2.
HARD = 20.0
# What has less than this is taken to bear none.
NO_SHEAR = 1e-4


@compiled
def inverses(a, b):
    """Return 1/a and 1/b, which take a single division."""
    both = 1.0 / (a * b)
    return b * both, a * both


@compiled
def drawn(u, of_u, t, of_t, shared, least):
    """Return by which shares of half their difference both sides move to each other, of velocities and of tractions.

    Parameters
    ----------
    u, t
        Square of the difference d.
    of_u, of_t
        Its products with both sides' slopes.
    shared
        The limiter.
    least
        The least share that the limiter is to return.
    """
    n1, d1 = shared(u, 2.0 * of_u[0] - u)
    n2, d2 = shared(u, 2.0 * of_u[1] - u)
    n3, d3 = shared(t, 2.0 * of_t[0] - t)
    n4, d4 = shared(t, 2.0 * of_t[1] - t)
    by_u, by_t = inverses(d1 * d2, d3 * d4)
    return ((max(n1 * d2 * by_u, least), max(n2 * d1 * by_u, least)),
            (max(n3 * d4 * by_t, least), max(n4 * d3 * by_t, least)))  # fmt: skip


@compiled
def met(inverse, za, zb, du, t_a, dt, shares_u, shares_t, half):
    """Return the contact velocity less the own one, and the traction, of a pair's normal Riemann problem.

    Parameters
    ----------
    inverse, za, zb
        1 over the sum of both impedances; impedances.
    du, t_a, dt
        The neighbour's velocity less the own one; the own traction, and the neighbour's less that.
    shares_u, shares_t, half
        Shares of half of them by which both sides move to each other, see `drawn`; 1/2 or, of pairs that go without, 0.
    """
    half_u, half_t = half * du, half * dt
    left_u, left_t = du - (shares_u[0] + shares_u[1]) * half_u, dt - (shares_t[0] + shares_t[1]) * half_t
    change = inverse * (zb * left_u + left_t)
    return shares_u[0] * half_u + change, t_a + shares_t[0] * half_t + za * change


@compiled
def met_beside(inverse, za, zb, du, t_a, dt, shares_u, shares_t, half):
    """Return the same of the tangential problem, of vectors."""
    half_u, half_t = times(half, du), times(half, dt)
    left_u = minus(du, times(shares_u[0] + shares_u[1], half_u))
    left_t = minus(dt, times(shares_t[0] + shares_t[1], half_t))
    change = times(inverse, plus(times(zb, left_u), left_t))
    return plus(times(shares_u[0], half_u), change), plus(t_a, plus(times(shares_t[0], half_t), times(za, change)))


@compiled
def counted(us, du, t, inverse, densities, most):
    """Return what of the exchange, `us` less the mean velocity, density goes without: `most` where a pair presses hard.

    Parameters
    ----------
    us, du, t
        Contact velocity and the neighbour's, both less the own one; normal traction.
    inverse, densities
        1 over the sum of both impedances, and the sum of both densities.
    most
        Largest share.
    """
    pressing = HARD * densities * inverse * inverse * min(t, 0.0)
    return min(pressing * pressing, most) * (us - 0.5 * du)


@compiled
def at_most(most, t):
    """Return the vector `t`, no longer than `most`."""
    t2 = dot(t, t)
    if anywhere(t2 - most * most):
        t = times(min(most / (np.sqrt(t2) + TINY), 1.0), t)
    return t


@compiled
def let_go(t_n, volumes, dx, inverse_r, order):
    """Return the normal traction, of which tension leaves a pair that is closer than its `volumes` allow."""
    leaves = min(HOLDING * max(volumes * to_dimensions(inverse_r * inverse_r, dx) - 1.0, 0.0), 1.0)
    return t_n - max(t_n, 0.0) * (order * leaves)


@compiled
def yielding(zt, zn):
    """Return 1/Z_t, but 0 of what bears no shear: there is nothing but rounding to divide by next to nothing."""
    least = NO_SHEAR * zn
    return zt / (zt * zt + least * least + TINY)


@compiled
def pressed(t, us, d, t_a, step, za, zb, other, gate):
    """Return normal traction and contact velocity where bodies meet, and half the velocity between both sides' own.

    Parameters
    ----------
    t, us
        Traction, and contact velocity less the own one, of bodies that are welded.
    d, t_a, step
        The neighbour's velocity less the own one; the own traction, and the neighbour's less that.
    za, zb
        Impedances.
    other, gate
        1 for a pair of different bodies, else 0; gate of the contact.
    """
    t += other * (gate * min(t, 0.0) - t)
    own, its = (t - t_a) / za, d - (t - t_a - step) / (zb + TINY)
    return t, us + other * (own - us), (0.5 * other) * (its - own)


@compiled
def slid(t, us, d, t_a, step, side_a, side_b, most, other):
    """Return tangential traction and contact velocity where bodies meet, and the heat of slip over the pair's weight.

    Vectors as in `pressed`; `side_a` and `side_b` are both impedances of each side, `most` is what friction bears.
    """
    t = at_most(most, t)
    beyond = minus(t, t_a)
    own = times(yielding(*side_a), beyond)
    its = minus(d, times(yielding(*side_b), minus(beyond, step)))
    return t, plus(us, times(other, minus(own, us))), (0.5 * other) * dot(t, minus(its, own))
