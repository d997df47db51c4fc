"""Conversion of isotropic elastic moduli."""

from __future__ import annotations


def bulk_modulus(young_modulus: float, poisson_ratio: float) -> float:
    """Return K = E / (3 (1 - 2 nu)) [Pa]."""
    return young_modulus / (3.0 * (1.0 - 2.0 * poisson_ratio))


def young_modulus(bulk_modulus: float, shear_modulus: float) -> float:
    """Return E = 9 K G / (3 K + G) [Pa], 0 of a fluid."""
    return 9.0 * bulk_modulus * shear_modulus / (3.0 * bulk_modulus + shear_modulus) if shear_modulus > 0.0 else 0.0
