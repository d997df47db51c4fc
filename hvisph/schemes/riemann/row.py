"""The row of contact SPH (`schemes.riemann.law`), and the pass before its pairs that writes into it.

Gradients of velocity and stress, renormalised, for the reconstruction, and where bodies lie, for those that meet
(`sph.contact.contact_normal`).
"""

from __future__ import annotations

import numpy as np

from hvisph.compiler.tensors import (
    dot,
    matrix,
    minus,
    no_gradient,
    no_symmetric,
    no_symmetric_gradient,
    no_vector,
    outer,
    own_symmetric,
    own_vector,
    plus,
    product,
    put,
    spread,
    symmetric,
    symmetric_outer,
    times,
    totals,
    vector,
)
from hvisph.compiler.vector.api import LANES, neighbours
from hvisph.sph.contact.contact_normal import of_other, smooth
from hvisph.sph.contact.variable_resolution import ENTRIES, depth, facing
from hvisph.sph.kernels import Kernel
from hvisph.sph.neighbours.pairs import Pass
from hvisph.sph.neighbours.particle_layout import RowLayout, those
from hvisph.sph.terms.shape_matrix import sound_inverse

# Where in the constants the tables of depths begin.
DEPTH_TABLE = 2
# Options of the pass, off unless bound.
RECONSTRUCTION = CONSISTENT = PARTED = UNLIKE = 0


def row_layout(dim: int, reconstruct: bool, consistent: bool = False, parted: bool = False,
               following: bool = False, revolved: bool = False, unlike: bool = False,
               faces: bool = False, spins: bool = False, leads: bool = False) -> RowLayout:  # fmt: skip
    """Return what a particle shows its neighbours; T is the stress, GU, GT are the gradients of U, T.

    BEAR and SHEAR are the tractions it bears, HEAT its energy, ORDER o, TWIST w, ROUGH, FILLS and
    ENDS N, F and O of its body, FACE O as it was before, DEPTH how deep it lies in it, RING and HOOP radius and hoop
    stress of a ring, REST the area of its section at rest over h^2, COUNTS 1 over the number of particles, FADES and
    LEAVES at what rates lead and density go.
    """
    return RowLayout(dim, those(
        ("x", "vector"), ("u", "vector"), ("h", "scalar"), ("v", "scalar"), ("t", "symmetric"),
        parted and ("body", "scalar"), faces and ("face", "vector"), ("zn", "scalar"), ("zt", "scalar"),
        consistent and ("rho", "scalar"), consistent and ("shear", "scalar"), spins and ("twist", "axial"),
        consistent and ("heat", "scalar"), consistent and ("order", "scalar"), revolved and ("ring", "radius"),
        revolved and leads and ("rest", "scalar"),
        consistent and ("bear", "scalar"), ("m", "scalar"),  # pairs read neither m nor what follows
        following and ("grows", "scalar"), revolved and ("hoop", "scalar"),
        leads and ("counts", "scalar"), leads and ("fades", "scalar"), leads and ("leaves", "scalar"),
    ), those(
        reconstruct and ("gu", "gradient"), reconstruct and ("gt", "symmetric_gradient"),
        parted and ("rough", "vector"), parted and ("fills", "vector"), parted and ("ends", "vector"),
        unlike and ("depth", "scalar"),
    ))  # fmt: skip


def read_by_all(layout: RowLayout) -> RowLayout:
    """Return the first part of the row: the rest is read where bodies meet."""
    return RowLayout(layout.dim, layout.fields, tuple(field for field in layout.made if field[0] in ("gu", "gt")))


def of_those_that_meet(layout: RowLayout, kernel: Kernel, unlike: bool, faces: bool = False) -> list[Pass]:
    """Return the passes behind `gradients` over what is near another body: its normals."""
    ways, parts = {"FACES": int(faces)}, (of_other,)
    first = [Pass(facing, layout, ways, parts, only="ROUGH", into_rows=True)] if unlike else []
    reach = {"REACH2": kernel.reach**2}
    return [*first, Pass(smooth, layout, ways | reach, parts, only="ROUGH", into_rows=True)]


def gradients(near, n, rows, i, constants, out):
    """Write the renormalised gradients of velocity and stress into row `i`, and where bodies lie."""
    x, u, s, h = own_vector(rows, i, 0, DIM), own_vector(rows, i, U, DIM), own_symmetric(rows, i, T, DIM), rows[i, H]
    moment, of_u = spread(no_symmetric(DIM)), spread(no_gradient(DIM))
    of_s = spread(no_symmetric_gradient(DIM))
    fills, ends = spread(no_vector(DIM)), spread(no_vector(DIM))
    for k in range(np.uint64(0), n, np.uint64(LANES)):
        b = neighbours(rows, near, k, WIDTH)
        dx = minus(vector(b, 0, DIM), x)
        r = np.sqrt(dot(dx, dx))
        ih = 2.0 / (h + b[H])
        g = times(-b[V] * scale(ih) * slope(r * ih) / r, dx)
        if PARTED:
            other = of_other(rows, i, b, dx)
            fills = plus(fills, times(other, g))
            g = times(1.0 - other, g)
            ends = minus(ends, g)
        if RECONSTRUCTION:
            moment = plus(moment, symmetric_outer(dx, g))
            of_u = plus(of_u, outer(minus(vector(b, U, DIM), u), g))
            of_s = plus(of_s, outer(minus(symmetric(b, T, DIM), s), g))
    if PARTED:
        lacking = totals(ends)
        put(out, i, ENDS, lacking)
        if UNLIKE:
            out[i, DEPTH] = depth(lacking, h, constants[DEPTH_TABLE + (DIM - 1) * ENTRIES :])
        put(out, i, ROUGH, totals(fills))
        put(out, i, FILLS, no_vector(DIM))
    if RECONSTRUCTION:
        inverse, _ = sound_inverse(matrix(totals(moment)))
        if CONSISTENT and rows[i, ORDER] < 0.0:  # what has failed
            inverse = times(0.0, inverse)
        put(out, i, GU, product(totals(of_u), inverse))
        put(out, i, GT, product(totals(of_s), inverse))
