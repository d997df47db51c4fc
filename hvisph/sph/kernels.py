"""Smoothing kernels in one, two and three dimensions.

    W(r, h) = norm_d / h^d w(q),   q = r / h,   support radius `reach` h

The compiled functions give the shape w(q) and its derivative divided by q, both
without branches so that loops over neighbours stay vectorised; w'(q)/q is finite
for every q that two distinct particles can have, and 0 beyond the support.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from hvisph.core.jit import compiled


@compiled
def _cubic_shape(q):
    a = max(2.0 - q, 0.0)
    b = max(1.0 - q, 0.0)
    return 0.25 * a * a * a - b * b * b


@compiled
def _cubic_slope(q):
    a = max(2.0 - q, 0.0)
    b = max(1.0 - q, 0.0)
    return 3.0 * b * b - 0.75 * a * a


@dataclass(frozen=True)
class Kernel:
    """A kernel family.

    Parameters
    ----------
    name
        Name in case files.
    reach
        Support radius over h.
    norms
        Normalisation in 1D, 2D and 3D, so that the kernel integrates to 1.
    shape, slope
        Compiled w(q) and w'(q).
    """

    name: str
    reach: float
    norms: tuple[float, float, float]
    shape: Any
    slope: Any

    def norm(self, dim: int) -> float:
        """Return the normalisation for `dim` dimensions."""
        return self.norms[dim - 1]

    def value(self, r: float, h: float, dim: int) -> float:
        """Return W(r, h) [1/m^dim], in plain Python."""
        return self.norm(dim) / h**dim * self.shape.py_func(r / h)

    def derivative(self, r: float, h: float, dim: int) -> float:
        """Return dW/dr [1/m^(dim+1)], in plain Python."""
        return self.norm(dim) / h ** (dim + 1) * self.slope.py_func(r / h)


CUBIC_SPLINE = Kernel("cubic_spline", 2.0, (2 / 3, 10 / (7 * math.pi), 1 / math.pi), _cubic_shape, _cubic_slope)

KERNELS = {kernel.name: kernel for kernel in (CUBIC_SPLINE,)}
