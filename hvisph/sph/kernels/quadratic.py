"""Quadratic kernel (Johnson, Stryk & Beissel 1996): w = 3/16 (2-q)+^2, reaching to 2h.

Its slope is largest at the centre and never turns: particles that come close keep repelling
each other, where splines let go. The price is a kink at q = 0.
"""

from __future__ import annotations

from math import pi

from hvisph.compiler.jit import inline

from .kernel import Kernel


@inline
def shape(q):
    """w(q)."""
    a = max(2.0 - q, 0.0)
    return 0.1875 * a * a


@inline
def slope(q):
    """w'(q)."""
    return -0.375 * max(2.0 - q, 0.0)


QUADRATIC = Kernel("quadratic", (1.0, 2 / pi, 5 / (4 * pi)), shape, slope)
