"""Particle row of Riemann SPH (`schemes.riemann.law`), and the pass that completes it before the pairs.

Gradients of velocity and stress, renormalised, for the reconstruction, and where bodies lie, for those that meet
(`sph.contact.contact_normal`).
"""

from __future__ import annotations

import numpy as np

from hvisph.compiler.tensors import (
    add,
    broadcast,
    dot,
    lane_sums,
    matrix,
    multiply,
    no_gradient,
    no_symmetric,
    no_symmetric_gradient,
    no_vector,
    outer,
    own_gradient,
    own_symmetric,
    own_vector,
    product,
    put,
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
from hvisph.sph.neighbours.particle_layout import RowLayout, select_fields
from hvisph.sph.terms.adjoint_operator import closed_moment, corrected_operator, extrapolated_stress
from hvisph.sph.terms.crack import crack_terms, crack_vector
from hvisph.sph.terms.shape_matrix import sound_inverse

# Where in the constants the tables of depths begin.
DEPTH_TABLE = 2
# Options of the pass, off unless bound.
RECONSTRUCTION = CORRECTED_VARIANT = SEPARATING = VARIABLE_RESOLUTION = FRACTURES = ADJOINT = EDGES = 0
# What passes write that all pairs read.
READ_BY_PAIRS = ("gu", "gt", "crack", "stage_t", "operator", "elastic")


def row_layout(dim: int, reconstruct: bool, consistent: bool = False, parted: bool = False,
               following: bool = False, revolved: bool = False, unlike: bool = False,
               faces: bool = False, spins: bool = False, leads: bool = False,
               anisotropic: bool = False, fractures: bool = False, adjoint: bool = False,
               turns: bool = False, edges: bool = False) -> RowLayout:  # fmt: skip
    """Return what a particle shows its neighbours; T is the stress, GU, GT are the gradients of U, T.

    TENSION_LIMIT and SHEAR_LIMIT are the tractions it bears, ENERGY its energy, LATTICE_ORDER o, SPIN_STRESS w,
    N_RAW, N_OTHER and
    N_SURFACE N, F and O of its body, N_PREVIOUS O as it was before, DEPTH how deep it lies in it, RING and HOOP
    radius and hoop
    stress of a ring, REST_AREA the area of its section at rest over h^2, INV_NUMBER_DENSITY 1 over the number of
    particles, Z_SQUARED the squares of the impedances by direction, CORRECTION_DECAY and DENSITY_RELAXATION at what
    rates lead and density go, SOFT the damage past the onset of fracture, CRACK where it lies (`sph.terms.crack`).
    GU_BEFORE is GU of the evaluation before, AHEAD_TWICE twice the time of the stage, STAGE_T the stress extrapolated
    to it, OPERATOR K, and ELASTIC the share with which K holds (`sph.terms.adjoint_operator`). TURN_RATE is the angular
    velocity of a rigid body, zero of others. AMBIENT is 1 in the layer beyond an open edge
    (`integrators.boundary_forces`).
    """
    return RowLayout(dim, select_fields(
        ("x", "vector"), ("u", "vector"), ("h", "scalar"), ("v", "scalar"), ("t", "symmetric"),
        parted and ("body", "scalar"), faces and ("n_previous", "vector"), ("zn", "scalar"), ("zt", "scalar"),
        anisotropic and ("z_squared", "symmetric"), edges and ("ambient", "scalar"),
        consistent and ("rho", "scalar"), consistent and ("shear_limit", "scalar"), spins and ("spin_stress", "axial"),
        turns and ("turn_rate", "axial"),
        consistent and ("energy", "scalar"), consistent and ("lattice_order", "scalar"), revolved and ("ring",
        "radius"), revolved and leads and ("rest_area", "scalar"),
 fractures and ("soft", "scalar"),
        consistent and ("tension_limit", "scalar"), ("m", "scalar"),  # pairs read neither m nor what follows
        adjoint and ("gu_before", "gradient"), adjoint and ("ahead_twice", "scalar"),
        following and ("free_length", "scalar"), revolved and ("hoop", "scalar"),
        leads and ("inv_number_density", "scalar"), leads and ("correction_decay", "scalar"), leads and
        ("density_relaxation", "scalar"),
    ), select_fields(
        reconstruct and ("gu", "gradient"), reconstruct and ("gt", "symmetric_gradient"), fractures and
        ("crack", "vector"),
        adjoint and ("stage_t", "symmetric"), adjoint and ("operator", "symmetric"), adjoint and ("elastic", "scalar"),
        parted and ("n_raw", "vector"), parted and ("n_other", "vector"), parted and ("n_surface", "vector"),
        unlike and ("depth", "scalar"),
    ))  # fmt: skip


def pair_layout(layout: RowLayout) -> RowLayout:
    """Return the first part of the row: the rest is read where bodies meet."""
    return RowLayout(layout.dim, layout.fields, tuple(field for field in layout.made if field[0] in READ_BY_PAIRS))


def contact_passes(layout: RowLayout, kernel: Kernel, unlike: bool, faces: bool = False) -> list[Pass]:
    """Return the passes behind `gradients` over what is near another body: its normals."""
    ways, parts = {"SELF_CONTACT": int(faces)}, (is_other_body,)
    first = [Pass(unequal_normals, layout, ways, parts, only="N_RAW", into_rows=True, skips=True)] if unlike else []
    reach = {"REACH2": kernel.reach**2}
    return [*first, Pass(smooth_normals, layout, ways | reach, parts, only="N_RAW", into_rows=True, skips=True)]


def gradients(near, n, rows, i, constants, out):
    """Write the renormalised gradients of velocity and stress into row `i`, and where bodies lie."""
    x, u, s, h = own_vector(rows, i, 0, DIM), own_vector(rows, i, U, DIM), own_symmetric(rows, i, T, DIM), rows[i, H]
    moment, of_u = broadcast(no_symmetric(DIM)), broadcast(no_gradient(DIM))
    of_s = broadcast(no_symmetric_gradient(DIM))
    fills, ends = broadcast(no_vector(DIM)), broadcast(no_vector(DIM))
    contact_moment = broadcast(no_symmetric(DIM))
    cracks, crack_sums = broadcast(no_vector(DIM)), (broadcast_lanes(0.0), broadcast_lanes(0.0))
    for k in range(np.uint64(0), n, np.uint64(LANES)):
        b = neighbours(rows, near, k, WIDTH)
        dx = subtract(vector(b, 0, DIM), x)
        r = np.sqrt(dot(dx, dx))
        ih = 2.0 / (h + b[H])
        g = multiply(-b[V] * scale(ih) * slope(r * ih) / r, dx)
        if SEPARATING:
            other = is_other_body(rows, i, b, dx)
            fills = add(fills, multiply(other, g))
            if ADJOINT:
                contact_moment = add(contact_moment, symmetric_outer(dx, multiply(other, g)))
            g = multiply(1.0 - other, g)
            ends = subtract(ends, g)
        if FRACTURES:
            cracks, crack_sums = crack_terms(cracks, crack_sums, b[SOFT], g)
        if RECONSTRUCTION:
            moment = add(moment, symmetric_outer(dx, g))
            if EDGES:  # the state goes on beyond an edge
                g = multiply(1.0 - b[AMBIENT], g)
            of_u = add(of_u, outer(subtract(vector(b, U, DIM), u), g))
            of_s = add(of_s, outer(subtract(symmetric(b, T, DIM), s), g))
    if SEPARATING:
        lacking = lane_sums(ends)
        put(out, i, N_SURFACE, lacking)
        if VARIABLE_RESOLUTION:
            out[i, DEPTH] = depth(lacking, h, constants[DEPTH_TABLE + (DIM - 1) * ENTRIES :])
        put(out, i, N_RAW, lane_sums(fills))
        put(out, i, N_OTHER, no_vector(DIM))
    if FRACTURES:
        put(out, i, CRACK, crack_vector(lane_sums(cracks), (lane_sum(crack_sums[0]), lane_sum(crack_sums[1]))))
    if RECONSTRUCTION:
        inverse, _ = sound_inverse(matrix(lane_sums(moment)))
        if CORRECTED_VARIANT and rows[i, LATTICE_ORDER] < 0.0:  # what has failed
            inverse = multiply(0.0, inverse)
        grad_u = product(lane_sums(of_u), inverse)
        put(out, i, GU, grad_u)
        if ADJOINT:
            moment = lane_sums(moment)
            if SEPARATING:
                moment = closed_moment(moment, lane_sums(contact_moment), lane_sums(fills), lacking)
            operator, share = corrected_operator(moment, rows[i, LATTICE_ORDER])
            put(out, i, OPERATOR, operator)
            out[i, ELASTIC] = share
            change = multiply(share, subtract(grad_u, own_gradient(rows, i, GU_BEFORE, DIM)))
            ahead = rows[i, AHEAD_TWICE]
            put(out, i, STAGE_T,
                extrapolated_stress(s, change, ahead, rows[i, ZN], rows[i, ZT], rows[i, V], rows[i, M]))  # fmt: skip
        put(out, i, GT, product(lane_sums(of_s), inverse))
