"""Smoothing kernels in one, two and three dimensions.

    W(r, h) = norm_d / h^d w(q),   q = r / h,   support radius `reach` h

The compiled functions give the shape w(q) and its derivative, both without branches so that loops
over neighbours stay vectorised, and both 0 beyond the support.
"""

from __future__ import annotations

from .cubic_spline import CUBIC_SPLINE
from .gaussian import GAUSSIAN
from .kernel import Kernel, scale
from .quadratic import QUADRATIC
from .quartic_spline import QUARTIC_SPLINE
from .quintic_spline import QUINTIC_SPLINE
from .wendland_c2 import WENDLAND_C2
from .wendland_c4 import WENDLAND_C4

KERNELS = {
    kernel.name: kernel
    for kernel in (
        CUBIC_SPLINE, QUADRATIC, QUARTIC_SPLINE, QUINTIC_SPLINE, GAUSSIAN, WENDLAND_C2, WENDLAND_C4,
    )
}  # fmt: skip

__all__ = ["CUBIC_SPLINE", "KERNELS", "Kernel", "scale"]
