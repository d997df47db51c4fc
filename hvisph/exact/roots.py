"""One-dimensional root finding."""

from __future__ import annotations

from collections.abc import Callable

from hvisph.core.errors import RunError


def bracketed_root(function: Callable[[float], float], low: float, high: float) -> float:
    """Return the root of a continuous function that has unlike signs at `low` and `high`, to rounding.

    Raises
    ------
    RunError
        If the signs are alike.
    """
    from scipy.optimize import brentq

    try:
        return float(brentq(function, low, high, xtol=1e-300, rtol=1e-15, maxiter=300))
    except ValueError:
        message = f"no state between {low:.6g} and {high:.6g} satisfies the jump conditions"
        raise RunError(message) from None
