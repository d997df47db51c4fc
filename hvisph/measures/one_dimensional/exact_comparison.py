"""A gauge against its exact history."""

from __future__ import annotations

import numpy as np


def mean_difference(times: np.ndarray, values: np.ndarray, exact: np.ndarray) -> float:
    """Return the mean over time of the size of `values` - `exact`, both at `times`; NaN is left out."""
    seen = np.isfinite(values)
    times, difference = times[seen], np.abs(values - exact)[seen]
    if len(times) < 2:
        return float("nan")
    return float(np.trapezoid(difference, times) / (times[-1] - times[0]))
