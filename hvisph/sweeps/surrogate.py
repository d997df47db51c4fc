"""Response surfaces of computed numbers, with their leave-one-out error, and Sobol indices.

A polynomial of first or second degree by least squares, or a Gaussian process (Rasmussen & Williams 2006) where
scikit-learn is installed: the one of the least error. The error of a point that is left out follows without a second
fit: r_i / (1 - h_i) with the residual r and the hat matrix h of a polynomial, [K^-1 y]_i / [K^-1]_ii of a process.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from hvisph.core.text import Plain

SOBOL_POINTS = 2048
Predict = Callable[[np.ndarray], np.ndarray]


class Surrogate:
    """Response surface of one computed number.

    `x`: points, (n, d); of about 0..1 for a process.
    `y`: numbers at the points, (n,).
    `polynomial`: whether polynomials alone are tried.
    """

    def __init__(self, x: np.ndarray, y: np.ndarray, *, polynomial: bool = False):
        process = None if polynomial else _gaussian_process(x, y)
        fits = [fit for fit in (_polynomial(x, y, 1), _polynomial(x, y, 2), process) if fit]
        if not fits:
            raise ValueError("more points than dimensions + 2 are needed")
        self.error, self.kind, self.predict = min(fits, key=lambda fit: fit[0])
        self.share = self.error / float(np.std(y)) if np.ptp(y) > 0.0 else 0.0

    def sobol(self, distributions: Sequence[Any]) -> tuple[list[float], list[float]]:
        """Return first-order and total Sobol indices for independent inputs of these `scipy.stats` distributions."""
        from scipy.stats import sobol_indices

        found = sobol_indices(func=lambda x: self.predict(x.T), n=SOBOL_POINTS, dists=list(distributions), rng=0)
        return [float(v) for v in found.first_order], [float(v) for v in found.total_order]


def sensitivity(x: np.ndarray, y: np.ndarray, distributions: Sequence[Any]) -> Plain | None:
    """Return how results depend on inputs; None for too few cases.

    `x`: inputs, (n, d).
    `y`: results, (n,).
    `distributions`: of each input, frozen ones of `scipy.stats`.

    Returns lists by input: ``slope`` with its standard ``error``, ``swing`` (change over 5 to 95 % of the input),
    ``share`` of the variance, ``first`` and ``total`` Sobol indices of a polynomial; ``r2`` of the slopes, and
    ``surrogate`` with its ``leave_one_out`` error as a share of the deviation.
    """
    n, d = x.shape
    if n < d + 3 or not np.ptp(y) > 0.0:
        return None
    terms = _terms(x, 1)
    inverse = np.linalg.pinv(terms)
    slopes, residual = inverse[1:] @ y, y - terms @ (inverse @ y)
    errors = np.sqrt(np.diag(inverse @ inverse.T)[1:] * (residual @ residual) / (n - d - 1))
    surface = Surrogate(x, y, polynomial=True)
    first, total = surface.sobol(distributions)
    swing = [float(b * np.diff(one.ppf([0.05, 0.95]))[0]) for b, one in zip(slopes, distributions, strict=True)]
    return {
        "slope": slopes.tolist(),
        "error": errors.tolist(),
        "swing": swing,
        "share": (slopes**2 * np.var(x, axis=0) / np.var(y)).tolist(),
        "first": first,
        "total": total,
        "r2": 1.0 - float(residual @ residual) / float(n * np.var(y)),
        "surrogate": surface.kind,
        "leave_one_out": surface.share,
    }


def _terms(x: np.ndarray, degree: int) -> np.ndarray:
    columns = [np.ones(len(x)), *x.T]
    if degree == 2:
        columns += [x[:, i] * x[:, j] for i in range(x.shape[1]) for j in range(i + 1)]
    return np.stack(columns, axis=1)


def _polynomial(x: np.ndarray, y: np.ndarray, degree: int) -> tuple[float, str, Predict] | None:
    scale = np.abs(x).max(axis=0) + 1e-300
    terms = _terms(x / scale, degree)
    if len(x) <= terms.shape[1]:
        return None
    inverse = np.linalg.pinv(terms)
    coefficients = inverse @ y
    free = np.maximum(1.0 - np.einsum("ij,ji->i", terms, inverse), 1e-12)
    error = float(np.sqrt(np.mean(((y - terms @ coefficients) / free) ** 2)))
    return error, f"polynomial of degree {degree}", lambda at: _terms(at / scale, degree) @ coefficients


def _gaussian_process(x: np.ndarray, y: np.ndarray) -> tuple[float, str, Predict] | None:
    try:
        from sklearn.gaussian_process import GaussianProcessRegressor
        from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
    except ImportError:
        return None
    if len(x) < x.shape[1] + 3 or not np.ptp(y) > 0.0:
        return None
    import warnings

    scale = float(np.std(y))
    centred = (y - y.mean()) / scale
    kernel = ConstantKernel(1.0) * RBF(np.ones(x.shape[1]), (0.05, 100.0)) + WhiteKernel(1e-4, (1e-9, 1.0))
    with warnings.catch_warnings():  # a length at its bound says that the input does not matter
        warnings.simplefilter("ignore")
        process = GaussianProcessRegressor(kernel, n_restarts_optimizer=2, random_state=0).fit(x, centred)
    inverse = np.linalg.inv(process.kernel_(x))
    error = scale * float(np.sqrt(np.mean((inverse @ centred / np.diag(inverse)) ** 2)))
    return error, "Gaussian process", lambda at: y.mean() + scale * process.predict(at)
