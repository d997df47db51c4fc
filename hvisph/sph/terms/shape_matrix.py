"""Inverse of the shape matrix sum_b V_b (x_b - x_a) (x) grad W, regularized where it is ill-conditioned.

Inside a body the matrix is near the identity. Where its determinant is below SINGULAR times that of an isotropic matrix
of the same trace (one or two neighbours, or a chain), or its trace is below SINGULAR, the identity takes the place of
the inverse.
"""

from __future__ import annotations

from hvisph.compiler.jit import inline
from hvisph.compiler.tensors import adjugate, determinant, identity, mean_diagonal, multiply, power_of_dimension

SINGULAR = 0.05


@inline
def sound_inverse(m):
    """Return the inverse of the shape matrix `m`, row by row, and True; the identity and False where none is sound."""
    mean, size = mean_diagonal(m), determinant(m)
    if mean > SINGULAR and size > SINGULAR * power_of_dimension(mean, m):
        return multiply(1.0 / size, adjugate(m)), True
    return identity(m), False
