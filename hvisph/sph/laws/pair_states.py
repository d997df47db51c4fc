"""What the contact law (`sph.laws.riemann`) makes of the two sides of a pair, before and after its Riemann problem.

Slopes move the sides to each other, limits of the material cut the tractions, and where bodies meet, pressing and
sliding take the place of what a welded pair would do.
"""

from __future__ import annotations

import numpy as np

from hvisph.core.jit import compiled
from hvisph.core.tensors import dot, minus, plus, times, to_dimensions
from hvisph.core.vectors import anywhere

from .limiters import TINY

# How soon tension leaves pairs closer than their volumes allow.
HOLDING = 12.0
# Root of the share of its exchange that a pair loses, over p/(2 rho c^2): half of it at 0.07 rho c^2.
HARD = 20.0
# What has less than this is taken to bear none.
NO_SHEAR = 1e-4


@compiled
def moved(d, slope_a, slope_b, limited, half):
    """Return how far both sides' numbers, `d` apart, move to each other by their limited slopes."""
    return half * limited(d, 2.0 * slope_a - d), half * limited(d, 2.0 * slope_b - d)


@compiled
def drawn(d, slope_a, slope_b, shared, half):
    """Return which shares of the vector `d` between them both sides' vectors move to each other."""
    d2 = dot(d, d)
    return half * shared(d2, 2.0 * dot(slope_a, d) - d2), half * shared(d2, 2.0 * dot(slope_b, d) - d2)


@compiled
def met(za, zb, du, t_a, dt, moves_u, moves_t):
    """Return the contact velocity less the own one, and the traction, of a pair's normal Riemann problem.

    Parameters
    ----------
    za, zb
        Impedances.
    du, t_a, dt
        The neighbour's velocity less the own one; the own traction, and the neighbour's less that.
    moves_u, moves_t
        How far both sides move to each other, see `moved`.
    """
    inverse = 1.0 / (za + zb)
    change = inverse * (zb * (du - moves_u[0] - moves_u[1]) + (dt - moves_t[0] - moves_t[1]))
    return moves_u[0] + change, t_a + moves_t[0] + za * change


@compiled
def met_beside(za, zb, du, t_a, dt, moves_u, moves_t):
    """Return the same of the tangential problem: of vectors, which both sides move to each other by shares."""
    inverse = 1.0 / (za + zb + TINY)
    change = plus(times(inverse * zb * (1.0 - moves_u[0] - moves_u[1]), du),
                  times(inverse * (1.0 - moves_t[0] - moves_t[1]), dt))  # fmt: skip
    return plus(times(moves_u[0], du), change), plus(t_a, plus(times(moves_t[0], dt), times(za, change)))


@compiled
def counted(us, du, t, za, zb, densities, most):
    """Return what of the exchange, `us` less the mean velocity, density goes without: `most` where a pair presses hard.

    Parameters
    ----------
    us, du, t
        Contact velocity and the neighbour's, both less the own one; normal traction.
    za, zb, densities
        Impedances, and the sum of both densities.
    most
        Largest share.
    """
    inverse = 1.0 / (za + zb)
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
