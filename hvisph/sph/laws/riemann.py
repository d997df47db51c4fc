"""CON: contact (Riemann) SPH of elastic-plastic solids, with optional limited reconstruction.

In each pair the acoustic Riemann problem along the line of centres e = (x_b - x_a)/r gives
a contact velocity and traction, normal with the impedance rho c_l, tangential with rho c_t:

    u* = (Z_a u_a + Z_b u_b + t_b - t_a) / (Z_a + Z_b)
    t* = (Z_b t_a + Z_a t_b + Z_a Z_b (u_b - u_a)) / (Z_a + Z_b),        t = sigma e
    F    = 2 V_a V_b |dW/dr| t*                   force on a, -F on b
    L_a += 2 V_b |dW/dr| (u* - u_a) (x) e
    m_a de_a += F . (u* - u_a)

Reconstruction moves each side's value halfway to the other by a limited slope: with d = f_b - f_a
and D = (grad f_a . e) r,  f_a += lim(d, 2 D - d)/2. Gradients are renormalised and come from a first
pass over the same neighbours (`gradients`), which writes them into the particle's own row.
The tangential part is limited as a vector, so the result does not depend on the frame.

Source: Parshikov & Medin 2002 as used by Mehra & Chaturvedi 2006; reconstruction after van Leer 1979.
"""

from __future__ import annotations

import numpy as np

from hvisph.core.jit import compiled
from hvisph.core.lanes import LANES, all_lanes, total
from hvisph.core.simd import neighbours
from hvisph.core.tensors import (
    dot,
    gradient,
    matrix,
    minus,
    no_gradient,
    no_symmetric,
    no_symmetric_gradient,
    no_vector,
    on,
    on_rows,
    outer,
    own_gradient,
    own_symmetric,
    own_symmetric_gradient,
    own_vector,
    plus,
    product,
    put,
    spread,
    symmetric,
    symmetric_gradient,
    symmetric_outer,
    times,
    totals,
    vector,
)
from hvisph.sph.rows import RowLayout
from hvisph.sph.shape_matrix import sound_inverse

# Keeps a pair without any shear impedance from dividing zero by zero.
TINY = 1e-30


def row_layout(dim: int, reconstruct: bool) -> RowLayout:
    """Return what a particle shows its neighbours; T is the stress, GU, GT are the gradients of U, T."""
    fields = [("x", "vector"), ("u", "vector"), ("h", "scalar"), ("v", "scalar"), ("zn", "scalar"),
              ("zt", "scalar"), ("t", "symmetric")]  # fmt: skip
    if reconstruct:
        fields += [("gu", "gradient"), ("gt", "symmetric_gradient")]
    fields.append(("m", "scalar"))  # the pairs never read it
    return RowLayout(dim, tuple(fields))


@compiled
def minmod(a, b):
    """Return the smaller in size of `a` and `b`, 0 where their signs differ."""
    return 0.5 * (np.copysign(1.0, a) + np.copysign(1.0, b)) * min(abs(a), abs(b))


@compiled
def van_leer(a, b):
    """Return the harmonic mean of `a` and `b`, 0 where their signs differ."""
    product = max(a * b, 0.0)
    return 2.0 * product * (a + b) / ((a + b) * (a + b) + TINY)


@compiled
def minmod_share(a, b):
    """Return minmod(a, b) / a for a >= 0, 0 for a = 0."""
    return max(min(a, b), 0.0) / (a + TINY)


@compiled
def van_leer_share(a, b):
    """Return van_leer(a, b) / a for a >= 0, 0 for a = 0."""
    b = max(b, 0.0)
    return 2.0 * b / (a + b + TINY)


LIMITERS = {"minmod": (minmod, minmod_share), "van_leer": (van_leer, van_leer_share)}


def gradients(near, n, rows, i, constants, out):
    """Write the renormalised gradients of velocity and stress into row `i`."""
    x, u, s, h = own_vector(rows, i, 0, DIM), own_vector(rows, i, U, DIM), own_symmetric(rows, i, T, DIM), rows[i, H]
    moment, of_u = spread(no_symmetric(DIM)), spread(no_gradient(DIM))
    of_s = spread(no_symmetric_gradient(DIM))
    for k in range(np.uint64(0), n, np.uint64(LANES)):
        b = neighbours(rows, near, k, WIDTH)
        dx = minus(vector(b, 0, DIM), x)
        r = np.sqrt(dot(dx, dx))
        ih = 2.0 / (h + b[H])
        g = times(-b[V] * scale(ih) * slope(r * ih) / r, dx)
        moment = plus(moment, symmetric_outer(dx, g))
        of_u = plus(of_u, outer(minus(vector(b, U, DIM), u), g))
        of_s = plus(of_s, outer(minus(symmetric(b, T, DIM), s), g))
    inverse, _ = sound_inverse(matrix(totals(moment)))
    put(out, i, GU, product(totals(of_u), inverse))
    put(out, i, GT, product(totals(of_s), inverse))


@compiled
def drawn_nearer(a, b, slope_a, slope_b, limited):
    """Return `a` and `b`, each moved halfway to the other by its limited slope: `limited` is a limiter's share."""
    d = minus(b, a)
    d2 = dot(d, d)
    towards = times(0.5 * limited(d2, 2.0 * dot(slope_a, d) - d2), d)
    back = times(0.5 * limited(d2, 2.0 * dot(slope_b, d) - d2), d)
    return plus(a, towards), minus(b, back)


def accumulate(near, n, rows, i, constants, out):
    """Sum the rates of particle `i` over its neighbours."""
    x, u, s = own_vector(rows, i, 0, DIM), own_vector(rows, i, U, DIM), own_symmetric(rows, i, T, DIM)
    h, zn, zt = rows[i, H], rows[i, ZN], rows[i, ZT]
    if RECONSTRUCTION:
        of_u, of_s = own_gradient(rows, i, GU, DIM), own_symmetric_gradient(rows, i, GT, DIM)
    power, a, l = all_lanes(0.0), spread(no_vector(DIM)), spread(no_gradient(DIM))
    for k in range(np.uint64(0), n, np.uint64(LANES)):
        b = neighbours(rows, near, k, WIDTH)
        dx = minus(vector(b, 0, DIM), x)
        r = np.sqrt(dot(dx, dx))
        ih = 2.0 / (h + b[H])
        g = -2.0 * b[V] * scale(ih) * slope(r * ih)
        e = times(1.0 / r, dx)
        # Velocities and tractions of both sides, along e and across.
        v, ta, tb = vector(b, U, DIM), on(s, e), on(symmetric(b, T, DIM), e)
        ua_n, ub_n, ta_n, tb_n = dot(u, e), dot(v, e), dot(ta, e), dot(tb, e)
        ua_t, ub_t = minus(u, times(ua_n, e)), minus(v, times(ub_n, e))
        ta_t, tb_t = minus(ta, times(ta_n, e)), minus(tb, times(tb_n, e))
        if RECONSTRUCTION:
            pa, pb = on_rows(of_u, dx), on_rows(gradient(b, GU, DIM), dx)
            qa, qb = on(on_rows(of_s, dx), e), on(on_rows(symmetric_gradient(b, GT, DIM), dx), e)
            d = ub_n - ua_n
            ua_n, ub_n = ua_n + 0.5 * limit(d, 2.0 * dot(pa, e) - d), ub_n - 0.5 * limit(d, 2.0 * dot(pb, e) - d)
            d = tb_n - ta_n
            ta_n, tb_n = ta_n + 0.5 * limit(d, 2.0 * dot(qa, e) - d), tb_n - 0.5 * limit(d, 2.0 * dot(qb, e) - d)
            if DIM > 1:
                ua_t, ub_t = drawn_nearer(ua_t, ub_t, pa, pb, share)
                ta_t, tb_t = drawn_nearer(ta_t, tb_t, qa, qb, share)
        # The acoustic Riemann problem, normal and tangential; us is u* - u_a.
        zb = b[ZN]
        inverse = 1.0 / (zn + zb)
        us = minus(times((zn * ua_n + zb * ub_n + tb_n - ta_n) * inverse, e), u)
        ts = times((zb * ta_n + zn * tb_n + zn * zb * (ub_n - ua_n)) * inverse, e)
        if DIM > 1:
            zb = b[ZT]
            inverse = 1.0 / (zt + zb + TINY)
            both = plus(plus(times(zt, ua_t), times(zb, ub_t)), minus(tb_t, ta_t))
            us = plus(us, times(inverse, both))
            both = plus(plus(times(zb, ta_t), times(zt, tb_t)), times(zt * zb, minus(ub_t, ua_t)))
            ts = plus(ts, times(inverse, both))
        a = plus(a, times(g, ts))
        power += g * dot(ts, us)
        l = plus(l, outer(us, times(g, e)))
    weight = rows[i, V] / rows[i, M]
    write_rates(out, i, times(weight, totals(a)), weight * total(power), 0.0, totals(l))
