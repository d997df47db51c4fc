"""Cracks between particles: traction of intact particles across softened ones.

    c_a = sum_b d_b g_ab (sum_b d_b^2 |g_ab|)/(sum_b d_b |g_ab|)^2,   g_ab = V_b |dW/dr| e
    t   <- t (1 - max(min(c_a . e, -c_b . e), 0))                     tension and shear of the pair a, b

c points towards softened material; its length is the mean damage there. A pair with softened material between its sides
spans the crack: its traction is that of the crack (Hillerborg's fictitious crack).
"""

from __future__ import annotations

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.compiler.tensors import add, dot, multiply

# Damage of both sides at which neither is soft.
SOFTENING_ONSET = 1e-12
# Stands for no limit [Pa].
UNLIMITED = 1e300


@inline
def crack_terms(cracks, sums, soft, g):
    """Add a neighbour of damage `soft` past onset to the sums of `crack_vector`."""
    weight = soft * np.sqrt(dot(g, g))
    return add(cracks, multiply(soft, g)), (sums[0] + weight, sums[1] + soft * weight)


@inline
def crack_vector(cracks, sums):
    """Return c, zero without softened neighbours, from the sums over d g, d |g| and d^2 |g|."""
    return multiply(sums[1] / (sums[0] * sums[0]) if sums[0] > 0.0 else 0.0, cracks)


@inline
def softened_bound(t, soft):
    """Return the largest traction [Pa] of a pair with a side of traction `t`, of damage `soft` past onset."""
    return max(t, 0.0) + UNLIMITED * (1.0 - min(soft / SOFTENING_ONSET, 1.0))


@inline
def unbroken_share(c_a, c_b, e):
    """Return the factor of tension and shear of a pair along `e`, from c of both sides."""
    return 1.0 - max(min(dot(c_a, e), -dot(c_b, e)), 0.0)
