"""Weights of pairs between bodies, and between Total Lagrangian and Eulerian particles.

    force     1 for two Eulerian particles, 0 for two Total Lagrangian ones of a body; of one of each 1/2 if they
              are each other's reference neighbours (the other half is their reference force), else 1
    gradient  1 within a body
    stress    artificial stress of a mixed pair: on both sides or on neither

All three are 0 between bodies that a contact algorithm separates.
"""

from __future__ import annotations

import numpy as np

from hvisph.compiler.tensors import dot, row_vector, subtract, vector

FIELDS = (("kind", "scalar"), ("body", "scalar"), ("d", "vector"))


def shares(rows, i, b, dx, reach2):
    """Return the three weights of the pairs of row `i` and the lanes `b` (template).

    Bound names: DIM, slots KIND, BODY and D (displacement from the reference position), CONTACT
    and STRESS_AT_INTERFACE (1.0 or 0.0). `dx` is x_a - x_b, `reach2` the square of the reference support [m^2].
    """
    mixed = abs(rows[i, KIND] - b[KIND])
    product = rows[i, KIND] * b[KIND]
    reference = subtract(dx, subtract(row_vector(rows, i, D, DIM), vector(b, D, DIM)))
    inside = max(np.copysign(1.0, reach2 - dot(reference, reference)), 0.0)
    other = min(abs(rows[i, BODY] - b[BODY]), 1.0)
    same = 1.0 - other
    gradient = 1.0 - CONTACT * other
    force = (1.0 - product * same) * (1.0 - 0.5 * mixed * inside * same) * gradient
    stress = 1.0 - (1.0 - STRESS_AT_INTERFACE) * mixed
    return force, gradient, stress


def separate_shares(rows, i, b, dx, reach2):
    """Return the three weights with contact and without Total Lagrangian particles (template)."""
    same = 1.0 - min(abs(rows[i, BODY] - b[BODY]), 1.0)
    return same, same, 1.0
