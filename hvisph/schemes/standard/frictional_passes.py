"""Particle passes between standard SPH and frictional contact: rows and added rates."""

from __future__ import annotations

import numpy as np

from hvisph.compiler.vector.prefetch import fetch_row

# Rows are asked for so many particles before they are needed.
AHEAD = 8


def contact_rows(k, rows, chosen, taken, packed):
    """Pack the rows of the `chosen` particles for contact: a template.

    `taken` are slots of contact and those of the standard law with the same in them; stresses (STRESSES from T on)
    want a factor of rho^2, and what has no mass is given one.
    """
    to, of = taken
    i = np.uint64(chosen[k])
    fetch_row(rows, np.uint64(chosen[min(k + np.uint64(AHEAD), np.uint64(chosen.shape[0] - 1))]), 0, rows.shape[1])
    rho, mass = rows[i, OF_RHO], rows[i, OF_M]
    for f in range(np.uint64(to.shape[0])):
        packed[k, np.uint64(to[f])] = rows[i, np.uint64(of[f])]
    for f in range(np.uint64(T), np.uint64(T + STRESSES)):
        packed[k, f] *= rho * rho
    packed[k, V] = mass * (1.0 / rho)
    packed[k, M] = mass if mass > 0.0 else 1.0


def add_contact(k, pushed, place, chosen, of_standard, rates):
    """Add the rates of contact, `pushed`, to those of standard SPH: a template.

    All of them add up but the largest |mu|, of which the larger stays, and the heat of slip, which is that of contact.
    Behind them stand ANGULAR_MOMENTUM numbers of the spin. `place` and `of_standard` say where the rates of the
    chosen particles, and those of all, stand.
    """
    mine, at = np.uint64(of_standard[np.uint64(chosen[k])]), np.uint64(place[k])
    before, closing = rates[mine, R_APPROACH], pushed[at, R_APPROACH]
    for f in range(np.uint64(R_GRADIENT + DIM * DIM)):
        rates[mine, f] += pushed[at, f]
    for f in range(np.uint64(R_SPIN), np.uint64(R_SPIN + ANGULAR_MOMENTUM)):
        rates[mine, f] += pushed[at, f]
    # what is no number stays seen
    rates[mine, R_APPROACH] = before if before > closing or before != before else closing
    rates[mine, R_SLIP] = pushed[at, R_SLIP]
