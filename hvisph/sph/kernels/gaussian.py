"""Gaussian cut off at 3h: w = exp(-q^2) for q < 3 (Zisis 2013 eq. 11).

Normalised as the whole Gaussian, by 1/pi^(d/2), which is what is published: the cut takes
2.2e-5 of the integral in 1D, 1.2e-4 in 2D and 4.4e-4 in 3D.

The exponential is a polynomial of q^2/64, squared six times: the sums over neighbours stay
vectorised, which a call of the library's function would not allow.
"""

from __future__ import annotations

from math import pi

from hvisph.compiler.jit import inline
from hvisph.core import catalogues

from .kernel import Kernel

REACH = catalogues.REACH["gaussian"]


@inline
def shape(q):
    """w(q), to 1e-13 of its own size."""
    t = min(q, REACH)
    t *= t * (1.0 / 64.0)
    # Taylor's series of exp(-t): t is below 0.15, the first term left out below 1e-17.
    s = 1.0 - t * (1.0 / 10.0)
    s = 1.0 - t * (1.0 / 9.0) * s
    s = 1.0 - t * (1.0 / 8.0) * s
    s = 1.0 - t * (1.0 / 7.0) * s
    s = 1.0 - t * (1.0 / 6.0) * s
    s = 1.0 - t * (1.0 / 5.0) * s
    s = 1.0 - t * (1.0 / 4.0) * s
    s = 1.0 - t * (1.0 / 3.0) * s
    s = 1.0 - t * (1.0 / 2.0) * s
    s = 1.0 - t * s
    s *= s
    s *= s
    s *= s
    s *= s
    s *= s
    s *= s
    # 1 inside, 0 from the cut on, without a branch.
    return s * min(max((REACH - q) * 1e300, 0.0), 1.0)


@inline
def slope(q):
    """w'(q), without the jump at the cut."""
    return -2.0 * min(q, REACH) * shape(q)


GAUSSIAN = Kernel("gaussian", (pi**-0.5, 1 / pi, pi**-1.5), shape, slope)
