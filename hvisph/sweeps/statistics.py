"""Order of convergence, value at infinite resolution and grid convergence index, of results at several resolutions.

With f1, f2, f3 from fine to coarse at spacings h1 < h2 < h3, errors that fall as h^p obey

    (f3 - f2)/(f2 - f1) = (h3^p - h2^p)/(h2^p - h1^p),

which has one solution where the three are monotone. Then

    f* = f1 + (f1 - f2)/(r^p - 1),    GCI = 1.25 |f2 - f1| / (|f1| (r^p - 1)),    r = h2/h1

(Roache 1994; Celik et al. 2008). Differences below what the results are themselves uncertain by say nothing
of an order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

SAFETY = 1.25
LOWEST, HIGHEST = 1e-3, 20.0  # orders that are looked for


@dataclass(frozen=True)
class Convergence:
    """What several resolutions say of a result.

    Parameters
    ----------
    verdict
        ``converging``, ``not converging``, ``not resolved`` (differences within the uncertainties),
        ``exact`` (no differences) or ``too few``.
    order
        Observed order p; None unless converging.
    extrapolated
        Value at infinite resolution; None unless converging.
    index
        Grid convergence index of the finest, relative; None unless converging.
    difference
        Between the two finest.
    """

    verdict: str
    order: float | None = None
    extrapolated: float | None = None
    index: float | None = None
    difference: float | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return the plain form for JSON."""
        return asdict(self)


def observed_order(f: Sequence[float], h: Sequence[float]) -> float | None:
    """Return the order p of three results at three spacings, finest first; None where they are not monotone."""
    if f[1] == f[0] or (f[2] - f[1]) / (f[1] - f[0]) <= 0.0:
        return None
    from scipy.optimize import brentq

    ratio = (f[2] - f[1]) / (f[1] - f[0])
    a, b = h[1] / h[0], h[2] / h[0]

    def excess(p: float) -> float:
        return (b**p - a**p) / (a**p - 1.0) - ratio

    if excess(LOWEST) * excess(HIGHEST) > 0.0:
        return None
    return float(brentq(excess, LOWEST, HIGHEST, xtol=1e-13, rtol=1e-13))


def convergence(
    results: Sequence[float], spacings: Sequence[float], uncertainties: Sequence[float | None] | None = None
) -> Convergence:
    """Return what results at several resolutions say, by the three finest.

    Parameters
    ----------
    results, spacings
        Values and what they were computed at, in any order.
    uncertainties
        What each value is uncertain by itself; None where that is not known.
    """
    known = uncertainties or [None] * len(results)
    points = sorted(zip(spacings, results, known, strict=True), key=lambda one: one[0])
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
