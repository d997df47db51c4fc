"""Wendland's C2 kernel (Wendland 1995): w = (1-q/2)+^4 (1+2q), reaching to 2h.

The function that is positive definite in up to three dimensions serves in one and two as well: a
positive Fourier transform keeps particles from pairing.
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
    return a * a * (1.0 + 2.0 * q)


@inline
def slope(q):
    """w'(q)."""
    a = max(1.0 - 0.5 * q, 0.0)
    return -5.0 * q * a * a * a


WENDLAND_C2 = Kernel("wendland_c2", (3 / 4, 7 / (4 * pi), 21 / (16 * pi)), shape, slope)
