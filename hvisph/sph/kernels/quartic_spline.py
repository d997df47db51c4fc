"""Quartic spline M5 (Schoenberg 1946): w = (5/2-q)+^4 - 5 (3/2-q)+^4 + 10 (1/2-q)+^4, reaching to 2.5h."""

from __future__ import annotations

from math import pi

from hvisph.compiler.jit import inline

from .kernel import Kernel


@inline
def shape(q):
    """w(q)."""
    a = max(2.5 - q, 0.0)
    b = max(1.5 - q, 0.0)
    c = max(0.5 - q, 0.0)
    a *= a
    b *= b
    c *= c
    return a * a - 5.0 * b * b + 10.0 * c * c


@inline
def slope(q):
    """w'(q)."""
    a = max(2.5 - q, 0.0)
    b = max(1.5 - q, 0.0)
    c = max(0.5 - q, 0.0)
    return 20.0 * b * b * b - 4.0 * a * a * a - 40.0 * c * c * c


QUARTIC_SPLINE = Kernel("quartic_spline", (1 / 24, 96 / (1199 * pi), 1 / (20 * pi)), shape, slope)
