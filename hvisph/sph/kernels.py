"""Smoothing kernels in one, two and three dimensions.

    W(r, h) = norm_d / h^d w(q),   q = r / h,   support radius `reach` h

The compiled functions give the shape w(q) and its derivative, both without branches so that loops over neighbours stay
vectorised, and both 0 beyond the support.

Splines M4 (Monaghan & Lattanzio 1985), M5 and M6 (Schoenberg 1946); quadratic (Johnson, Stryk & Beissel 1996); Gaussian
(Zisis 2013 eq. 11); C2 and C4 (Wendland 1995).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import pi

import numpy as np

from hvisph.compiler.jit import CompiledFunction, inline
from hvisph.core.catalogues import REACH

# Standard deviation of the cubic spline over h.
_CUBIC_DEVIATION = 3.0**-0.5
_CUT = REACH["gaussian"]
STEEP = 1e300  # slope of a step


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
    shape: CompiledFunction
    slope: CompiledFunction

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
        lateral = np.sqrt(sum(np.meshgrid(*[side**2] * (dim - 1)), np.zeros(1)).ravel()) if dim > 1 else np.zeros(1)
        return np.arange(last + 1) * dx, lateral


def _deviation(kernel: Kernel) -> float:
    """Return the standard deviation of W over h, in one dimension."""
    q = np.linspace(0.0, kernel.reach, 2001)
    w = np.array([kernel.shape.py_func(float(r)) for r in q])
    return float(np.sqrt((q * q * w).sum() / (w.sum() - 0.5 * w[0])))


@inline
def cubic_spline_shape(q):
    """Return w(q) of the cubic spline M4: (2-q)+^3/4 - (1-q)+^3, reaching to 2h."""
    a = max(2.0 - q, 0.0)
    b = max(1.0 - q, 0.0)
    return 0.25 * a * a * a - b * b * b


@inline
def cubic_spline_slope(q):
    """Return w'(q)."""
    a = max(2.0 - q, 0.0)
    b = max(1.0 - q, 0.0)
    return 3.0 * b * b - 0.75 * a * a


@inline
def quartic_spline_shape(q):
    """Return w(q) of the quartic spline M5: (5/2-q)+^4 - 5 (3/2-q)+^4 + 10 (1/2-q)+^4, reaching to 2.5h."""
    a = max(2.5 - q, 0.0)
    b = max(1.5 - q, 0.0)
    c = max(0.5 - q, 0.0)
    a *= a
    b *= b
    c *= c
    return a * a - 5.0 * b * b + 10.0 * c * c


@inline
def quartic_spline_slope(q):
    """Return w'(q)."""
    a = max(2.5 - q, 0.0)
    b = max(1.5 - q, 0.0)
    c = max(0.5 - q, 0.0)
    return 20.0 * b * b * b - 4.0 * a * a * a - 40.0 * c * c * c


@inline
def quintic_spline_shape(q):
    """Return w(q) of the quintic spline M6: (3-q)+^5 - 6 (2-q)+^5 + 15 (1-q)+^5, reaching to 3h."""
    a = max(3.0 - q, 0.0)
    b = max(2.0 - q, 0.0)
    c = max(1.0 - q, 0.0)
    a2 = a * a
    b2 = b * b
    c2 = c * c
    return a * a2 * a2 - 6.0 * b * b2 * b2 + 15.0 * c * c2 * c2


@inline
def quintic_spline_slope(q):
    """Return w'(q)."""
    a = max(3.0 - q, 0.0)
    b = max(2.0 - q, 0.0)
    c = max(1.0 - q, 0.0)
    a *= a
    b *= b
    c *= c
    return 30.0 * b * b - 5.0 * a * a - 75.0 * c * c


@inline
def quadratic_shape(q):
    """Return w(q) of the quadratic kernel: 3/16 (2-q)+^2, reaching to 2h.

    Its slope is largest at the centre: particles that come close repel each other more strongly, where the slope of a
    spline vanishes. The price is a kink at q = 0.
    """
    a = max(2.0 - q, 0.0)
    return 0.1875 * a * a


@inline
def quadratic_slope(q):
    """Return w'(q)."""
    return -0.375 * max(2.0 - q, 0.0)


@inline
def gaussian_shape(q):
    """Return w(q) of the Gaussian cut off at 3h: exp(-q^2) for q < 3, to 1e-13 of its own size.

    Normalised as the whole Gaussian, by 1/pi^(d/2), as published: the cut takes 2.2e-5 of the integral in 1D, 1.2e-4
    in 2D and 4.4e-4 in 3D. The exponential is a polynomial of q^2/64, squared six times: the sums over neighbours stay
    vectorised, which a call of the library's function would not allow.
    """
    t = min(q, _CUT)
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
    return s * min(max((_CUT - q) * STEEP, 0.0), 1.0)


@inline
def gaussian_slope(q):
    """Return w'(q), without the jump at the cut."""
    return -2.0 * min(q, _CUT) * gaussian_shape(q)


@inline
def wendland_c2_shape(q):
    """Return w(q) of Wendland's C2 kernel: (1-q/2)+^4 (1+2q), reaching to 2h.

    The function that is positive definite in up to three dimensions serves in one and two as well: a positive Fourier
    transform keeps particles from pairing.
    """
    a = max(1.0 - 0.5 * q, 0.0)
    a *= a
    return a * a * (1.0 + 2.0 * q)


@inline
def wendland_c2_slope(q):
    """Return w'(q)."""
    a = max(1.0 - 0.5 * q, 0.0)
    return -5.0 * q * a * a * a


@inline
def wendland_c4_shape(q):
    """Return w(q) of Wendland's C4 kernel: (1-q/2)+^6 (1 + 3q + 35/12 q^2), reaching to 2h.

    As for C2, the function of three dimensions serves in all. It is the narrower of the two: its accuracy needs a
    larger h over the spacing.
    """
    a = max(1.0 - 0.5 * q, 0.0)
    a *= a
    return a * a * a * (1.0 + q * (3.0 + (35.0 / 12.0) * q))


@inline
def wendland_c4_slope(q):
    """Return w'(q)."""
    a = max(1.0 - 0.5 * q, 0.0)
    a2 = a * a
    return (-7.0 / 3.0) * q * (2.0 + 5.0 * q) * a * a2 * a2


KERNELS = {
    kernel.name: kernel
    for kernel in (
        Kernel("cubic_spline", (2 / 3, 10 / (7 * pi), 1 / pi), cubic_spline_shape, cubic_spline_slope),
        Kernel("quadratic", (1.0, 2 / pi, 5 / (4 * pi)), quadratic_shape, quadratic_slope),
        Kernel("quartic_spline", (1 / 24, 96 / (1199 * pi), 1 / (20 * pi)), quartic_spline_shape, quartic_spline_slope),
        Kernel("quintic_spline", (1 / 120, 7 / (478 * pi), 1 / (120 * pi)), quintic_spline_shape, quintic_spline_slope),
        Kernel("gaussian", (pi**-0.5, 1 / pi, pi**-1.5), gaussian_shape, gaussian_slope),
        Kernel("wendland_c2", (3 / 4, 7 / (4 * pi), 21 / (16 * pi)), wendland_c2_shape, wendland_c2_slope),
        Kernel("wendland_c4", (27 / 32, 9 / (4 * pi), 495 / (256 * pi)), wendland_c4_shape, wendland_c4_slope),
    )
}
CUBIC_SPLINE = KERNELS["cubic_spline"]


def weigh(state, point, reach, rows, weights):
    """Find the particles whose kernels reach `point`, for the kernel interpolation there (template).

    Bound names: DIM, columns of the state (S_...) and `shape` of the kernel.

    `state`: particles (n, width)
    `point`: the place (dim,) [m]
    `reach`: support radius of the kernel over h
    `rows`, `weights`: (n,) receive the particles and their weights V W, up to a common factor

    Returns the number of particles found.
    """
    n = 0
    for s in range(state.shape[0]):
        h = state[s, S_SMOOTHING_LENGTH]
        square = 0.0
        volume = state[s, S_MASS] / state[s, S_DENSITY]
        for f in range(DIM):
            d = state[s, f] - point[f]
            square += d * d
            volume /= h
        if square < reach * reach * h * h:
            rows[n] = s
            weights[n] = volume * shape(np.sqrt(square) / h)
            n += 1
    return n
