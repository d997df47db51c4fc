"""Penalty contact of connected components: a pressure where volumes overlap.

    phi_a = sum over particles b of other bodies V_b W_ab              volume fraction of other bodies around a
    p_a   = max(phi_a - phi0_a, 0),    E = sum V_a K_a p_a^2 / 2
    F_ab  = - V_a V_b (K_a p_a + K_b p_b) grad_a W_ab                  force on a, -F_ab on b

phi0 is the value of two lattices that face each other at a distance of one spacing, or the initial value of a particle
where that is larger (it decreases with phi): bodies in touch at the start exert no force. phi is smooth along a face,
so that contact without friction exerts no tangential force. V are reference volumes; E is therefore a potential, and is
stored as contact energy.

Coulomb's friction (FRICTION) acts on the slip velocity across the normal n of `sph.contact.contact_normal`. Its heat is
shared equally; beside a rigid body (RIGID) the other side receives all of it. At rest friction is a dashpot:

    T_ab = - min(mu |F_ab . n|, sqrt(k_ab min(m_a, m_b))/2 |u_t|) u_t/|u_t|,    u_t = u_ab - (u_ab . n) n

Self-contact (SELF_CONTACT) acts between particles of one body that have reference neighbours (TIED) and whose distance
in the reference configuration exceeds the kernel's reach, as in a fold. Particles that have left their reference lists
form a body of their own.

A bound of the second derivatives of E, row by row, gives the frequency omega^2 and the limit 2/omega of the time step:

    omega^2 = 2 V_a/m_a (K_a g_a^2 + sum_b V_b K_b |W'_ab| g_b + sum_b V_b (K_a p_a + K_b p_b) 3 W(0)/h^2)

with g = sum V_b |W'_ab| over particles with p > 0. For axisymmetric particles (AXISYMMETRIC) of volume V the section is
A = V/(2 pi r), and E = sum V_a K_a p_a^2/2 also depends on the radii:

    F_ab = - 2 pi A_a A_b (r_a K_a p_a + r_b K_b p_b) grad_a W_ab,    F_a,r += 2 pi A_a/r_a sum A_b r_b K_b p_b W_ab

A uniform pressure between two faces then exerts no force along them. Images over the axis contribute to phi, but not to
self-contact.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.compiler.tensors import (
    add,
    add_radial,
    broadcast,
    dot,
    lane_sums,
    multiply,
    no_gradient,
    no_vector,
    put,
    radial_part,
    row_vector,
    subtract,
    vector,
)
from hvisph.compiler.vector.api import LANES, broadcast_lanes, elementwise_max, lane_max, lane_sum, neighbours
from hvisph.sph.kernels import Kernel
from hvisph.sph.neighbours.pairs import Pass
from hvisph.sph.neighbours.particle_layout import RowLayout, select_fields
from hvisph.sph.terms.limiters import TINY

# Options of the laws, off unless bound: axisymmetric particles, self-contact, friction, rigid bodies.
AXISYMMETRIC = SELF_CONTACT = FRICTION = RIGID = 0
# Largest pressure of a contact over the expected one: shifted lattices transmit less than facing ones.
RESERVE = 2.5
# Damping of friction at rest over sqrt(k m), half of the critical damping of a pair.
STICKING = 0.5


@dataclass(frozen=True)
class Pressing:
    """Parameters of the penalty contact: stiffness relative to the material, friction coefficient.

    The stiffness is increased for the `expected` pressure [Pa]. With `self_contact` faces of one body are in contact,
    with `rigid` some bodies are rigid.
    """

    stiffness: float = 1.0
    expected: float = 0.0
    friction: float = 0.0
    self_contact: bool = True
    rigid: bool = False

    separates = True  # kernel sums do not connect different bodies
    stores_energy = True  # it has a potential energy

    def of_material(self, density: float, sound_speed: float, spacing: float, dim: int, ratio: float = 1.0) -> float:
        """Return the stiffness [Pa] of a material from reference density [kg/m^3] and bulk sound speed [m/s].

        Relative to that of `coefficients`; `ratio` is the largest pressure of a contact over its stiffness.
        """
        return max(self.stiffness * density * sound_speed**2, RESERVE * self.expected / ratio)

    def carried_over_stiffness(self, kernel: Kernel, h_over_dx: float, dim: int) -> float:
        """Return the approximate largest pressure of a plane contact over its stiffness."""
        phi, slope = _facing(kernel, h_over_dx, dim)
        pressure = 2.0 * (phi - phi[0]) * slope
        return float(pressure.max() / (2.0 * slope[0] ** 2))

    def closer(self, kernel: Kernel, h_over_dx: float, dim: int, dx: float) -> float:
        """Return omega^2 rho/(2 K) of a particle half a spacing too close to a lattice [m^-2]."""
        phi, slope = _facing(kernel, h_over_dx, dim)
        middle = len(slope) // 2
        pressure = 3.0 * (phi[middle] - phi[0]) * kernel.value(0.0, h_over_dx, dim) / h_over_dx**2
        return float((2.0 * slope[middle] ** 2 + pressure) / (2.0 * slope[0] ** 2)) / dx**2

    def touching(self, kernel: Kernel, h_over_dx: float, dim: int) -> float:
        """Return phi0 of lattices at one spacing."""
        return float(_facing(kernel, h_over_dx, dim)[0][0])

    def coefficients(self, kernel: Kernel, h_over_dx: float, dim: int) -> np.ndarray:
        """Return K over the stiffness, 3 w(0), friction and the square of the support."""
        slope = _facing(kernel, h_over_dx, dim)[1][0]
        return np.array([0.5 / slope**2, 3.0 * kernel.shape.py_func(0.0), self.friction, kernel.reach**2])

    def passes(self, dim: int, axisymmetric: bool) -> list[Pass]:
        """Return the passes: overlap of bodies, then forces."""
        layout = self.row_layout(dim, axisymmetric)
        options = {"SELF_CONTACT": int(self.self_contact), "FRICTION": int(self.friction > 0.0)}
        options |= {"AXISYMMETRIC": int(axisymmetric)}
        return [
            Pass(fill, layout, options, (touch,), into_rows=True),
            Pass(accumulate, layout, options | {"RIGID": int(self.rigid)}, (touch,), has_friction=True),
        ]

    def row_layout(self, dim: int, axisymmetric: bool) -> RowLayout:
        """Return the particle row.

        K is the stiffness [Pa], START phi0, D the displacement from the reference, TIED whether the particle has
        reference neighbours, RIGID_SIDE whether it is rigid; the first pass writes P, G, the gradient of phi, and phi
        into START.
        """
        return RowLayout(dim, select_fields(
            ("x", "vector"), ("u", "vector"), ("h", "scalar"), ("m", "scalar"), ("v", "scalar"), ("body", "scalar"),
            ("k", "scalar"), ("p", "scalar"), ("g", "scalar"), self.self_contact and ("d", "vector"),
            self.self_contact and ("tied", "scalar"), self.friction > 0.0 and ("n_other", "vector"),
            axisymmetric and ("ring", "radius"), self.rigid and ("rigid_side", "scalar"), ("start", "scalar"),
        ))  # fmt: skip


def _facing(kernel: Kernel, h_over_dx: float, dim: int) -> tuple[np.ndarray, np.ndarray]:
    """Return phi of a particle s = 1 to 0 spacings before a lattice's first layer, and - dphi/ds [1/spacing]."""
    layers, lateral = kernel.layers(h_over_dx, dim)
    phi, slope = [], []
    for s in np.linspace(1.0, 0.0, 50, endpoint=False):
        r = np.hypot.outer(s + layers, lateral).ravel()
        cosines = np.repeat(s + layers, len(lateral)) / r
        phi.append(sum(kernel.value(distance, h_over_dx, dim) for distance in r))
        slope.append(
            -sum(
                kernel.derivative(distance, h_over_dx, dim) * cosine
                for distance, cosine in zip(r, cosines, strict=True)
            )
        )
    return np.array(phi), np.array(slope)


@inline
def was_outside_reach(dx, d_a, d_b, reach2):
    """Return 1 for a pair that was beyond `reach2` in the reference, else 0."""
    dx0 = subtract(dx, subtract(d_a, d_b))
    return max(np.copysign(1.0, dot(dx0, dx0) - reach2), 0.0)


def touch(rows, i, b, dx, reach2):
    """Return 1 for lanes `b` touching row `i` (template); `dx` is x_a - x_b, `reach2` the squared support [m^2]."""
    other = min(abs(rows[i, BODY] - b[BODY]), 1.0)
    if SELF_CONTACT:
        own_face = (
            rows[i, TIED] * b[TIED] * was_outside_reach(dx, row_vector(rows, i, D, DIM), vector(b, D, DIM), reach2)
        )
        if AXISYMMETRIC:  # an image over the axis has a radius below zero
            own_face = own_face * max(np.copysign(1.0, b[RING]), 0.0)
        other = max(other, own_face)
    return other


def fill(indices, n, rows, i, constants, out):
    """Write p, g, phi and its gradient of particle `i` into its row."""
    x, h = row_vector(rows, i, 0, DIM), rows[i, H]
    phi_sum, gradient, normal = broadcast_lanes(0.0), broadcast_lanes(0.0), broadcast(no_vector(DIM))
    for k in range(np.uint64(0), n, np.uint64(LANES)):
        b = neighbours(rows, indices, k, WIDTH)
        dx = subtract(x, vector(b, 0, DIM))
        other = touch(rows, i, b, dx, constants[3] * h * h)
        ih = 2.0 / (h + b[H])
        r = np.sqrt(dot(dx, dx))
        volume = other * b[V] * scale(ih)
        phi_sum += volume * shape(r * ih) / ih
        g = volume * abs(slope(r * ih))
        gradient += g
        if FRICTION:
            normal = add(normal, multiply(-g / r, dx))
    phi = lane_sum(phi_sum)
    overlap = max(phi - rows[i, START], 0.0)
    out[i, START] = phi
    out[i, P], out[i, G] = overlap, lane_sum(gradient) if overlap > 0.0 else 0.0
    if FRICTION:
        put(out, i, N_OTHER, lane_sums(normal))


def accumulate(indices, n, rows, i, constants, out):
    """Sum contact force, half of its work and omega^2 (in the slot of |mu|) of particle `i`, friction heat apart."""
    x, u, h = row_vector(rows, i, 0, DIM), row_vector(rows, i, U, DIM), rows[i, H]
    k_a, m_a, factor = constants[0] * rows[i, K], rows[i, M], rows[i, V] / rows[i, M]
    p_a, g_a = k_a * rows[i, P], rows[i, G]
    if FRICTION:
        n_a = row_vector(rows, i, N_OTHER, DIM)
    a = broadcast(no_vector(DIM))
    power = omega2 = friction_heat = ring_sum = broadcast_lanes(0.0)
    for k in range(np.uint64(0), n, np.uint64(LANES)):
        b = neighbours(rows, indices, k, WIDTH)
        dx, du = subtract(x, vector(b, 0, DIM)), subtract(u, vector(b, U, DIM))
        other = touch(rows, i, b, dx, constants[3] * h * h)
        ih = 2.0 / (h + b[H])
        r = np.sqrt(dot(dx, dx))
        k_b = constants[0] * b[K]
        volume = other * b[V] * scale(ih)
        gradient = volume * abs(slope(r * ih))
        if AXISYMMETRIC:
            k_b = k_b * (abs(b[RING]) / rows[i, RING])
            ring_sum += k_b * b[P] * volume * shape(r * ih) / ih
        push = p_a + k_b * b[P]
        force = multiply(push * gradient / r, dx)
        power += dot(force, du)
        stiffness = k_b * b[G] * gradient + push * volume * constants[1] * ih
        omega2 += stiffness
        if FRICTION:
            n_ab = subtract(vector(b, N_OTHER, DIM), n_a)
            n_ab = multiply(1.0 / (np.sqrt(dot(n_ab, n_ab)) + TINY), n_ab)
            du = subtract(du, multiply(dot(du, n_ab), n_ab))
            slip = np.sqrt(dot(du, du)) + TINY
            stiffness = (k_a * g_a + k_b * b[G]) * gradient
            limit = STICKING * np.sqrt(stiffness * min(m_a, b[M]) / rows[i, V]) * slip
            friction = min(abs(constants[2] * dot(force, n_ab)), limit)
            force = subtract(force, multiply(friction / slip, du))
            friction_heat += friction * slip * (1.0 + b[RIGID_SIDE] - rows[i, RIGID_SIDE]) if RIGID else friction * slip
        a = add(a, force)
    acceleration, work = multiply(factor, lane_sums(a)), -0.5 * factor * lane_sum(power)
    if AXISYMMETRIC:  # a widened torus has a smaller section and fills less
        radial = factor * lane_sum(ring_sum) / rows[i, RING]
        acceleration, work = add_radial(acceleration, radial), work - radial * radial_part(u)
    curvature = k_a * g_a * g_a + lane_sum(omega2)
    write_rates(out, i, acceleration, work, 2.0 * factor * curvature, no_gradient(DIM))
    out[i, R_SLIP] = 0.5 * factor * lane_sum(friction_heat)


def contact_search(dim: int, kernel: Kernel) -> tuple[RowLayout, np.ndarray, Pass]:
    """Return row layout, constants and pass of the law `find_overlap`."""
    layout = RowLayout(dim, (("x", "vector"), ("h", "scalar"), ("v", "scalar"), ("body", "scalar"), ("d", "vector")))
    return layout, np.array([kernel.reach**2]), Pass(find_overlap, layout, {})


def find_overlap(indices, n, rows, i, constants, out):
    """Find phi of particle `i` (slot of power), and whether distant parts of its body are near (slot of |mu|)."""
    x, d, h, body = row_vector(rows, i, 0, DIM), row_vector(rows, i, D, DIM), rows[i, H], rows[i, BODY]
    phi, fold, reach2 = broadcast_lanes(0.0), broadcast_lanes(0.0), constants[0] * h * h
    for k in range(np.uint64(0), n, np.uint64(LANES)):
        b = neighbours(rows, indices, k, WIDTH)
        dx, ih = subtract(x, vector(b, 0, DIM)), 2.0 / (h + b[H])
        other = min(abs(body - b[BODY]), 1.0)
        phi += other * b[V] * scale(ih) / ih * shape(np.sqrt(dot(dx, dx)) * ih)
        mask = min(b[V] * 1e300, 1.0)  # no padding
        fold = elementwise_max(fold, mask * (1.0 - other) * was_outside_reach(dx, d, vector(b, D, DIM), reach2))
    write_rates(out, i, no_vector(DIM), lane_sum(phi), lane_max(fold), no_gradient(DIM))
