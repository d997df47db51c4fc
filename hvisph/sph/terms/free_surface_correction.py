"""Velocity gradient and density rate in incomplete neighbourhoods: free faces, edges and corners.

    B = sum_b V_b |dW/dr| r e (x) e,    K = B^-1,    w = clip((0.95 - det B)/0.2, 0, 1) max(0, 1 - 20 mu/c_l)
    L <- L (1 + w (K - 1)),             div <- (1 - w) div + w tr L

Inside a body B is the identity up to the error of the lattice, and the plain sums keep density and number density
equal. Material without tensile strength (gas, failed solid) has no correction: it separates where it expands. In a
shock front, where particles close at the speed mu, the neighbourhood is non-uniform, not incomplete.
"""

from __future__ import annotations

from hvisph.compiler.jit import inline
from hvisph.compiler.tensors import (
    add,
    adjugate,
    determinant,
    divergence,
    identity,
    multiply,
    power_of_dimension,
    product,
    subtract,
)

# Determinant of B below which the correction begins, and the range below it over which it grows to its full share.
CORRECTION_ONSET, CORRECTION_RANGE = 0.95, 0.2
# Below this to the power of the dimensions det B is that of chains and fragments. B is positive, so that its mean
# diagonal is no less than the root of det B.
CORRECTABLE_MIN = 0.4


@inline
def correctable(moment):
    """Return whether B, row by row, can be inverted: it is nearly singular in chains and fragments of few particles."""
    return determinant(moment) > power_of_dimension(CORRECTABLE_MIN, moment)


@inline
def free_surface_correction(l, rate, moment, smooth, tension_limit):
    """Return the velocity gradient and the rate of volume, corrected as the neighbourhood is open.

    `l`, `rate`: sums of the velocity gradient, row by row, and of the rate of volume [1/s]
    `moment`: B, row by row
    `smooth`: 1 where nothing closes, 0 in a shock front, max(0, 1 - 20 mu/c_l)
    `tension_limit`: largest tension of the particle [Pa]
    """
    if not (tension_limit > 0.0 and correctable(moment)):
        return l, rate
    size = determinant(moment)
    opened = min(max((CORRECTION_ONSET - size) / CORRECTION_RANGE, 0.0), 1.0) * smooth
    change = subtract(multiply(1.0 / size, adjugate(moment)), identity(moment))
    l = add(l, multiply(opened, product(l, change)))
    return l, (1.0 - opened) * rate + opened * divergence(l)
