"""Contact between bodies: a repulsion between particles of different bodies (Vignjevic et al. 2006).

    E    = sum over pairs of different bodies of V_a V_b K w^n,    w = W_ab / W(dx)
    F_ab = - V_a V_b K n w^(n-1) / W(dx) grad_a W_ab               force on a, -F_ab on b
    e_a receives half of the pair's work, -F_ab . (u_a - u_b) / 2  (Young 2021 eqs. 15-16)

Kernels are uncorrected, in the current configuration; the force is along the line of centres, so there
is no friction. K [Pa/m^d] carries about 20 K dx^2 of pressure in 2D and 40 K dx^3 in 3D. A pair takes
the softer of its two stiffnesses. The stiffness of a pair against approach,

    k_ab = V_a V_b K n ((n - 1) w^(n-2) (W'/W(dx))^2 + w^(n-1) 3 W(0) / (W(dx) h^2)),

gives the frequency omega^2 = 2 sum_b k_ab / m_a and the limit 2/omega of the step.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hvisph.core.lanes import LANES, all_lanes, total
from hvisph.core.simd import neighbours
from hvisph.core.tensors import dot, minus, no_gradient, no_vector, own_vector, plus, spread, times, totals, vector
from hvisph.sph.kernels import Kernel
from hvisph.sph.rows import RowLayout

# Pressure that a plane contact of stiffness K carries, over K dx^d: measured, see Young 2021 sec. 2.4.
CARRIED = {1: 10.0, 2: 20.0, 3: 40.0}


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
    """

    stiffness: float = 0.025
    exponent: int = 4
    absolute: float | None = None

    def of_material(self, density: float, sound_speed: float, spacing: float, dim: int) -> float:
        """Return K [Pa/m^d] of a material with reference density [kg/m^3] and bulk sound speed [m/s]."""
        if self.absolute is not None:
            return self.absolute
        return self.stiffness * density * sound_speed**2 / spacing**dim

    def carried_pressure(self, density: float, sound_speed: float, spacing: float, dim: int) -> float:
        """Return about the largest pressure [Pa] that the contact carries."""
        return CARRIED[dim] * self.of_material(density, sound_speed, spacing, dim) * spacing**dim

    def coefficients(self, kernel: Kernel, h_over_dx: float) -> np.ndarray:
        """Return 1 / w(dx/h) and w(0) / w(dx/h), which the law reads."""
        at_spacing = kernel.shape.py_func(1.0 / h_over_dx)
        return np.array([1.0 / at_spacing, kernel.shape.py_func(0.0) / at_spacing])


def row_layout(dim: int) -> RowLayout:
    """Return what a particle shows its neighbours; K is its stiffness [Pa/m^d]."""
    return RowLayout(dim, (("x", "vector"), ("u", "vector"), ("h", "scalar"), ("m", "scalar"), ("v", "scalar"),
                           ("body", "scalar"), ("k", "scalar")))  # fmt: skip


def accumulate(near, n, rows, i, constants, out):
    """Sum contact force, half of its work and omega^2 of particle `i`; the row's |mu| slot takes omega^2."""
    inverse_w0, at_zero = constants[0], constants[1]
    x, u = own_vector(rows, i, 0, DIM), own_vector(rows, i, U, DIM)
    h, body, stiffness = rows[i, H], rows[i, BODY], rows[i, K]
    scale_own = rows[i, V] / rows[i, M]
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
        lower = ratio
        for _ in range(EXPONENT - 3):
            lower = lower * ratio
        # w^(n-2) for n = 2 is one
        if EXPONENT == 2:
            lower = all_lanes(1.0)
        power_of_w = lower * ratio
        both = other * b[V] * min(stiffness, b[K]) * float(EXPONENT)
        force = times(-both * power_of_w * slope_ratio / r, dx)
        a = plus(a, force)
        power += dot(force, minus(u, vector(b, U, DIM)))
        omega2 += both * (
            float(EXPONENT - 1) * lower * slope_ratio * slope_ratio + 3.0 * power_of_w * at_zero * ih * ih
        )
    write_rates(out, i, times(scale_own, totals(a)), -0.5 * scale_own * total(power), 2.0 * scale_own * total(omega2),
                no_gradient(DIM))  # fmt: skip
