"""Statistics of sweeps: convergence, limit of an event, combined uncertainty, response surfaces.

Convergence. With f1, f2, f3 from fine to coarse at spacings h1 < h2 < h3, errors that fall as h^p obey

    (f3 - f2)/(f2 - f1) = (h3^p - h2^p)/(h2^p - h1^p),

which has one solution where the three are monotone. Then

    f* = f1 + (f1 - f2)/(r^p - 1),    GCI = 1.25 |f2 - f1| / (|f1| (r^p - 1)),    r = h2/h1

(Roache 1994; Celik et al. 2008). Differences below the uncertainty of the results determine no order.

Limit. Lambert and Jonas 1976: above the ballistic limit v_bl a projectile leaves with v_r = a (v^p - v_bl^p)^(1/p);
p = 2 and a = m/(m + m_plug) where it pushes out a plug (Recht and Ipson 1963).

Uncertainty. All are half-widths of about 95 %: the grid convergence index times the value where the spacings converge,
the largest difference between them where they do not; the change over the last tenth of the run, or half the bracket of
a limit; 2 sqrt(g C g) of the material, with C the covariance of a fit and g finite differences over one standard
deviation of each parameter at the coarsest spacing. The combined one is the root of their sum of squares, and a share
is a square over that sum.

Response surfaces. A polynomial of first or second degree by least squares, or a Gaussian process (Rasmussen & Williams
2006) where scikit-learn is installed: the one of the least error. The error of a point that is left out follows without
a second fit: r_i / (1 - h_i) with the residual r and the hat matrix h of a polynomial, [K^-1 y]_i / [K^-1]_ii of a
process.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from hvisph.core.errors import CaseError
from hvisph.core.text import Plain, PlainMapping
from hvisph.measures.correlations import LambertJonas, lambert_jonas_velocity

from .parameters import MATERIAL, Values

SAFETY = 1.25  # factor of the grid convergence index
LOWEST, HIGHEST = 1e-3, 20.0  # bounds of the order


@dataclass(frozen=True)
class Convergence:
    """Convergence of a result over several resolutions."""

    # ``converging``, ``not converging``, ``not resolved`` (differences within the uncertainties), ``exact`` (no
    # differences) or ``too few``
    verdict: str
    order: float | None = None  # observed order p; None unless converging
    extrapolated: float | None = None  # value at infinite resolution; None unless converging
    index: float | None = None  # grid convergence index of the finest, relative; None unless converging
    difference: float | None = None  # between the two finest


def observed_order(f: Sequence[float], h: Sequence[float]) -> float | None:
    """Return the order p of three results at three spacings, finest first; None where they are not monotone."""
    if f[1] == f[0] or (f[2] - f[1]) / (f[1] - f[0]) <= 0.0:
        return None
    ratio = (f[2] - f[1]) / (f[1] - f[0])
    a, b = h[1] / h[0], h[2] / h[0]

    def excess(p: float) -> float:
        return (b**p - a**p) / (a**p - 1.0) - ratio

    if excess(LOWEST) * excess(HIGHEST) > 0.0:
        return None
    return float(scipy.optimize.brentq(excess, LOWEST, HIGHEST, xtol=1e-13, rtol=1e-13))


def convergence(
    results: Sequence[float], spacings: Sequence[float], uncertainties: Sequence[float | None] | None = None
) -> Convergence:
    """Return the convergence of results at several resolutions, by the three finest.

    `results`, `spacings`: values and their spacings, in any order.
    `uncertainties`: uncertainty of each value at its spacing; None where unknown.
    """
    errors = uncertainties or [None] * len(results)
    points = sorted(zip(spacings, results, errors, strict=True), key=lambda point: point[0])
    if len(points) < 2:
        return Convergence("too few")
    h, f, _ = zip(*points, strict=True)
    difference = f[1] - f[0]
    noise = max((u for _, _, u in points[:3] if u is not None), default=0.0)
    if max(f) == min(f):
        return Convergence("exact", None, f[0], 0.0, 0.0)
    if abs(difference) <= noise:
        return Convergence("not resolved", difference=difference)
    if len(points) < 3:
        return Convergence("too few", difference=difference)
    order = observed_order(f, h)
    if order is None:
        return Convergence("not converging", difference=difference)
    gain = (h[1] / h[0]) ** order - 1.0
    index = SAFETY * abs(difference) / (abs(f[0]) * gain) if f[0] else None
    return Convergence("converging", order, f[0] - difference / gain, index, difference)


PERCENTILES = (5, 50, 95)


def spread(results: Sequence[float]) -> dict[str, float]:
    """Return count, mean, standard deviation and 5, 50, 95 % of results."""
    x = np.asarray(results, float)
    statistics = {"count": len(x), "mean": float(x.mean()), "sd": float(x.std(ddof=1)) if len(x) > 1 else 0.0}
    return statistics | {f"p{q}": float(np.percentile(x, q)) for q in PERCENTILES}


@dataclass(frozen=True)
class Bracket:
    """Interval of a limit."""

    # the last value where it did not happen and the first where it did; None where none was seen
    below: float | None
    above: float | None
    # whether it did not happen beyond a value where it did: the limit is then a zone, between `above` and `below`
    mixed: bool

    @property
    def limit(self) -> float | None:
        """The limit's middle estimate, as V50 would be; None where one side was not seen."""
        return None if self.below is None or self.above is None else 0.5 * (self.below + self.above)

    def as_dict(self) -> Plain:
        """Return the plain form for JSON."""
        return asdict(self) | {"limit": self.limit}


def bracket(values: Sequence[float], happened: Sequence[bool], falling: bool = False) -> Bracket:
    """Return where the event begins to happen, as values grow or, `falling`, as they fall."""
    pairs = list(zip(values, happened, strict=True))
    last, first = (min, max) if falling else (max, min)
    below = last((value for value, yes in pairs if not yes), default=None)
    above = first((value for value, yes in pairs if yes), default=None)
    mixed = below is not None and above is not None and (below < above if falling else below > above)
    return Bracket(below, above, mixed)


def logistic_limit(values: Sequence[float], happened: Sequence[bool]) -> tuple[float, float] | None:
    """Return V50 and the standard deviation of the limit from a logistic fit; None where it has no maximum.

    The likelihood is penalised by the determinant of its information (Firth 1993), which keeps the estimate finite
    where a value separates all shots. The deviation is that of the logistic distribution, scale pi/sqrt(3).
    """
    v, y = np.asarray(values, float), np.asarray(happened, float)
    middle, width = float(v.mean()), float(v.std())
    if len(v) < 3 or width == 0.0 or len(set(happened)) < 2:
        return None
    terms = np.column_stack([np.ones(len(v)), (v - middle) / width])

    def loss(b: np.ndarray) -> float:
        z = terms @ b
        p = 1.0 / (1.0 + np.exp(-np.clip(z, -500.0, 500.0)))
        information = terms.T @ (terms * (p * (1.0 - p))[:, None])
        return float(np.logaddexp(0.0, z).sum() - y @ z - 0.5 * np.linalg.slogdet(information + 1e-12 * np.eye(2))[1])

    options = {"xatol": 1e-6, "fatol": 1e-9, "maxiter": 4000}
    fitted = scipy.optimize.minimize(loss, np.zeros(2), method="Nelder-Mead", options=options).x
    if fitted[1] == 0.0:
        return None
    return middle - width * float(fitted[0] / fitted[1]), width * float(np.pi / np.sqrt(3.0) / abs(fitted[1]))


def next_values(limits: Bracket, points: int, width: float) -> list[float]:
    """Return values that shrink the bracket by `points` + 1; none where it is narrow enough, open or mixed."""
    if limits.below is None or limits.above is None or limits.mixed:
        return []
    if abs(limits.above - limits.below) <= width * (1.0 + 1e-9):
        return []
    step = (limits.above - limits.below) / (points + 1)
    return [limits.below + k * step for k in range(1, points + 1)]


def lambert_jonas(velocities: Sequence[float], residuals: Sequence[float], limits: Bracket) -> LambertJonas | None:
    """Return the curve through two or more perforating shots; p = 2 below four, the bracket's limit for two."""
    v, r = np.asarray(velocities, float), np.asarray(residuals, float)
    if len(v) < 2 or limits.limit is None:
        return None
    free = min(len(v) - 1, 3)
    start = [0.9, limits.limit, 2.0][:free]
    lower = min(float(v.min()), limits.above or np.inf)
    bounds = ([0.01, 0.0, 1.0][:free], [1.2, lower, 6.0][:free])
    start[1:2] = [min(limits.limit, 0.999 * lower)][: max(free - 1, 0)]

    def parameters(x: np.ndarray) -> tuple[float, float, float]:
        a = float(x[0])
        limit = float(x[1]) if free > 1 else limits.limit or 0.0
        return a, float(x[2]) if free > 2 else 2.0, limit

    sizes = np.maximum(np.abs(start), 1e-3)
    fit = scipy.optimize.least_squares(
        lambda x: lambert_jonas_velocity(v, *parameters(x)) - r, start, bounds=bounds, x_scale=sizes
    )
    a, p, limit = parameters(fit.x)
    return LambertJonas(a, p, limit, float(np.sqrt(np.mean(fit.fun**2))))


def read_fit(source: str | PlainMapping | None, folder: Path) -> Plain | None:
    """Return name, parameters and correlation of a fit's material from its folder; raises `CaseError`."""
    if source is None or not isinstance(source, str):
        return None if source is None else dict(source)
    path = next((place for place in (folder / source, Path(source)) if place.is_dir()), Path(source))
    try:
        fit = json.loads((path / "results.json").read_text(encoding="utf-8"))["fit"]
        paths = [name for name in fit["parameters"] if name.startswith(MATERIAL)]
        columns = [list(fit["parameters"]).index(name) for name in paths]
        correlation = np.array(fit["correlation"])[np.ix_(columns, columns)].tolist()
        keys = ("value", "deviation", "unit")
        parameters = {name: {key: fit["parameters"][name][key] for key in keys} for name in paths}
        return {"material": fit["material"]["name"], "parameters": parameters, "correlation": correlation}
    except (OSError, ValueError, KeyError, TypeError):
        raise CaseError(f"{source} is not the folder of a finished fit of a material", where="fit") from None


def perturbations(fit: Any, base: PlainMapping) -> list[Values]:
    """Return settings that raise each parameter of the fit by its standard deviation, in all bodies of its material."""
    if fit is None:
        return []
    name = fit["material"]
    materials = {body: model.get("material") for body, model in base.get("bodies", {}).items()}
    bases = {body: used.get("base") if isinstance(used, dict) else used for body, used in materials.items()}
    bodies = [body for body in materials if name in (materials[body], bases[body])]
    if not bodies:
        raise CaseError(f"no body is made of {name}, the material of the fit", where="fit")
    return [
        dict.fromkeys(
            (f"bodies.{body}.{path}" for body in bodies), f"{p['value'] + p['deviation']:.8g} {p['unit']}".strip()
        )
        for path, p in fit["parameters"].items()
    ]


def combine_uncertainties(
    spacings: Sequence[float],
    values: Sequence[float],
    time: float,
    perturbed: Sequence[float | None],
    correlation: Sequence[Sequence[float]],
) -> Plain | None:
    """Return half-width and shares; None where a perturbed value is missing.

    `time`: Half-width by time at the finest.
    `perturbed`: values at the coarsest spacing with one parameter raised each.
    """
    if any(value is None for value in perturbed) or not values:
        return None
    finest, coarsest = (values[int(pick(spacings))] for pick in (np.argmin, np.argmax))
    fit = convergence(values, spacings)
    spread = max(values) - min(values) if fit.index is None else fit.index * abs(finest)
    g = np.array([float(value or 0.0) - coarsest for value in perturbed])
    parts = {"spacing": float(spread), "time": float(time)}
    if len(g):
        parts["material"] = 2.0 * float(np.sqrt(max(g @ np.array(correlation) @ g, 0.0)))
    total = float(np.sqrt(sum(part**2 for part in parts.values())))
    return {
        "value": finest,
        "half_width": total,
        "parts": parts,
        "shares": {source: (part / total) ** 2 if total else 0.0 for source, part in parts.items()},
    }


SOBOL_POINTS = 2048
Predict = Callable[[np.ndarray], np.ndarray]


class Surrogate:
    """Response surface of a computed number over points `x` (n, d), of about 0..1 for a process."""

    def __init__(self, x: np.ndarray, y: np.ndarray, *, polynomial: bool = False):
        process = None if polynomial else _gaussian_process(x, y)
        fits = [fit for fit in (_polynomial(x, y, 1), _polynomial(x, y, 2), process) if fit]
        if not fits:
            raise ValueError("more points than dimensions + 2 are needed")
        self.error, self.kind, self.predict = min(fits, key=lambda fit: fit[0])
        self.share = self.error / float(np.std(y)) if np.ptp(y) > 0.0 else 0.0

    def sobol(self, distributions: Sequence[Any]) -> tuple[list[float], list[float]]:
        """Return first-order and total Sobol indices for independent inputs of these `scipy.stats` distributions."""
        indices = scipy.stats.sobol_indices(
            func=lambda x: self.predict(x.T), n=SOBOL_POINTS, dists=list(distributions), rng=0
        )
        return [float(v) for v in indices.first_order], [float(v) for v in indices.total_order]


def sensitivity(x: np.ndarray, y: np.ndarray, distributions: Sequence[Any]) -> Plain | None:
    """Return how results depend on inputs; None for too few cases.

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
    swing = [float(b * np.diff(input_.ppf([0.05, 0.95]))[0]) for b, input_ in zip(slopes, distributions, strict=True)]
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
    with warnings.catch_warnings():  # a length at its bound: the input has no influence
        warnings.simplefilter("ignore")
        process = GaussianProcessRegressor(kernel, n_restarts_optimizer=2, random_state=0).fit(x, centred)
    inverse = np.linalg.inv(process.kernel_(x))
    error = scale * float(np.sqrt(np.mean((inverse @ centred / np.diag(inverse)) ** 2)))
    return error, "Gaussian process", lambda at: y.mean() + scale * process.predict(at)
