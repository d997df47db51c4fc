"""One-dimensional root finding, enough for wave curves."""

from __future__ import annotations

from collections.abc import Callable

from hvisph.core.errors import RunError


def bracketed_root(function: Callable[[float], float], low: float, high: float, tolerance: float = 1e-14) -> float:
    """Return the root of a continuous function that has unlike signs at `low` and `high`.

    Regula falsi with Illinois' weights, and a bisection whenever that has not halved the
    bracket in three goes.

    Raises
    ------
    RunError
        If the signs are alike.
    """
    f_low, f_high = function(low), function(high)
    if f_low == 0.0:
        return low
    if f_high == 0.0:
        return high
    if (f_low > 0.0) == (f_high > 0.0):
        raise RunError(f"no state between {low:.6g} and {high:.6g} satisfies the jump conditions")
    side, width, goes = 0, abs(high - low), 0
    for _ in range(300):
        goes += 1
        if goes == 3:
            middle = 0.5 * (low + high) if abs(high - low) > 0.5 * width else _falsi(low, high, f_low, f_high)
            width, goes = abs(high - low), 0
        else:
            middle = _falsi(low, high, f_low, f_high)
        value = function(middle)
        if value == 0.0:
            return middle
        if (value > 0.0) == (f_low > 0.0):
            low, f_low = middle, value
            if side == -1:
                f_high *= 0.5
            side = -1
        else:
            high, f_high = middle, value
            if side == 1:
                f_low *= 0.5
            side = 1
        if abs(high - low) <= tolerance * max(abs(low), abs(high)):
            break
    return _falsi(low, high, f_low, f_high)


def _falsi(low: float, high: float, f_low: float, f_high: float) -> float:
    middle = low - f_low * (high - low) / (f_high - f_low)
    return middle if min(low, high) < middle < max(low, high) else 0.5 * (low + high)
