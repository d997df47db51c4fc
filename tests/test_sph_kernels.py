"""Every kernel: integral, derivative, self value, support, and the same numbers compiled."""

import numpy as np
import pytest
from scipy.integrate import quad

from hvisph.compiler.jit import inline, specialise
from hvisph.compiler.vector.lanes import LANES, broadcast_lanes, lane_sum
from hvisph.sph.kernels import KERNELS

# Measure of the unit sphere's surface in 1D, 2D and 3D.
SURFACE = {1: 2.0, 2: 2.0 * np.pi, 3: 4.0 * np.pi}
# What the cut at 3h takes of the Gaussian: erfc(3), exp(-9), erfc(3) + 6 exp(-9)/sqrt(pi).
CUT = {1: 2.209e-5, 2: 1.2341e-4, 3: 4.3985e-4}
# W(0, 1) as published: Liu & Liu 2010; Dehnen & Aly 2012 for Wendland's in 2D and 3D.
SELF = {
    "cubic_spline": (2 / 3, 15 / (7 * np.pi) * 2 / 3, 3 / (2 * np.pi) * 2 / 3),
    "quadratic": (3 / 4, 2 / np.pi * 3 / 4, 5 / (4 * np.pi) * 3 / 4),
    "quartic_spline": (230 / 16 / 24, 96 / (1199 * np.pi) * 230 / 16, 230 / 16 / (20 * np.pi)),
    "quintic_spline": (66 / 120, 7 / (478 * np.pi) * 66, 66 / (120 * np.pi)),
    "gaussian": (np.pi**-0.5, 1 / np.pi, np.pi**-1.5),
    "wendland_c2": (3 / 4, 7 / (4 * np.pi), 21 / (16 * np.pi)),
    "wendland_c4": (27 / 32, 9 / (4 * np.pi), 495 / (256 * np.pi)),
}
EVERY = pytest.mark.parametrize("kernel", KERNELS.values(), ids=KERNELS)


@EVERY
@pytest.mark.parametrize("dim", [1, 2, 3])
def test_integrates_to_one(kernel, dim):
    h = 0.3
    breaks = [h * q for q in (0.5, 1.0, 1.5, 2.0, 2.5) if q < kernel.reach]
    found, _ = quad(lambda r: kernel.value(r, h, dim) * SURFACE[dim] * r ** (dim - 1), 0.0, kernel.reach * h,
                    points=breaks, epsabs=1e-12)  # fmt: skip
    missing = CUT[dim] if kernel.name == "gaussian" else 0.0
    # 1e-3 of what is missing: its own digits above; otherwise quadrature's rounding
    assert found == pytest.approx(1.0 - missing, abs=1e-3 * missing + 1e-11)


@EVERY
@pytest.mark.parametrize("dim", [1, 2, 3])
def test_self_value(kernel, dim):
    assert kernel.value(0.0, 1.0, dim) == pytest.approx(SELF[kernel.name][dim - 1], rel=1e-13)
    assert kernel.value(0.0, 2.0, dim) == pytest.approx(SELF[kernel.name][dim - 1] / 2**dim, rel=1e-13)


@EVERY
def test_derivative_is_that_of_the_value(kernel):
    h, step = 0.7, 1e-5
    r = np.linspace(0.01, kernel.reach * h - 0.01, 97)
    for dim in (1, 2, 3):
        difference = [(kernel.value(x + step, h, dim) - kernel.value(x - step, h, dim)) / (2 * step) for x in r]
        derivative = [kernel.derivative(x, h, dim) for x in r]
        scale = max(map(abs, derivative))
        # central differences: step^2 w'''/6, with w''' of some hundred at the splines' knots
        np.testing.assert_allclose(derivative, difference, atol=2e-5 * scale)
        assert max(derivative) <= 0.0


@EVERY
def test_nothing_beyond_the_support(kernel):
    for q in (kernel.reach, 1.001 * kernel.reach, 1e3, 1e33):
        assert abs(kernel.value(q, 1.0, 1)) < 1e-25
        assert abs(kernel.derivative(q, 1.0, 1)) < 1e-25
    assert kernel.value(0.999 * kernel.reach, 1.0, 1) > 0.0


def test_gaussian_is_the_exponential():
    kernel = KERNELS["gaussian"]
    q = np.linspace(0.0, 2.999, 500)
    found = [kernel.shape.py_func(x) for x in q]
    np.testing.assert_allclose(found, np.exp(-(q**2)), rtol=2e-13)  # 64 roundings


def _eight(q, found):
    found[0] = lane_sum(shape(broadcast_lanes(q))) / LANES  # noqa: F821
    found[1] = lane_sum(slope(broadcast_lanes(q))) / LANES  # noqa: F821
    found[2] = shape(q)  # noqa: F821
    found[3] = slope(q)  # noqa: F821


@EVERY
def test_compiled_on_eight_lanes_and_on_one(kernel):
    loop = inline(specialise(_eight, parallel=False, shape=kernel.shape, slope=kernel.slope).py_func)
    found = np.zeros(4)
    for q in (0.0, 0.4, 1.3, kernel.reach - 0.1, kernel.reach + 0.1, 1e30):
        loop(q, found)
        plain = (kernel.shape.py_func(q), kernel.slope.py_func(q))
        np.testing.assert_allclose(found[:2], plain, rtol=1e-12, atol=1e-14)  # orders of summation
        np.testing.assert_allclose(found[2:], plain, rtol=1e-12, atol=1e-14)
