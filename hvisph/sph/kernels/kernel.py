"""Kernel family: shape, slope, support and normalization."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from hvisph.core.catalogues import REACH


def scale(inverse_h):
    """Return norm_d / h^(d + 1), the factor of w'(q) in dW/dr (template with the free names NORM and DIM)."""
    power = inverse_h * inverse_h
    if DIM > 1:
        power = power * inverse_h
    if DIM > 2:
        power = power * inverse_h
    return NORM * power


@dataclass(frozen=True)
class Kernel:
    """Kernel family: name, normalization in 1D, 2D and 3D, compiled shape w(q) and slope w'(q)."""

    name: str
    norms: tuple[float, float, float]
    shape: Any
    slope: Any

    @cached_property
    def reach(self) -> float:
        """Support radius over h."""
        return REACH[self.name]

    @property
    def width(self) -> float:
        """Standard deviation of W in one dimension over that of the cubic spline of the same h."""
        return round(_deviation(self) / _CUBIC_DEVIATION, 3)

    def norm(self, dim: int) -> float:
        """Return the normalisation for `dim` dimensions."""
        return self.norms[dim - 1]

    def value(self, r: float, h: float, dim: int) -> float:
        """Return W(r, h) [1/m^dim], in plain Python."""
        return self.norm(dim) / h**dim * self.shape.py_func(r / h)

    def derivative(self, r: float, h: float, dim: int) -> float:
        """Return dW/dr [1/m^(dim+1)], in plain Python."""
        return self.norm(dim) / h ** (dim + 1) * self.slope.py_func(r / h)

    def layers(self, h_over_dx: float, dim: int, dx: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
        """Return the distances (layers,) and positions (places,) of lattice layers within the support."""
        last = int(self.reach * h_over_dx) + 1
        side = np.arange(-last, last + 1) * dx
        aside = np.sqrt(sum(np.meshgrid(*[side**2] * (dim - 1)), np.zeros(1)).ravel()) if dim > 1 else np.zeros(1)
        return np.arange(last + 1) * dx, aside


# Of the cubic spline, the kernel of which steps of 0.3 h/c are usual.
_CUBIC_DEVIATION = 3.0**-0.5


def _deviation(kernel: Kernel) -> float:
    """Return the standard deviation of W over h, in one dimension."""
    q = np.linspace(0.0, kernel.reach, 2001)
    w = np.array([kernel.shape.py_func(float(each)) for each in q])
    return float(np.sqrt((q * q * w).sum() / (w.sum() - 0.5 * w[0])))
