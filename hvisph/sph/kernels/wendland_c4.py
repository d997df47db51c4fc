"""Wendland's C4 kernel (Wendland 1995): w = (1-q/2)+^6 (1 + 3q + 35/12 q^2), reaching to 2h.

As for C2, the function of three dimensions serves in all. It is the narrower of the two: its
accuracy asks for a larger h over the spacing.
"""

from __future__ import annotations

from math import pi

from hvisph.compiler.jit import inline

from .kernel import Kernel


@inline
def shape(q):
    """w(q)."""
    a = max(1.0 - 0.5 * q, 0.0)
    a *= a
    return a * a * a * (1.0 + q * (3.0 + (35.0 / 12.0) * q))


@inline
def slope(q):
    """w'(q)."""
    a = max(1.0 - 0.5 * q, 0.0)
    a2 = a * a
    return (-7.0 / 3.0) * q * (2.0 + 5.0 * q) * a * a2 * a2


WENDLAND_C4 = Kernel("wendland_c4", (27 / 32, 9 / (4 * pi), 495 / (256 * pi)), shape, slope)
