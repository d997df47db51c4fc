"""Growth over a step, for densities, lengths and thicknesses that follow a rate of their logarithm."""

from __future__ import annotations

from .jit import compiled


@compiled
def grown(rate):
    """Return exp(rate) to second order, by a fraction that is positive for every step that a criterion allows."""
    return (1.0 + 0.5 * rate) / (1.0 - 0.5 * rate)
