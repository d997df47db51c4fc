"""Cubic spline M4 (Monaghan & Lattanzio 1985): w = (2-q)+^3/4 - (1-q)+^3, reaching to 2h."""

from __future__ import annotations

from math import pi

from hvisph.compiler.jit import inline

from .kernel import Kernel


@inline
def shape(q):
    """w(q)."""
    a = max(2.0 - q, 0.0)
    b = max(1.0 - q, 0.0)
    return 0.25 * a * a * a - b * b * b


@inline
def slope(q):
    """w'(q)."""
    a = max(2.0 - q, 0.0)
    b = max(1.0 - q, 0.0)
    return 3.0 * b * b - 0.75 * a * a


CUBIC_SPLINE = Kernel("cubic_spline", (2 / 3, 10 / (7 * pi), 1 / pi), shape, slope)
