"""Velocity gradient and density rate in incomplete neighbourhoods: free faces, edges and corners.

    B = sum_b V_b |dW/dr| r e (x) e,    K = B^-1,    w = clip((0.95 - det B)/0.2, 0, 1) max(0, 1 - 20 mu/c_l)
    L <- L (1 + w (K - 1)),             div <- (1 - w) div + w tr L

mu is the largest closing speed of the particle with a neighbour. Inside a body B is the identity up to the error of the
lattice, and the plain sums stay: density then follows the number density. The same holds for material without tensile
strength, a gas or a failed solid, which separates where it expands, and in shock fronts, where the lattice is uneven.

Source: Bonet & Lok 1999 (renormalisation); the blend is this code's own. Verification: linear fields at faces and
corners, `implosion` (strain of the free face).
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

# Determinant of B below which the correction begins, and its range to the full correction.
WHOLE, RANGE = 0.95, 0.2
# Determinant of B, to the power of 1 over the dimensions, below which B has no sound inverse.
SOUND = 0.4
# A closing speed of this share of the speed of sound is a front.
FRONT = 0.05


@inline
def correctable(moment):
    """Return whether B, row by row, determines a gradient; a chain of particles or a small fragment does not."""
    return determinant(moment) > power_of_dimension(SOUND, moment)


@inline
def free_surface_correction(l, rate, moment, calm, bear):
    """Return the velocity gradient and the rate of volume, corrected as the neighbourhood is open.

    Parameters
    ----------
    l, rate
        Sums of the velocity gradient, row by row, and of the rate of volume [1/s].
    moment
        B, row by row.
    calm
        1 where nothing closes, 0 in a shock front, max(0, 1 - 20 mu/c_l).
    bear
        Largest tension that the particle bears [Pa].
    """
    if not (bear > 0.0 and correctable(moment)):
        return l, rate
    size = determinant(moment)
    opened = min(max((WHOLE - size) / RANGE, 0.0), 1.0) * calm
    change = subtract(multiply(1.0 / size, adjugate(moment)), identity(moment))
    l = add(l, multiply(opened, product(l, change)))
    return l, (1.0 - opened) * rate + opened * divergence(l)
