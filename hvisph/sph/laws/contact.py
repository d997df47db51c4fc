"""Contact between bodies: a repulsion between particles of different bodies (Vignjevic et al. 2006).

    E    = sum over pairs of different bodies of V_a V_b K w^n,    w = W_ab / W(dx) - w0, where that is positive
    F_ab = - V_a V_b K n w^(n-1) / W(dx) grad_a W_ab               force on a, -F_ab on b

As published w0 = 0, n = 4: bodies that touch repel each other, and half of a pair's work, -F_ab . (u_a - u_b) / 2, is
heat of each side (Young 2021 eqs. 15-16). Unloaded, w0 = 1 and n = 2: particles a spacing apart, and all that is
farther, feel nothing; a pair that starts nearer takes the smaller of what its sides had with anyone at the start.
V are volumes of the reference then, so that E is a function of places alone: it gives back what it took, and is an
account of its own.

Kernels are uncorrected, in the current configuration; the force is along the line of centres, so there
is no friction. As published K [Pa/m^d] carries about 20 K dx^2 of pressure in 2D and 40 K dx^3 in 3D. A pair takes
the softer of its two stiffnesses. The stiffness of a pair against approach,

    k_ab = V_a V_b K n ((n - 1) w^(n-2) (W'/W(dx))^2 + w^(n-1) 3 W(0) / (W(dx) h^2)),

gives the frequency omega^2 = 2 sum_b k_ab / m_a and the limit 2/omega of the step.

Rings of solids of revolution (REVOLVED) meet all round: V are areas of their sections, and

    E    = 2 pi sum over pairs V_a V_b K w^n (r_a + r_b)/2

of which the radii take a part, too: - 2 pi V_a V_b K w^n/2 inwards. Images over the axis do not take part: who is
opposite is nearer than they are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hvisph.core.lanes import LANES, all_lanes, larger_lanes, largest, total
from hvisph.core.simd import neighbours
from hvisph.core.tensors import (
    dot,
    minus,
    no_gradient,
    no_vector,
    own_vector,
    plus,
    plus_radial,
    radial,
    spread,
    times,
    totals,
    vector,
)
from hvisph.sph.kernels import Kernel
from hvisph.sph.rows import RowLayout

from .rings import ring_weight

# Option of the law, off unless bound: rings about an axis.
REVOLVED = 0
# Pressure that a plane contact of stiffness K carries, over K dx^d: measured, see Young 2021 sec. 2.4.
CARRIED = {1: 10.0, 2: 20.0, 3: 40.0}
# k of an unloaded contact: bars of elastic metal leave 1.6 of 50 m/s with it, of 100 particles each.
UNLOADED_STIFFNESS = 0.25
# An unloaded contact carries so many times the pressure that is expected: lattices that do not face each other
# particle by particle carry less than those that do.
RESERVE = 2.5


@dataclass(frozen=True)
class Contact:
    """Parameters of the contact.

    Parameters
    ----------
    stiffness
        k, dimensionless: K = k rho0 c0^2 / dx^d of each material.
    exponent
        n, a whole number of 2 or more.
    absolute
        K [Pa/m^d] for all bodies, in place of k; None for none.
    unloaded
        Whether bodies that touch feel nothing until they press on each other; the exponent is 2 then.
    expected
        Pressure to come [Pa]; an unloaded contact is made stiff enough for it.
    """

    stiffness: float = 0.025
    exponent: int = 4
    absolute: float | None = None
    unloaded: bool = False
    expected: float = 0.0

    def of_material(self, density: float, sound_speed: float, spacing: float, dim: int, carried: float = 1.0) -> float:
        """Return K [Pa/m^d] of a material with reference density [kg/m^3] and bulk sound speed [m/s].

        `carried` is the largest pressure that a contact of this kind carries, over K dx^d.
        """
        if self.absolute is not None:
            return self.absolute
        stiffest = max(self.stiffness * density * sound_speed**2, RESERVE * self.expected / carried)
        return stiffest / spacing**dim

    def carried_over_stiffness(self, kernel: Kernel, h_over_dx: float, dim: int) -> float:
        """Return about the largest pressure that a plane contact carries, over K dx^d."""
        if not self.unloaded:
            return CARRIED[dim]
        r = np.linspace(1.0, 0.0, 400, endpoint=False)
        at_spacing = kernel.value(1.0, h_over_dx, dim)
        w = np.array([kernel.value(one, h_over_dx, dim) for one in r]) / at_spacing
        slope = -np.array([kernel.derivative(one, h_over_dx, dim) for one in r]) / at_spacing
        # of each particle its opposite one alone, which is the nearest
        return float((2.0 * (w - 1.0) * slope).max())

    def coefficients(self, kernel: Kernel, h_over_dx: float) -> np.ndarray:
        """Return 1 / w(dx/h) and w(0) / w(dx/h), which the law reads."""
        at_spacing = kernel.shape.py_func(1.0 / h_over_dx)
        return np.array([1.0 / at_spacing, kernel.shape.py_func(0.0) / at_spacing])


def row_layout(dim: int, revolved: bool = False) -> RowLayout:
    """Return what a particle shows its neighbours; K is its stiffness [Pa/m^d], START its own w0."""
    more = (("ring", "radius"),) if revolved else ()
    return RowLayout(dim, (("x", "vector"), ("u", "vector"), ("h", "scalar"), ("m", "scalar"), ("v", "scalar"),
                           ("body", "scalar"), ("k", "scalar"), ("start", "scalar"), *more))  # fmt: skip


def accumulate(near, n, rows, i, constants, out):
    """Sum contact force, half of its work and omega^2 of particle `i`; the row's |mu| slot takes omega^2."""
    inverse_w0, at_zero = constants[0], constants[1]
    x, u = own_vector(rows, i, 0, DIM), own_vector(rows, i, U, DIM)
    h, body, stiffness, start = rows[i, H], rows[i, BODY], rows[i, K], rows[i, START]
    scale_own = rows[i, V] / rows[i, M]
    if REVOLVED:
        inverse_ring = 1.0 / rows[i, RING]
    a = spread(no_vector(DIM))
    power = omega2 = all_lanes(0.0)
    for k in range(np.uint64(0), n, np.uint64(LANES)):
        b = neighbours(rows, near, k, WIDTH)
        dx = minus(x, vector(b, 0, DIM))
        ih = 2.0 / (h + b[H])
        r = np.sqrt(dot(dx, dx))
        q = r * ih
        other = min(abs(body - b[BODY]), 1.0)
        ratio = shape(q) * inverse_w0
        slope_ratio = slope(q) * (inverse_w0 * ih)
        if UNLOADED:
            ratio = larger_lanes(ratio - min(start, b[START]), all_lanes(0.0))
        lower = ratio
        for _ in range(EXPONENT - 3):
            lower = lower * ratio
        # w^(n-2) for n = 2 is one
        if EXPONENT == 2:
            lower = min(1e9 * ratio, 1.0) if UNLOADED else all_lanes(1.0)
        power_of_w = lower * ratio
        both = other * b[V] * min(stiffness, b[K]) * float(EXPONENT)
        if REVOLVED:
            both = both * ring_weight(b[RING], inverse_ring)[0]
        force = times(-both * power_of_w * slope_ratio / r, dx)
        power += dot(force, minus(u, vector(b, U, DIM)))
        if REVOLVED:
            share = other * b[V] * min(stiffness, b[K]) * (power_of_w * ratio * (-0.5 * inverse_ring))
            force = plus_radial(force, share)
            power += (2.0 * radial(u)) * share  # all of it its own, not half
        a = plus(a, force)
        omega2 += both * (
            float(EXPONENT - 1) * lower * slope_ratio * slope_ratio + 3.0 * power_of_w * at_zero * ih * ih
        )
    write_rates(out, i, times(scale_own, totals(a)), -0.5 * scale_own * total(power), 2.0 * scale_own * total(omega2),
                no_gradient(DIM))  # fmt: skip


def meet(near, n, rows, i, constants, out):
    """Find how other bodies stand about particle `i`: their sum of V W in place of the power, the largest w of |mu|."""
    x, h, body = own_vector(rows, i, 0, DIM), rows[i, H], rows[i, BODY]
    ih = 1.0 / h
    filled, nearest = all_lanes(0.0), all_lanes(0.0)
    for k in range(np.uint64(0), n, np.uint64(LANES)):
        b = neighbours(rows, near, k, WIDTH)
        dx = minus(x, vector(b, 0, DIM))
        of_shape = min(abs(body - b[BODY]), 1.0) * shape(np.sqrt(dot(dx, dx)) * ih)
        filled += b[V] * of_shape
        nearest = larger_lanes(nearest, of_shape * constants[0])
    write_rates(out, i, no_vector(DIM), total(filled) * scale(ih) / ih, largest(nearest), no_gradient(DIM))
