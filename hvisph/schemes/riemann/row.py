"""Particle row of Riemann SPH (`schemes.riemann.law`), and the pass that completes it before the pairs.

The pass computes renormalised gradients of velocity and stress for the reconstruction, and sums for the contact normals
(`sph.contact.contact_normal`).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hvisph.compiler.tensors import (
    add,
    broadcast,
    dot,
    exact_difference,
    exact_vector,
    lane_sums,
    matrix,
    multiply,
    no_gradient,
    no_symmetric,
    no_symmetric_gradient,
    no_vector,
    outer,
    product,
    put,
    row_exact_vector,
    row_gradient,
    row_symmetric,
    subtract,
    symmetric,
    symmetric_outer,
    vector,
)
from hvisph.compiler.vector.api import LANES, broadcast_lanes, lane_sum, neighbours
from hvisph.sph.contact.contact_normal import is_other_body, smooth_normals
from hvisph.sph.contact.variable_resolution import ENTRIES, depth, unequal_normals
from hvisph.sph.kernels import Kernel
from hvisph.sph.neighbours.pairs import Pass
from hvisph.sph.neighbours.particle_layout import RowLayout
from hvisph.sph.terms.adjoint_operator import closed_moment, corrected_operator, extrapolated_stress
from hvisph.sph.terms.crack import crack_terms, crack_vector
from hvisph.sph.terms.shape_matrix import sound_inverse

from .pair_states import layer_share

# Index in the constants at which the tables of depths begin.
DEPTH_TABLE = 2
# Options of the pass, off unless bound.
RECONSTRUCTION = CORRECTED_VARIANT = SEPARATING = VARIABLE_RESOLUTION = FRACTURES = ADJOINT = EDGES = 0
# Slots of what rounding takes of position and velocity, in single precision.
X_REST = U_REST = 0
# Fields that passes write and all pairs read.
READ_BY_PAIRS = ("gu", "gt", "crack", "stage_t", "operator", "elastic")


# Fields of the row: name, rank, and the options of the scheme that all hold where the row has the field.
PACKED = (
    ("x", "vector"),
    ("u", "vector"),
    ("h", "scalar"),
    ("v", "scalar"),
    ("t", "symmetric"),
    ("body", "scalar", "has_contact"),
    ("n_previous", "vector", "self_contact"),
    ("zn", "scalar"),
    ("zt", "scalar"),
    ("z_squared", "symmetric", "anisotropic"),
    ("ambient", "vector", "edges"),
    ("rho", "scalar", "corrected_variant"),
    ("shear_limit", "scalar", "corrected_variant"),
    ("spin_stress", "axial", "angular_momentum"),
    ("turn_rate", "axial", "turns"),
    ("energy", "scalar", "corrected_variant"),
    ("lattice_order", "scalar", "corrected_variant"),
    ("ring", "radius", "axisymmetric"),
    ("rest_area", "scalar", "axisymmetric", "corrects_density"),
    ("soft", "scalar", "fractures"),
    ("tension_limit", "scalar", "corrected_variant"),
    ("compression", "scalar", "varies_smoothing"),
    ("m", "scalar"),  # pairs read neither m nor what follows
    ("gu_before", "gradient", "adjoint"),
    ("ahead_twice", "scalar", "adjoint"),
    ("following_share", "scalar", "varies_smoothing"),
    ("hoop", "scalar", "axisymmetric"),
    ("inv_number_density", "scalar", "corrects_density"),
    ("correction_decay", "scalar", "corrects_density"),
    ("density_relaxation", "scalar", "corrects_density"),
)
COMPUTED_BY_PASSES = (
    ("gu", "gradient", "reconstructs"),
    ("gt", "symmetric_gradient", "reconstructs"),
    ("crack", "vector", "fractures"),
    ("stage_t", "symmetric", "adjoint"),
    ("operator", "symmetric", "adjoint"),
    ("elastic", "scalar", "adjoint"),
    ("n_raw", "vector", "has_contact"),
    ("n_other", "vector", "has_contact"),
    ("n_surface", "vector", "has_contact"),
    ("depth", "scalar", "has_unequal_spacings"),
)


def row_layout(dim: int, has_option: Callable[[str], bool]) -> RowLayout:
    """Return the layout of the particle data that pairs read; `holds(name)` returns whether an option is on.

    X, U, H, V, T, M        position, velocity, smoothing length, volume, stress, mass
    ZN, ZT, Z_SQUARED       normal and shear impedance; squares of the normal impedance by direction
    RHO, ENERGY             density, specific internal energy
    TENSION_LIMIT, SHEAR_LIMIT, LATTICE_ORDER   limits of the tractions; order of the lattice
    SPIN_STRESS             antisymmetric stress that returns angular momentum
    BODY, N_RAW, N_OTHER, N_SURFACE, N_PREVIOUS, DEPTH  body; normals and depth (`sph.contact.contact_normal`)
    RING, HOOP, REST_AREA   radius, hoop stress, section area at rest over h^2 of an axisymmetric particle
    INV_NUMBER_DENSITY, CORRECTION_DECAY, DENSITY_RELAXATION    `sph.terms.density_correction`
    COMPRESSION             volumetric compression from the density at rest
    FOLLOWING_SHARE         1 where h follows density within its bounds
    SOFT, CRACK             damage past the onset of fracture, and its direction (`sph.terms.crack`)
    GU, GT, GU_BEFORE       gradients of U and T, gradient of U of the evaluation before
    AHEAD_TWICE, STAGE_T, OPERATOR, ELASTIC     `sph.terms.adjoint_operator`
    TURN_RATE, AMBIENT      angular velocity of a rigid body; in the layer beyond an open edge its outward normal
    """
    packed, computed = (
        tuple((name, rank) for name, rank, *options in fields if all(map(has_option, options)))
        for fields in (PACKED, COMPUTED_BY_PASSES)
    )
    return RowLayout(dim, packed, computed)


def pair_layout(layout: RowLayout) -> RowLayout:
    """Return the part of the row that all pairs read; pairs in contact read all of it."""
    return RowLayout(layout.dim, layout.fields, tuple(field for field in layout.computed if field[0] in READ_BY_PAIRS))


def contact_passes(layout: RowLayout, kernel: Kernel, unequal_spacings: bool, self_contact: bool = False) -> list[Pass]:
    """Return the passes after `gradients`: contact normals of particles near another body."""
    options, parts = {"SELF_CONTACT": int(self_contact)}, (is_other_body,)
    aslant = Pass(unequal_normals, layout, options, parts, only="N_RAW", into_rows=True, skips_undisturbed=True)
    first = [aslant] if unequal_spacings else []
    reach = {"REACH2": kernel.reach**2}
    return [
        *first,
        Pass(smooth_normals, layout, options | reach, parts, only="N_RAW", into_rows=True, skips_undisturbed=True),
    ]


def gradients(indices, n, rows, i, constants, out):
    """Write the renormalised gradients of velocity and stress, and the unsmoothed contact normals, into row `i`."""
    x, u = row_exact_vector(rows, i, 0, X_REST, DIM), row_exact_vector(rows, i, U, U_REST, DIM)
    s, h = row_symmetric(rows, i, T, DIM), rows[i, H]
    moment, u_sum = broadcast(no_symmetric(DIM)), broadcast(no_gradient(DIM))
    s_sum = broadcast(no_symmetric_gradient(DIM))
    raw_sum, surface_sum = broadcast(no_vector(DIM)), broadcast(no_vector(DIM))
    contact_moment = broadcast(no_symmetric(DIM))
    cracks, crack_sums = broadcast(no_vector(DIM)), (broadcast_lanes(0.0), broadcast_lanes(0.0))
    for k in range(np.uint64(0), n, np.uint64(LANES)):
        b = neighbours(rows, indices, k, WIDTH)
        dx = exact_difference(exact_vector(b, 0, X_REST, DIM), x, DIM)
        r = np.sqrt(dot(dx, dx))
        ih = 2.0 / (h + b[H])
        g = multiply(-b[V] * scale(ih) * slope(r * ih) / r, dx)
        if SEPARATING:
            other = is_other_body(rows, i, b, dx)
            raw_sum = add(raw_sum, multiply(other, g))
            if ADJOINT:
                contact_moment = add(contact_moment, symmetric_outer(dx, multiply(other, g)))
            g = multiply(1.0 - other, g)
            surface_sum = subtract(surface_sum, g)
        if FRACTURES:
            cracks, crack_sums = crack_terms(cracks, crack_sums, b[SOFT], g)
        if RECONSTRUCTION:
            moment = add(moment, symmetric_outer(dx, g))
            if EDGES:  # the state is uniform beyond an edge
                g = multiply(1.0 - layer_share(vector(b, AMBIENT, DIM)), g)
            u_sum = add(u_sum, outer(exact_difference(exact_vector(b, U, U_REST, DIM), u, DIM), g))
            s_sum = add(s_sum, outer(subtract(symmetric(b, T, DIM), s), g))
    if SEPARATING:
        n_surface = lane_sums(surface_sum)
        put(out, i, N_SURFACE, n_surface)
        if VARIABLE_RESOLUTION:
            out[i, DEPTH] = depth(n_surface, h, constants[DEPTH_TABLE + (DIM - 1) * ENTRIES :])
        put(out, i, N_RAW, lane_sums(raw_sum))
        put(out, i, N_OTHER, no_vector(DIM))
    if FRACTURES:
        put(out, i, CRACK, crack_vector(lane_sums(cracks), (lane_sum(crack_sums[0]), lane_sum(crack_sums[1]))))
    if RECONSTRUCTION:
        inverse, _ = sound_inverse(matrix(lane_sums(moment)))
        if CORRECTED_VARIANT and rows[i, LATTICE_ORDER] < 0.0:  # failed particles
            inverse = multiply(0.0, inverse)
        grad_u = product(lane_sums(u_sum), inverse)
        put(out, i, GU, grad_u)
        if ADJOINT:
            moment = lane_sums(moment)
            if SEPARATING:
                moment = closed_moment(moment, lane_sums(contact_moment), lane_sums(raw_sum), n_surface)
            operator, share = corrected_operator(moment, rows[i, LATTICE_ORDER])
            put(out, i, OPERATOR, operator)
            out[i, ELASTIC] = share
            change = multiply(share, subtract(grad_u, row_gradient(rows, i, GU_BEFORE, DIM)))
            dt_2 = rows[i, AHEAD_TWICE]
            put(out, i, STAGE_T,
                extrapolated_stress(s, change, dt_2, rows[i, ZN], rows[i, ZT], rows[i, V], rows[i, M]))  # fmt: skip
        put(out, i, GT, product(lane_sums(s_sum), inverse))
