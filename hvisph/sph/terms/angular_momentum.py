"""Conservation of angular momentum: an antisymmetric stress that returns the torque of the pairs.

Tangential tractions act beside the line of centres and create angular momentum. Each particle adds up its share,

    m_a ds_a/dt = - sum r e x F/2 - V_a (tr B - B) w_a,     B = sum of the own body V_b |dW/dr| r e (x) e

half of the torque of its pairs and the torque that its own w returns. In the next step dt the pairs of the own body
carry (w_a + w_b) x e/2 beside t*, with w_a = rho_a s_a/(2 dt), equal and opposite in each pair. The work of w_a on
u_b - u_a belongs to a alone: a rigid rotation gains no heat. The torque of one step remains at any time.

s is set to zero where B cannot be inverted (`sph.terms.free_surface_correction.correctable`) in material that has
flowed, melted or failed: w would accelerate its fragments of few particles without limit. B of the corners of a solid
cannot be inverted either; solids that have not flowed keep s unless almost no neighbour is left (tr B/d below SINGULAR,
`sph.terms.shape_matrix`).

A step returns the share g of s, the mean of the two largest eigenvalues of B. It is 1 inside a body and more beside
neighbours of low density; above 2, s would grow from step to step. Above TORQUE_GAIN_MAX both terms are divided by an
upper bound of g (Wolkowicz & Styan 1980, Linear Algebra Appl. 29, 471), so that the next step returns all that remains.

Source: this code's own. Verification: `spinning_disc`, `random_collisions`.
"""

from __future__ import annotations

from math import sqrt

from hvisph.compiler.jit import inline
from hvisph.compiler.tensors import (
    add_identity,
    axial_cross,
    dot_rows,
    double_dot,
    inertia,
    matrix,
    mean_diagonal,
    multiply,
    subtract,
)

from .free_surface_correction import correctable
from .shape_matrix import SINGULAR

# Share returned in a step above which the rate of s is divided by it.
TORQUE_GAIN_MAX = 1.5


@inline
def spin_tractions(spin_a, spin_b, lever):
    """Return the tractions [Pa] of the antisymmetric stresses of both sides on the vector `lever`, e/2 or zero."""
    return axial_cross(spin_a, lever), axial_cross(spin_b, lever)


@inline
def torque_residual(pair_torque, moment, contact_moment, spin, order):
    """Return the rate of the torque that remains to be returned.

    `pair_torque`: half of the sum of r e x F of the pairs, negative: an axial vector
    `moment`, `contact_moment`: B, and the part of it that pairs with other bodies have
    `spin`: w
    `order`: lattice order, above zero in solids that have not flowed
    """
    inner, b = subtract(moment, contact_moment), matrix(moment)
    mean = mean_diagonal(matrix(inner))
    deviator = add_identity(inner, -mean)
    gain = mean + sqrt(double_dot(deviator, deviator) * (1.0 / 6.0))
    share = 1.0 / gain if gain > TORQUE_GAIN_MAX else 1.0
    residual = multiply(share, subtract(pair_torque, dot_rows(inertia(inner), spin)))
    is_returned = correctable(b) or (order > 0.0 and mean_diagonal(b) > SINGULAR)
    return residual if is_returned else multiply(-2.0, spin)
