"""Kernel interpolation at a point: particles within the support and their weights."""

from __future__ import annotations

import numpy as np


def weigh(state, point, reach, rows, weights):
    """Find the particles whose kernels reach `point`: the template.

    Bound names: DIM, columns of the state (S_...) and `shape` of the kernel.

    Parameters
    ----------
    state
        Particles (n, width).
    point
        The place (dim,) [m].
    reach
        Support radius of the kernel over h.
    rows, weights
        Receive the particles and their weights V W, up to a common factor; room for all particles.

    Returns
    -------
    The number of particles found.
    """
    n = 0
    for s in range(state.shape[0]):
        h = state[s, S_SMOOTHING_LENGTH]
        square = 0.0
        volume = state[s, S_MASS] / state[s, S_DENSITY]
        for f in range(DIM):
            d = state[s, f] - point[f]
            square += d * d
            volume /= h
        if square < reach * reach * h * h:
            rows[n] = s
            weights[n] = volume * shape(np.sqrt(square) / h)
            n += 1
    return n
