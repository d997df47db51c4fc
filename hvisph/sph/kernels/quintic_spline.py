"""Quintic spline M6 (Schoenberg 1946): w = (3-q)+^5 - 6 (2-q)+^5 + 15 (1-q)+^5, reaching to 3h."""

from __future__ import annotations

from math import pi

from hvisph.compiler.jit import inline

from .kernel import Kernel


@inline
def shape(q):
    """w(q)."""
    a = max(3.0 - q, 0.0)
    b = max(2.0 - q, 0.0)
    c = max(1.0 - q, 0.0)
    a2 = a * a
    b2 = b * b
    c2 = c * c
    return a * a2 * a2 - 6.0 * b * b2 * b2 + 15.0 * c * c2 * c2


@inline
def slope(q):
    """w'(q)."""
    a = max(3.0 - q, 0.0)
    b = max(2.0 - q, 0.0)
    c = max(1.0 - q, 0.0)
    a *= a
    b *= b
    c *= c
    return 30.0 * b * b - 5.0 * a * a - 75.0 * c * c


QUINTIC_SPLINE = Kernel("quintic_spline", (1 / 120, 7 / (478 * pi), 1 / (120 * pi)), shape, slope)
