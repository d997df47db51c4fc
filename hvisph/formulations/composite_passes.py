"""Passes over single particles between the two views of a composite body: its own rows, and the spatial pass's."""

from __future__ import annotations

import numpy as np

from hvisph.core.jit import prange

CHUNK = 256


def spatial_rows(rows, chosen, bodies, pressures, loads, coefficients, out):
    """Pack the rows of the `chosen` particles for the standard law: a template."""
    count = np.uint64(chosen.shape[0])
    for chunk in prange((count + np.uint64(CHUNK - 1)) // np.uint64(CHUNK)):
        first = np.uint64(chunk) * np.uint64(CHUNK)
        for k in range(first, min(first + np.uint64(CHUNK), count)):
            i = np.uint64(chosen[k])
            out[k, 0] = rows[i, 0]
            out[k, TO_D] = rows[i, 0] - rows[i, X0]
            v = w = s_yy = s_zz = s_xy = s_xz = s_yz = 0.0
            if DIM > 1:
                out[k, 1] = rows[i, 1]
                out[k, TO_D + 1] = rows[i, 1] - rows[i, X0 + 1]
                v, s_yy, s_xy = rows[i, U + 1], rows[i, S + 1], rows[i, S + DIM]
            if DIM > 2:
                out[k, 2] = rows[i, 2]
                out[k, TO_D + 2] = rows[i, 2] - rows[i, X0 + 2]
                w, s_zz, s_xz, s_yz = rows[i, U + 2], rows[i, S + 2], rows[i, S + 4], rows[i, S + 5]
            out[k, TO_KIND] = rows[i, KIND]
            out[k, TO_BODY] = bodies[i]
            write(out, k, coefficients, rows[i, U], v, w, rows[i, M], rows[i, RHO], 0.0, rows[i, H],
                  pressures[i] + loads[i], rows[i, C], 0.0, 0.0, rows[i, S], s_yy, s_zz, s_xy, s_xz, s_yz)  # fmt: skip


def add_rates(found, place, chosen, eulerian, rates):
    """Add what the spatial pass `found` to the `rates` of the `chosen` particles: a template.

    Accelerations and powers add up, of max|mu| the larger stays, and an Eulerian particle's velocity gradient
    is the spatial one.
    """
    count = np.uint64(chosen.shape[0])
    for chunk in prange((count + np.uint64(CHUNK - 1)) // np.uint64(CHUNK)):
        first = np.uint64(chunk) * np.uint64(CHUNK)
        for k in range(first, min(first + np.uint64(CHUNK), count)):
            i, at = np.uint64(chosen[k]), np.uint64(place[k])
            for slot in range(np.uint64(DIM + 1)):
                rates[i, slot] += found[at, slot]
            rates[i, DIM + 1] = max(rates[i, DIM + 1], found[at, DIM + 1])
            if eulerian[i] == 1:
                for slot in range(np.uint64(DIM + 2), np.uint64(DIM + 2 + DIM * DIM)):
                    rates[i, slot] = found[at, slot]
