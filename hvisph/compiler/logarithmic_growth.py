"""Growth factor over a step of densities, lengths and thicknesses with a given logarithmic rate."""

from __future__ import annotations

from .jit import inline


@inline
def growth_factor(rate):
    """Return exp(rate) to second order, by a fraction that is positive for every admissible step."""
    return (1.0 + 0.5 * rate) / (1.0 - 0.5 * rate)
