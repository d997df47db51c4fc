"""Isotropic elastic moduli out of one another."""

from __future__ import annotations


def bulk_modulus(young_modulus: float, poisson_ratio: float) -> float:
    """Return K = E / (3 (1 - 2 nu)) [Pa]."""
    return young_modulus / (3.0 * (1.0 - 2.0 * poisson_ratio))
