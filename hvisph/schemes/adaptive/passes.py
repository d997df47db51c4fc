"""Passes over single particles between the two views of a composite body: its own rows, and the spatial pass's."""

from __future__ import annotations

import numpy as np

from hvisph.compiler.tensors import minus, no_axial, own_gradient, own_symmetric, own_vector, plus, put
from hvisph.compiler.tensors3d import from_plane
from hvisph.integrators.particle_records import Shown


def spatial_rows(k, rows, chosen, bodies, pressures, loads, coefficients, out):
    """Pack the rows of the `chosen` particles for the standard law: a template."""
    i = np.uint64(chosen[k])
    x = own_vector(rows, i, 0, DIM)
    put(out, k, TO_D, minus(x, own_vector(rows, i, X0, DIM)))
    out[k, TO_KIND] = rows[i, KIND]
    out[k, TO_BODY] = bodies[i]
    s, ring = from_plane(own_symmetric(rows, i, S, DIM)), 0.0
    if AXISYMMETRIC:
        s, ring = (s[0], s[1], -s[0] - s[1], s[3], 0.0, 0.0), rows[i, RING]
    write(out, k, coefficients, Shown(x, own_vector(rows, i, U, DIM), rows[i, M], rows[i, RHO], 0.0, rows[i, H],
                                      pressures[i] + loads[i], rows[i, C], 0.0, 0.0, s, bodies[i],
                                      ring, no_axial(DIM), 0.0))  # fmt: skip


def add_rates(k, spatial, place, chosen, eulerian, rates):
    """Add what the spatial pass made, `spatial`, to the `rates` of the `chosen` particles: a template.

    Accelerations and powers add up, of max|mu| the larger stays, and an Eulerian particle's velocity gradient
    is the spatial one.
    """
    i, at = np.uint64(chosen[k]), np.uint64(place[k])
    a = plus(own_vector(rates, i, R_ACCELERATION, DIM), own_vector(spatial, at, R_ACCELERATION, DIM))
    put(rates, i, R_ACCELERATION, a)
    rates[i, R_POWER] += spatial[at, R_POWER]
    rates[i, R_APPROACH] = max(rates[i, R_APPROACH], spatial[at, R_APPROACH])
    if eulerian[i] == 1:
        put(rates, i, R_GRADIENT, own_gradient(spatial, at, R_GRADIENT, DIM))
        if AXISYMMETRIC:
            rates[i, R_HOOP] = spatial[at, R_HOOP]
