"""Penalty contact force between particles of different bodies (Vignjevic et al. 2006).

    E    = sum over pairs of different bodies of V_a V_b K w^n,    w = W_ab / W(dx)
    F_ab = - V_a V_b K n w^(n-1) / W(dx) grad_a W_ab               force on a, -F_ab on b

Touching bodies repel each other (n = 4 as published). Half of the work of a pair, -F_ab . (u_a - u_b) / 2, is heat of
each side (Young 2021 eqs. 15-16). `sph.contact.penalty_contact` has no force between touching bodies.

Kernels are uncorrected, in the current configuration; the force is along the line of centres. K [Pa/m^d] transmits
pressures of about 20 K dx^2 in 2D and 40 K dx^3 in 3D. A pair takes the smaller of its two stiffnesses. The stiffness
of a pair against approach,

    k_ab = V_a V_b K n ((n - 1) w^(n-2) (W'/W(dx))^2 + w^(n-1) 3 W(0) / (W(dx) h^2)),

gives the frequency omega^2 = 2 sum_b k_ab / m_a and the limit 2/omega of the time step.

For axisymmetric particles (AXISYMMETRIC) V are section areas, and

    E    = 2 pi sum over pairs V_a V_b K w^n (r_a + r_b)/2,

whose derivative with respect to the radii adds the force -2 pi V_a V_b K w^n/2 in the radial direction. Images over the
axis are left out.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from hvisph.compiler.tensors import (
    add,
    add_radial,
    broadcast,
    dot,
    lane_sums,
    multiply,
    no_gradient,
    no_vector,
    radial_part,
    row_vector,
    subtract,
    vector,
)
from hvisph.compiler.vector.api import LANES, broadcast_lanes, lane_sum, neighbours
from hvisph.sph.kernels import Kernel
from hvisph.sph.neighbours.pairs import Pass
from hvisph.sph.neighbours.particle_layout import RowLayout, select_fields
from hvisph.sph.terms.axisymmetric import mirror_weight

# Option of the law, off unless bound: axisymmetric particles.
AXISYMMETRIC = 0
# Largest pressure of a plane contact of stiffness K over K dx^d, measured; see Young 2021 sec. 2.4.
CARRIED = {1: 10.0, 2: 20.0, 3: 40.0}


@dataclass(frozen=True)
class Contact:
    """Dimensionless k of K = k rho0 c0^2/dx^d, exponent n >= 2; `absolute` is K [Pa/m^d] for all bodies."""

    stiffness: float = 0.025
    exponent: int = 4
    absolute: float | None = None

    separates = True  # kernel sums do not connect different bodies
    stores_energy = self_contact = False  # its work is heat of both sides
    friction = 0.0

    def of_material(self, density: float, sound_speed: float, spacing: float, dim: int, ratio: float = 1.0) -> float:
        """Return K [Pa/m^d] of a material from reference density [kg/m^3] and bulk sound speed [m/s]."""
        if self.absolute is not None:
            return self.absolute
        return self.stiffness * density * sound_speed**2 / spacing**dim

    def carried_over_stiffness(self, kernel: Kernel, h_over_dx: float, dim: int) -> float:
        """Return the approximate largest pressure of a plane contact over K dx^d."""
        return CARRIED[dim]

    def closer(self, kernel: Kernel, h_over_dx: float, dim: int, dx: float) -> float:
        """Return omega^2 rho/(2 K) of a particle half a spacing too close to a lattice [m^(d-2)]."""
        h, n = h_over_dx * dx, self.exponent
        w_dx = kernel.value(dx, h, dim)
        reach = int(kernel.reach * h_over_dx) + 1
        curvature = 3.0 * kernel.value(0.0, h, dim) / (w_dx * h**2)
        stiffness = 0.0
        for offset in itertools.product(range(reach), *[range(-reach, reach + 1)] * (dim - 1)):
            r = dx * float(np.hypot(offset[0] + 0.5, np.linalg.norm(offset[1:])))
            w, slope = kernel.value(r, h, dim) / w_dx, kernel.derivative(r, h, dim) / w_dx
            stiffness += n * ((n - 1) * w ** (n - 2) * slope**2 + w ** (n - 1) * curvature) if w > 0.0 else 0.0
        return stiffness * dx**dim

    def touching(self, kernel: Kernel, h_over_dx: float, dim: int) -> float:
        """Return 0: bodies at one spacing repel each other."""
        return 0.0

    def coefficients(self, kernel: Kernel, h_over_dx: float, dim: int) -> np.ndarray:
        """Return 1 / w(dx/h) and w(0) / w(dx/h)."""
        w_dx = kernel.shape.py_func(1.0 / h_over_dx)
        return np.array([1.0 / w_dx, kernel.shape.py_func(0.0) / w_dx])

    def passes(self, dim: int, axisymmetric: bool) -> list[Pass]:
        """Return the contact pass."""
        options = {"EXPONENT": self.exponent, "AXISYMMETRIC": int(axisymmetric)}
        return [Pass(accumulate, self.row_layout(dim, axisymmetric), options)]

    def row_layout(self, dim: int, axisymmetric: bool) -> RowLayout:
        """Return the particle row; K is the stiffness [Pa/m^d]."""
        return RowLayout(dim, select_fields(
            ("x", "vector"), ("u", "vector"), ("h", "scalar"), ("m", "scalar"), ("v", "scalar"), ("body", "scalar"),
            ("k", "scalar"), axisymmetric and ("ring", "radius"),
        ))  # fmt: skip


@dataclass(frozen=True)
class Bonded:
    """Bonded contact through the kernel sums."""

    separates = stores_energy = self_contact = False
    friction = 0.0


def accumulate(indices, n, rows, i, constants, out):
    """Sum contact force, half of its work and omega^2 (in the slot of |mu|) of particle `i`."""
    inverse_w0, w_0 = constants[0], constants[1]
    x, u = row_vector(rows, i, 0, DIM), row_vector(rows, i, U, DIM)
    h, body, stiffness = rows[i, H], rows[i, BODY], rows[i, K]
    factor = rows[i, V] / rows[i, M]
    if AXISYMMETRIC:
        inverse_ring = 1.0 / rows[i, RING]
    a = broadcast(no_vector(DIM))
    power = omega2 = broadcast_lanes(0.0)
    for k in range(np.uint64(0), n, np.uint64(LANES)):
        b = neighbours(rows, indices, k, WIDTH)
        dx = subtract(x, vector(b, 0, DIM))
        ih = 2.0 / (h + b[H])
        r = np.sqrt(dot(dx, dx))
        q = r * ih
        other = min(abs(body - b[BODY]), 1.0)
        ratio = shape(q) * inverse_w0
        slope_ratio = slope(q) * (inverse_w0 * ih)
        lower = ratio
        for _ in range(EXPONENT - 3):
            lower = lower * ratio
        if EXPONENT == 2:
            lower = broadcast_lanes(1.0)  # w^(n-2)
        power_of_w = lower * ratio
        weight = other * b[V] * min(stiffness, b[K]) * float(EXPONENT)
        if AXISYMMETRIC:
            weight = weight * mirror_weight(b[RING], inverse_ring)[0]
        force = multiply(-weight * power_of_w * slope_ratio / r, dx)
        power += dot(force, subtract(u, vector(b, U, DIM)))
        if AXISYMMETRIC:
            share = other * b[V] * min(stiffness, b[K]) * (power_of_w * ratio * (-0.5 * inverse_ring))
            force = add_radial(force, share)
            power += (2.0 * radial_part(u)) * share  # its whole work is that of particle i
        a = add(a, force)
        omega2 += weight * (float(EXPONENT - 1) * lower * slope_ratio * slope_ratio + 3.0 * power_of_w * w_0 * ih * ih)
    write_rates(out, i, multiply(factor, lane_sums(a)), -0.5 * factor * lane_sum(power),
                2.0 * factor * lane_sum(omega2), no_gradient(DIM))  # fmt: skip
