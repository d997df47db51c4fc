"""Quantiles of what has weights; spread of results over a sample of cases, and what they depend on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

PERCENTILES = (5, 50, 95)


def spread(results: Sequence[float]) -> dict[str, float]:
    """Return count, mean, standard deviation and 5, 50, 95 % of results."""
    x = np.asarray(results, float)
    statistics = {"count": len(x), "mean": float(x.mean()), "sd": float(x.std(ddof=1)) if len(x) > 1 else 0.0}
    return statistics | {f"p{q}": float(np.percentile(x, q)) for q in PERCENTILES}


def rank_correlations(results: Sequence[float], inputs: Mapping[str, Sequence[Any]]) -> dict[str, float | None]:
    """Return Spearman's rank correlation of results with each input; None where either does not vary."""
    from scipy.stats import spearmanr

    correlations: dict[str, float | None] = {}
    for name, values in inputs.items():
        numbers = [value if isinstance(value, int | float) else None for value in values]
        if any(number is None for number in numbers) or len(set(numbers)) < 2 or len(set(results)) < 2:
            correlations[name] = None
        else:
            correlations[name] = float(spearmanr(numbers, results).statistic)
    return correlations


def weighted_quantile(values: np.ndarray, weights: np.ndarray, share: float) -> float:
    """Return the value that `share` of the weight does not exceed: the same for a part and its mirrored whole."""
    order = np.argsort(values, kind="stable")
    cumulated = np.cumsum(weights[order])
    at = int(np.searchsorted(cumulated, share * cumulated[-1] * (1.0 - 1e-9)))
    return float(values[order[min(at, len(order) - 1)]])
