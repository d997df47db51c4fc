"""Where something begins to happen as a setting grows: bracket, mixed zone, and the curve of residual velocities.

Lambert and Jonas 1976: above the ballistic limit v_bl a projectile leaves with v_r = a (v^p - v_bl^p)^(1/p); p = 2
and a = m/(m + m_plug) where it pushes out a plug (Recht and Ipson 1963).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from hvisph.measures.correlations import LambertJonas, lambert_jonas_velocity


@dataclass(frozen=True)
class Bracket:
    """Where a limit lies.

    Parameters
    ----------
    below, above
        The last value where it did not happen and the first where it did; None where none was seen.
    mixed
        Whether it did not happen beyond a value where it did: the limit is then a zone, between `above` and `below`.
    """

    below: float | None
    above: float | None
    mixed: bool

    @property
    def limit(self) -> float | None:
        """The limit's middle estimate, as V50 would be; None where one side was not seen."""
        return None if self.below is None or self.above is None else 0.5 * (self.below + self.above)

    def as_dict(self) -> dict[str, Any]:
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
    from scipy.optimize import minimize

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
    fitted = minimize(loss, np.zeros(2), method="Nelder-Mead", options=options).x
    if fitted[1] == 0.0:
        return None
    return middle - width * float(fitted[0] / fitted[1]), width * float(np.pi / np.sqrt(3.0) / abs(fitted[1]))


def next_values(known: Bracket, points: int, width: float) -> list[float]:
    """Return values that shrink the bracket by `points` + 1; none where it is narrow enough, open or mixed."""
    if known.below is None or known.above is None or known.mixed:
        return []
    if abs(known.above - known.below) <= width * (1.0 + 1e-9):
        return []
    step = (known.above - known.below) / (points + 1)
    return [known.below + k * step for k in range(1, points + 1)]


def lambert_jonas(velocities: Sequence[float], residuals: Sequence[float], known: Bracket) -> LambertJonas | None:
    """Return the curve through shots that went through; None for fewer than two of them.

    With fewer than four shots p is 2, and with two the limit is the bracket's.
    """
    v, r = np.asarray(velocities, float), np.asarray(residuals, float)
    if len(v) < 2 or known.limit is None:
        return None
    from scipy.optimize import least_squares

    free = min(len(v) - 1, 3)
    start = [0.9, known.limit, 2.0][:free]
    lower = min(float(v.min()), known.above or np.inf)
    bounds = ([0.01, 0.0, 1.0][:free], [1.2, lower, 6.0][:free])
    start[1:2] = [min(known.limit, 0.999 * lower)][: max(free - 1, 0)]

    def full(x: np.ndarray) -> tuple[float, float, float]:
        a = float(x[0])
        limit = float(x[1]) if free > 1 else known.limit or 0.0
        return a, float(x[2]) if free > 2 else 2.0, limit

    sizes = np.maximum(np.abs(start), 1e-3)
    fit = least_squares(lambda x: lambert_jonas_velocity(v, *full(x)) - r, start, bounds=bounds, x_scale=sizes)
    a, p, limit = full(fit.x)
    return LambertJonas(a, p, limit, float(np.sqrt(np.mean(fit.fun**2))))
